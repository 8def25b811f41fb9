#include "algorithms/flows/intensity_range.h"

#include <algorithm>
#include <vector>

#include "algorithms/volume/parallel.h"

namespace volsmooth {

IntensityEnds intensity_ends(std::span<const float> voxels, const Progress& report) {
  constexpr std::int64_t kChunk = 1 << 18;
  using Ends = std::ranges::min_max_result<float>;
  std::vector<Ends> of_chunks((voxels.size() - 1) / kChunk + 1);
  parallel_for(
      static_cast<std::int64_t>(voxels.size()), kChunk,
      [&](std::int64_t begin, std::int64_t end) {
        of_chunks[static_cast<std::size_t>(begin / kChunk)] = std::ranges::minmax(
            voxels.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin)));
      },
      [&](double) { report(0); });
  return {std::ranges::min(of_chunks, {}, &Ends::min).min, std::ranges::max(of_chunks, {}, &Ends::max).max};
}

float intensity_range(std::span<const float> voxels, const Progress& report) {
  const auto [lowest, highest] = intensity_ends(voxels, report);
  return highest - lowest;
}

}  // namespace volsmooth
