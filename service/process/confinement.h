#pragma once

#include <seccomp.h>

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>

#include "service/process/check.h"

namespace volsmooth {

/// System calls that a process may still make; any other ends it. From the start those that every work needs:
/// for memory that holds no code, what it has open, the time, locks, and the end.
class SystemCalls {
 public:
  SystemCalls();  ///< throws std::system_error, as all of them

  void allow(std::initializer_list<int> calls);

  /// Only with arguments that meet the conditions (SCMP_A0 and so on).
  void allow(int call, auto... conditions) { add(SCMP_ACT_ALLOW, call, conditions...); }

  /// It gives the error, and does nothing.
  void fail(int call, std::uint16_t error) { add(SCMP_ACT_ERRNO(error), call); }

 private:
  void add(std::uint32_t action, int call, auto... conditions) {
    check_error(-::seccomp_rule_add(filter_.get(), action, call, sizeof...(conditions), conditions...),
                "seccomp_rule_add");
  }
  friend void confine(const struct ProcessLimits& limits, const SystemCalls& calls);

  std::unique_ptr<void, void (*)(scmp_filter_ctx)> filter_;
};

/// What the process may use at most from now on.
struct ProcessLimits {
  std::int64_t address_space_bytes = 0;
  std::int64_t output_bytes = 0;  ///< of any file it writes
  std::optional<std::int64_t> cpu_seconds = std::nullopt;
  std::optional<std::int64_t> descriptors =
      std::nullopt;  ///< that it opens (by number) or waits for (by count)
};

/// Gives up everything else for the rest of the process's life. It dies with its parent. Under
/// AddressSanitizer, which takes terabytes of addresses and more system calls, these stay free. Throws
/// std::system_error where the kernel cannot.
void confine(const ProcessLimits& limits, const SystemCalls& calls);

}  // namespace volsmooth
