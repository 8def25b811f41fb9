#include "algorithms/flows/conservative_mean_curvature_flow.h"
#include "algorithms/flows/mean_curvature_flow.h"
#include "algorithms/flows/sharpening.h"
#include "algorithms/surface/measures.h"
#include "algorithms/volume/functionals.h"
#include "tests/figures/models.h"
#include "tests/figures/rendering.h"

namespace volsmooth {
namespace {

constexpr double kStep_mm2 = 8;
constexpr int kSteps = 3;

struct Flow {
  const char* name;
  void (*step)(Volume&);
};
constexpr Flow kFlows[] = {
    {"conservative", [](Volume& rho) { smooth(rho, ConservativeMeanCurvatureFlow{kStep_mm2}); }},
    {"plain", [](Volume& rho) { smooth(rho, MeanCurvatureFlow{kStep_mm2}); }}};

struct State {
  double mass, volume_mm3, sharpened_volume_mm3, area_mm2;
};

double volume_of_sharpened(const Volume& rho) {
  const auto sharpened = copy_of(rho);
  smooth(*sharpened, Sharpening{3 * grid_of(rho).spacing_mm[0]});
  return measure(surface_of(*sharpened)).volume_mm3;
}

State state_of(const Volume& rho) {
  const SurfaceMeasures surface = measure(surface_of(rho));
  return {measure(rho).mass, surface.volume_mm3, volume_of_sharpened(rho), surface.area_mm2};
}

}  // namespace

/// Columns: t = 0, 8, 16, 24 mm^2. Above the conservative flow, below plain mean curvature flow.
void draw_figure_6_4(const FigureOrder& order) {
  const auto start = rabbit(order.cells(120, 60));
  const View view = view_of(surface_of(*start), 35, 12);
  const State first = state_of(*start);
  std::ofstream table(order.file("6.4.csv"));
  table << "flow,time (mm^2),mass of that at first,volume of that at first,volume when sharpened,"
           "area of that at first\n";
  Canvas canvas(kSteps + 1, std::size(kFlows), kSurfaceSide);
  std::int64_t row = 0;
  for (const auto& [name, step] : kFlows) {
    const auto rho = copy_of(*start);
    for (int taken = 0; taken <= kSteps; ++taken) {
      if (taken > 0) step(*rho);
      const State state = state_of(*rho);
      table << name << ',' << taken * kStep_mm2 << ',' << state.mass / first.mass << ','
            << state.volume_mm3 / first.volume_mm3 << ','
            << state.sharpened_volume_mm3 / first.sharpened_volume_mm3 << ','
            << state.area_mm2 / first.area_mm2 << '\n';
      Rendering rendering(view, kSurfaceSide);
      rendering.draw(surface_of(*rho), kClay);
      canvas.paint(taken, row, rendering);
    }
    ++row;
  }
  canvas.save(order.file("6.4.png"));
}

}  // namespace volsmooth
