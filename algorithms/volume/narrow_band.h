#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// Cells [x_begin, x_end) of the row (y, z).
struct CellRun {
  std::int64_t y, z, x_begin, x_end;
  std::int64_t first = 0;  ///< number of its first cell, counted through all runs of a band

  std::int64_t count() const { return x_end - x_begin; }
  bool operator==(const CellRun&) const = default;
};

struct BandLimits {
  float epsilon = 1e-3F;    ///< a cell within this of 0 or 1 counts as settled there
  std::int64_t radius = 1;  ///< of the stencils to be computed in the band
};

/// The cells around the interface of a density in [0, 1] (thesis, section 7.1): those that see in the box of
/// `radius` around them anything but cells settled at one and the same end. All others are exactly 0 or 1,
/// and so is all that their stencils see, but for less than epsilon: they need not be computed.
class NarrowBand {
 public:
  /// Scans all of `density`, x fastest, which the band keeps looking at. Settles cells outside.
  NarrowBand(std::span<float> density, const Size3& size, const BandLimits& limits,
             const Progress& report = no_progress);

  /// In the order of the volume; those of a row do not touch.
  std::span<const CellRun> runs() const { return runs_; }
  std::int64_t cell_count() const { return runs_.empty() ? 0 : runs_.back().first + runs_.back().count(); }

  std::span<const float> density() const { return density_; }
  const Size3& size() const { return size_; }
  const float* row(std::int64_t y, std::int64_t z) const {
    return density_.data() + (z * size_[1] + y) * size_[0];
  }

  /// The densities of the cells become `values`, in the order of the runs, and the band follows: cells join
  /// and leave where a cell settled or ceased to be. Costs time in proportion to the band alone.
  void assign(std::span<const float> values, const Progress& report = no_progress);

  /// The densities of the cells, in the order of the runs.
  std::vector<float> densities() const;

  /// Densities and `values` change places, and the band stays where it is: for the stages of a step.
  void exchange(std::span<float> values);

  /// Sum of the densities that cells lost when they settled at 0 or 1 (they gain where this is negative).
  double settled() const { return settled_; }

 private:
  float* cells_of_row(std::int64_t y, std::int64_t z) {
    return density_.data() + (z * size_[1] + y) * size_[0];
  }
  std::vector<CellRun> changes_of(std::span<const float> values, const Progress& report);
  std::vector<CellRun> around(std::span<const CellRun> changed) const;
  void follow(std::span<const CellRun> windows, const Progress& report);
  void find_runs(const CellRun& window, std::vector<std::uint8_t>& scratch,
                 std::vector<CellRun>& found) const;
  double settle(const CellRun& window, std::span<const CellRun> found);
  void replace(std::span<const CellRun> windows, const std::vector<std::vector<CellRun>>& found);

  std::span<float> density_;
  Size3 size_;
  BandLimits limits_;
  std::vector<CellRun> runs_, last_runs_;
  double settled_ = 0;
};

/// Cells of the band over the area of all isosurfaces in it (thesis, Eq. 5.3), in voxels: how many voxels
/// wide the band is on the average. Beyond what a flow needs, sharpening is due. 0 for an empty band.
double average_width(const NarrowBand& band);

}  // namespace volsmooth
