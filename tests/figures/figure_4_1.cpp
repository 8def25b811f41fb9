#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "algorithms/flows/advection.h"
#include "algorithms/formats/nifti.h"
#include "tests/figures/canvas.h"
#include "tests/figures/figures.h"
#include "tests/support/face_flows.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

using Values = std::vector<float>;

/// LeVeque's deformation, stretched to the box of a grid; it takes the same time in all.
FaceVelocities<float> deformation_of(const Grid& grid) {
  Vector3 extent;
  for (std::size_t e = 0; e < 3; ++e) extent[e] = static_cast<double>(grid.size[e]) * grid.spacing_mm[e];
  auto velocities =
      curl_on_faces<float>({grid.size,
                            {1 / static_cast<double>(grid.size[0]), 1 / static_cast<double>(grid.size[1]),
                             1 / static_cast<double>(grid.size[2])}},
                           deformation);
  for (std::size_t e = 0; e < 3; ++e)
    for (float& velocity : velocities.values[e]) velocity *= static_cast<float>(extent[e]);
  return velocities;
}

/// A ball with a notch, and a torus around it, in the unit cube; density 1 inside, edges of a voxel's width.
Values phantom(const Grid& grid) {
  const double h = grid.spacing_mm[0];
  return sampled(grid, [h](const Vector3& voxel) {
    const Vector3 x{voxel[0] + h / 2 - 0.42, voxel[1] + h / 2 - 0.42, voxel[2] + h / 2 - 0.45};
    const double ball = std::hypot(x[0], x[1], x[2]) - 0.17;
    const double notch = std::max({std::abs(x[0]) - 0.04, -0.05 - x[2]});
    const double torus = std::hypot(std::hypot(x[0], x[1]) - 0.26, x[2]) - 0.05;
    return soft_step(0, h)(std::min(std::max(ball, -notch), torus));
  });
}

double mean_distance(const Values& a, const Values& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(double{a[i]} - double{b[i]});
  return sum / static_cast<double>(a.size());
}

struct Journey {
  Values deformed, back;
};

Journey journey(const Values& start, const Grid& grid, double duration, Reconstruction scheme) {
  const auto forth = deformation_of(grid);
  Journey journey{start, {}};
  advect<float>(journey.deformed, grid, forth, duration, scheme);
  journey.back = journey.deformed;
  advect<float>(journey.back, grid, reversed(forth), duration, scheme);
  return journey;
}

struct Scheme {
  const char* name;
  Reconstruction reconstruction;
};
constexpr Scheme kSchemes[] = {{"piecewise-constant", Reconstruction::kPiecewiseConstant},
                               {"weno-7", Reconstruction::kWeno7},
                               {"weno-5", Reconstruction::kWeno5}};

/// Travels with each scheme, in the order of `kSchemes`, and writes a row of the table each.
std::vector<Journey> travel(const char* data, const Values& start, const Grid& grid, double duration,
                            std::ofstream& table) {
  std::vector<Journey> journeys;
  const double mass = std::accumulate(start.begin(), start.end(), 0.0);
  for (const auto& [name, reconstruction] : kSchemes) {
    journeys.push_back(journey(start, grid, duration, reconstruction));
    const Values& back = journeys.back().back;
    const auto [low, high] = std::ranges::minmax(back);
    table << data << ',' << name << ',' << mean_distance(back, start) << ',' << low << ',' << high << ','
          << std::accumulate(back.begin(), back.end(), 0.0) / mass - 1 << '\n';
  }
  return journeys;
}

/// From the left: at first; deformed (WENO-7); deformed and back, by piecewise constant fluxes, by WENO-7, by
/// WENO-5.
std::array<const Values*, 5> shown(const Values& start, const std::vector<Journey>& journeys) {
  return {&start, &journeys[1].deformed, &journeys[0].back, &journeys[1].back, &journeys[2].back};
}

void draw_phantom(const FigureOrder& order, std::ofstream& table) {
  constexpr std::int64_t kCells = 96;
  const Grid grid{{kCells, kCells, kCells}, {1.0 / kCells, 1.0 / kCells, 1.0 / kCells}};
  const Values start = phantom(grid);
  const auto journeys = travel("phantom", start, grid, 0.5, table);
  Canvas canvas(5, 1, 320);
  std::int64_t column = 0;
  for (const Values* values : shown(start, journeys)) {
    const Interpolated rho(*values, grid);
    canvas.paint(column++, 0, [&](double x, double y) { return surface_colour(rho, 0.5, x, y); });
  }
  canvas.save(order.file("4.1-phantom.png"));
}

/// The slice across the last axis, at 0.55 of it.
void paint_slice(Canvas& canvas, std::int64_t column, const Values& values, const Grid& grid, double white) {
  const Interpolated rho(values, grid);
  const Vector3 box = rho.extent_mm();
  canvas.paint(column, 0, [&](double x, double y) {
    return grey(rho.at({x * box[0], y * box[1], 0.55 * box[2]}), 0, white);
  });
}

void draw_head(const FigureOrder& order, std::ofstream& table) {
  const auto head = read_nifti(*order.head, {});
  if (!head) throw std::runtime_error("cannot read " + order.head->string());
  const Grid grid = grid_of(*head->volume);
  const Values start = values_of(*head->volume);
  const auto journeys = travel("head", start, grid, 0.3, table);
  Canvas canvas(5, 1, 320);
  std::int64_t column = 0;
  for (const Values* values : shown(start, journeys))
    paint_slice(canvas, column++, *values, grid, 0.8 * double{std::ranges::max(start)});
  canvas.save(order.file("4.1-head.png"));
}

}  // namespace

void draw_figure_4_1(const FigureOrder& order) {
  std::ofstream table(order.file("4.1.csv"));
  table << "data,scheme,mean error after return,least,greatest,relative change of mass\n";
  draw_phantom(order, table);
  if (order.head) draw_head(order, table);
}

}  // namespace volsmooth
