#include <algorithm>
#include <cmath>

#include "algorithms/formats/nifti.h"
#include "algorithms/formats/nifti_affine.h"
#include "algorithms/formats/nifti_extensions.h"
#include "algorithms/formats/nifti_layout.h"
#include "algorithms/formats/voxel_statistics.h"
#include "algorithms/formats/voxel_warnings.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kChunkBytes = std::int64_t{256} << 10;  // stays in the second-level cache

/// Says where the voxels [first, first + count) of a volume go.
using Destination = std::function<std::span<float>(std::int64_t first, std::int64_t count)>;

/// Called once the header is verified and before the first voxel is decoded.
using MakeDestination = std::function<Destination(const NiftiLayout&)>;

Refusal truncated() {
  return {"nifti-truncated-data", "The file ends before the last of the voxels that its header declares."};
}

Refusal trailing() {
  return {"nifti-trailing-data", "Bytes follow the voxels that the header declares."};
}

/// The length of a file that is not compressed is known before anything is allocated, and for gzip a bound.
std::optional<Refusal> check_length(const ByteSource& source, const NiftiLayout& layout) {
  constexpr std::int64_t kMostInflation = 1032;  // of deflate: 258 bytes from two bits
  const std::int64_t declared = layout.volumes * layout.volume_bytes;
  if (source.is_gzip()) {
    return declared / kMostInflation > source.file_size() ? std::optional(truncated()) : std::nullopt;
  }
  const std::int64_t payload = source.file_size() - layout.data_offset;
  if (payload < declared) return truncated();
  if (payload > declared) return trailing();
  return std::nullopt;
}

std::optional<Refusal> pass_volumes(ByteSource& source, std::int64_t bytes,
                                    const std::function<void()>& tell) {
  const auto skipped = source.skip(bytes, tell);
  if (!skipped) return skipped.error();
  if (*skipped < bytes) return truncated();
  return std::nullopt;
}

std::optional<Refusal> check_end(ByteSource& source) {
  std::byte surplus;
  const auto got = source.read({&surplus, 1});
  if (!got) return got.error();
  if (*got > 0) return trailing();
  return std::nullopt;
}

std::optional<Refusal> check_values(const DecodeCounts& counts, const ReadOptions& options) {
  if (counts.overflowing > 0) {
    return Refusal{"nifti-bad-scaling",
                   "Voxels, or voxels after scaling, are beyond the range of float32.",
                   {{"voxels", static_cast<double>(counts.overflowing)}}};
  }
  if (counts.non_finite > 0 && !options.non_finite) {
    return Refusal{"non-finite-voxels",
                   std::to_string(counts.non_finite) +
                       " voxels are NaN or infinite. Say by non_finite=VALUE what takes their place.",
                   {{"voxels", static_cast<double>(counts.non_finite)}}};
  }
  return std::nullopt;
}

/// Decodes the wanted volume chunk by chunk, `non_finite` in place of what is NaN or infinite.
std::optional<Refusal> decode_volume(ByteSource& source, const ParsedHeader& parsed,
                                     const NiftiLayout& layout, const ReadOptions& options,
                                     const Destination& destination, const std::function<void()>& tell,
                                     DecodeCounts& counts, VoxelStatistics& statistics) {
  const auto voxel_bytes = static_cast<std::int64_t>(layout.type->bytes);
  const std::int64_t count = voxel_count(layout.size), chunk = kChunkBytes / voxel_bytes;
  std::vector<std::byte> stored(static_cast<std::size_t>(std::min(count, chunk) * voxel_bytes));
  for (std::int64_t first = 0; first < count; first += chunk) {
    const std::int64_t part = std::min(chunk, count - first);
    const auto bytes = std::span(stored).first(static_cast<std::size_t>(part * voxel_bytes));
    const auto got = source.read(bytes);
    if (!got) return got.error();
    if (*got < bytes.size()) return truncated();
    const auto intensities = destination(first, part);
    const DecodeCounts met = layout.type->decode(bytes, parsed.swapped, layout.scaling, intensities);
    counts += met;
    if (met.non_finite + met.overflowing > 0) {
      std::ranges::replace_if(
          intensities, [](float value) { return !std::isfinite(value); }, options.non_finite.value_or(0));
    }
    statistics.add(intensities);
    tell();
  }
  return std::nullopt;
}

std::optional<float> padding_value(const DecodeCounts& counts, const VoxelStatistics& statistics,
                                   const ReadOptions& options) {
  if (counts.non_finite > 0) return options.non_finite;
  return looks_padded(statistics) ? std::optional(statistics.minimum()) : std::nullopt;
}

VolumeDescription describe(ParsedHeader parsed, const NiftiLayout& layout, const VoxelStatistics& statistics,
                           std::vector<std::string> warnings) {
  VolumeDescription description;
  description.format = "nifti-" + std::to_string(parsed.fields.version);
  description.size = layout.size;
  description.spacing_mm = spacing_of(layout.map);
  description.map = layout.map;
  description.voxel_type = layout.type->name;
  description.intensity_min = statistics.minimum();
  description.intensity_max = statistics.maximum();
  description.distinct_values = statistics.distinct();
  description.warnings = std::move(warnings);
  description.header = std::move(parsed.header);
  return description;
}

tl::expected<VolumeDescription, Refusal> read_through(const std::filesystem::path& file,
                                                      const ReadOptions& options, const Progress& report,
                                                      const MakeDestination& make_destination) {
  ByteSource source(file, options.limits);
  const auto tell = [&] { report(source.fraction_read()); };
  auto parsed = read_header(source);
  if (!parsed) return tl::unexpected(parsed.error());
  const auto layout = check_layout(parsed->fields, options);
  if (!layout) return tl::unexpected(layout.error());

  std::vector<std::string> warnings;
  warn_of_geometry(parsed->fields, warnings);
  std::optional<Refusal> refusal = pass_extensions(source, *parsed, *layout, warnings);
  if (!refusal) refusal = check_length(source, *layout);
  if (!refusal) refusal = pass_volumes(source, layout->wanted * layout->volume_bytes, tell);
  DecodeCounts counts;
  VoxelStatistics statistics;
  if (!refusal) {
    refusal =
        decode_volume(source, *parsed, *layout, options, make_destination(*layout), tell, counts, statistics);
  }
  const std::int64_t volumes_after = layout->volumes - 1 - layout->wanted;
  if (!refusal) refusal = pass_volumes(source, volumes_after * layout->volume_bytes, tell);
  if (!refusal) refusal = check_end(source);
  if (!refusal) refusal = check_values(counts, options);
  if (refusal) return tl::unexpected(*std::move(refusal));
  warn_of_voxels(*layout->type, counts, statistics, warnings);
  auto description = describe(*std::move(parsed), *layout, statistics, std::move(warnings));
  description.padding_value = padding_value(counts, statistics, options);
  return description;
}

}  // namespace

tl::expected<VolumeDescription, Refusal> inspect_nifti(const std::filesystem::path& file,
                                                       const ReadOptions& options, const Progress& report) {
  std::vector<float> scratch;
  const auto nowhere = [&](const NiftiLayout&) -> Destination {
    return [&](std::int64_t, std::int64_t count) {
      scratch.resize(static_cast<std::size_t>(count));
      return std::span(scratch);
    };
  };
  return read_through(file, options, report, nowhere);
}

tl::expected<LoadedVolume, Refusal> read_nifti(const std::filesystem::path& file, const ReadOptions& options,
                                               const Progress& report) {
  Volume::Pointer volume;
  const auto into_volume = [&](const NiftiLayout& layout) -> Destination {
    volume = make_volume(layout.size, layout.map);
    return [voxels = voxels_of(*volume)](std::int64_t first, std::int64_t count) {
      return voxels.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(count));
    };
  };
  auto description = read_through(file, options, report, into_volume);
  if (!description) return tl::unexpected(description.error());
  return LoadedVolume{*std::move(description), volume};
}

}  // namespace volsmooth
