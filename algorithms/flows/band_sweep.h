#pragma once

#include <functional>
#include <span>
#include <vector>

#include "algorithms/progress.h"
#include "algorithms/volume/narrow_band.h"

namespace volsmooth {

/// Cells of many runs of a band in one row, with all rows up to the stencil's radius beside it, so that row
/// kernels made for a whole volume run on them in whole vectors. Between runs lie the cells before and after
/// them (mirrored at the volume's border), where what a kernel computes means nothing.
struct PackedRow {
  std::int64_t count;        ///< that a kernel computes, in whole vectors
  const float* const* rows;  ///< [(dz + radius) (2 radius + 1) + dy + radius], each at its cell 0
  float* out;                ///< `count` floats for every output, one after the other

  float* output(int which) const { return out + which * count; }
};

/// Puts what `body` writes for the cells of `band` into `outputs`, in the order of its runs. On all cores;
/// the rows do not depend on their number.
void for_each_packed_row(const NarrowBand& band, std::int64_t radius,
                         const std::vector<std::span<float>>& outputs,
                         const std::function<void(const PackedRow&)>& body, const Progress& report);

}  // namespace volsmooth
