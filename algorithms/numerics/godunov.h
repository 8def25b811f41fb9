#pragma once

#include <cmath>
#include <limits>

#include "algorithms/numerics/gains.h"
#include "algorithms/numerics/metric.h"

namespace volsmooth {

/// How the gains from the two sides of an axis come together.
enum class UpwindGradient {
  kGodunov,       ///< the larger counts: a cell's content moves one way (thesis, Eqs. 6.2 and 6.3)
  kEngquistOsher  ///< both count: each face has its own velocity (thesis, end of section 6.1)
};

/// Any axes, for the upwind gradient as well.
template <class Scalar>
struct AnyUpwindMetric : AnyMetric<Scalar> {
  /// The inverse of G's part on the axes whose bits are set in the index; 0 elsewhere.
  std::array<std::array<std::array<Scalar, 3>, 3>, 8> inverse_on{};

  AnyUpwindMetric() = default;
  explicit AnyUpwindMetric(const std::array<std::array<double, 3>, 3>& metric);
};

/// The square of |grad rho|+ from gains: of the most that a cell can gain per unit of time when everything
/// moves at unit speed. Minus the gains give |grad rho|-, the most it can lose.
template <UpwindGradient kUpwind, class Scalar>
VOLSMOOTH_FORMULA Scalar upwind_square(const Neighbours<Scalar>& gains,
                                       const OrthogonalMetric<Scalar>& metric) {
  Scalar square = 0;
  unrolled<3>([&](auto e) VOLSMOOTH_INLINE {
    if constexpr (kUpwind == UpwindGradient::kGodunov) {
      const Scalar slope =
          std::max(std::max(gains.before[e], gains.after[e]), Scalar{0}) * metric.inverse_spacing[e];
      square += slope * slope;
    } else {
      const Scalar before = std::max(gains.before[e], Scalar{0}) * metric.inverse_spacing[e];
      const Scalar after = std::max(gains.after[e], Scalar{0}) * metric.inverse_spacing[e];
      square += before * before + after * after;
    }
  });
  return square;
}

/// The square of the most gained at unit speed along the axes in `kAxes` alone, backwards along those in
/// `kBackwards`: max b.v with v.G v = 1 is sqrt(b.G^-1 b), at v = G^-1 b; 0 where that v goes another way.
template <std::size_t kAxes, std::size_t kBackwards, class Scalar>
VOLSMOOTH_FORMULA Scalar square_going(const Neighbours<Scalar>& gains,
                                      const AnyUpwindMetric<Scalar>& metric) {
  Scalar square = 0, least_forward = 0;
  bool first = true;
  std::array<Scalar, 3> b{}, v{};
  unrolled<3>([&](auto e) VOLSMOOTH_INLINE {
    if constexpr (kAxes >> e & 1) b[e] = kBackwards >> e & 1 ? -gains.after[e] : gains.before[e];
  });
  unrolled<3>([&](auto e) VOLSMOOTH_INLINE {
    if constexpr (kAxes >> e & 1) {
      unrolled<3>([&](auto f) VOLSMOOTH_INLINE {
        if constexpr (kAxes >> f & 1) v[e] += metric.inverse_on[kAxes][e][f] * b[f];
      });
      const Scalar forward = kBackwards >> e & 1 ? -v[e] : v[e];
      least_forward = first ? forward : std::min(least_forward, forward);
      first = false;
      square += v[e] * b[e];
    }
  });
  return least_forward >= Scalar{0} ? square : Scalar{0};
}

/// On any axes the most is gained inside an octant of velocities, on a face between two or on an edge: 26
/// cases. Taking the most along every axis for itself is wrong there. Both ways of `UpwindGradient` are this.
template <UpwindGradient kUpwind, class Scalar>
VOLSMOOTH_FORMULA Scalar upwind_square(const Neighbours<Scalar>& gains,
                                       const AnyUpwindMetric<Scalar>& metric) {
  Scalar most = 0;
  unrolled<8>([&](auto axes) VOLSMOOTH_INLINE {
    unrolled<8>([&](auto backwards) VOLSMOOTH_INLINE {
      if constexpr (axes != 0 && (backwards & ~axes) == 0)
        most = std::max(most, square_going<axes, backwards>(gains, metric));
    });
  });
  return most;
}

/// |grad rho|+ (`direction` = 1) or |grad rho|- (-1) from gains (thesis, Eqs. 6.2 and 6.3, signs corrected).
/// 0 where the squares have lost their precision, as in `unit_normal`.
template <UpwindGradient kUpwind, class Scalar, class Metric>
VOLSMOOTH_FORMULA Scalar upwind_gradient(Scalar direction, Neighbours<Scalar> gains, const Metric& metric) {
  unrolled<3>([&](auto e) VOLSMOOTH_INLINE {
    gains.before[e] *= direction;
    gains.after[e] *= direction;
  });
  const Scalar square = upwind_square<kUpwind>(gains, metric);
  return square >= std::numeric_limits<Scalar>::min() ? std::sqrt(square) : Scalar{0};
}

/// The same with piecewise constant gains, which is Godunov's scheme: at most sqrt(sum_e 1/h_e^2) times the
/// largest difference to a neighbour on that side.
template <class Scalar>
VOLSMOOTH_FORMULA Scalar upwind_gradient(Scalar direction, Scalar rho, const Neighbours<Scalar>& neighbours,
                                         const std::array<Scalar, 3>& inverse_spacing) {
  Neighbours<Scalar> gains;
  for (std::size_t e = 0; e < 3; ++e) {
    gains.before[e] = neighbours.before[e] - rho;
    gains.after[e] = neighbours.after[e] - rho;
  }
  return upwind_gradient<UpwindGradient::kGodunov>(direction, gains,
                                                   OrthogonalMetric<Scalar>{inverse_spacing});
}

/// rho after one explicit step of normal flow at `speed` (thesis, Eq. 6.4).
template <class Scalar>
VOLSMOOTH_FORMULA Scalar moved(Scalar speed, Scalar rho, const Neighbours<Scalar>& neighbours,
                               const StencilStep<Scalar>& step) {
  const Scalar direction = speed > Scalar{0} ? Scalar{1} : Scalar{-1};
  return rho + step.time * (speed * upwind_gradient(direction, rho, neighbours, step.inverse_spacing));
}

/// What a step of normal flow is made of, beside the metric.
template <class Scalar>
struct NormalStep {
  Scalar time;
  Scalar epsilon;  ///< `weno_epsilon`
};

/// rho after one explicit step of normal flow at `speed` towards lower values (thesis, Eq. 6.4), on any axes.
/// `rho(e, k)` is the k-th voxel along axis e. The gains take it no further than to the extreme of its six
/// neighbours: piecewise constant ones would not in stable steps, but for rounding; those of WENO can.
template <Reconstruction kScheme, UpwindGradient kUpwind, class Scalar, class Metric, class Rho>
VOLSMOOTH_FORMULA Scalar moved_along_normal(const Rho& rho, Scalar speed, const Metric& metric,
                                            const NormalStep<Scalar>& step) {
  const Scalar direction = speed > Scalar{0} ? Scalar{1} : Scalar{-1};
  const Scalar here = direction * rho(std::size_t{0}, 0);
  Scalar highest = here;
  unrolled<3>([&](auto e) VOLSMOOTH_INLINE {
    highest = std::max(highest, std::max(direction * rho(e, -1), direction * rho(e, 1)));
  });
  const Scalar gradient = upwind_gradient<kUpwind>(direction, gains<kScheme>(rho, step.epsilon), metric);
  return direction * std::min(here + step.time * (direction * speed * gradient), highest);
}

template <class Scalar>
AnyUpwindMetric<Scalar>::AnyUpwindMetric(const std::array<std::array<double, 3>, 3>& metric)
    : AnyMetric<Scalar>(metric) {
  const auto& g = metric;
  // Of the axes e, f and their complement. The minors of a positive definite matrix have inverses.
  for (std::size_t e = 0; e < 3; ++e) {
    const std::size_t f = (e + 1) % 3, c = (e + 2) % 3;
    inverse_on[1U << e][e][e] = static_cast<Scalar>(1 / g[e][e]);
    const double determinant = g[e][e] * g[f][f] - g[e][f] * g[e][f];
    auto& pair = inverse_on[1U << e | 1U << f];
    pair[e][e] = static_cast<Scalar>(g[f][f] / determinant);
    pair[f][f] = static_cast<Scalar>(g[e][e] / determinant);
    pair[e][f] = pair[f][e] = static_cast<Scalar>(-g[e][f] / determinant);
    const double whole = g[0][0] * (g[1][1] * g[2][2] - g[1][2] * g[1][2]) -
                         g[0][1] * (g[0][1] * g[2][2] - g[1][2] * g[0][2]) +
                         g[0][2] * (g[0][1] * g[1][2] - g[1][1] * g[0][2]);
    inverse_on[7][c][c] = static_cast<Scalar>(determinant / whole);
    inverse_on[7][e][f] = inverse_on[7][f][e] =
        static_cast<Scalar>((g[e][c] * g[f][c] - g[e][f] * g[c][c]) / whole);
  }
}

}  // namespace volsmooth
