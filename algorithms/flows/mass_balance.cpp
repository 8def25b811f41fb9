#include "algorithms/flows/mass_balance.h"

#include <array>
#include <cmath>

#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::size_t kLanes = 16;

/// Lane by lane, which vectorises, and then over the lanes.
template <class Value>
double sum_of(std::span<const float> values, const Value& value) {
  std::array<double, kLanes> lanes{};
  const std::size_t whole = values.size() / kLanes * kLanes;
  for (std::size_t first = 0; first < whole; first += kLanes)
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      lanes[lane] += value(static_cast<double>(values[first + lane]));
  for (std::size_t n = whole; n < values.size(); ++n)
    lanes[n - whole] += value(static_cast<double>(values[n]));
  double sum = 0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

double itself(double value) {
  return value;
}
double magnitude(double value) {
  return std::abs(value);
}

}  // namespace

BalancedMass& BalancedMass::operator+=(const BalancedMass& more) {
  mass += more.mass;
  response += more.response;
  return *this;
}

void RowSums::set(std::int64_t row, std::span<const float> moved, std::span<const float> response) {
  rows_[static_cast<std::size_t>(row)] = {sum_of(moved, itself), sum_of(response, itself)};
}

BalancedMass RowSums::total() const {
  BalancedMass total;
  for (const BalancedMass& row : rows_) total += row;
  return total;
}

Mass mass_of(std::span<const float> values, const Progress& report) {
  constexpr std::int64_t kChunk = 1 << 18;
  const auto count = static_cast<std::int64_t>(values.size());
  std::vector<Mass> chunks(static_cast<std::size_t>((count + kChunk - 1) / kChunk));
  parallel_for(
      count, kChunk,
      [&](std::int64_t begin, std::int64_t end) {
        const auto chunk =
            values.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin));
        chunks[static_cast<std::size_t>(begin / kChunk)] = {sum_of(chunk, itself), sum_of(chunk, magnitude)};
      },
      report);
  Mass total;
  for (const Mass& chunk : chunks) {
    total.sum += chunk.sum;
    total.magnitude += chunk.magnitude;
  }
  return total;
}

}  // namespace volsmooth
