#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "algorithms/progress.h"
#include "algorithms/surface/nearest_point.h"

namespace volsmooth {

/// Triangles by the cell of a volume's grid that their centre lies in. Those of an isosurface lie in one cell
/// each, so only the few cells within reach need to be looked at for the nearest one. Cells stand in blocks
/// of 8^3, of which those without triangles take 4 bytes.
class TriangleGrid {
 public:
  /// Of the triangles `chosen` of `mesh`, which must outlive the grid; at least one. `map` says where the
  /// cells lie in the mesh's world. The search is exact with any invertible one, and fast with that of the
  /// volume which the mesh was made of.
  TriangleGrid(const Mesh& mesh, const std::vector<std::uint32_t>& chosen, const VoxelToWorld& map,
               const Progress& report = no_progress);

  /// The point of all triangles nearest to `from`. `guess` is any triangle of the grid: the nearer it lies,
  /// the faster; the distance found does not depend on it.
  NearestPoint nearest(const Vector3& from, std::uint32_t guess) const;

  /// All triangles that touch `point`, and some others near it, in an order that depends on nothing else.
  std::vector<std::uint32_t> near(const Vector3& point) const;

 private:
  static constexpr std::int64_t kSide = 8;  // of a block, in cells
  using Cell = std::array<std::int64_t, 3>;

  /// A block's cells with triangles: bit x + 8 y of element z.
  struct Block {
    std::array<std::uint64_t, kSide> cells{};
    std::uint32_t first_cell = 0;  ///< number of the first of them
  };
  struct CellRange {
    Cell first, last;  ///< inclusive; empty when one of `last` is less
  };

  void place_cells(const std::vector<std::uint32_t>& chosen, const Progress& report);
  std::unique_ptr<std::uint32_t[]> keys_of(const std::vector<std::uint32_t>& chosen, const Progress& report);
  void sort_into_blocks(const std::vector<std::uint32_t>& chosen, std::unique_ptr<std::uint32_t[]> keys,
                        const Progress& report);

  Vector3 place_of(const Vector3& point) const;  ///< in cells
  CellRange cells_within(const Vector3& place, double reach_mm) const;
  double distance_to(const Cell& first, std::int64_t side, const Vector3& place) const;
  template <typename IsWanted, typename Visit>
  void for_each_cell(const CellRange& range, const IsWanted& is_wanted, const Visit& visit) const;

  const Mesh& mesh_;
  Matrix3 world_to_cell_, cell_to_world_;
  Vector3 origin_mm_;
  bool is_orthogonal_;  ///< whether cells are boxes
  double half_diagonal_mm_ = 0;
  Vector3 first_place_{};   ///< of the first cell, from `origin_mm_`
  Vector3 cells_per_mm_{};  ///< how far along each axis a way of one mm leads at the most
  Vector3 mm_per_cell_{};   ///< its inverse: the distance between the planes of cells
  double excess_ = 0;       ///< how far a triangle sticks out of its cell at the most, in cells
  Cell cells_along_{}, blocks_along_{};
  std::vector<std::uint32_t> block_at_;  ///< by place: 1 + the number of the block; 0: it has no triangles
  std::vector<Block> blocks_;
  std::vector<std::uint32_t> first_of_cell_;  ///< its first triangle; last, the number of all
  std::vector<std::uint32_t> triangles_;      ///< by cell
};

}  // namespace volsmooth
