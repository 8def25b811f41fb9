#include <cmath>
#include <numbers>

#include "algorithms/flows/offset.h"
#include "tests/figures/models.h"
#include "tests/figures/rendering.h"
#include "tests/support/level_set.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

constexpr double kFeet_mm = 16, kEars_mm = 107;  // heights in the rabbit's grid

/// How far the surface moves, in mm: from -2.5 at the feet to 2.5 at the tips of the ears, 0 in the middle,
/// flat there.
double polynomial(double height_mm) {
  const double u = 2 * (height_mm - kFeet_mm) / (kEars_mm - kFeet_mm) - 1;
  return 1.25 * (u + u * u * u);
}

double sinusoid(double height_mm) {
  constexpr double kWave_mm = 10;
  return 1.2 * std::sin(2 * std::numbers::pi * height_mm / kWave_mm);
}

Volume::Pointer moved(const Volume& start, double (*distance_mm)(double)) {
  const auto volume = copy_of(start);
  const auto weights = sampled(grid_of(start), [=](const Vector3& x) { return distance_mm(x[2]); });
  smooth(*volume, Offset{.distance_mm = 1, .weights = weights});
  return volume;
}

double area_at(const Volume& volume, std::int64_t slice) {
  const Grid grid = grid_of(volume);
  const auto values = voxels_of(volume).subspan(static_cast<std::size_t>(slice * grid.size[0] * grid.size[1]),
                                                static_cast<std::size_t>(grid.size[0] * grid.size[1]));
  return area_above({{grid.size[0], grid.size[1]}, grid.spacing_mm[0], {values.begin(), values.end()}}, 0.5);
}

}  // namespace

/// From the left: at first; offset by a polynomial of the height, by a sinusoid of it.
void draw_figure_6_2(const FigureOrder& order) {
  const auto start = rabbit(order.cells(120, 60));
  const std::array volumes{start, moved(*start, polynomial), moved(*start, sinusoid)};
  Canvas canvas(volumes.size(), 1, kSurfaceSide);
  View view = view_of(surface_of(*start), 35, 12);
  view.side_mm += 8;
  for (std::size_t column = 0; column < volumes.size(); ++column) {
    Rendering rendering(view, kSurfaceSide);
    rendering.draw(surface_of(*volumes[column]), kClay);
    canvas.paint(static_cast<std::int64_t>(column), 0, rendering);
  }
  canvas.save(order.file("6.2.png"));

  std::ofstream table(order.file("6.2.csv"));
  table << "height (mm),polynomial (mm),sinusoid (mm),cross-section at first (mm^2),by the polynomial,by the "
           "sinusoid\n";
  const Grid grid = grid_of(*start);
  for (std::int64_t slice = 0; slice < grid.size[2]; ++slice) {
    const double height = static_cast<double>(slice) * grid.spacing_mm[2];
    table << height << ',' << polynomial(height) << ',' << sinusoid(height);
    for (const auto& volume : volumes) table << ',' << area_at(*volume, slice);
    table << '\n';
  }
}

}  // namespace volsmooth
