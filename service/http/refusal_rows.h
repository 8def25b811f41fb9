#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

namespace volsmooth {

/// How many rows of the audit those may cause whom nobody knows: rows are for ever, and anyone can be refused
/// as often as the network allows. Sixty a minute; the next row says how many were left out.
class RefusalRows {
 public:
  using Clock = std::chrono::steady_clock;

  /// Whether this refusal gets a row, and how many before it got none.
  std::optional<std::int64_t> admit(Clock::time_point now = Clock::now()) {
    if (now - minute_began_ >= std::chrono::minutes(1)) {
      minute_began_ = now;
      rows_ = 0;
    }
    if (rows_ == kRowsAMinute) {
      ++left_out_;
      return std::nullopt;
    }
    ++rows_;
    return std::exchange(left_out_, 0);
  }

 private:
  static constexpr int kRowsAMinute = 60;
  Clock::time_point minute_began_{};
  int rows_ = 0;
  std::int64_t left_out_ = 0;
};

}  // namespace volsmooth
