#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "algorithms/formats/nifti.h"
#include "tests/support/nifti_maker.h"
#include "tests/support/temporary_file.h"

namespace volsmooth::test {

/// One file that must be refused, and how.
struct BadFile {
  std::string name;
  std::string slug;
  std::function<ByteVector()> make;
};

inline std::string name_of_row(const testing::TestParamInfo<BadFile>& row) {
  return row.param.name;
}

/// Both readers give the slug of the row, and say what is wrong.
inline void expect_refused(const BadFile& bad) {
  const TemporaryFile file(bad.make());
  const auto inspected = inspect_nifti(file.path(), {});
  ASSERT_FALSE(inspected.has_value());
  EXPECT_EQ(inspected.error().slug, bad.slug) << inspected.error().detail;
  EXPECT_FALSE(inspected.error().detail.empty());
  const auto read = read_nifti(file.path(), {});
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().slug, bad.slug);
}

}  // namespace volsmooth::test
