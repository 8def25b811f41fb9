#include <cmath>
#include <optional>

#include "algorithms/flows/mean_curvature_flow.h"
#include "tests/figures/canvas.h"
#include "tests/figures/figures.h"
#include "tests/support/level_set.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

constexpr double kRadius = 0.7, kStep = 0.01, kWide = 0.25;  // in [-1, 1]^2
constexpr int kSteps = 16, kStepsToCircle = 4, kStepsToRedistance = 100;
constexpr Colour kBlack{0, 0, 0};

double exact_radius(double time) {
  return std::sqrt(kRadius * kRadius - 2 * time);
}

/// Mean distance from the middle of the places where `field` passes `level` between two cells.
double radius_of(const PlaneField& field, double level) {
  double sum = 0, count = 0;
  const auto width = field.size[0];
  for (std::int64_t y = 0; y + 1 < field.size[1]; ++y)
    for (std::int64_t x = 0; x + 1 < width; ++x)
      for (const std::array<std::int64_t, 2> to : {std::array<std::int64_t, 2>{1, 0}, {0, 1}}) {
        const double here = field.values[static_cast<std::size_t>(x + width * y)] - level;
        const double there = field.values[static_cast<std::size_t>(x + to[0] + width * (y + to[1]))] - level;
        if ((here > 0) == (there > 0)) continue;
        const double part = here / (here - there);
        const auto place = [&](std::int64_t cell, std::int64_t step) {
          return (static_cast<double>(cell) + 0.5 + part * static_cast<double>(step)) * field.spacing - 1;
        };
        sum += std::hypot(place(x, to[0]), place(y, to[1]));
        ++count;
      }
  return sum / count;
}

struct Scheme {
  const char* name;
  Colour colour;
  MeanCurvatureScheme scheme;
};
constexpr Scheme kSchemes[] = {{"thesis piecewise-constant", {240, 150, 20}, MeanCurvatureScheme::kThesis},
                               {"thesis weno-7", {30, 90, 230}, MeanCurvatureScheme::kThesisWeno},
                               {"face-centred", {20, 150, 60}, MeanCurvatureScheme::kFaceCentred}};

struct Contestant {
  std::string name;
  std::optional<Colour> colour;  ///< in the figure, if it is there
  PlaneField field;
  double level;
  std::function<void(PlaneField&)> step;

  double radius() const { return radius_of(field, level); }
};

std::vector<Contestant> contestants(std::int64_t cells) {
  const double h = 2.0 / static_cast<double>(cells);
  const PlaneField distance = sampled_in_plane(
      {cells, cells}, h, [](double x, double y) { return std::hypot(x - 1, y - 1) - kRadius; });
  PlaneField density = distance, wide = distance;
  for (double& value : density.values) value = soft_step(0, 3 * h)(value);
  for (double& value : wide.values) value = soft_step(0, kWide)(value);
  const auto flow = [=](MeanCurvatureScheme scheme) {
    return [=](PlaneField& rho) {
      const auto volume = volume_of({{cells, cells, 1}, {h, h, h}}, {rho.values.begin(), rho.values.end()});
      smooth(*volume, MeanCurvatureFlow{kStep, scheme});
      std::ranges::copy(voxels_of(*volume), rho.values.begin());
    };
  };
  const auto flow_of_distance = [](int redistancing) {
    return [=](PlaneField& phi) { flow_by_curvature(phi, kStep, redistancing); };
  };
  std::vector<Contestant> all;
  for (const auto& [name, colour, scheme] : kSchemes)
    all.push_back({name, colour, density, 0.5, flow(scheme)});
  all.push_back({"level set", Colour{220, 30, 30}, distance, 0, flow_of_distance(0)});
  all.push_back(
      {"level set redistanced", Colour{160, 60, 200}, distance, 0, flow_of_distance(kStepsToRedistance)});
  for (const auto& [name, colour, scheme] : kSchemes)
    all.push_back({name + std::string(" on a wide profile"), std::nullopt, wide, 0.5, flow(scheme)});
  return all;
}

using Line = std::vector<std::array<double, 2>>;

/// The circles of the thesis' scheme at every fourth row of the table, on its density at first.
void draw_circles(Canvas& canvas, const PlaneField& rho, bool is_first) {
  const std::vector<float> voxels(rho.values.begin(), rho.values.end());
  const Interpolated interpolated(voxels,
                                  {{rho.size[0], rho.size[1], 1}, {rho.spacing, rho.spacing, rho.spacing}});
  const auto value = [&](double x, double y) { return interpolated.at({2 * x, 2 * y, 0}); };
  if (is_first) canvas.paint(0, 0, [&](double x, double y) { return grey(value(x, y), 1.5, -0.2); });
  canvas.trace(0, 0, value, 0.5, {30, 90, 230});
}

}  // namespace

/// From the left: the circle at t = 0, 0.04, ... by the thesis' scheme with WENO gains; radius (0 to 0.8)
/// over time (0 to 0.16); what it is above or below the exact one, lines at -0.003, 0 and 0.003 (128^2).
/// Black: exact. Orange: thesis, constant gains. Blue: WENO. Green: face-centred. Red: level set; violet:
/// redistanced.
void draw_figure_6_3(const FigureOrder& order) {
  constexpr double kShown = 0.004;
  auto all = contestants(order.cells(128, 64));
  std::vector<Line> radii(all.size()), errors(all.size());
  Line exact;
  std::ofstream table(order.file("6.3.csv"));
  table << "time,exact";
  for (const Contestant& contestant : all) table << ',' << contestant.name;
  table << '\n';
  Canvas canvas(3, 1, 256);
  for (int step = 0; step <= kSteps; ++step) {
    const double along = static_cast<double>(step) / kSteps, radius = exact_radius(step * kStep);
    exact.push_back({along, radius / 0.8});
    table << step * kStep << ',' << radius;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double measured = all[i].radius();
      table << ',' << measured;
      radii[i].push_back({along, measured / 0.8});
      errors[i].push_back({along, 0.5 + (measured - radius) / (2 * kShown)});
    }
    table << '\n';
    if (step % kStepsToCircle == 0) draw_circles(canvas, all[1].field, step == 0);
    for (Contestant& contestant : all) contestant.step(contestant.field);
  }
  canvas.plot(1, 0, exact, kBlack);
  for (const double level : {-0.003, 0.0, 0.003}) {
    const double y = 0.5 + level / (2 * kShown);
    canvas.plot(2, 0, Line{{0, y}, {1, y}}, level == 0 ? kBlack : Colour{200, 200, 200});
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].colour) continue;
    canvas.plot(1, 0, radii[i], *all[i].colour);
    canvas.plot(2, 0, errors[i], *all[i].colour);
  }
  canvas.save(order.file("6.3.png"));
}

}  // namespace volsmooth
