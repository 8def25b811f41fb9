#include "tests/support/level_set.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "algorithms/numerics/weno.h"

namespace volsmooth {
namespace {

using Vector2 = std::array<double, 2>;

double dot(const Vector2& a, const Vector2& b) {
  return a[0] * b[0] + a[1] * b[1];
}

/// A field with three more cells on all sides, to which it goes on linearly.
class Extended {
 public:
  static constexpr std::int64_t kHalo = 3;

  explicit Extended(const PlaneField& field)
      : size_(field.size),
        stride_(size_[0] + 2 * kHalo),
        values_(static_cast<std::size_t>(stride_ * (size_[1] + 2 * kHalo))) {
    for (std::int64_t y = 0; y < size_[1]; ++y) {
      std::copy_n(field.values.data() + y * size_[0], size_[0], at(0, y));
      extend(at(0, y), size_[0], 1);
    }
    for (std::int64_t x = -kHalo; x < size_[0] + kHalo; ++x) extend(at(x, 0), size_[1], stride_);
  }

  double* at(std::int64_t x, std::int64_t y) { return values_.data() + (x + kHalo) + (y + kHalo) * stride_; }
  const double* at(std::int64_t x, std::int64_t y) const { return const_cast<Extended*>(this)->at(x, y); }

  std::int64_t stride(std::size_t axis) const { return axis == 0 ? 1 : stride_; }
  const std::array<std::int64_t, 2>& size() const { return size_; }

 private:
  static void extend(double* first, std::int64_t count, std::int64_t stride) {
    double* last = first + (count - 1) * stride;
    for (std::int64_t k = 1; k <= kHalo; ++k) {
      first[-k * stride] = first[0] + static_cast<double>(k) * (first[0] - first[stride]);
      last[k * stride] = last[0] + static_cast<double>(k) * (last[0] - last[-stride]);
    }
  }

  std::array<std::int64_t, 2> size_;
  std::int64_t stride_;
  std::vector<double> values_;
};

/// Calls `visit(x, y)` for every cell, x fastest.
template <class Visit>
void for_each_cell(const std::array<std::int64_t, 2>& size, const Visit& visit) {
  for (std::int64_t y = 0; y < size[1]; ++y)
    for (std::int64_t x = 0; x < size[0]; ++x) visit(x, y);
}

/// One step of Heun's method (TVD Runge-Kutta of second order) with d field / dt = `rate(extended, x, y)`.
template <class Rate>
void heun_step(PlaneField& field, double step, const Rate& rate) {
  const std::vector<double> before = field.values;
  const auto euler_step = [&] {
    const Extended extended(field);
    std::size_t cell = 0;
    for_each_cell(field.size, [&](std::int64_t x, std::int64_t y) {
      field.values[cell++] += step * rate(extended, x, y);
    });
  };
  euler_step();
  euler_step();
  for (std::size_t cell = 0; cell < before.size(); ++cell)
    field.values[cell] = 0.5 * (before[cell] + field.values[cell]);
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

struct OneSided {
  double before, after;
};

/// The derivatives at `phi` from either side: WENO-5 of differences.
OneSided one_sided_slopes(const double* phi, std::int64_t stride, double spacing) {
  constexpr double kEpsilon = 1e-6;  // for slopes around 1
  std::array<double, 6> d;
  for (std::int64_t k = 0; k < 6; ++k)
    d[static_cast<std::size_t>(k)] = (phi[(k - 2) * stride] - phi[(k - 3) * stride]) / spacing;
  return {d[2] + weno5_correction<double>({d[1] - d[0], d[2] - d[1], d[3] - d[2], d[4] - d[3]}, kEpsilon),
          d[3] + weno5_correction<double>({d[4] - d[5], d[3] - d[4], d[2] - d[3], d[1] - d[2]}, kEpsilon)};
}

/// Godunov's |grad phi| for a phi that grows away from its zero set on the side where it has `sign`.
double godunov_gradient(const Extended& phi, std::int64_t x, std::int64_t y, double sign, double spacing) {
  double square = 0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto [before, after] = one_sided_slopes(phi.at(x, y), phi.stride(axis), spacing);
    const double slope = std::max({sign * before, -sign * after, 0.0});
    square += slope * slope;
  }
  return std::sqrt(square);
}

double curvature_rate(const double* phi, std::int64_t stride, double spacing) {
  const double fx = (phi[1] - phi[-1]) / (2 * spacing), fy = (phi[stride] - phi[-stride]) / (2 * spacing);
  const double area = spacing * spacing, square = fx * fx + fy * fy;
  const double fxx = (phi[1] - 2 * phi[0] + phi[-1]) / area;
  const double fyy = (phi[stride] - 2 * phi[0] + phi[-stride]) / area;
  const double fxy = (phi[stride + 1] - phi[stride - 1] - phi[1 - stride] + phi[-stride - 1]) / (4 * area);
  return square > 1e-20 ? (fxx * fy * fy - 2 * fx * fy * fxy + fyy * fx * fx) / square : 0;
}

/// The bicubic Lagrange interpolant of the 4 x 4 cells around a place, given in cells from the first centre.
struct Bicubic {
  double value;
  Vector2 gradient;
};

struct CubicWeights {
  std::array<double, 4> value, slope;
};

/// Of the values at -1, 0, 1 and 2, at `t`.
CubicWeights cubic_weights(double t) {
  constexpr std::array<double, 4> kNodes{-1, 0, 1, 2};
  CubicWeights weights{};
  for (std::size_t i = 0; i < 4; ++i) {
    double value = 1, slope = 0;
    for (std::size_t j = 0; j < 4; ++j) {
      if (j == i) continue;
      const double scale = 1 / (kNodes[i] - kNodes[j]);
      slope = (slope * (t - kNodes[j]) + value) * scale;
      value *= (t - kNodes[j]) * scale;
    }
    weights.value[i] = value;
    weights.slope[i] = slope;
  }
  return weights;
}

Bicubic interpolated(const Extended& phi, const Vector2& place) {
  std::array<std::int64_t, 2> cell;
  std::array<CubicWeights, 2> weights;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    cell[axis] = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(place[axis])), -1,
                                          phi.size()[axis] - 1);
    weights[axis] = cubic_weights(place[axis] - static_cast<double>(cell[axis]));
  }
  Bicubic result{};
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i) {
      const double value =
          *phi.at(cell[0] + static_cast<std::int64_t>(i) - 1, cell[1] + static_cast<std::int64_t>(j) - 1);
      result.value += weights[0].value[i] * weights[1].value[j] * value;
      result.gradient[0] += weights[0].slope[i] * weights[1].value[j] * value;
      result.gradient[1] += weights[0].value[i] * weights[1].slope[j] * value;
    }
  return result;
}

/// The distance in cells from a centre to the zero set of the interpolant, by Chopp's iteration: towards the
/// zero set, and along it towards the centre. Nothing where that goes astray, as at features below a cell.
std::optional<double> distance_to_curve(const Extended& phi, std::int64_t x, std::int64_t y) {
  const Vector2 centre{static_cast<double>(x), static_cast<double>(y)};
  Vector2 place = centre;
  for (int iteration = 0; iteration < 30; ++iteration) {
    const auto [value, gradient] = interpolated(phi, place);
    const double square = dot(gradient, gradient);
    if (square < 1e-20) return std::nullopt;
    const Vector2 back{centre[0] - place[0], centre[1] - place[1]};
    const double across = (value + dot(back, gradient)) / square;
    double moved = 0;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double move = back[axis] - across * gradient[axis];
      place[axis] += move;
      moved = std::max(moved, std::abs(move));
    }
    const double away = std::hypot(place[0] - centre[0], place[1] - centre[1]);
    if (away > 2) return std::nullopt;
    if (moved < 1e-10) return away;
  }
  return std::nullopt;
}

/// First-order distance in cells (Russo and Smereka 2000), where the interpolant gives none.
double rough_distance(const double* phi, std::int64_t stride) {
  double central = 0, one_sided = 0;
  for (const std::int64_t along : {std::int64_t{1}, stride}) {
    central += std::pow((phi[along] - phi[-along]) / 2, 2);
    one_sided = std::max({one_sided, std::abs(phi[along] - phi[0]), std::abs(phi[0] - phi[-along])});
  }
  return std::abs(phi[0]) / std::max(std::sqrt(central), one_sided);
}

bool is_beside_curve(const double* phi, std::int64_t stride) {
  const auto crosses = [&](std::int64_t to) { return (phi[0] < 0) != (phi[to] < 0); };
  return crosses(1) || crosses(-1) || crosses(stride) || crosses(-stride);
}

/// Area of the part of a triangle of area 1 in which a linear function with these values at the corners is
/// positive.
double positive_part(double a, double b, double c) {
  const int positive = (a > 0) + (b > 0) + (c > 0);
  if (positive == 0 || positive == 3) return positive / 3;
  if (positive == 2) return 1 - positive_part(-a, -b, -c);
  if (b > 0) std::swap(a, b);
  if (c > 0) std::swap(a, c);
  return a * a / ((a - b) * (a - c));
}

}  // namespace

PlaneField sampled_in_plane(const std::array<std::int64_t, 2>& size, double spacing,
                            const PlaneFunction& function) {
  PlaneField field{size, spacing, {}};
  for_each_cell(size, [&](std::int64_t x, std::int64_t y) {
    field.values.push_back(
        function((static_cast<double>(x) + 0.5) * spacing, (static_cast<double>(y) + 0.5) * spacing));
  });
  return field;
}

/// Each square of four centres falls into four triangles around its middle.
double area_above(const PlaneField& field, double isovalue) {
  double triangles = 0;
  for_each_cell({field.size[0] - 1, field.size[1] - 1}, [&](std::int64_t x, std::int64_t y) {
    const double* first = field.values.data() + x + y * field.size[0];
    std::array<double, 4> around{first[0], first[1], first[field.size[0] + 1], first[field.size[0]]};
    for (double& value : around) value -= isovalue;
    const double middle = (around[0] + around[1] + around[2] + around[3]) / 4;
    for (std::size_t i = 0; i < 4; ++i) triangles += positive_part(middle, around[i], around[(i + 1) % 4]);
  });
  return triangles / 4 * field.spacing * field.spacing;
}

double enclosed_area(const PlaneField& phi) {
  PlaneField inside = phi;
  for (double& value : inside.values) value = -value;
  return area_above(inside, 0);
}

void advect_level_set(PlaneField& phi, const PlaneVelocity& velocity, double duration) {
  constexpr double kCourant = 0.3;
  std::vector<Vector2> velocities;
  double fastest = 0;
  for_each_cell(phi.size, [&](std::int64_t x, std::int64_t y) {
    const Vector2 u =
        velocity((static_cast<double>(x) + 0.5) * phi.spacing, (static_cast<double>(y) + 0.5) * phi.spacing);
    velocities.push_back(u);
    fastest = std::max(fastest, std::abs(u[0]) + std::abs(u[1]));
  });
  const double steps = std::max(1.0, std::ceil(duration * fastest / (kCourant * phi.spacing)));
  const auto rate = [&](const Extended& extended, std::int64_t x, std::int64_t y) {
    const Vector2& u = velocities[static_cast<std::size_t>(x + y * phi.size[0])];
    double sum = 0;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto [before, after] = one_sided_slopes(extended.at(x, y), extended.stride(axis), phi.spacing);
      sum -= u[axis] * (u[axis] > 0 ? before : after);
    }
    return sum;
  };
  for (double taken = 0; taken < steps; ++taken) heun_step(phi, duration / steps, rate);
}

void flow_by_curvature(PlaneField& phi, double duration, int steps_between_redistancing) {
  const double steps = std::max(1.0, std::ceil(duration / (0.2 * phi.spacing * phi.spacing)));
  const auto rate = [&](const Extended& extended, std::int64_t x, std::int64_t y) {
    return curvature_rate(extended.at(x, y), extended.stride(1), phi.spacing);
  };
  for (int taken = 1; taken <= steps; ++taken) {
    heun_step(phi, duration / steps, rate);
    if (steps_between_redistancing > 0 && taken % steps_between_redistancing == 0) redistance(phi);
  }
}

void redistance(PlaneField& phi) {
  constexpr int kMostSteps = 40;
  constexpr double kAtRest = 1e-4;  // cells a step
  std::vector<double> sign;
  std::vector<bool> is_fixed;
  const Extended start(phi);
  for_each_cell(phi.size, [&](std::int64_t x, std::int64_t y) {
    const double* here = start.at(x, y);
    double& value = phi.values[sign.size()];
    sign.push_back(*here < 0 ? -1 : 1);
    is_fixed.push_back(is_beside_curve(here, start.stride(1)));
    if (!is_fixed.back()) return;
    const auto cells = distance_to_curve(start, x, y);
    value = sign.back() * phi.spacing * cells.value_or(rough_distance(here, start.stride(1)));
  });
  const auto rate = [&](const Extended& extended, std::int64_t x, std::int64_t y) {
    const auto cell = static_cast<std::size_t>(x + y * phi.size[0]);
    if (is_fixed[cell]) return 0.0;
    return sign[cell] * (1 - godunov_gradient(extended, x, y, sign[cell], phi.spacing));
  };
  for (int step = 0; step < kMostSteps; ++step) {
    const std::vector<double> before = phi.values;
    heun_step(phi, 0.5 * phi.spacing, rate);
    if (largest_difference(before, phi.values) < kAtRest * phi.spacing) return;
  }
}

}  // namespace volsmooth
