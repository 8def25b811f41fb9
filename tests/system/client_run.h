#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "tests/support/child_process.h"

namespace volsmooth::test {

/// One run of the real volsmooth.
class ClientRun {
 public:
  explicit ClientRun(std::vector<std::string> arguments)
      : process_(command(std::move(arguments)), out(), err()) {}

  ChildProcess& process() { return process_; }
  int exit_code() { return process_.wait(); }
  std::string output() const { return content_of(out()); }
  std::string error() const { return content_of(err()); }

  std::vector<std::string> output_lines() const {
    std::vector<std::string> lines;
    std::istringstream text(output());
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    return lines;
  }

 private:
  static std::vector<std::string> command(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), VOLSMOOTH);
    return arguments;
  }
  std::filesystem::path out() const { return directory_ / "stdout"; }
  std::filesystem::path err() const { return directory_ / "stderr"; }

  TemporaryDirectory directory_;
  ChildProcess process_;
};

/// The names of the files in a directory.
inline std::vector<std::string> names_in(const std::filesystem::path& directory) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(directory))
    names.push_back(entry.path().filename().string());
  return names;
}

inline void write_file(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

}  // namespace volsmooth::test
