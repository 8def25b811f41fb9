#include "algorithms/flows/advection_transfer.h"

#include <gtest/gtest.h>

#include <numeric>

#include "algorithms/flows/advection.h"
#include "tests/support/face_flows.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

constexpr Grid kBox{{9, 8, 7}, {1, 1.5, 0.7}};

std::vector<double> densities() {
  const auto values = noise(kBox.size, 5);
  return {values.begin(), values.end()};
}

/// Neither smooth nor free of divergence.
FaceVelocities<double> noisy_velocities(bool crosses_border = false) {
  FaceVelocities<double> velocities(kBox.size);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Size3 counts = velocities.counts[axis];
    const auto values = noise(counts, static_cast<unsigned>(axis), -1, 1);
    std::size_t face = 0;
    for_each_voxel({counts, {1, 1, 1}}, [&](const Size3& index, const Vector3&) {
      const bool is_border = index[axis] == 0 || index[axis] == kBox.size[axis];
      velocities.at(axis, index) = is_border && !crosses_border ? 0 : double{values[face]};
      ++face;
    });
  }
  return velocities;
}

/// The circulation of noise on the edges, 0 on those of the border.
FaceVelocities<double> noise_without_divergence() {
  std::array<std::vector<float>, 3> edges;
  const Size3 corners{kBox.size[0] + 1, kBox.size[1] + 1, kBox.size[2] + 1};
  for (std::size_t axis = 0; axis < 3; ++axis)
    edges[axis] = noise(corners, static_cast<unsigned>(axis), -1, 1);
  return curl_on_faces<double>(kBox, [&](std::size_t axis, const Vector3& x) {
    Size3 index;
    for (std::size_t e = 0; e < 3; ++e) {
      index[e] = static_cast<std::int64_t>(x[e] / kBox.spacing_mm[e] + 0.01);
      if (e != axis && (index[e] == 0 || index[e] == kBox.size[e])) return 0.0;
    }
    return double{
        edges[axis][static_cast<std::size_t>(index[0] + corners[0] * (index[1] + corners[1] * index[2]))]};
  });
}

/// The time in which the first cell drains, or a number of times it.
double draining(const FaceVelocities<double>& velocities, double times = 1) {
  return times / largest_rate(kBox, velocities);
}

TEST(TransferThroughFaces, IsThePiecewiseConstantStepWhileNoCellDrains) {
  for (const bool crosses_border : {false, true}) {
    const auto velocities = noisy_velocities(crosses_border);
    const double step = draining(velocities, 0.99);
    auto transferred = densities(), advected = transferred;
    transfer_through_faces<double>(transferred, kBox, velocities, step);
    advect<double>(advected, kBox, velocities, step, Reconstruction::kPiecewiseConstant);
    for (std::size_t i = 0; i < advected.size(); ++i) ASSERT_NEAR(transferred[i], advected[i], 1e-14);
  }
}

TEST(TransferThroughFaces, KeepsMassAndSignInAnyFieldAtAnyStep) {
  const auto velocities = noisy_velocities();
  const auto before = densities();
  for (const double times : {0.5, 2.0, 5.0, 10.0}) {
    auto rho = before;
    transfer_through_faces<double>(rho, kBox, velocities, draining(velocities, times));
    EXPECT_NEAR(std::reduce(rho.begin(), rho.end()), std::reduce(before.begin(), before.end()), 1e-11);
    EXPECT_GE(std::ranges::min(rho), -1e-14) << times;
  }
}

TEST(TransferThroughFaces, KeepsConstantsAndTheRangeInFieldsWithoutDivergence) {
  const auto velocities = noise_without_divergence();
  for (const double times : {0.5, 2.0, 5.0, 10.0}) {
    std::vector<double> constant(densities().size(), 7.25);
    transfer_through_faces<double>(constant, kBox, velocities, draining(velocities, times));
    for (const double value : constant) ASSERT_NEAR(value, 7.25, 1e-12) << times;
    auto rho = densities();
    transfer_through_faces<double>(rho, kBox, velocities, draining(velocities, times));
    EXPECT_LE(std::ranges::max(rho), std::ranges::max(densities()) + 1e-14) << times;
  }
}

/// Where the velocity is constant, all cells drain at once and hand on what they were given: the data moves
/// by whole cells. The border is open here, and what flows in is as the first cell was.
TEST(TransferThroughFaces, ShiftsByWholeCells) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const std::int64_t cells : {-3, -1, 2, 4}) {
      FaceVelocities<float> velocities(kBox.size);
      std::ranges::fill(velocities.values[axis], static_cast<float>(cells));
      const auto before = noise(kBox.size, 5);
      auto rho = before;
      transfer_through_faces<float>(rho, kBox, velocities, kBox.spacing_mm[axis]);
      std::size_t voxel = 0;
      for_each_voxel(kBox, [&](const Size3& index, const Vector3&) {
        Size3 source = index;
        source[axis] = std::clamp<std::int64_t>(index[axis] - cells, 0, kBox.size[axis] - 1);
        const auto place = source[0] + kBox.size[0] * (source[1] + kBox.size[1] * source[2]);
        ASSERT_NEAR(rho[voxel++], before[static_cast<std::size_t>(place)], 1e-6) << axis << ' ' << cells;
      });
    }
}

/// The thesis expects a small loss. Larger steps smear less instead, as fewer averages are taken: on 64^2
/// cells 0.0323 in steps of one cell, 0.0304 in steps of four was measured.
TEST(TransferThroughFaces, LosesNoAccuracyByLargeStepsInAVortex) {
  constexpr std::int64_t kCells = 32;
  const Grid grid{{kCells, kCells, 1}, {1.0 / kCells, 1.0 / kCells, 1.0 / kCells}};
  const auto forth = curl_on_faces<double>(grid, single_vortex), back = reversed(forth);
  const auto start = sampled<double>(grid, [](const Vector3& x) {
    return soft_step(0.15, 0.05)(std::hypot(x[0] + 0.5 / kCells - 0.5, x[1] + 0.5 / kCells - 0.75));
  });
  const auto error = [&](double courant) {
    const double steps = std::ceil(0.5 * largest_rate(grid, forth) / courant);
    auto rho = start;
    for (const auto* velocities : {&forth, &back})
      for (double step = 0; step < steps; ++step)
        transfer_through_faces<double>(rho, grid, *velocities, 0.5 / steps);
    double sum = 0;
    for (std::size_t i = 0; i < rho.size(); ++i) sum += std::abs(rho[i] - start[i]);
    return sum / static_cast<double>(rho.size());
  };
  EXPECT_LT(error(4), error(1));
}

TEST(TransferThroughFaces, CanBeCancelled) {
  auto rho = densities();
  EXPECT_THROW(
      transfer_through_faces<double>(rho, kBox, noisy_velocities(), 1, [](double) { throw Cancelled(); }),
      Cancelled);
}

}  // namespace
}  // namespace volsmooth
