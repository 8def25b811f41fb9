#include "algorithms/surface/triangle_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "algorithms/surface/serial_for.h"
#include "algorithms/surface/vector_math.h"
#include "algorithms/volume/large_pages.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kTrianglesPerChunk = 1 << 14, kBlocksPerChunk = 64;
constexpr std::uint32_t kCellsOfBlock = 8 * 8 * 8;
/// Blocks, also those without triangles: at least so many are affordable, and of more the numbers of cells
/// are beyond 32 bits.
constexpr double kFewBlocks = 1 << 12, kMostBlocks = 1 << 22;
constexpr double kRounding = 1e-6;  // of places, in cells, and, relative, of distances

Vector3 times(const Matrix3& m, const Vector3& v) {
  return {dot(m[0], v), dot(m[1], v), dot(m[2], v)};
}

struct Box {
  Vector3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  void add(const Vector3& place) { add(Box{place, place}); }

  void add(const Box& other) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], other.low[axis]);
      high[axis] = std::max(high[axis], other.high[axis]);
    }
  }
};

bool holds(const auto& range, const auto& cell) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (cell[axis] < range.first[axis] || cell[axis] > range.last[axis]) return false;
  }
  return true;
}

/// Bits `first` to `last` of eight.
std::uint64_t bits_between(std::int64_t first, std::int64_t last) {
  return (0xffU >> (7 - (last - first))) << first;
}

/// A plane of a block: the cells of a rectangle.
std::uint64_t rectangle(std::int64_t first_x, std::int64_t last_x, std::int64_t first_y,
                        std::int64_t last_y) {
  constexpr std::uint64_t kEveryRow = 0x0101010101010101U;
  const std::uint64_t rows = (~std::uint64_t{0} >> (8 * (7 - (last_y - first_y)))) << (8 * first_y);
  return kEveryRow * bits_between(first_x, last_x) & rows;
}

}  // namespace

TriangleGrid::TriangleGrid(const Mesh& mesh, const std::vector<std::uint32_t>& chosen,
                           const VoxelToWorld& map, const Progress& report)
    : mesh_(mesh),
      world_to_cell_(inverse(map.linear)),
      origin_mm_(map.origin),
      is_orthogonal_(is_orthogonal(grid_of({}, map))) {
  place_cells(chosen, part_of(report, 0, 0.1));
  auto keys = keys_of(chosen, part_of(report, 0.1, 0.4));
  sort_into_blocks(chosen, std::move(keys), part_of(report, 0.4, 1));
}

/// The cells of the volume round all triangles; larger ones where these would be too many for them.
void TriangleGrid::place_cells(const std::vector<std::uint32_t>& chosen, const Progress& report) {
  std::vector<Box> boxes(chosen.size() / kTrianglesPerChunk + 1);
  parallel_for(
      std::ssize(chosen), kTrianglesPerChunk,
      [&](std::int64_t begin, std::int64_t end) {
        Box& box = boxes[static_cast<std::size_t>(begin / kTrianglesPerChunk)];
        for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
          for (const std::uint32_t vertex : mesh_.triangles[chosen[k]])
            box.add(place_of(to_double(mesh_.positions[vertex])));
        }
      },
      report);
  Box box;
  for (const Box& part : boxes) box.add(part);
  const double most_blocks = std::min(kMostBlocks, std::max(kFewBlocks, static_cast<double>(chosen.size())));
  double scale = 1, blocks = 0;
  do {
    blocks = 1;
    for (std::size_t axis = 0; axis < 3; ++axis)
      blocks *=
          std::floor((std::floor(box.high[axis] / scale) - std::floor(box.low[axis] / scale)) / kSide) + 1;
    scale *= blocks > most_blocks ? 2 : 1;
  } while (blocks > most_blocks);

  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (double& element : world_to_cell_[axis]) element /= scale;
    cells_per_mm_[axis] = length(world_to_cell_[axis]);
    mm_per_cell_[axis] = 1 / cells_per_mm_[axis];
    first_place_[axis] = std::floor(box.low[axis] / scale);
    cells_along_[axis] =
        static_cast<std::int64_t>(std::floor(box.high[axis] / scale) - first_place_[axis]) + 1;
    blocks_along_[axis] = (cells_along_[axis] - 1) / kSide + 1;
  }
  cell_to_world_ = inverse(world_to_cell_);
  for (const double one : {-1.0, 1.0})
    for (const double other : {-1.0, 1.0})
      half_diagonal_mm_ =
          std::max(half_diagonal_mm_, length(times(cell_to_world_, {0.5, 0.5 * one, 0.5 * other})));
}

/// For every triangle the place of its block, times 8^3, plus that of its cell in the block.
std::unique_ptr<std::uint32_t[]> TriangleGrid::keys_of(const std::vector<std::uint32_t>& chosen,
                                                       const Progress& report) {
  auto keys = uninitialised<std::uint32_t>(chosen.size());
  std::vector<double> excess(chosen.size() / kTrianglesPerChunk + 1);
  parallel_for(
      std::ssize(chosen), kTrianglesPerChunk,
      [&](std::int64_t begin, std::int64_t end) {
        double& most = excess[static_cast<std::size_t>(begin / kTrianglesPerChunk)];
        for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
          const auto corners = corners_of(mesh_, mesh_.triangles[chosen[k]]);
          const std::array places{place_of(corners[0]), place_of(corners[1]), place_of(corners[2])};
          std::int64_t block = 0, cell = 0;
          for (std::size_t a = 3; a-- > 0;) {
            const double centre = (places[0][a] + places[1][a] + places[2][a]) / 3;
            const auto at =
                std::clamp<std::int64_t>(static_cast<std::int64_t>(centre), 0, cells_along_[a] - 1);
            block = block * blocks_along_[a] + at / kSide;
            cell = cell * kSide + at % kSide;
            const auto low = static_cast<double>(at);
            for (const Vector3& place : places) most = std::max({most, low - place[a], place[a] - (low + 1)});
          }
          keys[k] = static_cast<std::uint32_t>(block * kCellsOfBlock + cell);
        }
      },
      report);
  excess_ = std::ranges::max(excess) + kRounding;
  return keys;
}

void TriangleGrid::sort_into_blocks(const std::vector<std::uint32_t>& chosen,
                                    std::unique_ptr<std::uint32_t[]> keys, const Progress& report) {
  const auto places = static_cast<std::size_t>(blocks_along_[0] * blocks_along_[1] * blocks_along_[2]);
  // A counting sort by block; each block then sorts its own triangles by cell.
  std::vector<std::uint32_t> next(places + 1);
  serial_for(
      chosen.size(),
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) ++next[keys[k] / kCellsOfBlock + 1];
      },
      part_of(report, 0, 0.2));
  block_at_.assign(places, 0);
  std::vector<std::uint32_t> first{0};
  for (std::size_t place = 0; place < places; ++place) {
    if (next[place + 1] != 0) {
      first.push_back(first.back() + next[place + 1]);
      block_at_[place] = static_cast<std::uint32_t>(first.size() - 1);
    }
    next[place + 1] += next[place];
  }
  struct Keyed {
    std::uint32_t triangle, cell;
  };
  auto sorted = uninitialised<Keyed>(chosen.size());
  serial_for(
      chosen.size(),
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
          sorted[next[keys[k] / kCellsOfBlock]++] = {chosen[k], keys[k] % kCellsOfBlock};
      },
      part_of(report, 0.2, 0.5));
  keys.reset();

  blocks_.resize(first.size() - 1);
  triangles_.resize(chosen.size());
  std::vector<std::uint32_t> starts(
      chosen.size());  // of the cells of a block, from its first triangle's place
  parallel_for(
      std::ssize(blocks_), kBlocksPerChunk,
      [&](std::int64_t begin, std::int64_t end) {
        for (auto b = static_cast<std::size_t>(begin); b < static_cast<std::size_t>(end); ++b) {
          std::array<std::uint32_t, kCellsOfBlock + 1> places_of_cells{};
          for (std::uint32_t k = first[b]; k < first[b + 1]; ++k) ++places_of_cells[sorted[k].cell + 1];
          std::uint32_t cells = 0;
          for (std::uint32_t cell = 0; cell < kCellsOfBlock; ++cell) {
            if (places_of_cells[cell + 1] != 0) {
              blocks_[b].cells[cell / 64] |= std::uint64_t{1} << cell % 64;
              starts[first[b] + cells++] = first[b] + places_of_cells[cell];
            }
            places_of_cells[cell + 1] += places_of_cells[cell];
          }
          blocks_[b].first_cell = cells;  // their number, until the numbers of all are known
          for (std::uint32_t k = first[b]; k < first[b + 1]; ++k)
            triangles_[first[b] + places_of_cells[sorted[k].cell]++] = sorted[k].triangle;
        }
      },
      part_of(report, 0.5, 1));
  std::uint32_t cells = 0;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::uint32_t own = std::exchange(blocks_[b].first_cell, cells);
    std::copy_n(&starts[first[b]], own, &starts[cells]);
    cells += own;
  }
  starts.resize(cells);
  starts.push_back(static_cast<std::uint32_t>(chosen.size()));
  first_of_cell_ = std::move(starts);
}

Vector3 TriangleGrid::place_of(const Vector3& point) const {
  return times(world_to_cell_, point - origin_mm_) - first_place_;
}

TriangleGrid::CellRange TriangleGrid::cells_within(const Vector3& place, double reach_mm) const {
  CellRange range;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double reach = reach_mm * (1 + kRounding) * cells_per_mm_[axis] + excess_;
    const auto last = static_cast<double>(cells_along_[axis] - 1);
    range.first[axis] = static_cast<std::int64_t>(std::clamp(std::floor(place[axis] - reach), 0.0, last + 1));
    range.last[axis] = static_cast<std::int64_t>(std::clamp(std::floor(place[axis] + reach), -1.0, last));
  }
  return range;
}

/// The least that a triangle of the cells [first, first + side)^3 may be away, in mm.
double TriangleGrid::distance_to(const Cell& first, std::int64_t side, const Vector3& place) const {
  double squared = 0, farthest = 0;
  Vector3 to_centre;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double half = 0.5 * static_cast<double>(side);
    to_centre[axis] = static_cast<double>(first[axis]) + half - place[axis];
    const double beyond = std::max(std::abs(to_centre[axis]) - half - excess_, 0.0) * mm_per_cell_[axis];
    squared += beyond * beyond;
    farthest = std::max(farthest, beyond);
  }
  if (is_orthogonal_) return std::sqrt(squared);
  const double ball = (static_cast<double>(side) + 2 * excess_) * half_diagonal_mm_;
  return std::max(farthest, length(times(cell_to_world_, to_centre)) - ball);
}

/// Calls `visit(triangles)` for the cells with triangles that `is_wanted(first cell, side)`, asked for blocks
/// and for cells.
template <typename IsWanted, typename Visit>
void TriangleGrid::for_each_cell(const CellRange& range, const IsWanted& is_wanted,
                                 const Visit& visit) const {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (range.last[axis] < range.first[axis]) return;
  }
  Cell first_block, last_block, block;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first_block[axis] = range.first[axis] / kSide;
    last_block[axis] = range.last[axis] / kSide;
  }
  for (block[2] = first_block[2]; block[2] <= last_block[2]; ++block[2]) {
    for (block[1] = first_block[1]; block[1] <= last_block[1]; ++block[1]) {
      for (block[0] = first_block[0]; block[0] <= last_block[0]; ++block[0]) {
        const std::int64_t place = block[0] + blocks_along_[0] * (block[1] + blocks_along_[1] * block[2]);
        const std::uint32_t number = block_at_[static_cast<std::size_t>(place)];
        const Cell corner{kSide * block[0], kSide * block[1], kSide * block[2]};
        if (number == 0 || !is_wanted(corner, kSide)) continue;
        const Block& cells = blocks_[number - 1];
        Cell first, last;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          first[axis] = std::max<std::int64_t>(range.first[axis] - corner[axis], 0);
          last[axis] = std::min<std::int64_t>(range.last[axis] - corner[axis], kSide - 1);
        }
        const std::uint64_t wanted = rectangle(first[0], last[0], first[1], last[1]);
        std::uint32_t before = cells.first_cell;
        for (std::int64_t z = 0; z < first[2]; ++z)
          before += static_cast<std::uint32_t>(std::popcount(cells.cells[static_cast<std::size_t>(z)]));
        for (std::int64_t z = first[2]; z <= last[2]; ++z) {
          const std::uint64_t plane = cells.cells[static_cast<std::size_t>(z)];
          for (std::uint64_t bits = plane & wanted; bits != 0; bits &= bits - 1) {
            const int bit = std::countr_zero(bits);
            const std::uint64_t below = plane & ((std::uint64_t{1} << bit) - 1);
            const std::uint32_t cell = before + static_cast<std::uint32_t>(std::popcount(below));
            if (!is_wanted(Cell{corner[0] + bit % 8, corner[1] + bit / 8, corner[2] + z}, 1)) continue;
            for (std::uint32_t k = first_of_cell_[cell]; k < first_of_cell_[cell + 1]; ++k)
              visit(triangles_[k]);
          }
          before += static_cast<std::uint32_t>(std::popcount(plane));
        }
      }
    }
  }
}

NearestPoint TriangleGrid::nearest(const Vector3& from, std::uint32_t guess) const {
  NearestPoint best = nearest_point(mesh_, guess, from);
  double distance = std::sqrt(best.squared_distance);
  const Vector3 place = place_of(from);
  CellRange seen{{0, 0, 0}, {-1, -1, -1}};
  const auto look_within = [&](double reach) {
    const CellRange range = cells_within(place, reach);
    for_each_cell(
        range,
        [&](const Cell& first, std::int64_t side) {
          const bool is_new = side > 1 || !holds(seen, first);
          return is_new && distance_to(first, side, place) <= distance * (1 + kRounding);
        },
        [&](std::uint32_t t) {
          const NearestPoint other = nearest_point(mesh_, t, from);
          if (other.squared_distance >= best.squared_distance) return;
          best = other;
          distance = std::sqrt(best.squared_distance);
        });
    seen = range;
  };
  // Outwards by steps that double, lest a bad guess make it look at everything.
  const double cell_mm = 1 / std::ranges::max(cells_per_mm_);
  for (double reach = 0; reach < distance; reach = std::max(2 * reach, cell_mm / 4)) look_within(reach);
  look_within(distance);
  return best;
}

std::vector<std::uint32_t> TriangleGrid::near(const Vector3& point) const {
  std::vector<std::uint32_t> found;
  for_each_cell(
      cells_within(place_of(point), 0), [](const Cell&, std::int64_t) { return true; },
      [&](std::uint32_t t) { found.push_back(t); });
  return found;
}

}  // namespace volsmooth
