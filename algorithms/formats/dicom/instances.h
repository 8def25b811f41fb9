#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/formats/read_limits.h"
#include "algorithms/formats/refusal.h"

namespace volsmooth {

/// Which instance a Part 10 file in an upload is, and where it lies there.
struct InstanceIdentity {
  std::string sop_class_uid, sop_instance_uid, study_uid, series_uid;
  std::int64_t offset = 0, bytes = 0;
};

/// The instances of a multipart body of Part 10 files, or of one such file, in their order; every file is
/// walked whole. Refusals: those of `WalkedFile`, multipart-corrupt, dicom-no-images (a part that is no DICOM
/// file), unsupported-format (a zip), dicom-missing-attribute, dicom-bad-attribute (a UID that is none).
tl::expected<std::vector<InstanceIdentity>, Refusal> read_instances(std::span<const std::byte> upload,
                                                                    const ReadLimits& limits);

}  // namespace volsmooth
