#include "algorithms/flows/surface_advection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "algorithms/flows/advection.h"
#include "algorithms/flows/conservative_mean_curvature_flow.h"
#include "algorithms/flows/narrow_band_flow.h"
#include "algorithms/volume/parallel.h"
#include "tests/support/face_flows.h"
#include "tests/support/phantoms.h"
#include "tests/support/surface_distance.h"

namespace volsmooth {
namespace {

const Grid kCube{{32, 32, 32}, {1.0 / 32, 1.0 / 32, 1.0 / 32}};

/// A ball in the unit cube, from 1 at its middle to 0 in the corners, exactly.
std::vector<float> ball() {
  return sampled(kCube, [](const Vector3& x) {
    return std::clamp(0.5 - 0.50001 * std::tanh(32 * (distance(x, {0.35, 0.35, 0.35}) - 0.2)), 0.0, 1.0);
  });
}

const FaceVelocities<float>& swirl() {
  static const auto velocities = curl_on_faces<float>(kCube, deformation);
  return velocities;
}

double mass_mm3(const std::vector<float>& density) {
  return std::accumulate(density.begin(), density.end(), 0.0) * voxel_volume_mm3(kCube);
}

struct Advected {
  std::vector<float> density;
  SurfaceAdvectionResult result;
};

Advected in_band(const SurfaceAdvection& advection, const std::vector<float>& density = ball()) {
  auto volume = volume_of(kCube, density);
  const auto result = advect_surface(*volume, swirl(), advection);
  return {values_of(*volume), result};
}

std::vector<float> everywhere(double duration, Reconstruction reconstruction) {
  auto density = ball();
  advect<float>(density, kCube, swirl(), duration, reconstruction);
  return density;
}

const Reconstruction kReconstructions[] = {Reconstruction::kPiecewiseConstant, Reconstruction::kWeno7,
                                           Reconstruction::kWeno5};
const Reinjection kReinjections[] = {Reinjection::kNormalFlow, Reinjection::kAlongChanges,
                                     Reinjection::kSharpening};

/// To the byte; WENO passes 0 and 1 by up to 6e-5, and cells that do settle there. Measured: 1.5e-8.
TEST(SurfaceAdvection, WithoutAThresholdDoesWhatTheFullGridDoes) {
  for (const Reconstruction reconstruction : kReconstructions) {
    const auto band = in_band({.duration = 0.05, .reconstruction = reconstruction, .epsilon = 0}).density;
    const auto full = everywhere(0.05, reconstruction);
    const float tolerance = reconstruction == Reconstruction::kPiecewiseConstant ? 0 : 3e-8F;
    for (std::size_t cell = 0; cell < full.size(); ++cell) ASSERT_NEAR(band[cell], full[cell], tolerance);
  }
}

/// In voxels, as the thesis' band is to be taken for the full grid.
TEST(SurfaceAdvection, TakesTheSurfaceWhereTheFullGridDoes) {
  for (const Reconstruction reconstruction : kReconstructions) {
    const auto band = in_band({.duration = 0.15, .reconstruction = reconstruction}).density;
    EXPECT_LT(largest_distance(kCube.size, band, everywhere(0.15, reconstruction)), 0.02);
  }
}

TEST(SurfaceAdvection, KeepsTheMassUpToWhatIsPostponed) {
  const double mass = mass_mm3(ball());
  for (const Reinjection reinjection : kReinjections) {
    const auto [density, result] =
        in_band({.duration = 0.3, .reinjection = reinjection, .largest_postponed = 2e-4, .epsilon = 0.01F});
    EXPECT_GT(result.reinjections, 1);
    EXPECT_LT(result.largest_postponed_mm3, 0.005 * mass);
    EXPECT_LT(std::abs(result.postponed_mm3), 1e-3 * mass);
    EXPECT_NEAR(mass_mm3(density) + result.postponed_mm3, mass, 1e-12 * mass);
  }
}

/// Piecewise constant fluxes smear: there and back, the band is half as wide again. Sharpened on the way it
/// stays within the limit.
TEST(SurfaceAdvection, SharpensABandThatGetsTooWide) {
  const auto wide = in_band({.duration = 0.3});
  const auto narrow = in_band({.duration = 0.3, .largest_width_voxels = 8});
  EXPECT_EQ(wide.result.sharpening_steps, 0);
  EXPECT_GT(narrow.result.sharpening_steps, 0);
  EXPECT_LT(narrow.result.cells_computed, 0.9 * static_cast<double>(wide.result.cells_computed));
  EXPECT_NEAR(mass_mm3(narrow.density), mass_mm3(ball()), 1e-3 * mass_mm3(ball()));
}

TEST(SurfaceAdvection, DoesNotDependOnTheNumberOfThreads) {
  for (const Reinjection reinjection : kReinjections) {
    std::vector<Advected> all;
    for (const int threads : {1, 2, 3})
      with_threads(threads, [&] {
        all.push_back(in_band({.duration = 0.1,
                               .reinjection = reinjection,
                               .largest_postponed = 1e-5,
                               .largest_width_voxels = 9}));
      });
    for (const Advected& other : all) {
      EXPECT_EQ(other.density, all[0].density);
      EXPECT_EQ(other.result.postponed_mm3, all[0].result.postponed_mm3);
    }
  }
}

TEST(SurfaceAdvection, EndsAtOnceWithoutASurfaceOrMotion) {
  const std::vector<float> full(ball().size(), 1.0F);
  const auto of_full = in_band({.duration = 1e6}, full);
  EXPECT_EQ(of_full.density, full);
  EXPECT_EQ(of_full.result.steps, 0);
  EXPECT_EQ(in_band({.duration = 0}).result.steps, 0);
}

TEST(SurfaceAdvection, CanBeCancelled) {
  auto volume = volume_of(kCube, ball());
  const Progress cancel_half_way = [](double fraction) {
    if (fraction > 0.5) throw Cancelled();
  };
  EXPECT_THROW(advect_surface(*volume, swirl(), {.duration = 0.1}, cancel_half_way), Cancelled);
}

/// An ellipsoid becomes rounder and keeps its mass; the same surface as on the full grid.
TEST(ConservativeSurfaceFlow, MovesAsOnTheFullGridAndKeepsTheMass) {
  const Grid grid{{32, 28, 24}, {1, 1, 1}};
  const auto density = sampled(grid, [](const Vector3& x) {
    const double r = std::hypot((x[0] - 15.5) / 12, (x[1] - 13.5) / 8, (x[2] - 11.5) / 7);
    return (1 - std::tanh(14 * (r - 1))) / 2;
  });
  auto full = volume_of(grid, density), band = volume_of(grid, density);
  smooth(*full, ConservativeMeanCurvatureFlow{.flow_time_mm2 = 10});
  const auto result = smooth_surface(*band, ConservativeSurfaceFlow{.flow_time_mm2 = 10});
  EXPECT_GT(largest_distance(grid.size, density, values_of(*band)), 0.5);
  EXPECT_LT(largest_distance(grid.size, values_of(*full), values_of(*band)), 0.02);
  const double mass = std::accumulate(density.begin(), density.end(), 0.0);
  const auto after = values_of(*band);
  EXPECT_NEAR(std::accumulate(after.begin(), after.end(), 0.0), mass, 1e-5 * mass);
  EXPECT_GT(result.steps, 40);
}

}  // namespace
}  // namespace volsmooth
