#include "algorithms/flows/offset.h"
#include "algorithms/surface/measures.h"
#include "tests/figures/models.h"
#include "tests/figures/rendering.h"

namespace volsmooth {
namespace {

constexpr double kDistances_mm[] = {-2.5, 5};

struct Scheme {
  const char* name;
  Reconstruction gains;
  UpwindGradient upwind = UpwindGradient::kGodunov;
};
constexpr Scheme kSchemes[] = {
    {"weno-7", Reconstruction::kWeno7},
    {"weno-5", Reconstruction::kWeno5},
    {"piecewise-constant", Reconstruction::kPiecewiseConstant},
    {"weno-7 engquist-osher", Reconstruction::kWeno7, UpwindGradient::kEngquistOsher}};

Mesh offset_surface(const Volume& start, double distance_mm, const Scheme& scheme) {
  const auto moved = copy_of(start);
  smooth(*moved, Offset{distance_mm, scheme.gains, scheme.upwind});
  return surface_of(*moved);
}

}  // namespace

/// From the left: inwards by 2.5 mm, at first, outwards by 5 mm; gains by WENO-7 above, piecewise constant
/// below.
void draw_figure_6_1(const FigureOrder& order) {
  const auto start = rabbit(order.cells(120, 60));
  const Mesh before = surface_of(*start);
  std::ofstream table(order.file("6.1.csv"));
  table << "scheme,distance (mm),mean displacement (mm),least,greatest,volume (mm^3)\n";
  Canvas canvas(3, 2, kSurfaceSide);
  const View view = view_of(offset_surface(*start, kDistances_mm[1], kSchemes[0]), 35, 12);
  const auto paint = [&](std::int64_t column, std::int64_t row, const Mesh& mesh) {
    Rendering rendering(view, kSurfaceSide);
    rendering.draw(mesh, kClay);
    canvas.paint(column, row, rendering);
  };
  for (const std::int64_t row : {0, 1}) paint(1, row, before);
  for (const Scheme& scheme : kSchemes)
    for (const double distance_mm : kDistances_mm) {
      const Mesh moved = offset_surface(*start, distance_mm, scheme);
      const Displacement by = displacement(moved, before).value();
      table << scheme.name << ',' << distance_mm << ',' << by.mean_mm << ',' << by.min_mm << ',' << by.max_mm
            << ',' << measure(moved).volume_mm3 << '\n';
      const std::int64_t column = distance_mm < 0 ? 0 : 2;
      if (&scheme == &kSchemes[0]) paint(column, 0, moved);
      if (&scheme == &kSchemes[2]) paint(column, 1, moved);
    }
  canvas.save(order.file("6.1.png"));
}

}  // namespace volsmooth
