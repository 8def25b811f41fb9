#pragma once

#include <array>
#include <cstdint>

#include "algorithms/numerics/metric.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// `face_centred_moved` along a row.
template <class Metric>
struct FaceCentredRow {
  std::int64_t count;
  std::array<const float*, 9> rows;  ///< [3 (dz + 1) + dy + 1]
  Metric metric;
  float time;
  float* moved;  ///< out
};

template <class Metric>
using FaceCentredKernel = void (*)(const FaceCentredRow<Metric>&);

/// For the metrics of both kinds, in float.
template <class Metric>
FaceCentredKernel<Metric> face_centred_kernel(InstructionSet set);

}  // namespace volsmooth
