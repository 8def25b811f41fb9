#pragma once

#include <span>
#include <vector>

#include "algorithms/flows/intensity_range.h"
#include "algorithms/progress.h"
#include "algorithms/volume/geometry.h"
#include "algorithms/volume/instruction_set.h"

namespace volsmooth {

/// Convolves every line of voxels along `axis` with a symmetric kernel ([k] for distances k of both sides) of
/// at most one more weights than the line has voxels; beyond its ends a line goes on as its mirror image. In
/// place; what rounding would take out of `range` is held in it. The same bytes for any number of threads.
struct LineKernel {
  std::size_t axis = 0;
  std::vector<float> weights;
  IntensityEnds range{};
};
void convolve_lines(std::span<float> voxels, const Size3& size, const LineKernel& kernel,
                    const Progress& report = no_progress);

/// The same for an instruction set; none changes the result.
void convolve_lines(std::span<float> voxels, const Size3& size, const LineKernel& kernel, InstructionSet set,
                    const Progress& report);

/// The kernel of the heat equation in time `time` (in squared spacings) for lines of `count` voxels, in
/// float; the weights of all distances add up to 1 but for the rounding of the first.
std::vector<float> heat_weights(double time, std::int64_t count);

}  // namespace volsmooth
