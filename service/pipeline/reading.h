#pragma once

#include <cstdint>
#include <filesystem>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/formats/nifti.h"
#include "service/jobs/job.h"
#include "service/pipeline/pipeline.h"
#include "service/process/descriptor.h"

namespace volsmooth {

/// Voxels of the input that nothing was measured at. While a method works they hold the lowest valid
/// intensity.
class Padding {
 public:
  Padding() = default;
  /// `bits`: one for each voxel, the lowest of a byte first; `intensities`: those of the padded voxels, in
  /// order.
  Padding(std::vector<std::uint8_t> bits, std::vector<float> intensities);

  /// Puts the input's intensities into the padded voxels and keeps what was there: twice changes nothing.
  void exchange(Volume& volume);

 private:
  std::vector<std::uint8_t> bits_;
  std::vector<float> intensities_;
};

struct InputVolume {
  VolumeDescription description;  ///< of any format; its header is the one that NIfTI output gets
  Volume::Pointer volume;
  Padding padding = {};
};

/// Verifies an uploaded file without holding its voxels, and reads it; its content says of what format it is.
/// `kept`: where the voxels of DICOM pass through, if that memory is to be used again.
tl::expected<VolumeDescription, Problem> describe_volume(const std::filesystem::path& file,
                                                         const UploadOptions& options,
                                                         const PipelineLimits& limits,
                                                         const Progress& report);
tl::expected<InputVolume, Problem> read_volume(const std::filesystem::path& file, const StoredVolume& stored,
                                               const PipelineLimits& limits, const Progress& report,
                                               const Descriptor* kept = nullptr);

}  // namespace volsmooth
