#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>

#include "service/jobs/job.h"

namespace volsmooth {

/// What is held back on the disk for the results of a job.
struct ResultsSize {
  std::int64_t all = 0;
  /// Of `all`, what is one method's beside its surfaces: volumes that nothing compresses, its picture, its
  /// part of the report. These are bounds.
  std::int64_t beside_surfaces = 0;
};

/// What is held back for `order`, which runs so many methods and has so many surfaces of each. How many
/// vertices surfaces have is known when they are there: twice what a head has is counted on, and
/// ResultsTooLarge is for the rest.
ResultsSize held_for_results(const JobOrder& order, const VolumeFacts& volume, std::size_t methods,
                             std::size_t surfaces);

/// What a surface as a DICOM object takes at most. `output`: "dicom-stl", "dicom-obj",
/// "dicom-surface-segmentation".
std::int64_t most_bytes_of_dicom(const std::string& output, std::int64_t vertices, std::int64_t triangles);

/// Results would be longer than what is held back for them, with too little room beyond. Thrown before they
/// are written.
class ResultsTooLarge : public std::length_error {
 public:
  ResultsTooLarge(std::int64_t needed, std::int64_t held)
      : std::length_error("results beyond what is held back for them"), needed_bytes(needed), limit(held) {}
  std::int64_t needed_bytes, limit;
};

}  // namespace volsmooth
