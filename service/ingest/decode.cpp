#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>

#include "service/ingest/commands.h"
#include "service/ingest/volume_answer.h"
#include "service/process/check.h"

namespace volsmooth {
namespace {

/// Which voxels are padding, and their intensities.
struct Padding {
  std::vector<std::uint8_t> bits;
  std::vector<float> intensities;

  void mark(std::size_t voxel, float intensity) {
    bits[voxel / 8] |= static_cast<std::uint8_t>(1U << voxel % 8);
    intensities.push_back(intensity);
  }
};

/// Puts `intensity` into the padded ones of the voxels that were written.
void fill(const Padding& padding, std::size_t voxels, float intensity) {
  void* mapped =
      ::mmap(nullptr, voxels * sizeof(float), PROT_READ | PROT_WRITE, MAP_SHARED, kOutputDescriptor, 0);
  check(mapped != MAP_FAILED, "mapping the voxels");
  float* const written = static_cast<float*>(mapped);
  for (std::size_t byte = 0; byte < padding.bits.size(); ++byte) {
    if (padding.bits[byte] == 0) continue;
    for (std::size_t bit = 0; bit < 8; ++bit)
      if ((padding.bits[byte] >> bit & 1) != 0) written[8 * byte + bit] = intensity;
  }
}

}  // namespace

nlohmann::json answer_decode(const IngestCall& call) {
  const auto series = read_series(call.upload, call.series);
  if (!series) return answer_of(series.error());
  const auto voxels = static_cast<std::size_t>(voxel_count(series->size));
  Padding padding{std::vector<std::uint8_t>((voxels + 7) / 8), {}};
  const auto take = [&](std::int64_t slice, std::span<const float> intensities,
                        std::span<const std::uint8_t> padded) {
    write_output(std::as_bytes(intensities));
    const std::size_t first = static_cast<std::size_t>(slice) * intensities.size();
    for (std::size_t i = 0; i < padded.size(); ++i)
      if (padded[i] != 0) padding.mark(first + i, intensities[i]);
  };
  const auto facts = decode_series(*series, take, call.second_half);
  if (!facts) return answer_of(facts.error());
  if (facts->padded_voxels > 0) {
    fill(padding, voxels, static_cast<float>(facts->intensity_min));
    write_output(std::as_bytes(std::span(padding.bits)));
    write_output(std::as_bytes(std::span(padding.intensities)));
  }
  return volume_answer(*series, *facts);
}

}  // namespace volsmooth
