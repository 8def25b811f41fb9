#pragma once

#include <span>
#include <string_view>

#include "service/ingest/call.h"

namespace volsmooth {

/// What the child can be told to do; each gives its answer.
struct IngestCommand {
  std::string_view name;
  nlohmann::json (*run)(const IngestCall& call);
};

std::span<const IngestCommand> ingest_commands();

/// What came to a preset: {"instances": [...]} with the UIDs and the place of each.
nlohmann::json answer_instances(const IngestCall& call);

/// Verifies the whole upload: {"volume": ...} or {"refusal": ...}.
nlohmann::json answer_inspect(const IngestCall& call);

/// The same, and the voxels into the output: float32, x fastest, padding at the lowest valid intensity; where
/// there is padding, then a bit for each voxel, lowest first, that tells it, and the intensity of each padded
/// voxel in order, float32.
nlohmann::json answer_decode(const IngestCall& call);

/// Makes a DICOM object, or a zip of a series, of the upload and of the input; the options' member "derive"
/// says which:
/// {"made": ...} or {"refusal": ...}.
nlohmann::json answer_derive(const IngestCall& call);

}  // namespace volsmooth
