#include <algorithm>
#include <cmath>
#include <numeric>

#include "algorithms/flows/advection.h"
#include "tests/figures/canvas.h"
#include "tests/figures/models.h"
#include "tests/figures/rendering.h"
#include "tests/support/face_flows.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

using Values = std::vector<float>;

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
  const auto forth = curl_on_faces<float>(grid, deformation);
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

/// Travels with each scheme, in the order of `kSchemes`, and writes a row of a table each.
std::vector<Journey> travel(const Values& start, const Grid& grid, double duration,
                            const std::filesystem::path& csv) {
  std::ofstream table(csv);
  table << "scheme,mean error after return,least,greatest,relative change of mass\n";
  std::vector<Journey> journeys;
  const double mass = std::accumulate(start.begin(), start.end(), 0.0);
  for (const auto& [name, reconstruction] : kSchemes) {
    journeys.push_back(journey(start, grid, duration, reconstruction));
    const Values& back = journeys.back().back;
    const auto [low, high] = std::ranges::minmax(back);
    table << name << ',' << mean_distance(back, start) << ',' << low << ',' << high << ','
          << std::accumulate(back.begin(), back.end(), 0.0) / mass - 1 << '\n';
  }
  return journeys;
}

}  // namespace

/// From the left: at first; deformed (WENO-7); deformed and back, by piecewise constant fluxes, by WENO-7, by
/// WENO-5.
void draw_figure_4_1(const FigureOrder& order) {
  constexpr Vector3 kMiddle{0.49, 0.45, 0.43};
  constexpr Vector3 kRight{0.8, 0.6, 0}, kUp{-0.24, 0.32, 0.9165}, kToEye{0.55, -0.7333, 0.4};
  const std::int64_t cells = order.cells(96, 40);
  const double h = 1 / static_cast<double>(cells);
  const Grid grid{{cells, cells, cells}, {h, h, h}};
  const Values start = phantom(grid);
  const auto journeys = travel(start, grid, 0.5, order.file("4.1.csv"));
  Canvas canvas(5, 1, kSurfaceSide);
  std::int64_t column = 0;
  for (const Values* values :
       {&start, &journeys[1].deformed, &journeys[0].back, &journeys[1].back, &journeys[2].back}) {
    Rendering rendering({kMiddle, 0.85, kRight, kUp, kToEye}, kSurfaceSide);
    rendering.draw(surface_of(*volume_of(grid, *values)), {150, 190, 210});
    canvas.paint(column++, 0, rendering);
  }
  canvas.save(order.file("4.1.png"));
}

}  // namespace volsmooth
