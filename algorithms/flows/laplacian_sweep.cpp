#include "algorithms/flows/laplacian_sweep.h"

#include <algorithm>
#include <vector>

#include "algorithms/numerics/diffusion.h"
#include "algorithms/numerics/reflection.h"

namespace volsmooth {
namespace {

/// A row along x with the rows beside it along y and z.
struct DiffusedRow {
  std::int64_t count;
  const float* rho;
  std::array<const float*, 2> before, after;  ///< along y, z
  std::array<float, 3> factors;
  float* diffused;  ///< out
};

VOLSMOOTH_FORMULA float diffused_at(const DiffusedRow& row, std::int64_t x, std::int64_t left,
                                    std::int64_t right) {
  return diffused(row.rho[x],
                  Neighbours<float>{.before = {row.rho[left], row.before[0][x], row.before[1][x]},
                                    .after = {row.rho[right], row.after[0][x], row.after[1][x]}},
                  row.factors);
}

VOLSMOOTH_FORMULA void diffuse_row(const DiffusedRow& around) {
  DiffusedRow row = around;
  const std::int64_t last = row.count - 1;
  row.diffused[0] = diffused_at(row, 0, 0, std::min<std::int64_t>(1, last));
#pragma GCC ivdep
  for (std::int64_t x = 1; x < last; ++x) row.diffused[x] = diffused_at(row, x, x - 1, x + 1);
  if (last > 0) row.diffused[last] = diffused_at(row, last, last - 1, last);
}

/// Three planes of a tile fit the second-level cache; up to 280^2, that is three whole planes.
TileShape cached_tile(const Size3& size) {
  constexpr std::int64_t kVoxelsOfPlane = 80000;
  return {.rows = std::clamp<std::int64_t>(kVoxelsOfPlane / size[0], 4, 1024), .planes = 16};
}

void right_angled_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                       InstructionSet set, const TileShape& shape, const Progress& report) {
  const Size3 size = grid.size;
  const auto factors = flux_per_difference<float>(grid.spacing_mm, step_mm2);
  const auto diffuse = row_kernel<DiffusedRow, diffuse_row>(set);
  const auto row = [&](std::int64_t y, std::int64_t z) {
    return from.data() + (reflected(z, size[2]) * size[1] + reflected(y, size[1])) * size[0];
  };
  const auto sweep = [&](const Tile& tile) {
    for (std::int64_t z = tile.z_begin; z < tile.z_end; ++z)
      for (std::int64_t y = tile.y_begin; y < tile.y_end; ++y)
        diffuse({size[0],
                 row(y, z),
                 {row(y - 1, z), row(y, z - 1)},
                 {row(y + 1, z), row(y, z + 1)},
                 factors,
                 to.data() + (z * size[1] + y) * size[0]});
  };
  for_each_tile(size, shape, sweep, report);
}

/// What a row gains through links to one other row.
struct GainRow {
  std::int64_t count;
  const float *here, *there;
  float factor;
  float* gain;  ///< added to
};

VOLSMOOTH_FORMULA void gain_row(const GainRow& around) {
  GainRow row = around;
#pragma GCC ivdep
  for (std::int64_t x = 0; x < row.count; ++x)
    row.gain[x] += link_gain(row.here[x], row.there[x], row.factor);
}

/// Rows exchange with the rows that links lead to; what would lead out of the volume leads nowhere.
void skew_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
               InstructionSet set, const TileShape& shape, const Progress& report) {
  const Size3 size = grid.size;
  const auto links = heat_links<float>(inverse(metric_of(grid)), step_mm2);
  const auto gain_from = row_kernel<GainRow, gain_row>(set);
  const auto add_gains = [&](std::int64_t y, std::int64_t z, std::vector<float>& gain) {
    const float* here = from.data() + (z * size[1] + y) * size[0];
    for (const auto& [offset, factor] : links) {
      const std::int64_t there_y = y + offset[1], there_z = z + offset[2];
      if (there_y < 0 || there_y >= size[1] || there_z < 0 || there_z >= size[2]) continue;
      const std::int64_t begin = std::max<std::int64_t>(0, -offset[0]),
                         end = std::min<std::int64_t>(size[0], size[0] - offset[0]);
      const float* there = from.data() + (there_z * size[1] + there_y) * size[0] + offset[0];
      if (begin < end) gain_from({end - begin, here + begin, there + begin, factor, gain.data() + begin});
    }
  };
  const auto sweep = [&](const Tile& tile) {
    std::vector<float> gain(static_cast<std::size_t>(size[0]));
    for (std::int64_t z = tile.z_begin; z < tile.z_end; ++z) {
      for (std::int64_t y = tile.y_begin; y < tile.y_end; ++y) {
        std::ranges::fill(gain, 0.0F);
        add_gains(y, z, gain);
        const std::int64_t first = (z * size[1] + y) * size[0];
        std::transform(gain.begin(), gain.end(), from.data() + first, to.data() + first,
                       [](float more, float rho) { return rho + more; });
      }
    }
  };
  for_each_tile(size, shape, sweep, report);
}

}  // namespace

void laplacian_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                    InstructionSet set, const TileShape& shape, const Progress& report) {
  const auto step = is_orthogonal(grid) ? right_angled_step : skew_step;
  step(from, to, grid, step_mm2, set, shape, report);
}

void laplacian_step(std::span<const float> from, std::span<float> to, const Grid& grid, double step_mm2,
                    const Progress& report) {
  laplacian_step(from, to, grid, step_mm2, instruction_sets().back(), cached_tile(grid.size), report);
}

}  // namespace volsmooth
