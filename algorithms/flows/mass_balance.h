#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "algorithms/progress.h"

namespace volsmooth {

/// What a step with a constant made of a volume, in intensity x voxels.
struct BalancedMass {
  double mass = 0;      ///< sum of the new values
  double response = 0;  ///< by how much it falls when the constant grows by one

  BalancedMass& operator+=(const BalancedMass& more);
};

/// The sums over a volume, row by row along x: in double, in an order that depends on nothing but its size.
class RowSums {
 public:
  explicit RowSums(std::int64_t rows) : rows_(static_cast<std::size_t>(rows)) {}

  /// Rows are independent of one another: several threads may set different ones.
  void set(std::int64_t row, std::span<const float> moved, std::span<const float> response);
  BalancedMass total() const;

 private:
  std::vector<BalancedMass> rows_;
};

/// Sum of all values and of all their magnitudes.
struct Mass {
  double sum = 0, magnitude = 0;
};
Mass mass_of(std::span<const float> values, const Progress& report = no_progress);

/// How near to the mass, relative to the sum of magnitudes, a constant in float always comes: two that are
/// next to each other move every value by up to a rounding of 2^-23, and the nearer one is half of it away.
inline constexpr double kFloatMassTolerance = 0x1p-24;

/// Finds the constant for which a step leaves the mass what it was at the start: of the whole flow, so that
/// what rounding takes in one step the next gives back.
template <class Scalar>
class MassBalance {
 public:
  /// Writes the values of a step with a constant, from the same values at every call.
  using Step = std::function<BalancedMass(Scalar constant, const Progress& report)>;

  /// `tolerance`: of the mass, relative to the sum of magnitudes. The constant is looked for in
  /// (-limit, limit).
  MassBalance(const Mass& mass, double tolerance, Scalar limit)
      : mass_(mass.sum), tolerance_(tolerance * mass.magnitude), limit_(limit) {}

  /// Repeats `step` until it keeps the mass, by Newton's method in a bracket, starting where the last two
  /// steps' constants point to. The mass falls piecewise linearly in the constant: two calls are the rule,
  /// and one once the data are smooth. Between two neighbouring constants of its type the mass may jump by
  /// more than the tolerance; then the one that comes nearer is taken.
  void take(const Step& step, const Progress& report = no_progress) {
    constexpr int kMostCalls = 40;
    const Scalar before = constant_;
    constant_ = std::clamp(before + trend_, -limit_, limit_);
    Scalar low = -limit_, high = limit_;
    double left = 1;
    const auto step_with = [&](Scalar constant) {
      constant_ = constant;
      const BalancedMass got = step(constant, part_of(report, 1 - left, 1 - left / 2));
      left /= 2;
      return got;
    };
    Scalar nearest = constant_;
    double least = std::numeric_limits<double>::infinity();
    for (int call = 0; call < kMostCalls; ++call) {
      const BalancedMass got = step_with(constant_);
      const double surplus = got.mass - mass_;
      if (std::abs(surplus) <= tolerance_) break;
      if (std::abs(surplus) < least) {
        least = std::abs(surplus);
        nearest = constant_;
      }
      (surplus > 0 ? low : high) = constant_;
      auto next = static_cast<Scalar>(static_cast<double>(constant_) + surplus / got.response);
      if (!(next > low && next < high)) next = low + (high - low) / 2;
      if (next == low || next == high) {
        if (constant_ != nearest) step_with(nearest);
        break;
      }
      constant_ = next;
    }
    trend_ = taken_++ > 0 ? constant_ - before : Scalar{0};
    report(1);
  }

  Scalar constant() const { return constant_; }  ///< of the last step

 private:
  double mass_, tolerance_;
  Scalar limit_;
  Scalar constant_ = 0;
  Scalar trend_ = 0;        ///< by how much the last step changed it
  std::int64_t taken_ = 0;  ///< steps
};

}  // namespace volsmooth
