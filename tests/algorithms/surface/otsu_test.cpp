#include "algorithms/surface/otsu.h"

#include <gtest/gtest.h>

#include <random>

#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

template <typename Intensity>
Volume::Pointer filled(const Intensity& intensity) {
  auto volume = make_volume(Grid{{80, 70, 60}, {1, 1, 1}});
  for (float& voxel : voxels_of(*volume)) voxel = static_cast<float>(intensity());
  return volume;
}

TEST(Otsu, OfConstantDataIsTheValue) {
  EXPECT_EQ(otsu_threshold(*filled([] { return -1024; })), -1024);
}

/// Whatever the part of each value, and for values that are no round numbers.
TEST(Otsu, OfTwoValuesIsTheMidpoint) {
  for (unsigned part : {2u, 7u, 1000u}) {
    std::mt19937 random(part);
    EXPECT_DOUBLE_EQ(otsu_threshold(*filled([&] { return random() % part == 0 ? 1 : 0; })), 0.5);
    EXPECT_DOUBLE_EQ(otsu_threshold(*filled([&] { return random() % part == 0 ? 300 : -1000; })), -350);
  }
}

/// Two equal classes far apart: every border between them is as good, and the middle one is taken.
TEST(Otsu, SeparatesTwoClassesInTheMiddleOfTheGap) {
  std::mt19937 random(1);
  const auto volume = filled([&] { return random() % 101 + (random() % 2 == 0 ? 0 : 900); });
  EXPECT_NEAR(otsu_threshold(*volume), 500, 1);
}

/// For classes of the same width and weight the best threshold is halfway between their means.
TEST(Otsu, OfTwoEqualHumpsLiesHalfway) {
  std::mt19937 random(2);
  const auto hump = [&] { return static_cast<double>(random() % 500 + random() % 500 + random() % 500); };
  const auto volume = filled([&] { return hump() + (random() % 2 == 0 ? 0 : 1000); });
  EXPECT_NEAR(otsu_threshold(*volume), 750 + 500, 10);
}

/// Padding of -2000 below a scan of air and soft tissue would draw the threshold into the gap between the
/// two.
TEST(Otsu, LeavesExcludedVoxelsOut) {
  const auto scan = [](unsigned part_of_padding) {
    std::mt19937 random(4);
    return filled([&] {
      const auto tissue = random() % 101 + (random() % 2 == 0 ? 0 : 900);
      return part_of_padding > 0 && random() % part_of_padding == 0 ? -4000.0 : static_cast<double>(tissue);
    });
  };
  EXPECT_LT(otsu_threshold(*scan(4)), 0);
  EXPECT_NEAR(otsu_threshold(*scan(4), no_progress, -4000.0F), 500, 1);
  EXPECT_EQ(otsu_threshold(*scan(0), no_progress, -4000.0F), otsu_threshold(*scan(0)));
}

TEST(Otsu, OfNothingButExcludedVoxelsIsTheirValue) {
  EXPECT_EQ(otsu_threshold(*filled([] { return -2000; }), no_progress, -2000.0F), -2000);
}

TEST(Otsu, DoesNotDependOnTheNumberOfThreads) {
  std::mt19937 random(3);
  const auto volume =
      filled([&] { return static_cast<double>(random()) / 7 * static_cast<double>(random()); });
  double one = 0, two = 1;
  with_threads(1, [&] { one = otsu_threshold(*volume); });
  with_threads(2, [&] { two = otsu_threshold(*volume); });
  EXPECT_EQ(one, two);
}

}  // namespace
}  // namespace volsmooth
