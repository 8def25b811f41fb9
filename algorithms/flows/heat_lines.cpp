#include "algorithms/flows/heat_lines.h"

#include <algorithm>

#include "algorithms/numerics/heat_kernel.h"
#include "algorithms/numerics/reflection.h"
#include "algorithms/numerics/stencil.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

/// Sums along `count` parallel lines at once, or at `count` places of one line: neighbours along the lines
/// are `stride` apart.
struct KernelRow {
  std::int64_t count, stride;
  const float* centre;
  std::span<const float> weights;
  IntensityEnds range;
  float* out;
};

VOLSMOOTH_FORMULA float pair(const KernelRow& row, std::int64_t x, std::int64_t k) {
  return row.weights[static_cast<std::size_t>(k)] *
         (row.centre[x - k * row.stride] + row.centre[x + k * row.stride]);
}

VOLSMOOTH_FORMULA void sum_row(const KernelRow& around) {
  const KernelRow row = around;
  const auto reach = std::ssize(row.weights) - 1;
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x) row.out[x] = row.weights[0] * row.centre[x];
  std::int64_t k = 1;
  for (; k + 3 <= reach; k += 4) {
#pragma GCC ivdep
    for (std::int64_t x = 0; x < row.count; ++x)
      row.out[x] += (pair(row, x, k) + pair(row, x, k + 1)) + (pair(row, x, k + 2) + pair(row, x, k + 3));
  }
  for (; k <= reach; ++k) {
#pragma GCC ivdep
    for (std::int64_t x = 0; x < row.count; ++x) row.out[x] += pair(row, x, k);
  }
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x)
    row.out[x] = std::min(std::max(row.out[x], row.range.lowest), row.range.highest);
}

/// That are convolved side by side: 64, fewer of lines so long that these would leave the cache.
std::int64_t columns_for(std::int64_t padded_length) {
  constexpr std::int64_t kMostFloats = std::int64_t{1} << 18;
  return std::clamp<std::int64_t>(kMostFloats / padded_length / 16 * 16, 16, 64);
}

/// All lines of a volume along one axis, in bundles that lie side by side along x.
class Lines {
 public:
  Lines(std::span<float> voxels, const Size3& size, const LineKernel& kernel, InstructionSet set)
      : voxels_(voxels),
        kernel_(kernel),
        sum_(row_kernel<KernelRow, sum_row>(set)),
        width_(size[0]),
        length_(size[kernel.axis]),
        stride_(kernel.axis == 1 ? size[0] : size[0] * size[1]),
        columns_(columns_for(length_ + 2 * std::ssize(kernel.weights))),
        across_((size[0] + columns_ - 1) / columns_),
        slices_(kernel.axis == 1 ? size[2] : size[1]),
        slice_stride_(kernel.axis == 1 ? size[0] * size[1] : size[0]) {}

  std::int64_t bundles() const { return across_ * slices_; }

  void convolve(std::int64_t bundle) const {
    const std::int64_t x = bundle % across_ * columns_, columns = std::min(columns_, width_ - x);
    float* first = voxels_.data() + bundle / across_ * slice_stride_ + x;
    const std::int64_t reach = std::ssize(kernel_.weights) - 1;
    std::vector<float> lines(static_cast<std::size_t>((length_ + 2 * reach) * columns_));
    for (std::int64_t i = -reach; i < length_ + reach; ++i)
      std::copy_n(first + reflected(i, length_) * stride_, columns,
                  &lines[static_cast<std::size_t>((i + reach) * columns_)]);
    for (std::int64_t i = 0; i < length_; ++i)
      sum_({columns, columns_, &lines[static_cast<std::size_t>((i + reach) * columns_)], kernel_.weights,
            kernel_.range, first + i * stride_});
  }

 private:
  std::span<float> voxels_;
  const LineKernel& kernel_;
  RowKernel<KernelRow> sum_;
  std::int64_t width_, length_, stride_, columns_, across_, slices_, slice_stride_;
};

/// Along x, one after the other.
void convolve_row(float* row, std::int64_t width, const LineKernel& kernel, RowKernel<KernelRow> sum) {
  const std::int64_t reach = std::ssize(kernel.weights) - 1;
  std::vector<float> line(static_cast<std::size_t>(width + 2 * reach));
  for (std::int64_t x = -reach; x < width + reach; ++x)
    line[static_cast<std::size_t>(x + reach)] = row[reflected(x, width)];
  sum({width, 1, &line[static_cast<std::size_t>(reach)], kernel.weights, kernel.range, row});
}

}  // namespace

void convolve_lines(std::span<float> voxels, const Size3& size, const LineKernel& kernel, InstructionSet set,
                    const Progress& report) {
  if (kernel.axis == 0) {
    const auto sum = row_kernel<KernelRow, sum_row>(set);
    parallel_for(
        size[1] * size[2], 16,
        [&](std::int64_t begin, std::int64_t end) {
          for (std::int64_t row = begin; row < end; ++row)
            convolve_row(voxels.data() + row * size[0], size[0], kernel, sum);
        },
        report);
    return;
  }
  const Lines lines(voxels, size, kernel, set);
  parallel_for(
      lines.bundles(), 1,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t bundle = begin; bundle < end; ++bundle) lines.convolve(bundle);
      },
      report);
}

void convolve_lines(std::span<float> voxels, const Size3& size, const LineKernel& kernel,
                    const Progress& report) {
  convolve_lines(voxels, size, kernel, instruction_sets().back(), report);
}

std::vector<float> heat_weights(double time, std::int64_t count) {
  // Much earlier than this, two mirrors have made every line even.
  const double even = 4 * static_cast<double>(count) * static_cast<double>(count);
  const std::vector<double> kernel = folded(heat_kernel(std::min(time, even)), count);
  std::vector<float> weights(kernel.begin(), kernel.end());
  double others = 0;
  for (std::size_t k = 1; k < weights.size(); ++k) others += 2 * double{weights[k]};
  weights[0] = static_cast<float>(1 - others);
  return weights;
}

}  // namespace volsmooth
