#include "algorithms/formats/picture.h"

#include <gtest/gtest.h>
#include <png.h>
#include <unistd.h>

#include <cmath>
#include <system_error>

#include "algorithms/formats/slice_views.h"
#include "tests/support/world_phantoms.h"

namespace volsmooth {
namespace {

using namespace test;

struct Image {
  std::int64_t width = 0, height = 0;
  std::vector<std::array<std::uint8_t, 3>> pixels;
  const auto& at(std::int64_t x, std::int64_t y) const {
    return pixels[static_cast<std::size_t>(y * width + x)];
  }
};

Image read_png(const std::filesystem::path& file) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, file.c_str()) == 0) throw std::runtime_error("not a PNG");
  png.format = PNG_FORMAT_RGB;
  Image image{png.width, png.height, {}};
  image.pixels.resize(std::size_t{png.width} * png.height);
  if (png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) == 0)
    throw std::runtime_error("bad PNG");
  return image;
}

Image picture_of(const MiddleSlices& before, const MiddleSlices& after, std::span<const double> isovalues) {
  const auto file =
      std::filesystem::path(testing::TempDir()) / ("picture." + std::to_string(::getpid()) + ".png");
  write_picture(file, before, after, isovalues);
  const Image image = read_png(file);
  std::filesystem::remove(file);
  return image;
}

/// How the voxels of one head may lie: its axes permuted and mirrored, in either frame.
struct Lie {
  Matrix3 linear;
  Frame frame;
};
class Orientation : public testing::TestWithParam<Lie> {};

/// A head of 40 x 60 x 50 mm about the origin, brighter to the left, to the front and upwards.
double head(const Vector3& ras) {
  return 100 - ras[0] + 2 * ras[1] + 4 * ras[2];
}

TEST_P(Orientation, IsRadiological) {
  const VoxelToWorld linear{.linear = GetParam().linear};
  const Vector3 extent{40, 60, 50};
  Size3 size{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double covered = 0, step = 0;
    for (std::size_t row = 0; row < 3; ++row) {
      covered += std::abs(linear.linear[row][axis]) * extent[row];
      step += linear.linear[row][axis] * linear.linear[row][axis];
    }
    size[axis] = std::lround(covered / step);
  }
  const VoxelToWorld ras = centred_map(linear.linear, size);
  const auto volume = sampled_in_world(size, ras, head);
  const MiddleSlices slices = middle_slices(*volume, in_frame(ras, GetParam().frame));
  const auto views = radiological_views(slices.size, slices.map);

  // Along a step to the right and one down in millimetres: axial and coronal slices run to the patient's
  // left, sagittal ones to the back; axial ones run backwards, the others down.
  const std::array<std::array<double, 2>, 3> expected{{{1, -2}, {1, -4}, {-2, -4}}};
  for (std::size_t v = 0; v < 3; ++v) {
    const SliceVoxels voxels(slices, views[v]);
    const auto at = [&](double right_mm, double down_mm) {
      const auto right = views[v].right.between(right_mm), down = views[v].down.between(down_mm);
      const auto along = [&](std::int64_t row) {
        return std::lerp(double{voxels.at(right.low, row)}, double{voxels.at(right.next, row)},
                         double{right.part});
      };
      return std::lerp(along(down.low), along(down.next), double{down.part});
    };
    EXPECT_NEAR((at(30, 20) - at(10, 20)) / 20, expected[v][0], 1e-5) << v;
    EXPECT_NEAR((at(20, 30) - at(20, 10)) / 20, expected[v][1], 1e-5) << v;
  }
  EXPECT_NEAR(views[0].right.extent_mm(), 40, 1e-9);
  EXPECT_NEAR(views[0].down.extent_mm(), 60, 1e-9);
  EXPECT_NEAR(views[1].down.extent_mm(), 50, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(SliceViews, Orientation,
                         testing::Values(Lie{scaling(1, 1, 1), Frame::kRas},
                                         Lie{scaling(1, 1, 1), Frame::kLps},
                                         Lie{scaling(-1, -1, 2), Frame::kRas},
                                         Lie{scaling(2, 0.5, -1), Frame::kLps},
                                         Lie{{{{0, 0, 1}, {-1, 0, 0}, {0, 1, 0}}}, Frame::kRas},
                                         Lie{{{{0, 2, 0}, {0, 0, -1}, {-1, 0, 0}}}, Frame::kLps}));

TEST(Picture, IsTrueToScaleInMm) {
  const Size3 size{40, 40, 10};
  const VoxelToWorld map = centred_map(scaling(1, 1, 4), size);
  const auto volume = sampled_in_world(size, map, [](const Vector3& x) { return x[0]; });
  const MiddleSlices slices = middle_slices(*volume, map);
  const Image image = picture_of(slices, slices, {});
  EXPECT_EQ(image.width, 3 * 440 + 4 * 10);
  EXPECT_EQ(image.height, 2 * 440 + 3 * 10);
}

TEST(Picture, ShowsBeforeAboveAfterAndContoursInColour) {
  const Size3 size{41, 41, 41};
  const VoxelToWorld map = centred_map(scaling(1, 1, 1), size);
  const auto ball = [&](double radius) {
    return middle_slices(*sampled_in_world(size, map, [&](const Vector3& x) { return radius - norm(x); }),
                         map);
  };
  const std::vector<double> isovalues{0};
  const Image image = picture_of(ball(15), ball(8), isovalues);
  // A circle of radius r has its rightmost point in the middle row of its panel.
  const double pixels_per_mm = 440.0 / 41;
  const auto coloured = [&](double radius_mm, std::int64_t row) {
    int count = 0;
    const auto x = static_cast<std::int64_t>(10 + 220 + radius_mm * pixels_per_mm);
    for (std::int64_t near = x - 3; near <= x + 3; ++near) {
      const auto& [red, green, blue] = image.at(near, 10 + row * 450 + 220);
      count += red > green && green > blue ? 1 : 0;
    }
    return count;
  };
  EXPECT_GE(coloured(15, 0), 1);
  EXPECT_GE(coloured(8, 1), 1);
  EXPECT_EQ(coloured(8, 0), 0);
  EXPECT_EQ(coloured(15, 1), 0);
  EXPECT_EQ(image.at(230, 230)[0], 255);  // the middle of the ball is white
  EXPECT_EQ(image.at(2, 2)[0], 0);
}

TEST(Picture, OfOneConstantOrThinVolumeIsAPicture) {
  for (const Size3& size : {Size3{1, 1, 1}, Size3{5, 1, 3}, Size3{300, 2, 2}}) {
    const VoxelToWorld map{};
    const MiddleSlices slices =
        middle_slices(*sampled_in_world(size, map, [](const Vector3&) { return 7; }), map);
    const std::vector<double> isovalues{7, 8};
    EXPECT_GT(picture_of(slices, slices, isovalues).height, 0);
  }
}

/// Of an axis longer than that, 2048 voxels are taken; its extent and what lies where stay the same.
TEST(MiddleSlices, OfAHugeThinVolumeAreSampled) {
  const Size3 size{5000, 3, 2};
  const VoxelToWorld map{.linear = scaling(0.5, 2, -3)};
  const auto volume = sampled_in_world(size, map, [](const Vector3& x) { return x[0]; });
  const MiddleSlices slices = middle_slices(*volume, map);
  EXPECT_EQ(slices.size, (Size3{2048, 3, 2}));
  EXPECT_EQ(slices.slices[2].size(), 2048u * 3);
  const SliceView axial = radiological_views(slices.size, slices.map)[0];
  EXPECT_NEAR(axial.right.extent_mm(), 2500, 1e-9);
  EXPECT_NEAR(axial.down.extent_mm(), 6, 1e-9);
  const double spacing = 2500.0 / 2048;
  const SliceVoxels voxels(slices, axial);
  for (std::int64_t i = 0; i < 2048; ++i) {
    // The middle of a sample, from the first voxel's centre; what is taken is the voxel it lies in.
    const double middle = (static_cast<double>(i) + 0.5) * spacing - 0.25;
    ASSERT_NEAR(double{voxels.at(i, 1)}, middle, 0.25 + 1e-3) << i;
  }
}

TEST(Picture, SaysWhyItCannotBeWritten) {
  const VoxelToWorld map{};
  const MiddleSlices slices =
      middle_slices(*sampled_in_world({4, 4, 4}, map, [](const Vector3&) { return 7; }), map);
  EXPECT_THROW(write_picture("/no/such/folder/picture.png", slices, slices, {}), std::system_error);
}

}  // namespace
}  // namespace volsmooth
