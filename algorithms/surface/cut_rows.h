#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// Where one isosurface cuts the rows of a volume, from one bit per voxel: inside is `intensity >= isovalue`.
/// The volume is surrounded by one layer of outside: bit x + 1 of row (y, z) is voxel (x, y, z), rows -1 and
/// n exist, and a row ends with a word of zeros.
class CutRows {
 public:
  /// `closed`: the surface also runs round the volume, between its border and the layer outside.
  CutRows(const Volume& volume, double isovalue, bool closed, const Progress& report);

  const Size3& size() const { return size_; }
  bool closed() const { return closed_; }
  std::int64_t words() const { return words_; }
  bool is_row(std::int64_t y, std::int64_t z) const {
    return y >= 0 && y < size_[1] && z >= 0 && z < size_[2];
  }

  /// The cut edges of row (y, z) along an axis: the bits of their lower voxels in one word. Edges into the
  /// layer outside are left out.
  std::uint64_t cut_edges(std::int64_t y, std::int64_t z, std::size_t axis, std::int64_t word) const;

  /// The inside voxels of row (y, z) on the border of the volume, where it is closed.
  std::uint64_t border_voxels(std::int64_t y, std::int64_t z, std::int64_t word) const;

  /// Calls `visit(place, corners)` for all cells of the row (y..y+1, z..z+1) that have triangles, in
  /// ascending order. Place i is the cell between the bits i and i + 1; `corners` are its inside bits. Cells
  /// outside along two axes are left out: all their triangles have lost an edge.
  template <typename Visit>
  void for_each_cut_cell(std::int64_t y, std::int64_t z, const Visit& visit) const;

 private:
  const std::uint64_t* row(std::int64_t y, std::int64_t z) const {
    return bits_.data() + ((z + 1) * (size_[1] + 2) + y + 1) * (words_ + 1);
  }
  /// Bit i of the result is bit i + 1 of the row, counted from the word.
  static std::uint64_t next_bits(const std::uint64_t* row, std::int64_t word) {
    return row[word] >> 1 | row[word + 1] << 63;
  }
  /// The bits of a word whose places in the row lie in [first, last).
  static std::uint64_t places(std::int64_t word, std::int64_t first, std::int64_t last) {
    const auto below = [word](std::int64_t place) {
      const std::int64_t bits = place - 64 * word;
      return bits <= 0 ? 0 : bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
    };
    return below(last) & ~below(first);
  }

  Size3 size_;
  bool closed_;
  std::int64_t words_;
  std::vector<std::uint64_t> bits_;
};

template <typename Visit>
void CutRows::for_each_cut_cell(std::int64_t y, std::int64_t z, const Visit& visit) const {
  const bool beyond_y = y < 0 || y + 1 == size_[1], beyond_z = z < 0 || z + 1 == size_[2];
  if (beyond_y && beyond_z) return;
  const bool beyond_x_too = closed_ && !beyond_y && !beyond_z;
  const std::int64_t first = beyond_x_too ? 0 : 1, last = beyond_x_too ? size_[0] + 1 : size_[0];
  const std::array rows{row(y, z), row(y + 1, z), row(y, z + 1), row(y + 1, z + 1)};
  for (std::int64_t word = 0; word < words_; ++word) {
    std::array<std::uint64_t, 8> corner;
    std::uint64_t any = 0, all = ~std::uint64_t{0};
    for (std::size_t r = 0; r < 4; ++r) {
      corner[2 * r] = rows[r][word];
      corner[2 * r + 1] = next_bits(rows[r], word);
      any |= corner[2 * r] | corner[2 * r + 1];
      all &= corner[2 * r] & corner[2 * r + 1];
    }
    for (std::uint64_t cut = any & ~all & places(word, first, last); cut != 0; cut &= cut - 1) {
      const int at = std::countr_zero(cut);
      unsigned corners = 0;
      for (std::size_t c = 0; c < 8; ++c) corners |= static_cast<unsigned>(corner[c] >> at & 1u) << c;
      visit(64 * word + at, corners);
    }
  }
}

}  // namespace volsmooth
