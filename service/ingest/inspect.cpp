#include "service/ingest/commands.h"
#include "service/ingest/volume_answer.h"

namespace volsmooth {

nlohmann::json answer_inspect(const IngestCall& call) {
  const auto series = read_series(call.upload, call.series);
  if (!series) return answer_of(series.error());
  const auto nowhere = [](std::int64_t, std::span<const float>, std::span<const std::uint8_t>) {};
  const auto voxels = decode_series(*series, nowhere, call.second_half);
  if (!voxels) return answer_of(voxels.error());
  return volume_answer(*series, *voxels);
}

}  // namespace volsmooth
