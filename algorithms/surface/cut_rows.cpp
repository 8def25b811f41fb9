#include "algorithms/surface/cut_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

/// The smallest float that is not below `value`: a float v has `v >= value` just when `v >= threshold`.
float float_threshold(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded < value ? std::nextafter(rounded, std::numeric_limits<float>::infinity()) : rounded;
}

void classify(const float* voxels, std::int64_t count, float threshold, std::uint64_t* bits) {
  for (std::int64_t begin = -1; begin < count; begin += 64, ++bits) {
    const std::int64_t last = std::min(begin + 64, count);
    std::uint64_t word = 0;
    for (std::int64_t x = std::max<std::int64_t>(begin, 0); x < last; ++x) {
      word |= static_cast<std::uint64_t>(voxels[x] >= threshold) << (x - begin);
    }
    *bits = word;
  }
}

}  // namespace

CutRows::CutRows(const Volume& volume, double isovalue, bool closed, const Progress& report)
    : size_(grid_of(volume).size),
      closed_(closed),
      words_((size_[0] + 2 + 63) / 64),
      bits_(static_cast<std::size_t>((words_ + 1) * (size_[1] + 2) * (size_[2] + 2))) {
  constexpr std::int64_t kRowsPerChunk = 256;
  const float threshold = float_threshold(isovalue);
  const float* voxels = voxels_of(volume).data();
  parallel_for(
      size_[1] * size_[2], kRowsPerChunk,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t r = begin; r < end; ++r) {
          std::uint64_t* bits = bits_.data() + (row(r % size_[1], r / size_[1]) - bits_.data());
          classify(voxels + r * size_[0], size_[0], threshold, bits);
        }
      },
      report);
}

std::uint64_t CutRows::cut_edges(std::int64_t y, std::int64_t z, std::size_t axis, std::int64_t word) const {
  const std::uint64_t* here = row(y, z);
  if (axis == 0) return (here[word] ^ next_bits(here, word)) & places(word, 1, size_[0]);
  const std::int64_t next_y = y + (axis == 1 ? 1 : 0), next_z = z + (axis == 2 ? 1 : 0);
  return is_row(next_y, next_z) ? here[word] ^ row(next_y, next_z)[word] : 0;
}

std::uint64_t CutRows::border_voxels(std::int64_t y, std::int64_t z, std::int64_t word) const {
  if (!closed_) return 0;
  const bool whole_row = y == 0 || y + 1 == size_[1] || z == 0 || z + 1 == size_[2];
  const std::uint64_t inside = row(y, z)[word];
  return whole_row ? inside : inside & (places(word, 1, 2) | places(word, size_[0], size_[0] + 1));
}

}  // namespace volsmooth
