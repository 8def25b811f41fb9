#pragma once

#include <cstdint>
#include <fstream>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/child_process.h"

namespace volsmooth::test {

/// The real volsmoothd on a free port of the loopback, with a data directory that outlives restarts.
class Daemon {
 public:
  /// `program`: the path of volsmoothd. `options`: more of its options. `data`: its data directory, when that
  /// is to be a certain one.
  explicit Daemon(std::string program, std::vector<std::string> options = {}, std::filesystem::path data = {})
      : program_(std::move(program)), options_(std::move(options)), data_(std::move(data)) {
    if (data_.empty()) data_ = directory_ / "data";
    start();
  }

  /// Starts it again after it has ended; the port may be another one.
  void start() {
    const std::filesystem::path log = directory_ / ("daemon" + std::to_string(starts_++) + ".log");
    std::vector<std::string> command{program_, "--listen", "127.0.0.1:0", "--data", data().string()};
    command.insert(command.end(), options_.begin(), options_.end());
    process_.emplace(command, log, log);
    logs_.push_back(log);
    static const std::regex listening(R"(listening on (https?)://127\.0\.0\.1:(\d+))");
    std::smatch match;
    std::string text;
    const bool up = eventually([&] {
      text = content_of(log);
      return std::regex_search(text, match, listening) || !process_->running();
    });
    if (!up || match.empty()) throw std::runtime_error("volsmoothd did not start:\n" + text);
    scheme_ = match[1];
    port_ = std::stoi(match[2]);
  }

  void kill() { process_->kill_and_wait(SIGKILL); }
  int terminate() { return process_->kill_and_wait(SIGTERM); }  ///< its exit code
  int wait() { return process_->wait(); }                       ///< for its end; the exit code
  bool running() { return process_->running(); }

  pid_t pid() const { return process_->pid(); }
  int port() const { return port_; }
  std::string url() const { return scheme_ + "://127.0.0.1:" + std::to_string(port_); }
  const std::filesystem::path& data() const { return data_; }

  /// All that it has logged so far, over all starts.
  std::string log() const {
    std::string all;
    for (const auto& file : logs_) all += content_of(file);
    return all;
  }

  std::int64_t resident_bytes() const { return status_bytes("VmRSS:"); }
  /// The most that was resident since the start or the last `reset_peak`.
  std::int64_t peak_resident_bytes() const { return status_bytes("VmHWM:"); }
  void reset_peak() const { std::ofstream("/proc/" + std::to_string(pid()) + "/clear_refs") << 5; }

 private:
  std::int64_t status_bytes(const std::string& field) const {
    std::ifstream status("/proc/" + std::to_string(pid()) + "/status");
    for (std::string word; status >> word;) {
      std::int64_t kilobytes = 0;
      if (word == field && status >> kilobytes) return kilobytes * 1024;
    }
    return 0;
  }

  std::string program_;
  std::vector<std::string> options_;
  TemporaryDirectory directory_;
  std::filesystem::path data_;
  std::vector<std::filesystem::path> logs_;
  std::optional<ChildProcess> process_;
  int starts_ = 0;
  std::string scheme_;
  int port_ = 0;
};

}  // namespace volsmooth::test
