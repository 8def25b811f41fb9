// The surfaces of a real head: cut by the border of its volume, thousands of voxels equal to the isovalue.

#include <gtest/gtest.h>

#include "algorithms/formats/mesh_writers.h"
#include "algorithms/formats/nifti.h"
#include "algorithms/surface/isosurface.h"
#include "algorithms/surface/measures.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/temporary_file.h"

namespace volsmooth {
namespace {

const std::filesystem::path kHead = "/usr/share/mricron/templates/ch2.nii.gz";

class HeadSurface : public testing::TestWithParam<double> {};

TEST_P(HeadSurface, IsAClosedManifoldAlsoWhenItsStlIsMergedByPosition) {
  if (!std::filesystem::exists(kHead)) GTEST_SKIP() << "needs the package mricron-data";
  const auto loaded = read_nifti(kHead, {});
  ASSERT_TRUE(loaded.has_value());
  const Mesh mesh = extract_isosurface(*loaded->volume, loaded->description.map, GetParam());
  const SurfaceMeasures measures = measure(mesh);
  EXPECT_GT(measures.triangles, 1'000'000);
  EXPECT_GT(measures.cap_area_mm2, 10'000);
  EXPECT_TRUE(measures.closed);

  const test::TemporaryFile file;
  find_mesh_format("stl")->write(file.path(), {&mesh, 1}, no_progress);
  const test::MergedMesh merged = test::merge_by_position(test::read_stl(file.path()));
  EXPECT_EQ(merged.positions.size(), mesh.positions.size());
  EXPECT_EQ(test::manifold_fault(merged), "");
}

INSTANTIATE_TEST_SUITE_P(Isovalues, HeadSurface, testing::Values(40, 90));

}  // namespace
}  // namespace volsmooth
