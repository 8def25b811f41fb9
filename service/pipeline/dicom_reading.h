#pragma once

#include <nlohmann/json.hpp>

#include "service/pipeline/reading.h"
#include "service/process/descriptor.h"

namespace volsmooth {

/// Whether the content of a file is an upload of DICOM: a zip, a multipart body or a Part 10 file.
bool is_dicom_upload(const std::filesystem::path& file);

/// Options of a call of volsmooth-ingest for an upload; `voxels`: how many it will write, 0 for none.
nlohmann::json ingest_options(const UploadOptions& options, const PipelineLimits& limits,
                              std::int64_t upload_bytes, std::int64_t voxels);

/// As `describe_volume` and `read_volume`, by volsmooth-ingest. `kept`: an empty memory file that the voxels
/// are decoded to and that keeps their memory.
tl::expected<VolumeDescription, Problem> describe_dicom(const std::filesystem::path& file,
                                                        const UploadOptions& options,
                                                        const PipelineLimits& limits, const Progress& report);
tl::expected<InputVolume, Problem> read_dicom(const std::filesystem::path& file, const StoredVolume& stored,
                                              const PipelineLimits& limits, const Progress& report,
                                              const Descriptor* kept = nullptr);

/// Which instances a body of DICOM files holds, by volsmooth-ingest.
tl::expected<std::vector<ArrivedInstance>, Problem> list_instances(const std::filesystem::path& file,
                                                                   const PipelineLimits& limits,
                                                                   const Progress& report);

}  // namespace volsmooth
