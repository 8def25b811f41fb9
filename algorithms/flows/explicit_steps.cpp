#include "algorithms/flows/explicit_steps.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "algorithms/volume/large_pages.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kChunk = 1 << 18;

/// A pass over all voxels that moves no progress but can be cancelled.
void for_each_chunk(std::span<float> voxels, const std::function<void(std::span<float>)>& body,
                    const Progress& report, double fraction) {
  parallel_for(
      static_cast<std::int64_t>(voxels.size()), kChunk,
      [&](std::int64_t begin, std::int64_t end) {
        body(voxels.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin)));
      },
      [&](double) { report(fraction); });
}

/// By their bits, whose order is that of the magnitudes: maxima of integers are vectorised.
float largest_magnitude(std::span<float> voxels, const Progress& report) {
  std::vector<std::int32_t> largest(voxels.size() / kChunk + 1, 0);
  for_each_chunk(
      voxels,
      [&](std::span<float> chunk) {
        std::int32_t found = 0;
        for (const float value : chunk) found = std::max(found, std::bit_cast<std::int32_t>(std::abs(value)));
        largest[static_cast<std::size_t>(chunk.data() - voxels.data()) / kChunk] = found;
      },
      report, 0);
  return std::bit_cast<float>(*std::ranges::max_element(largest));
}

/// The power of two to multiply a volume with so that squares of its differences neither overflow nor vanish
/// in float. 1 for all but absurd units. Every flow commutes with it, to the last bit.
float safe_scale(float largest) {
  constexpr float kLeast = 0x1p-20F, kMost = 0x1p60F;
  if (largest == 0 || (largest >= kLeast && largest <= kMost)) return 1;
  return std::ldexp(1.0F, std::clamp(-std::ilogb(largest), -126, 126));
}

void scale(std::span<float> voxels, float factor, const Progress& report, double fraction) {
  if (factor == 1) return;
  for_each_chunk(
      voxels,
      [&](std::span<float> chunk) {
        for (float& value : chunk) value *= factor;
      },
      report, fraction);
}

void take_plain_steps(Volume& volume, std::int64_t steps, const ExplicitStep& step, const Progress& report) {
  const std::size_t count = voxels_of(volume).size();
  Buffer next = buffer_of(count);
  for (std::int64_t taken = 0; taken < steps; ++taken) {
    const auto begin = static_cast<double>(taken), all = static_cast<double>(steps);
    step(voxels_of(volume), {next->GetBufferPointer(), count},
         part_of(report, begin / all, (begin + 1) / all));
    Buffer last = volume.GetPixelContainer();
    volume.SetPixelContainer(next);
    next = last;
  }
}

}  // namespace

Buffer buffer_of(std::size_t count) {
  auto buffer = Volume::PixelContainer::New();
  buffer->Reserve(count);
  ask_for_large_pages(std::as_bytes(std::span(buffer->GetBufferPointer(), count)));
  return buffer;
}

void scaled_safely(Volume& volume, const Progress& report, const std::function<void()>& body) {
  const float factor = safe_scale(largest_magnitude(voxels_of(volume), report));
  scale(voxels_of(volume), factor, report, 0);
  body();
  scale(voxels_of(volume), 1 / factor, report, 1);
}

void take_steps(Volume& volume, std::int64_t steps, const ExplicitStep& step, const Progress& report) {
  scaled_safely(volume, report, [&] { take_plain_steps(volume, steps, step, report); });
}

}  // namespace volsmooth
