#include "algorithms/formats/dicom/geometry.h"

#include <algorithm>
#include <cmath>

namespace volsmooth {
namespace {

std::vector<double> gaps_of(std::span<const double> depths) {
  std::vector<double> gaps;
  for (std::size_t k = 1; k < depths.size(); ++k) gaps.push_back(depths[k] - depths[k - 1]);
  return gaps;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

double dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Vector3 sum(const Vector3& a, const Vector3& b, double factor_of_b) {
  return {a[0] + factor_of_b * b[0], a[1] + factor_of_b * b[1], a[2] + factor_of_b * b[2]};
}

double length(const Vector3& v) {
  return std::sqrt(dot(v, v));
}

/// step = sum (k - mean k) (p_k - mean p) / sum (k - mean k)^2,  origin = mean p - mean k step
UniformSlices fit_uniform(std::span<const Vector3> positions) {
  const auto count = static_cast<double>(positions.size());
  Vector3 mean{};
  for (const Vector3& position : positions) mean = sum(mean, position, 1 / count);
  const double middle = (count - 1) / 2;
  Vector3 moment{};
  double squares = 0;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const double off = static_cast<double>(k) - middle;
    moment = sum(moment, sum(positions[k], mean, -1), off);
    squares += off * off;
  }
  UniformSlices fit;
  fit.step_mm = sum({}, moment, 1 / squares);
  fit.origin_mm = sum(mean, fit.step_mm, -middle);
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const Vector3 there = sum(fit.origin_mm, fit.step_mm, static_cast<double>(k));
    fit.residual_mm = std::max(fit.residual_mm, length(sum(positions[k], there, -1)));
  }
  return fit;
}

OddGap oddest_gap(std::span<const double> depths) {
  const std::vector<double> gaps = gaps_of(depths);
  OddGap odd{.usual_mm = median(gaps)};
  for (std::size_t k = 0; k < gaps.size(); ++k) {
    if (k > 0 && std::abs(gaps[k] - odd.usual_mm) <= std::abs(odd.gap_mm - odd.usual_mm)) continue;
    odd.before = k;
    odd.gap_mm = gaps[k];
  }
  return odd;
}

std::vector<Blend> even_blends(std::span<const double> depths) {
  const double extent = depths.back() - depths.front();
  const auto steps = static_cast<std::size_t>(std::max(1LL, std::llround(extent / median(gaps_of(depths)))));
  std::vector<Blend> blends;
  std::size_t lower = 0;
  for (std::size_t k = 0; k <= steps; ++k) {
    const double depth = depths.front() + extent * static_cast<double>(k) / static_cast<double>(steps);
    while (lower + 2 < depths.size() && depths[lower + 1] <= depth) ++lower;
    const double weight = (depth - depths[lower]) / (depths[lower + 1] - depths[lower]);
    blends.push_back({lower, lower + 1, std::clamp(weight, 0.0, 1.0)});
  }
  return blends;
}

}  // namespace volsmooth
