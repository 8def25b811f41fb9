#include "algorithms/flows/advection.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "algorithms/flows/advection_rows.h"
#include "algorithms/flows/step_plan.h"
#include "algorithms/flows/tiles.h"
#include "algorithms/numerics/reflection.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

/// `share` of a step of Euler's from `from`, the rest of `kept`: a stage of a Runge-Kutta method.
template <class Scalar>
struct Stage {
  const Scalar *from, *kept;
  Scalar* to;
  Scalar share;
};

/// What all stages have in common.
template <class Scalar>
struct Scheme {
  Grid grid;
  const FaceVelocities<Scalar>& velocities;
  FluxKernel<Scalar> kernel;
  double step;
  Scalar epsilon;
};

/// One thread's sweep through one tile after another. Fluxes are computed once within a tile, and at its rim
/// by the same operations as its neighbour's.
template <class Scalar>
class Sweep {
 public:
  Sweep(const Scheme<Scalar>& scheme, const Stage<Scalar>& stage, const TileShape& shape)
      : scheme_(scheme), stage_(stage), size_(scheme.grid.size) {
    const auto width = static_cast<std::size_t>(size_[0]);
    padded_.resize(width + 2 * kHalo);
    across_x_.resize(width + 1);
    for (auto* row : {&before_y_, &after_y_, &after_z_}) row->resize(width);
    before_z_.resize(width * static_cast<std::size_t>(std::min(shape.rows, size_[1])));
  }

  void run(const Tile& tile) {
    for (std::int64_t y = tile.y_begin; y < tile.y_end; ++y)
      make_flux(2, y, tile.z_begin, before_z(y - tile.y_begin));
    for (std::int64_t z = tile.z_begin; z < tile.z_end; ++z) {
      make_flux(1, tile.y_begin, z, before_y_.data());
      for (std::int64_t y = tile.y_begin; y < tile.y_end; ++y) {
        make_flux_across_x(y, z);
        make_flux(1, y + 1, z, after_y_.data());
        make_flux(2, y, z + 1, after_z_.data());
        move_row(y, z, before_z(y - tile.y_begin));
        std::swap(before_y_, after_y_);
        std::ranges::copy(after_z_, before_z(y - tile.y_begin));
      }
    }
  }

 private:
  static constexpr std::int64_t kHalo = 4;  ///< cells that a face looks at on either side

  Scalar* before_z(std::int64_t row) { return before_z_.data() + row * size_[0]; }

  std::int64_t place(std::int64_t y, std::int64_t z) const { return (z * size_[1] + y) * size_[0]; }

  void run_kernel(std::size_t axis, std::int64_t count, const std::array<const Scalar*, 8>& rho,
                  const Scalar* velocity, Scalar* flux) const {
    const auto per_velocity = static_cast<Scalar>(scheme_.step / scheme_.grid.spacing_mm[axis]);
    scheme_.kernel({count, rho, velocity, per_velocity, scheme_.epsilon, flux});
  }

  /// Across y or z.
  void make_flux(std::size_t axis, std::int64_t y, std::int64_t z, Scalar* flux) const {
    std::array<const Scalar*, 8> rho;
    for (std::size_t i = 0; i < rho.size(); ++i) {
      Size3 cell{0, y, z};
      cell[axis] = reflected(cell[axis] + static_cast<std::int64_t>(i) - kHalo, size_[axis]);
      rho[i] = stage_.from + place(cell[1], cell[2]);
    }
    run_kernel(axis, size_[0], rho, scheme_.velocities.row(axis, y, z), flux);
  }

  void make_flux_across_x(std::int64_t y, std::int64_t z) {
    const Scalar* row = stage_.from + place(y, z);
    std::copy_n(row, size_[0], padded_.data() + kHalo);
    for (std::int64_t beyond = 0; beyond < kHalo; ++beyond) {
      padded_[static_cast<std::size_t>(beyond)] = row[reflected(beyond - kHalo, size_[0])];
      padded_[static_cast<std::size_t>(size_[0] + kHalo + beyond)] =
          row[reflected(size_[0] + beyond, size_[0])];
    }
    std::array<const Scalar*, 8> rho;
    for (std::size_t i = 0; i < rho.size(); ++i) rho[i] = padded_.data() + i;
    run_kernel(0, size_[0] + 1, rho, scheme_.velocities.row(0, y, z), across_x_.data());
  }

  void move_row(std::int64_t y, std::int64_t z, const Scalar* before_z) const {
    const std::int64_t first = place(y, z);
    const Scalar *from = stage_.from + first, *kept = stage_.kept + first, share = stage_.share;
    const Scalar *across_x = across_x_.data(), *before_y = before_y_.data(), *after_y = after_y_.data(),
                 *after_z = after_z_.data();
    Scalar* to = stage_.to + first;
    for (std::int64_t x = 0; x < size_[0]; ++x) {
      const Scalar gain =
          (across_x[x] - across_x[x + 1]) + (before_y[x] - after_y[x]) + (before_z[x] - after_z[x]);
      to[x] = kept[x] + share * ((from[x] - kept[x]) + gain);
    }
  }

  Scheme<Scalar> scheme_;
  Stage<Scalar> stage_;
  Size3 size_;
  std::vector<Scalar> padded_, across_x_, before_y_, after_y_, before_z_, after_z_;
};

/// A plane of a tile with the eight planes it looks at fits the second-level cache.
TileShape cached_tile(const Size3& size) {
  constexpr std::int64_t kVoxelsOfPlane = 9000;
  return {.rows = std::clamp<std::int64_t>(kVoxelsOfPlane / size[0], 4, 64), .planes = 32};
}

template <class Scalar>
void run_stage(const Scheme<Scalar>& scheme, const Stage<Scalar>& stage, const Progress& report) {
  const TileShape shape = cached_tile(scheme.grid.size);
  oneapi::tbb::enumerable_thread_specific<Sweep<Scalar>> sweeps(scheme, stage, shape);
  for_each_tile(
      scheme.grid.size, shape, [&](const Tile& tile) { sweeps.local().run(tile); }, report);
}

/// The largest `value(begin, end)` of the chunks of [0, count).
double largest_of_chunks(std::int64_t count, std::int64_t grain,
                         const std::function<double(std::int64_t, std::int64_t)>& value,
                         const Progress& report) {
  std::vector<double> largest(static_cast<std::size_t>((count + grain - 1) / grain));
  parallel_for(
      count, grain,
      [&](std::int64_t begin, std::int64_t end) {
        largest[static_cast<std::size_t>(begin / grain)] = value(begin, end);
      },
      [&](double) { report(0); });
  return *std::ranges::max_element(largest);
}

template <class Scalar>
double intensity_range(std::span<const Scalar> rho, const Progress& report) {
  constexpr std::int64_t kChunk = 1 << 18;
  const auto largest = [&](double sign) {
    return largest_of_chunks(
        static_cast<std::int64_t>(rho.size()), kChunk,
        [&](std::int64_t begin, std::int64_t end) {
          double found = sign * double{rho[static_cast<std::size_t>(begin)]};
          for (std::int64_t i = begin; i < end; ++i)
            found = std::max(found, sign * double{rho[static_cast<std::size_t>(i)]});
          return found;
        },
        report);
  };
  return largest(1) + largest(-1);
}

template <class Scalar>
double rate_of_cell(const Grid& grid, const FaceVelocities<Scalar>& velocities, const Size3& cell) {
  double out = 0, in = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Size3 next = cell;
    ++next[axis];
    const double before = double{velocities.at(axis, cell)}, after = double{velocities.at(axis, next)};
    out += (std::max(after, 0.0) + std::max(-before, 0.0)) / grid.spacing_mm[axis];
    in += (std::max(before, 0.0) + std::max(-after, 0.0)) / grid.spacing_mm[axis];
  }
  return std::max(out, in);
}

}  // namespace

double largest_courant(Reconstruction reconstruction) {
  return reconstruction == Reconstruction::kPiecewiseConstant ? kRoundingMargin : 0.3;
}

template <class Scalar>
double largest_rate(const Grid& grid, const FaceVelocities<Scalar>& velocities, const Progress& report) {
  constexpr std::int64_t kRows = 8;
  const auto largest_of_rows = [&](std::int64_t begin, std::int64_t end) {
    double largest = 0;
    for (std::int64_t row = begin; row < end; ++row)
      for (std::int64_t x = 0; x < grid.size[0]; ++x)
        largest =
            std::max(largest, rate_of_cell(grid, velocities, {x, row % grid.size[1], row / grid.size[1]}));
    return largest;
  };
  return largest_of_chunks(grid.size[1] * grid.size[2], kRows, largest_of_rows, report);
}

template <class Scalar>
void advect(std::span<Scalar> rho, const Grid& grid, const FaceVelocities<Scalar>& velocities,
            double duration, Reconstruction reconstruction, const Progress& report) {
  const double steps =
      std::ceil(duration * largest_rate(grid, velocities, report) / largest_courant(reconstruction));
  if (steps == 0) return;
  const auto range = static_cast<Scalar>(intensity_range<Scalar>(rho, report));
  const Scheme<Scalar> scheme{grid, velocities,
                              flux_kernel<Scalar>(reconstruction, instruction_sets().back()),
                              duration / steps, weno_epsilon(range)};
  std::vector<Scalar> buffer(rho.size());
  Scalar *now = rho.data(), *next = buffer.data();
  for (double taken = 0; taken < steps; ++taken) {
    const Progress of_step = part_of(report, taken / steps, (taken + 1) / steps);
    if (reconstruction == Reconstruction::kPiecewiseConstant) {
      run_stage<Scalar>(scheme, {now, now, next, 1}, of_step);
      std::swap(now, next);
    } else {
      run_stage<Scalar>(scheme, {now, now, next, 1}, part_of(of_step, 0, 0.5));
      run_stage<Scalar>(scheme, {next, now, now, Scalar{0.5F}}, part_of(of_step, 0.5, 1));
    }
  }
  if (now != rho.data()) std::ranges::copy(buffer, rho.data());
}

template double largest_rate(const Grid& grid, const FaceVelocities<float>& velocities,
                             const Progress& report);
template double largest_rate(const Grid& grid, const FaceVelocities<double>& velocities,
                             const Progress& report);
template void advect(std::span<float> rho, const Grid& grid, const FaceVelocities<float>& velocities,
                     double duration, Reconstruction reconstruction, const Progress& report);
template void advect(std::span<double> rho, const Grid& grid, const FaceVelocities<double>& velocities,
                     double duration, Reconstruction reconstruction, const Progress& report);

}  // namespace volsmooth
