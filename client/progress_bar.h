#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace volsmooth {

/// What a bar shows.
struct ProgressView {
  std::string what;   ///< such as the input's name
  std::string stage;  ///< such as "flow"
  double fraction = 0;
  std::string amount = {};  ///< such as "12 of 85 MB"; empty: none
  std::optional<double> eta_seconds = {};
};

/// One line of at most `columns` characters.
std::string bar_line(const ProgressView& view, int columns);

/// The `progress` of a job document.
ProgressView view_of(const std::string& what, const nlohmann::json& job);
ProgressView view_of_transfer(const std::string& what, const std::string& stage, std::int64_t done,
                              std::int64_t all);

/// A bar on standard error, redrawn in place and wiped when it goes; on anything but a terminal it shows
/// nothing.
class ProgressBar {
 public:
  explicit ProgressBar(bool wanted);
  ProgressBar(const ProgressBar&) = delete;
  ~ProgressBar() { wipe(); }

  bool is_shown() const { return shown_; }
  void show(const ProgressView& view);
  void wipe();

 private:
  bool shown_;
  std::string stage_;  ///< empty: there is no line
  std::chrono::steady_clock::time_point drawn_;
};

}  // namespace volsmooth
