#pragma once

#include <exception>
#include <functional>

namespace volsmooth {

/// Thrown out of a `Progress` call to end a computation; nothing else in the core throws it.
class Cancelled : public std::exception {
 public:
  const char* what() const noexcept override { return "cancelled"; }
};

/// Told the finished fraction (0..1) of a computation, at least four times a second at any volume size. It
/// may be called from any of the computation's threads, several at once and slightly out of order, and ends
/// the computation by throwing `Cancelled`.
using Progress = std::function<void(double fraction)>;

inline const Progress no_progress = [](double) {};

/// The part [from, to] of a larger computation's progress.
inline Progress part_of(const Progress& whole, double from, double to) {
  return [whole, from, to](double fraction) { whole(from + (to - from) * fraction); };
}

}  // namespace volsmooth
