#include "algorithms/flows/mean_curvature_flow.h"
#include "algorithms/surface/isosurface.h"
#include "algorithms/surface/measures.h"
#include "algorithms/volume/density.h"
#include "tests/figures/models.h"
#include "tests/figures/rendering.h"

namespace volsmooth {
namespace {

constexpr double kFlowTime_mm2 = 4;
constexpr Colour kSkin{225, 180, 150}, kBone{235, 230, 205};

struct Surfaces {
  Mesh skin, bone;
};

Surfaces surfaces_of(const Volume& volume, const Scan& scan) {
  return {extract_isosurface(volume, scan.map, scan.skin), extract_isosurface(volume, scan.map, scan.bone)};
}

Rendering drawn(const View& view, const Mesh& mesh, const Colour& colour) {
  Rendering rendering(view, kSurfaceSide);
  rendering.draw(mesh, colour);
  return rendering;
}

void draw_row(Canvas& canvas, std::int64_t row, const Volume& volume, const Scan& scan, const View& view) {
  const Surfaces surfaces = surfaces_of(volume, scan);
  const auto skin = drawn(view, surfaces.skin, kSkin), bone = drawn(view, surfaces.bone, kBone);
  canvas.paint(0, row, skin);
  canvas.paint(1, row, bone);
  canvas.paint(2, row, [&](double x, double y) { return mixed(skin(x, y), bone(x, y), 0.35); });
  const auto value = cut(volume, scan.map, turned(view, 90, 0));
  canvas.paint(3, row,
               [&](double x, double y) { return grey(value(x, y), scan.skin, 2 * scan.bone - scan.skin); });
  canvas.trace(3, row, value, scan.skin, {40, 110, 250});
  canvas.trace(3, row, value, scan.bone, {230, 60, 40});
}

/// The surface smoothed alone: everything but its surroundings is cut off first.
Mesh smoothed_alone(const Scan& scan, double isovalue) {
  const auto density = copy_of(*scan.volume);
  to_density(*density, {isovalue, 0.4 * (scan.bone - scan.skin)});
  smooth(*density, MeanCurvatureFlow{kFlowTime_mm2});
  return extract_isosurface(*density, scan.map, 0.5);
}

void measure_surface(std::ofstream& table, const Scan& scan, double isovalue, const Mesh& before,
                     const Mesh& after) {
  for (const Mesh* mesh : {&before, &after}) {
    const SurfaceMeasures measures = measure(*mesh);
    table << scan.name << ',' << isovalue << ',' << (mesh == &before ? 0 : kFlowTime_mm2) << ','
          << measures.area_mm2 << ',' << measures.volume_mm3 << ',' << measures.components << ','
          << measures.rms_curvature_per_mm;
    if (mesh == &after) table << ',' << displacement(after, smoothed_alone(scan, isovalue)).value().mean_mm;
    table << '\n';
  }
}

}  // namespace

/// Above: at first, below: after 4 mm^2 of mean curvature flow. From the left: skin, bone, both, the middle
/// slice with the two surfaces.
void draw_figure_7_4(const FigureOrder& order) {
  std::ofstream table(order.file("7.4.csv"));
  table << "data,isovalue,time (mm^2),area (mm^2),volume (mm^3),components,rms curvature (1/mm),"
           "mean displacement from the surface smoothed alone (mm)\n";
  for (const Scan& scan : scans(order)) {
    const auto after = copy_of(*scan.volume);
    smooth(*after, MeanCurvatureFlow{kFlowTime_mm2});
    const Surfaces at_first = surfaces_of(*scan.volume, scan), at_last = surfaces_of(*after, scan);
    measure_surface(table, scan, scan.skin, at_first.skin, at_last.skin);
    measure_surface(table, scan, scan.bone, at_first.bone, at_last.bone);
    const View view = view_of(at_first.skin, 40, 8);
    Canvas canvas(4, 2, kSurfaceSide);
    draw_row(canvas, 0, *scan.volume, scan, view);
    draw_row(canvas, 1, *after, scan, view);
    canvas.save(order.file("7.4-" + scan.name + ".png"));
  }
}

}  // namespace volsmooth
