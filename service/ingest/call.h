#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>

#include "algorithms/formats/dicom/series.h"

namespace volsmooth {

/// What stands behind the descriptors that the daemon gives the child.
enum CallDescriptor : int {
  kUploadDescriptor = 0,    ///< the upload: a regular file, read only
  kAnswerDescriptor = 1,    ///< gets the answer, a JSON document
  kOutputDescriptor = 3,    ///< gets what the command makes; decode: a memory file for the voxels
  kOptionsDescriptor = 4,   ///< a JSON document with options and limits
  kInputDescriptor = 5,     ///< what the command needs beside the upload
  kProgressDescriptor = 6,  ///< gets how far it is, over and over at its beginning: a double from 0 to 1
};

/// One command on one upload.
struct IngestCall {
  std::span<const std::byte> upload;
  SeriesOptions series;    ///< to read it is half of the way
  Execution second_half;   ///< of what is done with it
  nlohmann::json options;  ///< the whole document
};

/// The options document; throws std::exception when it is none.
nlohmann::json read_options();

/// Maps the upload; throws std::system_error.
IngestCall open_call(nlohmann::json options);

/// Appends to what the command makes; throws std::system_error.
void write_output(std::span<const std::byte> bytes);

/// A refused upload as an answer.
nlohmann::json answer_of(const Refusal& refusal);

}  // namespace volsmooth
