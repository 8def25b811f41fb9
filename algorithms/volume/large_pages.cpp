#include "algorithms/volume/large_pages.h"

#include <sys/mman.h>

#include <cstdint>

namespace volsmooth {

void ask_for_large_pages(std::span<const std::byte> memory) {
  constexpr std::uintptr_t kPage = 4096;
  const auto begin = (reinterpret_cast<std::uintptr_t>(memory.data()) + kPage - 1) / kPage * kPage;
  const auto end = reinterpret_cast<std::uintptr_t>(memory.data() + memory.size());
  if (end > begin) ::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

}  // namespace volsmooth
