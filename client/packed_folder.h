#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "client/descriptor.h"
#include "client/failure.h"

namespace volsmooth {

/// The files of a folder as one body, ready to be sent.
struct PackedFolder {
  Descriptor body;  ///< a file without a name, at its beginning
  std::int64_t bytes = 0;
  std::string content_type;
};

/// Packs all regular files in a folder and its subfolders into a multipart/related body of application/dicom
/// parts, as STOW-RS has it: names are not sent. Failures: kNoInput for a folder without files or one that
/// cannot be read, kCannotWrite when there is no room in $TMPDIR or /tmp.
Expected<PackedFolder> pack_folder(const std::filesystem::path& folder);

}  // namespace volsmooth
