#pragma once

#include <algorithm>
#include <cstddef>

#include "algorithms/progress.h"
#include "algorithms/volume/large_pages.h"

namespace volsmooth {

/// Calls `body(begin, end)` for consecutive parts of [0, count) in this thread, and `report` after each: for
/// loops whose passes depend on one another, so that they can be cancelled all the same.
template <typename Body>
void serial_for(std::size_t count, const Body& body, const Progress& report) {
  constexpr std::size_t kPerPart = std::size_t{1} << 18;
  for (std::size_t begin = 0; begin < count; begin += kPerPart) {
    const std::size_t end = std::min(count, begin + kPerPart);
    body(begin, end);
    report(static_cast<double>(end) / static_cast<double>(count));
  }
}

/// Makes an empty vector one of `count` zeros; touching so much new memory takes a while.
template <typename Vector>
void grow(Vector& vector, std::size_t count, const Progress& report) {
  vector.reserve(count);
  ask_for_large_pages(std::as_bytes(std::span(vector.data(), count)));
  serial_for(
      count, [&](std::size_t, std::size_t end) { vector.resize(end); }, report);
}

}  // namespace volsmooth
