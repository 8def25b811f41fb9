#include "algorithms/formats/isal.h"

#include <gtest/gtest.h>

#include "tests/support/nifti_maker.h"

#if defined(__x86_64__)
#include <cpuid.h>

namespace volsmooth {
namespace {

/// XINUSE (Intel's manual, volume 1, 13.2), of which bit 2 is set while an upper half of a register is in
/// use.
[[gnu::target("xsave")]] bool upper_halves_are_in_use() {
  return (__builtin_ia32_xgetbv(1) & 4U) != 0;
}

bool can_be_asked() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __builtin_cpu_supports("avx") && __get_cpuid_count(13, 1, &a, &b, &c, &d) != 0 && (a & 4U) != 0;
}

TEST(Isal, GivesBackTheUpperHalvesOfVectorRegisters) {
  if (!can_be_asked()) GTEST_SKIP() << "the processor does not tell";
  std::vector<std::byte> plain(1 << 20);
  for (std::size_t i = 0; i < plain.size(); ++i) plain[i] = static_cast<std::byte>(i * i >> 7);
  const test::ByteVector packed = test::gzipped(plain);
  inflate_state state;
  isal_inflate_init(&state);
  state.crc_flag = ISAL_GZIP;
  state.next_in = reinterpret_cast<std::uint8_t*>(const_cast<std::byte*>(packed.data()));
  state.avail_in = static_cast<std::uint32_t>(packed.size());
  state.next_out = reinterpret_cast<std::uint8_t*>(plain.data());
  state.avail_out = static_cast<std::uint32_t>(plain.size());
  EXPECT_EQ(isal::inflate(state), ISAL_DECOMP_OK);
  EXPECT_FALSE(upper_halves_are_in_use());
  isal::crc32(0, plain);
  EXPECT_FALSE(upper_halves_are_in_use());
}

}  // namespace
}  // namespace volsmooth
#endif
