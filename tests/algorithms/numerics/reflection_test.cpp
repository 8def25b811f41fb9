#include "algorithms/numerics/reflection.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

TEST(Reflected, MirrorsInTheOuterFacesOfTheBorderVoxels) {
  const struct {
    std::int64_t index, size, expected;
  } cases[] = {{0, 5, 0}, {4, 5, 4}, {-1, 5, 0}, {-2, 5, 1}, {5, 5, 4}, {6, 5, 3}, {-1, 1, 0}, {-2, 1, 0},
               {1, 1, 0}, {2, 1, 0}, {-2, 2, 1}, {2, 2, 1},  {3, 2, 0}, {4, 2, 0}, {-3, 2, 1}};
  for (const auto& [index, size, expected] : cases)
    EXPECT_EQ(reflected(index, size), expected) << index << " of " << size;
}

}  // namespace
}  // namespace volsmooth
