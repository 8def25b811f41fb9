// The fast steps are held to the plain ones, byte for byte.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "algorithms/flows/face_centred_stages.h"
#include "algorithms/flows/face_centred_sweep.h"
#include "algorithms/flows/laplacian_sweep.h"
#include "algorithms/flows/mean_curvature_sweep.h"
#include "algorithms/flows/offset_sweep.h"
#include "algorithms/flows/plain_steps.h"
#include "algorithms/flows/thesis_sweep.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

using PlainStep = void (*)(std::span<const float>, std::span<float>, const Grid&, double);
using TunedStep = void (*)(std::span<const float>, std::span<float>, const Grid&, double, InstructionSet,
                           const TileShape&, const Progress&);

struct Flow {
  const char* name;
  PlainStep plain;
  TunedStep fast;
};

/// Inwards, with weights of both signs.
template <Reconstruction kGains, UpwindGradient kUpwind>
OffsetStage weighted_stage(std::span<const float> weights, double step_mm2) {
  return {.gains = kGains,
          .upwind = kUpwind,
          .step_mm = -std::sqrt(step_mm2),
          .weights = weights,
          .range = 2000,
          .second_of_heun = kGains == Reconstruction::kWeno7};
}

/// The rows of the table for an offset.
template <Reconstruction kGains, UpwindGradient kUpwind>
Flow offset_flow(const char* name) {
  return {name,
          [](std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2) {
            const auto weights = noise(grid.size, 3, -1, 1);
            plain_offset_stage(from, to, grid, weighted_stage<kGains, kUpwind>(weights, step_mm2));
          },
          [](std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
             InstructionSet set, const TileShape& tile, const Progress& report) {
            const auto weights = noise(grid.size, 3, -1, 1);
            offset_stage(from, to, grid, weighted_stage<kGains, kUpwind>(weights, step_mm2), set, tile,
                         report);
          }};
}

/// A stage between volumes of noise, and what stands in `to`.
Stage noisy_stage(std::span<const float> from, std::span<const float> to,
                  const std::array<std::vector<float>, 2>& others) {
  return {.weights = {.start = 0.3F,
                      .start_moved = -0.7F,
                      .before = -0.9F,
                      .previous = 1.1F,
                      .previous_moved = 1.2F},
          .start = others[0],
          .start_moved = others[1],
          .before = to,
          .previous = from,
          .range = {-700, 900}};
}

std::array<std::vector<float>, 2> two_noises(const Grid& grid) {
  return {noise(grid.size, 3, -1000, 1000), noise(grid.size, 4, -1000, 1000)};
}

const Flow kFaceCentredStage{
    "FaceCentredStage",
    [](std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2) {
      const auto others = two_noises(grid);
      plain_face_centred_stage(noisy_stage(from, to, others), to, grid, step_mm2);
    },
    [](std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
       InstructionSet set, const TileShape& tile, const Progress& report) {
      const auto others = two_noises(grid);
      face_centred_stage(noisy_stage(from, to, others), to, grid, step_mm2, set, tile, report);
    }};

template <Reconstruction kGains>
Flow thesis_flow(const char* name) {
  return {name,
          [](std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2) {
            plain_thesis_step(from, to, grid, {.gains = kGains, .step_mm2 = step_mm2, .range = 2000});
          },
          [](std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
             InstructionSet set, const TileShape& tile, const Progress& report) {
            thesis_step(from, to, grid, {.gains = kGains, .step_mm2 = step_mm2, .range = 2000}, set, tile,
                        report);
          }};
}

using enum Reconstruction;
using enum UpwindGradient;

const Flow kFlows[] = {{"MeanCurvature", plain_mean_curvature_step<float>, mean_curvature_step},
                       {"FaceCentred", plain_face_centred_step<float>, face_centred_step},
                       kFaceCentredStage,
                       {"Laplacian", plain_laplacian_step<float>, laplacian_step},
                       offset_flow<kPiecewiseConstant, kGodunov>("OffsetConstant"),
                       offset_flow<kPiecewiseConstant, kEngquistOsher>("OffsetConstantBothSides"),
                       offset_flow<kWeno7, kGodunov>("OffsetWeno7"),
                       offset_flow<kWeno5, kEngquistOsher>("OffsetWeno5BothSides"),
                       thesis_flow<kPiecewiseConstant>("ThesisConstant"),
                       thesis_flow<kWeno7>("ThesisWeno7")};

struct Case {
  Flow flow;
  Grid grid;
  TileShape tile;
};

void PrintTo(const Case& value, std::ostream* out) {
  *out << value.flow.name;
}

std::vector<Case> cases() {
  const TileShape whole{64, 48}, small{3, 2}, single{1, 1};
  const std::pair<Grid, TileShape> grids[] = {
      {{{17, 13, 11}, {1, 1, 1}}, whole},       {{{17, 13, 11}, {0.7, 1.1, 2.5}}, small},
      {{{16, 8, 8}, {2, 1, 1}}, single},        {{{33, 5, 7}, {1e-3, 0.5, 1}}, small},
      {{{1, 1, 1}, {1, 2, 3}}, whole},          {{{1, 19, 7}, {1, 1, 1}}, whole},
      {{{19, 1, 7}, {1, 1, 3}}, small},         {{{19, 7, 1}, {1, 1, 1}}, small},
      {{{2, 2, 2}, {1, 1, 1}}, single},         {{{3, 2, 1}, {1, 1, 1}}, whole},
      {{{257, 3, 2}, {900, 900, 1000}}, whole}, {{{1, 1, 29}, {1, 1, 1}}, small},
      {{{29, 1, 1}, {1, 1, 1}}, whole},         {{{15, 31, 31}, {1, 1, 1.5}}, {8, 5}},
  };
  const std::pair<Grid, TileShape> skew_grids[] = {{{{17, 13, 11}, {1, 1, 1}, {0.1, -0.3, 0.5}}, whole},
                                                   {{{17, 5, 6}, {1, 1, 5}, {0, 0.34, 0}}, small},
                                                   {{{1, 4, 3}, {1, 2, 3}, {0.2, 0.2, 0.2}}, single}};
  std::vector<Case> all;
  for (const Flow& flow : kFlows)
    for (const auto& [grid, tile] : grids) all.push_back({flow, grid, tile});
  for (const Flow& flow : std::span(kFlows).subspan(1))  // the first is for right angles
    for (const auto& [grid, tile] : skew_grids) all.push_back({flow, grid, tile});
  return all;
}

std::string name_of_case(const testing::TestParamInfo<Case>& info) {
  std::string name = info.param.flow.name;
  for (const std::int64_t n : info.param.grid.size) name.append("_").append(std::to_string(n));
  return name.append("_").append(std::to_string(info.index));
}

class FastStep : public testing::TestWithParam<Case> {};

TEST_P(FastStep, GivesTheBytesOfThePlainOneOnNoise) {
  const auto& [flow, grid, tile] = GetParam();
  const double smallest = *std::ranges::min_element(grid.spacing_mm);
  const double step = 0.05 * smallest * smallest;
  std::vector<float> plain = noise(grid.size, 7, -1000, 1000), next(plain.size());
  for (int count = 0; count < 3; ++count) {
    const std::vector<float> from = plain, stood = next;
    flow.plain(from, next, grid, step);
    for (const InstructionSet set : instruction_sets()) {
      std::vector<float> fast = stood;
      flow.fast(from, fast, grid, step, set, tile, no_progress);
      EXPECT_EQ(fast, next) << "instruction set " << static_cast<int>(set) << ", step " << count;
    }
    plain.swap(next);
  }
}

INSTANTIATE_TEST_SUITE_P(Grids, FastStep, testing::ValuesIn(cases()), name_of_case);

}  // namespace
}  // namespace volsmooth
