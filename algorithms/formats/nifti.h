#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/formats/read_limits.h"
#include "algorithms/formats/refusal.h"
#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

struct ReadOptions {
  std::optional<std::int64_t> volume_index = {};  ///< which volume of a 4-D file, from 0
  std::optional<float> non_finite = {};           ///< takes the place of NaN and infinite voxels
  ReadLimits limits = {};
};

/// A NIfTI header whose every field that matters was checked, in native byte order, as it will be written
/// again.
struct NiftiHeader {
  int version = 1;               ///< 1 or 2
  std::vector<std::byte> bytes;  ///< 348 or 540, native byte order, of the input file
};

/// What a verified file holds; everything but the voxels.
struct VolumeDescription {
  std::string format;  ///< "nifti-1" or "nifti-2"
  Size3 size{};
  Vector3 spacing_mm{};
  VoxelToWorld map;        ///< in mm and the format's own frame (RAS)
  std::string voxel_type;  ///< "uint8", "int16", ..., "float64"
  double intensity_min = 0;
  double intensity_max = 0;
  std::int64_t distinct_values = 0;  ///< counted up to 256; 257 means more
  /// Intensity of voxels that nothing was measured at: what took the place of non-finite ones, or the minimum
  /// where padding-values is warned of.
  std::optional<float> padding_value = {};
  std::vector<std::string> warnings;
  NiftiHeader header;
};

struct LoadedVolume {
  VolumeDescription description;
  Volume::Pointer volume;
};

/// Verifies a whole NIfTI-1 or NIfTI-2 file (.nii or .nii.gz, told apart by content) without holding its
/// voxels: memory stays below a few MB for any file.
tl::expected<VolumeDescription, Refusal> inspect_nifti(const std::filesystem::path& file,
                                                       const ReadOptions& options,
                                                       const Progress& report = no_progress);

/// The same checks, and the voxels in intensity units (scl_slope and scl_inter applied in double).
tl::expected<LoadedVolume, Refusal> read_nifti(const std::filesystem::path& file, const ReadOptions& options,
                                               const Progress& report = no_progress);

enum class OutputVoxelType { kSame, kFloat32 };

struct WriteOutcome {
  double rounding_rms = 0;          ///< RMS over voxels of written minus given intensity
  std::int64_t clipped_voxels = 0;  ///< outside what the voxel type can hold
};

/// Writes `volume` as .nii.gz under the header of the file it came from: affine, units, cal and intent bit
/// for bit, same voxel type and scaling (round half to even) or float32; descriptive text replaced by ours,
/// extensions dropped. Throws std::system_error when the file cannot be written.
WriteOutcome write_nifti(const std::filesystem::path& file, const Volume& volume, const NiftiHeader& header,
                         OutputVoxelType voxel_type, const Progress& report = no_progress);

}  // namespace volsmooth
