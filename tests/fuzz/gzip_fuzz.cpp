// links: algorithms_formats
//
// A gzip file inflated to its end, in steps of odd lengths.
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>

#include "algorithms/formats/byte_source.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const int memory = ::memfd_create("input", 0);
  if (::ftruncate(memory, 0) != 0 || ::pwrite(memory, data, size, 0) != static_cast<ssize_t>(size))
    std::abort();
  volsmooth::ByteSource source("/proc/self/fd/" + std::to_string(memory), {.free_inflated_bytes = 1 << 22});
  std::array<std::byte, 4099> out;
  for (std::size_t got = out.size(); got == out.size();) {
    const auto read = source.read(out);
    if (!read) return 0;
    got = *read;
  }
  return 0;
}
