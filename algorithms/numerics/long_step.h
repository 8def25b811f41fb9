#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "algorithms/numerics/stencil.h"

namespace volsmooth {

/// One stage of a long step: the sum of five values of a voxel, each times its weight.
template <class Scalar>
struct StageWeights {
  Scalar start, start_moved;        ///< rho where the long step starts, and after an explicit step from there
  Scalar before;                    ///< rho two stages ago
  Scalar previous, previous_moved;  ///< rho one stage ago, and after an explicit step from there
};

template <class Scalar>
VOLSMOOTH_FORMULA Scalar staged(const StageWeights<Scalar>& weights, const StageWeights<Scalar>& values) {
  return weights.start * values.start + weights.start_moved * values.start_moved +
         weights.before * values.before + weights.previous * values.previous +
         weights.previous_moved * values.previous_moved;
}

/// Chebyshev's polynomials of the first kind at w, up to `degree`, with their first two derivatives.
struct Chebyshev {
  Chebyshev(int degree, double w) : value{1, w}, slope{0, 1}, bend{0, 0} {
    for (std::size_t n = 2; n <= static_cast<std::size_t>(degree); ++n) {
      value.push_back(2 * w * value[n - 1] - value[n - 2]);
      slope.push_back(2 * value[n - 1] + 2 * w * slope[n - 1] - slope[n - 2]);
      bend.push_back(4 * slope[n - 1] + 2 * w * bend[n - 1] - bend[n - 2]);
    }
  }
  std::vector<double> value, slope, bend;
};

/// A long step of `stages` evaluations in place of `steps` explicit ones: stabilised Runge-Kutta-Chebyshev
/// (van der Houwen and Sommeijer; Verwer), with damping. Its coefficients are not those of exp(z) to second
/// order but those of (1 + z/steps)^steps: what it approximates is the result of the explicit steps.
class LongStep {
 public:
  static constexpr int kLeastStages = 2;

  LongStep(int stages, double steps)
      : steps_(steps), bend_(1 - 1 / steps), w0_(shift(stages)), chebyshev_(stages, w0_) {
    const auto s = static_cast<std::size_t>(stages);
    w1_ = bend_ * chebyshev_.slope[s] / chebyshev_.bend[s];
  }

  /// The most explicit steps that `stages` may stand for, when an explicit one multiplies no wave by less
  /// than 1 - `stiffness`. (Waves that an explicit step turns over are damped by a long one as well.)
  static double most_steps(int stages, double stiffness) {
    const auto s = static_cast<std::size_t>(stages);
    const double w0 = shift(stages);
    const Chebyshev chebyshev(stages, w0);
    return 1 + (1 + w0) * chebyshev.bend[s] / (chebyshev.slope[s] * stiffness);
  }

  /// Of stage 1 .. `stages`; the first has no stage before it but the start.
  StageWeights<double> weights(int stage) const {
    const auto j = static_cast<std::size_t>(stage);
    if (stage == 1) {
      const double share = scale(1) * w1_ * steps_;
      return {.start = 1 - share, .start_moved = share, .before = 0, .previous = 0, .previous_moved = 0};
    }
    const double mu = 2 * scale(j) * w0_ / scale(j - 1), nu = -scale(j) / scale(j - 2);
    const double rate = 2 * scale(j) * w1_ / scale(j - 1) * steps_;
    const double start_rate = -(1 - scale(j - 1) * chebyshev_.value[j - 1]) * rate;
    return {.start = 1 - mu - nu - start_rate,
            .start_moved = start_rate,
            .before = nu,
            .previous = mu - rate,
            .previous_moved = rate};
  }

  /// What the result y is off, to leading order: weights for the start and the result, and for both after an
  /// explicit step.
  struct ErrorWeights {
    double start, start_moved, result, result_moved;
  };
  ErrorWeights error_weights() const {
    // A fifteenth of the third derivative, of which the trapezium has a twelfth.
    constexpr double kScale = 0.8;
    const double of_start = kScale * steps_ * (1 - bend_ / 2), of_result = kScale * steps_ * bend_ / 2;
    return {.start = kScale - of_start,
            .start_moved = of_start,
            .result = -kScale - of_result,
            .result_moved = of_result};
  }

 private:
  static constexpr double kDamping = 1;
  static double shift(int stages) { return 1 + kDamping / (static_cast<double>(stages) * stages); }

  /// b_j of the literature; that of the first two stages is that of the third.
  double scale(std::size_t j) const {
    const std::size_t n = std::max<std::size_t>(j, 2);
    return chebyshev_.bend[n] / (chebyshev_.slope[n] * chebyshev_.slope[n]) / bend_;
  }

  double steps_, bend_, w0_, w1_ = 0;
  Chebyshev chebyshev_;
};

}  // namespace volsmooth
