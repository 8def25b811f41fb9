#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace volsmooth {

/// How many rows of the audit, or lines of the log, those may cause whom nobody knows: rows are for ever, and
/// anyone can be refused as often as the network allows. Sixty a minute; the next one says how many were left
/// out. Thread-safe.
class RefusalRows {
 public:
  using Clock = std::chrono::steady_clock;

  /// Whether this refusal gets a row, and what is to be said at its end: nothing, or how many before it got
  /// none.
  std::optional<std::string> admit(Clock::time_point now = Clock::now()) {
    const std::lock_guard lock(mutex_);
    if (now - minute_began_ >= std::chrono::minutes(1)) {
      minute_began_ = now;
      rows_ = 0;
    }
    if (rows_ == kRowsAMinute) {
      ++left_out_;
      return std::nullopt;
    }
    ++rows_;
    const std::int64_t left_out = std::exchange(left_out_, 0);
    return left_out == 0 ? "" : ", and " + std::to_string(left_out) + " before it without a row";
  }

 private:
  static constexpr int kRowsAMinute = 60;
  std::mutex mutex_;
  Clock::time_point minute_began_{};
  int rows_ = 0;
  std::int64_t left_out_ = 0;
};

}  // namespace volsmooth
