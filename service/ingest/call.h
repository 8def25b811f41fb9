#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>

#include "algorithms/formats/dicom/series.h"

namespace volsmooth {

/// What stands behind the descriptors that the daemon gives the child.
enum CallDescriptor : int {
  kUploadDescriptor = 0,   ///< the upload: a regular file, read only
  kAnswerDescriptor = 1,   ///< gets the answer, a JSON document
  kOutputDescriptor = 3,   ///< gets what the command makes; decode: a memory file for the voxels
  kOptionsDescriptor = 4,  ///< a JSON document with options and limits
  kInputDescriptor = 5,    ///< what the command needs beside the upload
};

/// One command on one upload.
struct IngestCall {
  std::span<const std::byte> upload;
  SeriesOptions series;
  nlohmann::json options;  ///< the whole document
};

/// The options document; throws std::exception when it is none.
nlohmann::json read_options();

/// Maps the upload; throws std::system_error.
IngestCall open_call(nlohmann::json options);

/// A refused upload as an answer.
nlohmann::json answer_of(const Refusal& refusal);

}  // namespace volsmooth
