#include "algorithms/flows/band_sweep.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "algorithms/flows/plane_ring.h"
#include "algorithms/numerics/reflection.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kVector = PlaneRing::kVector;

/// In whole vectors, where that does not read beyond `end`: lengths that are known cost no call.
void copy_cells(const float* from, std::int64_t count, const float* end, float* to) {
  if (end - from < PlaneRing::padded(count)) {
    std::copy_n(from, count, to);
    return;
  }
  for (std::int64_t x = 0; x < count; x += kVector) std::memcpy(to + x, from + x, kVector * sizeof(float));
}

/// `reflected`, which divides, only where it has to be.
std::int64_t mirrored(std::int64_t index, std::int64_t size) {
  return index >= 0 && index < size ? index : reflected(index, size);
}

/// One thread's rows, filled again and again.
class Packing {
 public:
  Packing(const NarrowBand& band, std::int64_t radius, const std::vector<std::span<float>>& outputs)
      : band_(band), radius_(radius), side_(2 * radius + 1), outputs_(outputs) {}

  void run(std::span<const CellRun> runs, const std::function<void(const PackedRow&)>& body) {
    while (!runs.empty()) {
      const auto packed = runs.first(how_many(runs));
      make_room();
      pack(runs, packed.size());
      body({PlaneRing::padded(length_), rows_.data(), out_.data()});
      unpack(packed);
      runs = runs.subspan(packed.size());
    }
  }

 private:
  /// The first runs that, with their rows, fit the first-level cache; one at least.
  std::size_t how_many(std::span<const CellRun> runs) {
    constexpr std::int64_t kFloats = 4800;
    std::size_t n = 0;
    length_ = 0;
    do {
      length_ += runs[n++].count() + 2 * radius_;
    } while (n < runs.size() && (length_ + runs[n].count()) * side_ * side_ <= kFloats);
    return n;
  }

  void pack(std::span<const CellRun> runs, std::size_t count) {
    constexpr std::size_t kAhead = 6;
    const Size3& size = band_.size();
    std::int64_t at = 0;
    for (std::size_t n = 0; n < count; ++n) {
      const CellRun& run = runs[n];
      if (n + kAhead < runs.size()) fetch(runs[n + kAhead]);
      float* to = floats_.data() + at;
      for (std::int64_t dz = -radius_; dz <= radius_; ++dz) {
        const std::int64_t z = mirrored(run.z + dz, size[2]);
        for (std::int64_t dy = -radius_; dy <= radius_; ++dy, to += stride_)
          pack_row(run, band_.row(mirrored(run.y + dy, size[1]), z), to);
      }
      at += run.count() + 2 * radius_;
    }
  }

  /// Of the rows that a run needs, all but the last are in cache from the runs before; a run is too short for
  /// the processor to see what comes next.
  void fetch(const CellRun& run) const {
    constexpr std::int64_t kCacheLine = 16, kMost = 4;
    const Size3& size = band_.size();
    const float* row = band_.row(mirrored(run.y + radius_, size[1]), mirrored(run.z + radius_, size[2]));
    for (std::int64_t x = 0; x < std::min(run.count() + kCacheLine, kMost * kCacheLine); x += kCacheLine)
      __builtin_prefetch(row + std::min(run.x_begin + x, size[0] - 1));
  }

  void make_room() {
    // Copies of whole vectors and a last row's end reach beyond.
    const std::int64_t needed = PlaneRing::padded(length_ + 2 * radius_) + kVector;
    if (needed <= stride_) return;
    stride_ = needed;
    floats_.assign(static_cast<std::size_t>(side_ * side_ * stride_), 0.0F);
    out_.resize(outputs_.size() * static_cast<std::size_t>(stride_));
    rows_.clear();
    for (std::int64_t row = 0; row < side_ * side_; ++row)
      rows_.push_back(floats_.data() + row * stride_ + radius_);
  }

  void pack_row(const CellRun& run, const float* row, float* to) const {
    const std::int64_t size = band_.size()[0];
    const float* end = band_.density().data() + band_.density().size();
    if (run.x_begin >= radius_ && run.x_end + radius_ <= size) {
      copy_cells(row + run.x_begin - radius_, run.count() + 2 * radius_, end, to);
      return;
    }
    copy_cells(row + run.x_begin, run.count(), end, to + radius_);
    for (std::int64_t x = 0; x < radius_; ++x) {
      to[x] = row[reflected(run.x_begin - radius_ + x, size)];
      to[radius_ + run.count() + x] = row[reflected(run.x_end + x, size)];
    }
  }

  void unpack(std::span<const CellRun> runs) const {
    const float* from_first = out_.data();
    for (const std::span<float> output : outputs_) {
      const float* from = from_first;
      for (const CellRun& run : runs) {
        std::copy_n(from, run.count(), output.data() + run.first);
        from += run.count() + 2 * radius_;
      }
      from_first += PlaneRing::padded(length_);
    }
  }

  const NarrowBand& band_;
  std::int64_t radius_, side_, stride_ = 0, length_ = 0;
  const std::vector<std::span<float>>& outputs_;
  std::vector<float> floats_, out_;
  std::vector<const float*> rows_;
};

}  // namespace

void for_each_packed_row(const NarrowBand& band, std::int64_t radius,
                         const std::vector<std::span<float>>& outputs,
                         const std::function<void(const PackedRow&)>& body, const Progress& report) {
  constexpr std::int64_t kRunsOfChunk = 256;
  oneapi::tbb::enumerable_thread_specific<Packing> packings(band, radius, outputs);
  parallel_for(
      std::ssize(band.runs()), kRunsOfChunk,
      [&](std::int64_t begin, std::int64_t end) {
        packings.local().run(
            band.runs().subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin)),
            body);
      },
      report);
}

}  // namespace volsmooth
