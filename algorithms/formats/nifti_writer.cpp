#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "algorithms/formats/gzip_writer.h"
#include "algorithms/formats/nifti.h"
#include "algorithms/formats/nifti_header.h"
#include "algorithms/formats/nifti_limits.h"
#include "algorithms/formats/voxel_type.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kBlockBytes = std::int64_t{512} << 10;
constexpr int kFloat32 = 16;
constexpr char kDescription[] = "volsmooth";

/// The header in front of the voxels, and how they are to be encoded.
struct OutputPlan {
  std::vector<std::byte> front;  ///< header and extension flags: all that comes before the voxels
  const VoxelType* type;
  Scaling scaling;
};

template <class Text>
void blank(Text& text) {
  std::ranges::fill(text, '\0');
}

/// One volume of the file's geometry; fields of free text and those that NIfTI took over unused from
/// ANALYZE 7.5 may hold patient data and are blanked.
template <class Header>
OutputPlan plan_output(const NiftiHeader& input, const Size3& size, OutputVoxelType voxel_type) {
  auto header = header_from<Header>(input.bytes);
  header.dim[0] = 3;
  std::fill(header.dim + 1, header.dim + 8, 1);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    header.dim[axis + 1] = static_cast<std::remove_reference_t<decltype(header.dim[0])>>(size[axis]);
  }
  std::fill(header.pixdim + 4, header.pixdim + 8, 0);
  header.vox_offset = static_cast<decltype(header.vox_offset)>(least_data_offset(Header::kVersion));
  blank(header.descrip);
  blank(header.aux_file);
  std::ranges::copy(kDescription, header.descrip);
  if constexpr (Header::kVersion == 1) {
    blank(header.data_type);
    blank(header.db_name);
    header.extents = header.glmax = header.glmin = 0;
    header.session_error = 0;
    header.regular = 0;
  } else {
    blank(header.unused_str);
  }
  if (voxel_type == OutputVoxelType::kFloat32) {
    header.datatype = kFloat32;
    header.bitpix = 32;
    header.scl_slope = 1;
    header.scl_inter = 0;
  }
  OutputPlan plan{bytes_of(header), find_voxel_type(header.datatype), {}};
  plan.front.resize(static_cast<std::size_t>(least_data_offset(Header::kVersion)));
  if (header.scl_slope != 0) plan.scaling = {header.scl_slope, header.scl_inter};
  return plan;
}

OutputPlan plan_output_for(const NiftiHeader& input, const Size3& size, OutputVoxelType voxel_type) {
  const auto plan = input.version == 1 ? plan_output<Nifti1Header>(input, size, voxel_type)
                                       : plan_output<Nifti2Header>(input, size, voxel_type);
  if (!plan.type) throw std::invalid_argument("the header was not verified");
  return plan;
}

}  // namespace

WriteOutcome write_nifti(const std::filesystem::path& file, const Volume& volume, const NiftiHeader& header,
                         OutputVoxelType voxel_type, const Progress& report) {
  const auto voxels = voxels_of(volume);
  const OutputPlan plan = plan_output_for(header, grid_of(volume).size, voxel_type);
  const auto front_bytes = static_cast<std::int64_t>(plan.front.size());
  const auto voxel_bytes = static_cast<std::int64_t>(plan.type->bytes);
  const std::int64_t size = front_bytes + static_cast<std::int64_t>(voxels.size()) * voxel_bytes;
  // kept for each block and added in order, so that the sum does not depend on the threads
  std::vector<EncodeLoss> losses(static_cast<std::size_t>((size + kBlockBytes - 1) / kBlockBytes));

  const auto make = [&](std::int64_t first, std::span<std::byte> block) {
    const auto front =
        std::span(plan.front).subspan(std::min(static_cast<std::size_t>(first), plan.front.size()));
    const auto copied =
        std::ranges::copy(front.first(std::min(front.size(), block.size())), block.begin()).out;
    const auto stored = std::span(copied, block.end());
    const auto first_voxel =
        static_cast<std::size_t>(std::max(first - front_bytes, std::int64_t{0}) / voxel_bytes);
    losses[static_cast<std::size_t>(first / kBlockBytes)] = plan.type->encode(
        voxels.subspan(first_voxel, stored.size() / plan.type->bytes), plan.scaling, stored);
  };
  write_gzip(file, size, kBlockBytes, make, report);

  const EncodeLoss loss = std::accumulate(losses.begin(), losses.end(), EncodeLoss{},
                                          [](EncodeLoss sum, const EncodeLoss& part) { return sum += part; });
  return {.rounding_rms = std::sqrt(loss.squared_error / static_cast<double>(voxels.size())),
          .clipped_voxels = loss.clipped};
}

}  // namespace volsmooth
