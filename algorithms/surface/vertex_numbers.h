#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/progress.h"
#include "algorithms/surface/cell_cases.h"
#include "algorithms/surface/cut_rows.h"

namespace volsmooth {

/// Numbers for the vertices of a surface, row by row of the volume: those on edges along x, y and z from the
/// row's voxels, then those at the voxels of the border, each kind in ascending order of x. An edge into the
/// layer outside has its vertex at the voxel of the border itself; the up to three such edges share it.
class VertexNumbers {
 public:
  /// Throws std::length_error when there are more than 2^32 - 1 vertices.
  VertexNumbers(const CutRows& cut, const Progress& report);

  struct Row {
    std::array<std::uint32_t, 3> on_edges;  ///< the first one along each axis
    std::uint32_t on_border;
  };
  const Row& row(std::int64_t y, std::int64_t z) const {
    return rows_[static_cast<std::size_t>(z * cut_.size()[1] + y)];
  }
  std::uint32_t count() const { return rows_.back().on_edges[0]; }

  /// The first vertex on edges along y or z from row (y, z), which may lie just outside the volume.
  std::uint32_t first_across(std::int64_t y, std::int64_t z, std::size_t axis) const;

  const CutRows& cut() const { return cut_; }

 private:
  const CutRows& cut_;
  std::vector<Row> rows_;  // and one more, whose first number is the count
};

/// The vertices round the cut cells of one row, which are to be visited all and in ascending order.
class VertexCursor {
 public:
  VertexCursor(const VertexNumbers& numbers, std::int64_t y, std::int64_t z);

  /// The vertices on the twelve edges of a cell; of meaning on those that are cut.
  std::array<std::uint32_t, 12> of_cell(std::int64_t place, unsigned corners) {
    const std::uint32_t cut = cut_edges(corners);
    std::array<std::uint32_t, 12> vertices;
    for (std::size_t k = 0; k < 4; ++k) {
      const bool before = place == 0, beyond = place == last_place_;
      vertices[k] = before ? first_on_border_[k] : beyond ? last_on_border_[k] : along_[k];
      along_[k] += before ? 0 : cut >> k & 1u;
      const std::uint32_t is_cut = cut >> (4 + 2 * k) & 1u;
      vertices[4 + 2 * k] = across_[k];
      vertices[5 + 2 * k] = across_[k] += is_cut;
    }
    return vertices;
  }

 private:
  std::int64_t last_place_;
  std::array<std::uint32_t, 4> along_{};   // next vertex along x on the four rows
  std::array<std::uint32_t, 4> across_{};  // next one along y (at z, z + 1) and along z (at y, y + 1)
  std::array<std::uint32_t, 4> first_on_border_{}, last_on_border_{};
};

}  // namespace volsmooth
