#pragma once

#include <span>
#include <vector>

#include "algorithms/flows/balanced_band_steps.h"
#include "algorithms/flows/mass_balance.h"
#include "algorithms/volume/narrow_band.h"

namespace volsmooth {

/// A narrow band whose flow keeps the mass of the whole density (thesis, section 7.1). What a step would have
/// changed outside, and what cells lose when they settle, is postponed: owed to the band until it is
/// reinjected.
class MassKeepingBand {
 public:
  MassKeepingBand(std::span<float> density, const Size3& size, const BandLimits& limits,
                  const Progress& report = no_progress);

  NarrowBand& band() { return band_; }
  const NarrowBand& band() const { return band_; }

  double mass() const { return mass_; }              ///< to be kept, in voxels: the density's at the start
  double postponed() const { return mass_ - now_; }  ///< of it, by what the density has too little

  /// `values` become the densities of the cells, and the band follows.
  void assign(std::span<const float> values, const Progress& report = no_progress);

  /// A step of a flow with a constant, the one that leaves nothing postponed: all is reinjected on the way
  /// (but for what settles right after).
  void take(MassBalance<float>& balance, const BalancedBandStep& step, const Progress& report = no_progress);

  /// For `take`; the constants of a flow's steps follow one another.
  MassBalance<float> balance(double limit) const;

  /// Changes `values`, which a step has made of the densities, by the mass that is postponed and that they
  /// lack: in cells that increased (if it is negative, decreased) in proportion to their change, up to 1
  /// (down to 0).
  void reinject_along_changes(std::span<float> values) const;

 private:
  double mass_;
  NarrowBand band_;
  double now_;
  std::vector<float> values_, response_;
};

}  // namespace volsmooth
