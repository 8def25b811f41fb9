#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "service/jobs/pacs.h"

namespace volsmooth {

/// Calls `body` with each DICOM instance of a result file of ours, a zip of Part 10 files or one such file,
/// and its bytes. Throws std::runtime_error when the file is not what we wrote.
void for_each_instance(const std::filesystem::path& file,
                       const std::function<void(const DicomInstance&, std::span<const std::byte>)>& body);

/// The SOP class and instance that a Part 10 file's meta information names (PS3.10, 7.1).
DicomInstance instance_of(std::span<const std::byte> part10);

}  // namespace volsmooth
