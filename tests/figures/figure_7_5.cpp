#include <cmath>
#include <numeric>

#include "algorithms/flows/laplacian.h"
#include "algorithms/flows/mean_curvature_flow.h"
#include "algorithms/surface/isosurface.h"
#include "algorithms/surface/measures.h"
#include "algorithms/surface/triangle_grid.h"
#include "algorithms/surface/vector_math.h"
#include "tests/figures/models.h"
#include "tests/figures/rendering.h"

namespace volsmooth {
namespace {

constexpr double kFlowTime_mm2 = 4, kCloseUp = 0.4, kShownDistance_mm = 2;
constexpr Colour kRed{215, 70, 60}, kTeal{40, 160, 165}, kGreen{80, 170, 60};

struct Smoothed {
  const char* name;
  void (*smooth_in_place)(Volume&);
  Colour colour;
};
constexpr Smoothed kMethods[] = {
    {"mean curvature flow", [](Volume& volume) { smooth(volume, MeanCurvatureFlow{kFlowTime_mm2}); }, kTeal},
    {"laplacian", [](Volume& volume) { smooth(volume, Laplacian{kFlowTime_mm2}); }, kGreen}};

/// How far every vertex of `moved` is outside of the nearest triangle of `original`.
std::vector<double> distances(const Mesh& moved, const Mesh& original) {
  std::vector<std::uint32_t> triangles(original.triangles.size());
  std::iota(triangles.begin(), triangles.end(), 0U);
  const TriangleGrid grid(original, triangles, {});
  std::vector<double> distances;
  std::uint32_t guess = 0;
  for (const Float3& position : moved.positions) {
    const NearestPoint nearest = grid.nearest(to_double(position), guess);
    guess = nearest.triangle;
    const Vector3 away = to_double(position) - nearest.point;
    distances.push_back(
        std::copysign(length(away), dot(away, area_normal(corners_of(original, original.triangles[guess])))));
  }
  return distances;
}

void add_row(std::ofstream& table, const Scan& scan, const char* name, const Mesh& mesh, const Mesh& before) {
  const SurfaceMeasures measures = measure(mesh);
  const Displacement by = displacement(mesh, before).value();
  table << scan.name << ',' << scan.bone << ',' << name << ',' << measures.area_mm2 << ','
        << measures.volume_mm3 << ',' << measures.components << ',' << measures.rms_curvature_per_mm << ','
        << by.mean_mm << ',' << by.min_mm << ',' << by.max_mm << '\n';
}

void draw_scan(const FigureOrder& order, const Scan& scan, std::ofstream& table) {
  const Mesh before = extract_isosurface(*scan.volume, scan.map, scan.bone);
  const View view = view_of(before, 40, 8);
  Canvas canvas(3, 2, kSurfaceSide);
  const auto paint = [&](std::int64_t column, std::int64_t row, const Mesh& mesh,
                         const VertexColour& colour) {
    Rendering rendering(view, kSurfaceSide);
    rendering.draw(mesh, colour);
    canvas.paint(column, row, rendering);
  };
  View side = turned(view, 90, 0);
  side.middle = side.middle + 0.3 * side.side_mm * side.right + 0.1 * side.side_mm * side.up;
  side.side_mm *= kCloseUp;
  const auto slice = cut(*scan.volume, scan.map, side);
  add_row(table, scan, "none", before, before);
  paint(0, 0, before, [](std::size_t) { return kRed; });
  canvas.paint(0, 1, [&](double x, double y) { return grey(slice(x, y), scan.skin, 3 * scan.bone); });
  canvas.trace(0, 1, slice, scan.bone, kRed);
  std::int64_t column = 1;
  for (const Smoothed& method : kMethods) {
    const auto after = copy_of(*scan.volume);
    method.smooth_in_place(*after);
    const Mesh mesh = extract_isosurface(*after, scan.map, scan.bone);
    add_row(table, scan, method.name, mesh, before);
    const auto by = distances(mesh, before);
    paint(column, 0, mesh, [&](std::size_t) { return method.colour; });
    paint(column, 1, mesh, [&](std::size_t v) { return diverging(by[v], kShownDistance_mm); });
    canvas.trace(0, 1, cut(*after, scan.map, side), scan.bone, method.colour);
    ++column;
  }
  canvas.save(order.file("7.5-" + scan.name + ".png"));
}

}  // namespace

/// Above: bone (red); after mean curvature flow (teal); after the heat equation of the same time (green).
/// Below: the three around the forehead in the middle slice; the latter two by how far they lie outside (red,
/// 2 mm) or inside (blue) of the first.
void draw_figure_7_5(const FigureOrder& order) {
  std::ofstream table(order.file("7.5.csv"));
  table << "data,isovalue,method,area (mm^2),volume (mm^3),components,rms curvature (1/mm),"
           "mean displacement (mm),least,greatest\n";
  for (const Scan& scan : scans(order)) draw_scan(order, scan, table);
}

}  // namespace volsmooth
