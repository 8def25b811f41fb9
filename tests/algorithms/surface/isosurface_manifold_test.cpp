// The law of this file: a closed surface is an oriented 2-manifold, whatever the volume holds.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "algorithms/surface/isosurface.h"
#include "algorithms/surface/measures.h"
#include "tests/support/mesh_checks.h"

namespace volsmooth {
namespace {

using test::manifold_fault;

template <typename Intensity>
Volume::Pointer volume_of(const Size3& size, const Intensity& intensity) {
  auto volume = make_volume(Grid{size, {1, 1, 1}});
  std::size_t next = 0;
  for (std::int64_t z = 0; z < size[2]; ++z) {
    for (std::int64_t y = 0; y < size[1]; ++y) {
      for (std::int64_t x = 0; x < size[0]; ++x)
        voxels_of(*volume)[next++] = static_cast<float>(intensity(x, y, z));
    }
  }
  return volume;
}

/// Voxel sizes and an oblique place in the world, so that nothing is a round number.
VoxelToWorld oblique_map() {
  return {.linear = {{{0.9, 0.1, -0.2}, {-0.1, 1.1, 0.3}, {0.2, -0.2, 1.7}}},
          .origin = {-91.3, -126.7, -71.1}};
}

TEST(IsosurfaceManifold, AllVolumesOfTwoVoxelsCubed) {
  for (unsigned inside = 1; inside < 256; ++inside) {
    const auto volume =
        volume_of({2, 2, 2}, [&](auto x, auto y, auto z) { return inside >> (x + 2 * y + 4 * z) & 1u; });
    for (double isovalue : {0.5, 1.0}) {
      const Mesh mesh = extract_isosurface(*volume, oblique_map(), isovalue);
      ASSERT_EQ(manifold_fault(mesh), "") << "case " << inside << " at " << isovalue;
      ASSERT_FALSE(mesh.triangles.empty());
      ASSERT_GT(measure(mesh).volume_mm3, 0);
    }
  }
}

TEST(IsosurfaceManifold, AllVolumesOfThreeByTwoByTwoVoxels) {
  for (unsigned inside = 1; inside < 4096; ++inside) {
    const auto volume =
        volume_of({2, 3, 2}, [&](auto x, auto y, auto z) { return inside >> (x + 2 * y + 6 * z) & 1u; });
    ASSERT_EQ(manifold_fault(extract_isosurface(*volume, oblique_map(), 1.0)), "") << "case " << inside;
  }
}

/// Noise of integers has its isovalue at a third of all voxels exactly.
TEST(IsosurfaceManifold, NoiseOfManySizes) {
  constexpr unsigned kVolumes = 2000;
  for (unsigned seed = 0; seed < kVolumes; ++seed) {
    std::mt19937 random(seed);
    const auto up_to = [&random](unsigned n) { return static_cast<std::int64_t>(random() % (n + 1)); };
    const Size3 size{2 + up_to(9), 2 + up_to(7), 2 + up_to(5)};
    const bool integers = seed % 2 == 0;
    const auto volume = volume_of(size, [&](auto, auto, auto) {
      return integers ? static_cast<double>(up_to(2)) : static_cast<double>(random()) / 2147483648.0;
    });
    const Mesh mesh = extract_isosurface(*volume, oblique_map(), 1.0);
    ASSERT_EQ(manifold_fault(mesh), "") << "seed " << seed;
    const SurfaceMeasures measures = measure(mesh);
    ASSERT_TRUE(measures.closed || mesh.triangles.empty());
  }
}

TEST(IsosurfaceManifold, RowsLongerThanOneWord) {
  for (std::int64_t n : {61, 62, 63, 64, 65, 126, 127, 128}) {
    std::mt19937 random(static_cast<unsigned>(n));
    const auto volume = volume_of({n, 4, 3}, [&](auto, auto, auto) { return random() % 3; });
    EXPECT_EQ(manifold_fault(extract_isosurface(*volume, oblique_map(), 1.0)), "") << n;
  }
}

TEST(IsosurfaceManifold, BallsCutByFacesEdgesAndCorners) {
  for (const Vector3& centre :
       {Vector3{12, 12, 12}, {2, 12, 12}, {2, 2, 12}, {2, 2, 2}, {-3, 12, 23}, {0, 0, 0}}) {
    const auto volume = volume_of({24, 24, 24}, [&](auto x, auto y, auto z) {
      return -std::hypot(static_cast<double>(x) - centre[0], static_cast<double>(y) - centre[1],
                         static_cast<double>(z) - centre[2]);
    });
    const Mesh mesh = extract_isosurface(*volume, oblique_map(), -8);
    EXPECT_EQ(manifold_fault(mesh), "");
    EXPECT_EQ(measure(mesh).euler_characteristic, 2);
  }
}

/// Positions of spacing 0.01 mm at 10 m from the origin differ by few ulps only.
TEST(IsosurfaceManifold, TinyVoxelsFarFromTheOrigin) {
  const VoxelToWorld map{.linear = {{{0.01, 0, 0}, {0, 0.01, 0}, {0, 0, 0.02}}},
                         .origin = {10'000, -9'000, 0}};
  std::mt19937 random(7);
  const auto volume = volume_of({6, 7, 8}, [&](auto, auto, auto) { return random() % 3; });
  EXPECT_EQ(manifold_fault(extract_isosurface(*volume, map, 1.0)), "");
}

TEST(IsosurfaceManifold, NothingInsideOrNoThicknessIsAnEmptyMesh) {
  const auto empty = volume_of({4, 4, 4}, [](auto, auto, auto) { return 0; });
  EXPECT_TRUE(extract_isosurface(*empty, oblique_map(), 1).positions.empty());
  const auto flat = volume_of({4, 1, 4}, [](auto, auto, auto) { return 2; });
  EXPECT_TRUE(extract_isosurface(*flat, oblique_map(), 1).triangles.empty());
}

}  // namespace
}  // namespace volsmooth
