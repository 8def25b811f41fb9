#include <algorithm>
#include <cmath>
#include <numeric>
#include <type_traits>

#include "algorithms/formats/gzip_writer.h"
#include "algorithms/formats/nifti.h"
#include "algorithms/formats/nifti_header.h"
#include "algorithms/formats/nifti_limits.h"
#include "algorithms/formats/voxel_type.h"

namespace volsmooth {
namespace {

/// Longer than a header, and no voxel lies across two blocks: headers are multiples of the widest voxel.
constexpr std::int64_t kBlockBytes = std::int64_t{512} << 10;

/// All that comes before the voxels, and how they are encoded.
struct OutputPlan {
  std::vector<std::byte> front;  ///< header and extension flags
  const VoxelType* type;
  Scaling scaling;
};

template <class Header>
void set_size(Header& header, const Size3& size) {
  using Dimension = std::remove_reference_t<decltype(*header.dim)>;
  std::ranges::fill(header.dim, Dimension{1});
  header.dim[0] = 3;
  std::ranges::transform(size, header.dim + 1,
                         [](std::int64_t voxels) { return static_cast<Dimension>(voxels); });
}

template <class... Text>
void blank(Text&... texts) {
  (std::ranges::fill(texts, '\0'), ...);
}

/// Free text, and fields of ANALYZE 7.5 that NIfTI leaves unused, may hold patient data.
template <class Header>
void replace_text(Header& header) {
  blank(header.descrip, header.aux_file);
  std::ranges::copy("volsmooth", header.descrip);
  if constexpr (Header::kVersion == 1) {
    blank(header.data_type, header.db_name);
    header.extents = header.glmax = header.glmin = 0;
    header.session_error = 0;
    header.regular = 0;
  } else {
    blank(header.unused_str);
  }
}

template <class Header>
void set_float32(Header& header) {
  header.datatype = 16;
  header.bitpix = 32;
  header.scl_slope = 1;
  header.scl_inter = 0;
}

template <class Header>
OutputPlan plan_output(const NiftiHeader& input, const Size3& size, OutputVoxelType voxel_type) {
  constexpr std::int64_t kVoxelsBegin = least_data_offset(Header::kVersion);
  auto header = header_from<Header>(input.bytes);
  set_size(header, size);
  replace_text(header);
  header.vox_offset = kVoxelsBegin;
  if (voxel_type == OutputVoxelType::kFloat32) set_float32(header);
  OutputPlan plan{bytes_of(header), find_voxel_type(header.datatype), {}};
  plan.front.resize(kVoxelsBegin);  // four flags of 0: no extensions
  if (header.scl_slope != 0) plan.scaling = {header.scl_slope, header.scl_inter};
  return plan;
}

}  // namespace

WriteOutcome write_nifti(const std::filesystem::path& file, const Volume& volume, const NiftiHeader& header,
                         OutputVoxelType voxel_type, const Progress& report) {
  const auto voxels = voxels_of(volume);
  const auto plan_of_version = header.version == 1 ? plan_output<Nifti1Header> : plan_output<Nifti2Header>;
  const OutputPlan plan = plan_of_version(header, grid_of(volume).size, voxel_type);
  const auto front_bytes = static_cast<std::int64_t>(plan.front.size());
  const auto voxel_bytes = static_cast<std::int64_t>(plan.type->bytes);
  const std::int64_t size = front_bytes + static_cast<std::int64_t>(voxels.size()) * voxel_bytes;
  // kept for each block and added in order, so that the sum does not depend on the threads
  std::vector<EncodeLoss> losses(static_cast<std::size_t>((size + kBlockBytes - 1) / kBlockBytes));

  const auto make = [&](std::int64_t first, std::span<std::byte> block) {
    std::span<std::byte> stored = block;
    if (first == 0) {
      std::ranges::copy(plan.front, block.begin());
      stored = block.subspan(plan.front.size());
    }
    const std::int64_t first_voxel = (first == 0 ? 0 : first - front_bytes) / voxel_bytes;
    const auto given =
        voxels.subspan(static_cast<std::size_t>(first_voxel), stored.size() / plan.type->bytes);
    losses[static_cast<std::size_t>(first / kBlockBytes)] = plan.type->encode(given, plan.scaling, stored);
  };
  write_gzip(file, size, kBlockBytes, make, report);

  const EncodeLoss loss = std::accumulate(losses.begin(), losses.end(), EncodeLoss{},
                                          [](EncodeLoss sum, const EncodeLoss& part) { return sum += part; });
  return {.rounding_rms = std::sqrt(loss.squared_error / static_cast<double>(voxels.size())),
          .clipped_voxels = loss.clipped};
}

}  // namespace volsmooth
