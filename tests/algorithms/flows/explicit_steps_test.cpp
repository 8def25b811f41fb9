#include "algorithms/flows/explicit_steps.h"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>

#include "algorithms/flows/conservative_mean_curvature_flow.h"
#include "algorithms/flows/laplacian.h"
#include "algorithms/flows/mean_curvature_flow.h"
#include "algorithms/flows/sharpening.h"
#include "algorithms/volume/parallel.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

using Smooth = std::function<void(Volume&, const Progress&)>;

struct Case {
  const char* name;
  Smooth smooth;
};

const Case kCases[] = {
    {"MeanCurvatureFlow",
     [](Volume& volume, const Progress& report) { smooth(volume, MeanCurvatureFlow{0.5}, report); }},
    {"LongMeanCurvatureFlow",
     [](Volume& volume, const Progress& report) { smooth(volume, MeanCurvatureFlow{8}, report); }},
    {"ConservativeMeanCurvatureFlow",
     [](Volume& volume, const Progress& report) {
       smooth(volume, ConservativeMeanCurvatureFlow{0.5}, report);
     }},
    {"Sharpening", [](Volume& volume, const Progress& report) { smooth(volume, Sharpening{1.5}, report); }},
    {"Laplacian", [](Volume& volume, const Progress& report) { smooth(volume, Laplacian{1}, report); }}};

class Flow : public testing::TestWithParam<Case> {};

const Grid kGrid{{17, 70, 101}, {1, 1, 1.2}};  // several tiles along y and z

TEST_P(Flow, GivesTheSameBytesWithAnyNumberOfThreads) {
  const auto before = noise(kGrid.size, 3, 0, 1000);
  std::vector<float> first;
  for (const int threads : {1, 2, 7}) {
    auto volume = volume_of(kGrid, before);
    with_threads(threads, [&] { GetParam().smooth(*volume, no_progress); });
    if (first.empty()) first = values_of(*volume);
    EXPECT_EQ(values_of(*volume), first) << threads << " threads";
  }
}

TEST_P(Flow, ReportsEveryTileAndEndsAtOne) {
  auto volume = volume_of(kGrid, noise(kGrid.size, 3));
  std::mutex mutex;
  std::vector<double> fractions;
  GetParam().smooth(*volume, [&](double fraction) {
    const std::lock_guard lock(mutex);
    fractions.push_back(fraction);
  });
  // Tiles are at most 48 planes deep: three of them or more here, in each of three steps or more.
  EXPECT_GE(fractions.size(), 3U * 3U);
  EXPECT_GE(std::ranges::min(fractions), 0);
  EXPECT_EQ(std::ranges::max(fractions), 1);
}

TEST_P(Flow, EndsAtTheReportThatCancelsIt) {
  auto volume = volume_of(kGrid, noise(kGrid.size, 3));
  std::atomic<int> calls{0};
  const auto cancel_at_tenth = [&](double) {
    if (++calls >= 10) throw Cancelled();
  };
  with_threads(1, [&] { EXPECT_THROW(GetParam().smooth(*volume, cancel_at_tenth), Cancelled); });
  EXPECT_EQ(calls, 10);
}

INSTANTIATE_TEST_SUITE_P(All, Flow, testing::ValuesIn(kCases),
                         [](const auto& flow) { return std::string(flow.param.name); });

TEST(TakeSteps, SwapsTwoBuffersAndCopiesNone) {
  const Grid grid{{4, 3, 2}, {1, 1, 1}};
  auto volume = volume_of(grid, std::vector<float>(24, 1.0F));
  std::vector<const float*> read, written;
  take_steps(
      *volume, 3,
      [&](std::span<const float> from, std::span<float> to, const Progress&) {
        read.push_back(from.data());
        written.push_back(to.data());
        for (std::size_t voxel = 0; voxel < from.size(); ++voxel) to[voxel] = from[voxel] + 1;
      },
      no_progress);
  EXPECT_EQ(values_of(*volume), std::vector<float>(24, 4.0F));
  EXPECT_EQ(read, (std::vector<const float*>{read[0], written[0], read[0]}));
  EXPECT_EQ(volume->GetBufferPointer(), written[2]);
}

TEST(TakeSteps, ShowsStepsIntensitiesWhoseSquaresAreFloats) {
  const Grid grid{{2, 1, 1}, {1, 1, 1}};
  for (const float magnitude : {1e-45F, 1e-30F, 1.0F, 1e30F, 3.4e38F}) {
    auto volume = volume_of(grid, {magnitude, -magnitude});
    take_steps(
        *volume, 1,
        [&](std::span<const float> from, std::span<float> to, const Progress&) {
          const float square = (from[0] - from[1]) * (from[0] - from[1]);
          EXPECT_TRUE(std::isnormal(square)) << magnitude;
          std::ranges::copy(from, to.begin());
        },
        no_progress);
    EXPECT_EQ(values_of(*volume), (std::vector<float>{magnitude, -magnitude}));
  }
}

}  // namespace
}  // namespace volsmooth
