#include "service/pipeline/reading.h"

#include <algorithm>
#include <utility>

#include "service/pipeline/dicom_reading.h"

namespace volsmooth {
namespace {

ReadOptions read_options(const UploadOptions& options, const PipelineLimits& limits) {
  ReadOptions result;
  result.volume_index = options.volume_index;
  if (options.non_finite) result.non_finite = static_cast<float>(*options.non_finite);
  result.limits.max_voxels = limits.max_voxels;
  return result;
}

Problem problem_from(const Refusal& refusal) {
  Problem problem{refusal.slug, refusal.detail};
  for (const auto& [name, number] : refusal.numbers) problem.members[name] = number;
  return problem;
}

/// Options that a format does not have are refused, lest someone believe that they did something.
tl::expected<void, Problem> check_options(bool is_dicom, const UploadOptions& options) {
  const auto refuse_option = [](const char* name, const char* why) {
    return tl::unexpected(
        Problem{"bad-query", std::string("'") + name + "' is for " + why, {{"parameter", name}}});
  };
  if (is_dicom && options.volume_index)
    return refuse_option("volume_index", "4-D NIfTI files; this is DICOM.");
  if (is_dicom && options.non_finite)
    return refuse_option("non_finite", "NIfTI files; DICOM holds integers.");
  if (!is_dicom && !options.series.empty()) return refuse_option("series", "DICOM; this is no DICOM file.");
  if (!is_dicom && !options.resample.empty())
    return refuse_option("resample", "DICOM; this is no DICOM file.");
  return {};
}

}  // namespace

Padding::Padding(std::vector<std::uint8_t> bits, std::vector<float> intensities)
    : bits_(std::move(bits)), intensities_(std::move(intensities)) {}

void Padding::exchange(Volume& volume) {
  const std::span<float> voxels = voxels_of(volume);
  auto next = intensities_.begin();
  for (std::size_t byte = 0; byte < bits_.size(); ++byte) {
    if (bits_[byte] == 0) continue;
    for (std::size_t bit = 0; bit < 8; ++bit)
      if ((bits_[byte] >> bit & 1) != 0) std::swap(voxels[8 * byte + bit], *next++);
  }
}

tl::expected<VolumeDescription, Problem> describe_volume(const std::filesystem::path& file,
                                                         const UploadOptions& options,
                                                         const PipelineLimits& limits,
                                                         const Progress& report) {
  const bool is_dicom = is_dicom_upload(file);
  if (const auto checked = check_options(is_dicom, options); !checked) return tl::unexpected(checked.error());
  if (is_dicom) return describe_dicom(file, options, limits, report);
  return inspect_nifti(file, read_options(options, limits), report).map_error(problem_from);
}

tl::expected<InputVolume, Problem> read_volume(const std::filesystem::path& file, const StoredVolume& stored,
                                               const PipelineLimits& limits, const Progress& report,
                                               const Descriptor* kept) {
  if (is_dicom_upload(file)) return read_dicom(file, stored, limits, report, kept);
  return read_nifti(file, read_options(stored.options, limits), report)
      .map([](LoadedVolume&& loaded) {
        return InputVolume{std::move(loaded.description), loaded.volume};
      })
      .map_error(problem_from);
}

}  // namespace volsmooth
