#include "algorithms/surface/vertex_numbers.h"

#include <limits>
#include <stdexcept>

#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

using RowCounts = std::array<std::int32_t, 4>;  // of vertices on edges along each axis, and on the border

std::vector<RowCounts> count_vertices(const CutRows& cut, const Progress& report) {
  constexpr std::int64_t kRowsPerChunk = 256;
  const std::int64_t rows = cut.size()[1] * cut.size()[2];
  std::vector<RowCounts> counts(static_cast<std::size_t>(rows));
  parallel_for(
      rows, kRowsPerChunk,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t r = begin; r < end; ++r) {
          const std::int64_t y = r % cut.size()[1], z = r / cut.size()[1];
          RowCounts& of_row = counts[static_cast<std::size_t>(r)];
          for (std::int64_t word = 0; word < cut.words(); ++word) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
              of_row[axis] += std::popcount(cut.cut_edges(y, z, axis, word));
            }
            of_row[3] += std::popcount(cut.border_voxels(y, z, word));
          }
        }
      },
      report);
  return counts;
}

}  // namespace

VertexNumbers::VertexNumbers(const CutRows& cut, const Progress& report) : cut_(cut) {
  const std::vector<RowCounts> counts = count_vertices(cut, report);
  rows_.resize(counts.size() + 1);
  std::int64_t total = 0;
  const auto first_of = [&total](std::int32_t count) {
    const auto first = static_cast<std::uint32_t>(total);
    total += count;
    return first;
  };
  for (std::size_t r = 0; r < counts.size(); ++r) {
    for (std::size_t axis = 0; axis < 3; ++axis) rows_[r].on_edges[axis] = first_of(counts[r][axis]);
    rows_[r].on_border = first_of(counts[r][3]);
  }
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw std::length_error("an isosurface of more than 2^32 - 1 vertices");
  }
  rows_.back().on_edges[0] = first_of(0);
}

std::uint32_t VertexNumbers::first_across(std::int64_t y, std::int64_t z, std::size_t axis) const {
  const std::int64_t next_y = y + (axis == 1 ? 1 : 0), next_z = z + (axis == 2 ? 1 : 0);
  if (!cut_.is_row(y, z)) return cut_.is_row(next_y, next_z) ? row(next_y, next_z).on_border : 0;
  return cut_.is_row(next_y, next_z) ? row(y, z).on_edges[axis] : row(y, z).on_border;
}

VertexCursor::VertexCursor(const VertexNumbers& numbers, std::int64_t y, std::int64_t z)
    : last_place_(numbers.cut().size()[0]) {
  for (std::int64_t k = 0; k < 4; ++k) {
    const auto at = static_cast<std::size_t>(k);
    across_[at] = k < 2 ? numbers.first_across(y, z + k, 1) : numbers.first_across(y + k - 2, z, 2);
    if (!numbers.cut().is_row(y + k % 2, z + k / 2)) continue;
    const VertexNumbers::Row* row = &numbers.row(y + k % 2, z + k / 2);
    along_[at] = row->on_edges[0];
    first_on_border_[at] = row->on_border;
    last_on_border_[at] = row[1].on_edges[0] - 1;
  }
}

}  // namespace volsmooth
