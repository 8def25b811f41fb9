#include "algorithms/flows/mass_keeping_band.h"

#include <algorithm>

#include "algorithms/volume/parallel.h"

namespace volsmooth {

MassKeepingBand::MassKeepingBand(std::span<float> density, const Size3& size, const BandLimits& limits,
                                 const Progress& report)
    : mass_(mass_of(density, [&](double) { report(0); }).sum),  // before the band settles cells
      band_(density, size, limits, report),
      now_(mass_ - band_.settled()) {}

void MassKeepingBand::assign(std::span<const float> values, const Progress& report) {
  const double before = mass_of(band_.densities()).sum, settled_before = band_.settled();
  now_ += mass_of(values).sum - before;
  band_.assign(values, report);
  now_ -= band_.settled() - settled_before;
}

MassBalance<float> MassKeepingBand::balance(double limit) const {
  constexpr double kTolerance = 1e-8;
  return {{.sum = mass_, .magnitude = mass_}, kTolerance, static_cast<float>(limit)};
}

void MassKeepingBand::take(MassBalance<float>& balance, const BalancedBandStep& step,
                           const Progress& report) {
  const double outside = now_ - mass_of(band_.densities()).sum;
  values_.resize(static_cast<std::size_t>(band_.cell_count()));
  response_.resize(values_.size());
  balance.take(
      [&](float constant, const Progress& report_call) {
        for_each_packed_row(
            band_, 1, {values_, response_}, [&](const PackedRow& row) { step(constant, row); }, report_call);
        return BalancedMass{.mass = outside + mass_of(values_).sum, .response = mass_of(response_).sum};
      },
      report);
  assign(values_, [&](double) { report(1); });
}

void MassKeepingBand::reinject_along_changes(std::span<float> values) const {
  const std::vector<float> before = band_.densities();
  const double owed = postponed() - (mass_of(values).sum - mass_of(before).sum);
  const bool grows = owed > 0;
  std::vector<float> changes(values.size());
  const auto for_each_cell = [&](const auto& body) {
    constexpr std::int64_t kCells = 1 << 14;
    parallel_for(std::ssize(values), kCells, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t n = begin; n < end; ++n) body(static_cast<std::size_t>(n));
    });
  };
  for_each_cell([&](std::size_t n) {
    const float change = values[n] - before[n];
    changes[n] = grows ? std::max(change, 0.0F) : std::min(change, 0.0F);
  });
  const double sum = mass_of(changes).sum;
  if (sum == 0) return;
  const auto factor = static_cast<float>(owed / sum);
  for_each_cell([&](std::size_t n) {
    const float more = values[n] + factor * changes[n];
    values[n] = grows ? std::min(more, std::max(values[n], 1.0F)) : std::max(more, std::min(values[n], 0.0F));
  });
}

}  // namespace volsmooth
