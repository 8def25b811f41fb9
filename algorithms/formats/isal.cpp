#include "algorithms/formats/isal.h"

#include <isa-l/crc.h>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace volsmooth::isal {
namespace {

#if defined(__x86_64__)
[[gnu::target("avx")]] void zero_upper_halves() {
  _mm256_zeroupper();
}

template <class Result>
Result released(Result result) {
  static const bool has_upper_halves = __builtin_cpu_supports("avx") != 0;
  if (has_upper_halves) zero_upper_halves();
  return result;
}
#else
template <class Result>
Result released(Result result) {
  return result;
}
#endif

}  // namespace

int inflate(inflate_state& state) {
  return released(isal_inflate(&state));
}

int deflate(isal_zstream& stream) {
  return released(isal_deflate(&stream));
}

int deflate_stateless(isal_zstream& stream) {
  return released(isal_deflate_stateless(&stream));
}

std::uint32_t crc32(std::uint32_t crc, std::span<const std::byte> bytes) {
  return released(crc32_gzip_refl(crc, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

}  // namespace volsmooth::isal
