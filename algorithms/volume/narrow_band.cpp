#include "algorithms/volume/narrow_band.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>

#include "algorithms/numerics/metric.h"
#include "algorithms/numerics/reflection.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kRunsOfChunk = 64;

std::size_t chunk_count(std::int64_t runs) {
  return static_cast<std::size_t>((runs + kRunsOfChunk - 1) / kRunsOfChunk);
}

/// Calls `body(chunk, runs of the chunk)`; `report` hears of every one, but moves no progress.
void for_each_chunk(std::span<const CellRun> runs,
                    const std::function<void(std::size_t, std::span<const CellRun>)>& body,
                    const Progress& report) {
  parallel_for(
      std::ssize(runs), kRunsOfChunk,
      [&](std::int64_t begin, std::int64_t end) {
        body(static_cast<std::size_t>(begin / kRunsOfChunk),
             runs.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin)));
      },
      [&](double) { report(0); });
}

/// The sum of `value(run)`, in an order that does not depend on the number of threads.
double sum_over(std::span<const CellRun> runs, const std::function<double(const CellRun&)>& value) {
  std::vector<double> sums(chunk_count(std::ssize(runs)));
  for_each_chunk(
      runs,
      [&](std::size_t chunk, std::span<const CellRun> of_chunk) {
        for (const CellRun& run : of_chunk) sums[chunk] += value(run);
      },
      no_progress);
  double total = 0;
  for (const double sum : sums) total += sum;
  return total;
}

bool same_row(const CellRun& a, const CellRun& b) {
  return a.y == b.y && a.z == b.z;
}

struct Before {
  bool operator()(const CellRun& a, const CellRun& b) const {
    return std::tie(a.z, a.y, a.x_begin) < std::tie(b.z, b.y, b.x_begin);
  }
};
constexpr Before before;

/// Adds a run that does not begin before the last one; the two become one where they touch.
void append(std::vector<CellRun>& runs, const CellRun& run) {
  if (!runs.empty() && same_row(runs.back(), run) && run.x_begin <= runs.back().x_end)
    runs.back().x_end = std::max(runs.back().x_end, run.x_end);
  else
    runs.push_back(run);
}

/// Which of its two ends a cell is away from.
constexpr unsigned kNotAtZero = 1, kNotAtOne = 2, kAtNeither = 3;

unsigned state_of(float density, float epsilon) {
  return (density > epsilon ? kNotAtZero : 0) | (density < 1 - epsilon ? kNotAtOne : 0);
}

/// The indices up to `radius` beside [begin, end) on an axis of `size` cells.
struct Reach {
  std::int64_t begin, end;
};

Reach reach(std::int64_t begin, std::int64_t end, std::int64_t radius, std::int64_t size) {
  return {std::max(begin - radius, std::int64_t{0}), std::min(end + radius, size)};
}

}  // namespace

NarrowBand::NarrowBand(std::span<float> density, const Size3& size, const BandLimits& limits,
                       const Progress& report)
    : density_(density), size_(size), limits_(limits) {
  std::vector<CellRun> rows;
  for (std::int64_t z = 0; z < size[2]; ++z)
    for (std::int64_t y = 0; y < size[1]; ++y) rows.push_back({y, z, 0, size[0]});
  follow(rows, report);
}

void NarrowBand::assign(std::span<const float> values, const Progress& report) {
  const std::vector<CellRun> changed = changes_of(values, report);
  if (!changed.empty()) follow(around(changed), report);
}

std::vector<float> NarrowBand::densities() const {
  std::vector<float> values(static_cast<std::size_t>(cell_count()));
  for_each_chunk(
      runs_,
      [&](std::size_t, std::span<const CellRun> runs) {
        for (const CellRun& run : runs)
          std::copy_n(row(run.y, run.z) + run.x_begin, run.count(), values.data() + run.first);
      },
      no_progress);
  return values;
}

void NarrowBand::exchange(std::span<float> values) {
  for_each_chunk(
      runs_,
      [&](std::size_t, std::span<const CellRun> runs) {
        for (const CellRun& run : runs)
          std::swap_ranges(values.data() + run.first, values.data() + run.first + run.count(),
                           cells_of_row(run.y, run.z) + run.x_begin);
      },
      no_progress);
}

/// Puts `values` in place. Returns, of each run, all between the first and the last cell whose state is new.
std::vector<CellRun> NarrowBand::changes_of(std::span<const float> values, const Progress& report) {
  const float epsilon = limits_.epsilon;
  std::vector<std::vector<CellRun>> of_chunks(chunk_count(std::ssize(runs_)));
  const auto assign_run = [&](const CellRun& run, std::vector<CellRun>& changed) {
    float* cells = cells_of_row(run.y, run.z);
    const float* value = values.data() + run.first - run.x_begin;
    const auto is_new = [&](std::int64_t x) {
      return state_of(cells[x], epsilon) ^ state_of(value[x], epsilon);
    };
    unsigned any = 0;
    for (std::int64_t x = run.x_begin; x < run.x_end; ++x) any |= is_new(x);
    if (any != 0) {
      CellRun part = run;
      while (is_new(part.x_begin) == 0) ++part.x_begin;
      while (is_new(part.x_end - 1) == 0) --part.x_end;
      changed.push_back(part);
    }
    std::copy(value + run.x_begin, value + run.x_end, cells + run.x_begin);
  };
  for_each_chunk(
      runs_,
      [&](std::size_t chunk, std::span<const CellRun> runs) {
        for (const CellRun& run : runs) assign_run(run, of_chunks[chunk]);
      },
      report);
  std::vector<CellRun> all;
  for (const auto& changed : of_chunks) all.insert(all.end(), changed.begin(), changed.end());
  return all;
}

/// The cells that see one of `changed`.
std::vector<CellRun> NarrowBand::around(std::span<const CellRun> changed) const {
  std::vector<CellRun> seeing;
  for (const CellRun& run : changed) {
    const Reach x = reach(run.x_begin, run.x_end, limits_.radius, size_[0]),
                y = reach(run.y, run.y + 1, limits_.radius, size_[1]),
                z = reach(run.z, run.z + 1, limits_.radius, size_[2]);
    for (std::int64_t at_z = z.begin; at_z < z.end; ++at_z)
      for (std::int64_t at_y = y.begin; at_y < y.end; ++at_y) seeing.push_back({at_y, at_z, x.begin, x.end});
  }
  std::ranges::sort(seeing, before);
  std::vector<CellRun> windows;
  for (const CellRun& run : seeing) append(windows, run);
  return windows;
}

/// Decides anew which cells of `windows` are in the band.
void NarrowBand::follow(std::span<const CellRun> windows, const Progress& report) {
  std::vector<std::vector<CellRun>> found(chunk_count(std::ssize(windows)));
  for_each_chunk(
      windows,
      [&](std::size_t chunk, std::span<const CellRun> of_chunk) {
        std::vector<std::uint8_t> scratch;
        for (const CellRun& window : of_chunk) find_runs(window, scratch, found[chunk]);
      },
      report);
  std::vector<double> settled(found.size());
  for_each_chunk(
      windows,
      [&](std::size_t chunk, std::span<const CellRun> of_chunk) {
        for (const CellRun& window : of_chunk) settled[chunk] += settle(window, found[chunk]);
      },
      report);
  for (const double sum : settled) settled_ += sum;
  replace(windows, found);
}

void NarrowBand::find_runs(const CellRun& window, std::vector<std::uint8_t>& scratch,
                           std::vector<CellRun>& found) const {
  const Reach x = reach(window.x_begin, window.x_end, limits_.radius, size_[0]),
              y = reach(window.y, window.y + 1, limits_.radius, size_[1]),
              z = reach(window.z, window.z + 1, limits_.radius, size_[2]);
  const float epsilon = limits_.epsilon;
  const std::int64_t count = x.end - x.begin;
  scratch.assign(static_cast<std::size_t>(count), 0);
  std::uint8_t* seen = scratch.data();
  for (std::int64_t at_z = z.begin; at_z < z.end; ++at_z)
    for (std::int64_t at_y = y.begin; at_y < y.end; ++at_y) {
      const float* cells = row(at_y, at_z) + x.begin;
      for (std::int64_t n = 0; n < count; ++n)
        seen[n] = static_cast<std::uint8_t>(seen[n] | state_of(cells[n], epsilon));
    }
  for (std::int64_t at_x = window.x_begin; at_x < window.x_end; ++at_x) {
    const Reach box = reach(at_x, at_x + 1, limits_.radius, size_[0]);
    unsigned state = 0;
    for (std::int64_t near = box.begin; near < box.end; ++near) state |= seen[near - x.begin];
    if (state == kAtNeither) append(found, {window.y, window.z, at_x, at_x + 1});
  }
}

/// Sets the cells of `window` that are not among `found` to 0 or 1. Returns what that took from them.
double NarrowBand::settle(const CellRun& window, std::span<const CellRun> found) {
  float* cells = cells_of_row(window.y, window.z);
  double taken = 0;
  const auto settle_cells = [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t x = begin; x < end; ++x) {
      const float settled = cells[x] < 0.5F ? 0.0F : 1.0F;
      taken += double{cells[x]} - settled;
      cells[x] = settled;
    }
  };
  std::int64_t x = window.x_begin;
  for (auto run = std::ranges::lower_bound(found, window, before);
       run != found.end() && same_row(*run, window) && run->x_begin < window.x_end; ++run) {
    settle_cells(x, run->x_begin);
    x = run->x_end;
  }
  settle_cells(x, window.x_end);
  return taken;
}

/// `found` takes the place of what the band had in `windows`.
void NarrowBand::replace(std::span<const CellRun> windows, const std::vector<std::vector<CellRun>>& found) {
  std::vector<CellRun> all_found;
  for (const auto& runs : found) all_found.insert(all_found.end(), runs.begin(), runs.end());
  runs_.swap(last_runs_);
  runs_.clear();
  auto next = all_found.begin();
  const auto keep = [&](const CellRun& run) {
    while (next != all_found.end() && before(*next, run)) append(runs_, *next++);
    append(runs_, run);
  };
  auto window = windows.begin();
  for (CellRun run : last_runs_) {
    while (window != windows.end() &&
           (same_row(*window, run) ? window->x_end <= run.x_begin : before(*window, run)))
      ++window;
    for (auto cut = window; cut != windows.end() && same_row(*cut, run) && cut->x_begin < run.x_end; ++cut) {
      if (run.x_begin < cut->x_begin) keep({run.y, run.z, run.x_begin, cut->x_begin});
      run.x_begin = std::min(cut->x_end, run.x_end);
    }
    if (run.count() > 0) keep(run);
  }
  while (next != all_found.end()) append(runs_, *next++);
  std::int64_t cells = 0;
  for (CellRun& run : runs_) {
    run.first = cells;
    cells += run.count();
  }
}

double average_width(const NarrowBand& band) {
  const Size3& size = band.size();
  const double area = sum_over(band.runs(), [&](const CellRun& run) {
    const float *here = band.row(run.y, run.z), *south = band.row(reflected(run.y - 1, size[1]), run.z),
                *north = band.row(reflected(run.y + 1, size[1]), run.z),
                *below = band.row(run.y, reflected(run.z - 1, size[2])),
                *above = band.row(run.y, reflected(run.z + 1, size[2]));
    double sum = 0;
    for (std::int64_t x = run.x_begin; x < run.x_end; ++x) {
      const float left = here[std::max(x - 1, std::int64_t{0})], right = here[std::min(x + 1, size[0] - 1)];
      sum += 0.5 * std::sqrt(square_of<double>(
                       {double{right} - left, double{north[x]} - south[x], double{above[x]} - below[x]}));
    }
    return sum;
  });
  return area > 0 ? static_cast<double>(band.cell_count()) / area : 0;
}

}  // namespace volsmooth
