#pragma once

#include <cstddef>
#include <memory>
#include <span>

namespace volsmooth {

/// Asks for large pages for memory that was allocated and not touched yet: each of the small ones would be a
/// fault of its own.
void ask_for_large_pages(std::span<const std::byte> memory);

/// An array of `count` elements that are not initialised, in large pages.
template <class Element>
std::unique_ptr<Element[]> uninitialised(std::size_t count) {
  auto elements = std::make_unique_for_overwrite<Element[]>(count);
  ask_for_large_pages(std::as_bytes(std::span(elements.get(), count)));
  return elements;
}

}  // namespace volsmooth
