#include <cmath>
#include <numbers>
#include <numeric>

#include "algorithms/flows/advection.h"
#include "tests/figures/canvas.h"
#include "tests/figures/figures.h"
#include "tests/support/face_flows.h"
#include "tests/support/level_set.h"

namespace volsmooth {
namespace {

constexpr double kRadius = 0.15, kStep = 0.05;
constexpr int kSteps = 120, kStepsToFrame = 30;

double distance_to_circle(double x, double y) {
  return std::hypot(x - 0.5, y - 0.75) - kRadius;
}

std::array<double, 2> velocity_of_vortex(double x, double y) {
  const double pi = std::numbers::pi;
  return {pi * humps(x) * waves(y), -pi * waves(x) * humps(y)};
}

/// The part of each cell inside the circle, from 8 x 8 points.
PlaneField density_of_circle(std::int64_t cells, double spacing) {
  constexpr int kPoints = 8;
  return sampled_in_plane({cells, cells}, spacing, [=](double x, double y) {
    int inside = 0;
    for (int j = 0; j < kPoints; ++j)
      for (int i = 0; i < kPoints; ++i)
        inside += distance_to_circle(x + spacing * ((i + 0.5) / kPoints - 0.5),
                                     y + spacing * ((j + 0.5) / kPoints - 0.5)) < 0;
    return static_cast<double>(inside) / (kPoints * kPoints);
  });
}

/// A curve that moves: what it is stored in, and how a frame of it looks.
class Contestant {
 public:
  Contestant(PlaneField field, double level, std::function<void(PlaneField&)> step,
             std::pair<double, double> black_and_white)
      : field_(std::move(field)), level_(level), step_(std::move(step)), window_(black_and_white) {}

  void step() { step_(field_); }

  double area() const { return is_level_set() ? enclosed_area(field_) : area_above(field_, level_); }

  double mass() const {
    return std::accumulate(field_.values.begin(), field_.values.end(), 0.0) * field_.spacing * field_.spacing;
  }

  void paint(Canvas& canvas, std::int64_t column, std::int64_t row) const {
    const std::vector<float> voxels(field_.values.begin(), field_.values.end());
    const Interpolated interpolated(
        voxels, {{field_.size[0], field_.size[1], 1}, {field_.spacing, field_.spacing, 1}});
    const auto value = [&](double x, double y) { return interpolated.at({x, y, 0}); };
    canvas.paint(column, row,
                 [&](double x, double y) { return grey(value(x, y), window_.first, window_.second); });
    canvas.trace(column, row, value, level_, {220, 30, 30});
  }

 private:
  bool is_level_set() const { return level_ == 0; }

  PlaneField field_;
  double level_;
  std::function<void(PlaneField&)> step_;
  std::pair<double, double> window_;
};

std::vector<Contestant> contestants(std::int64_t cells) {
  const double spacing = 1 / static_cast<double>(cells);
  const PlaneField distance = sampled_in_plane({cells, cells}, spacing, distance_to_circle);
  const PlaneField density = density_of_circle(cells, spacing);
  const auto advect_density = [=](Reconstruction scheme) {
    const Grid grid{{cells, cells, 1}, {spacing, spacing, spacing}};
    return [scheme, grid, velocities = curl_on_faces<double>(grid, single_vortex)](PlaneField& rho) {
      advect<double>(rho.values, grid, velocities, kStep, scheme);
    };
  };
  const auto move = [](PlaneField& phi) { advect_level_set(phi, velocity_of_vortex, kStep); };
  const auto move_and_redistance = [move](PlaneField& phi) {
    move(phi);
    redistance(phi);
  };
  return {{distance, 0, move, {-spacing, spacing}},
          {distance, 0, move_and_redistance, {-spacing, spacing}},
          {density, 0.5, advect_density(Reconstruction::kWeno5), {1, 0}},
          {density, 0.5, advect_density(Reconstruction::kWeno7), {1, 0}}};
}

}  // namespace

/// Rows: level set; level set, redistanced every 0.05 units of time; density by WENO-5; by WENO-7. Columns:
/// t = 0, 1.5, 3, 4.5, 6. Red: the curve.
void draw_figure_4_2(const FigureOrder& order) {
  auto all = contestants(order.cells(128, 32));
  std::ofstream table(order.file("4.2.csv"));
  table << "time,area level set,area level set redistanced,area density weno-5,area density weno-7,"
           "mass density weno-5,mass density weno-7\n";
  Canvas canvas(1 + kSteps / kStepsToFrame, static_cast<std::int64_t>(all.size()), 256);
  for (int step = 0; step <= kSteps; ++step) {
    table << step * kStep;
    for (const Contestant& contestant : all) table << ',' << contestant.area();
    table << ',' << all[2].mass() << ',' << all[3].mass() << '\n';
    if (step % kStepsToFrame == 0)
      for (std::size_t row = 0; row < all.size(); ++row)
        all[row].paint(canvas, step / kStepsToFrame, static_cast<std::int64_t>(row));
    for (Contestant& contestant : all) contestant.step();
  }
  canvas.save(order.file("4.2.png"));
}

}  // namespace volsmooth
