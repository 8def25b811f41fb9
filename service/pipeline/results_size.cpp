#include "service/pipeline/results_size.h"

#include <algorithm>
#include <cmath>

#include "algorithms/formats/mesh_writers.h"
#include "algorithms/formats/voxel_type.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {
namespace {

/// Of results and of originals, in volumes of up to 256^3 voxels; beyond, a surface grows with the area. A
/// head (ch2 of mricron, 7 million voxels) has 0.05 to 0.11 after a flow of 1 mm^2 and 0.07 to 0.14 before;
/// a tenth of the range of noise makes 0.65 of an original, and nothing has more than 1.5 but a pattern.
constexpr double kOfResult = 0.2, kOfOriginal = 0.5;

std::int64_t vertices_in(double voxels, double per_voxel) {
  return static_cast<std::int64_t>(std::ceil(per_voxel * voxels * std::min(1.0, 256 / std::cbrt(voxels))));
}

double bytes_of_voxel(const std::string& voxel_type) {
  const VoxelType* type = find_voxel_type(voxel_type);
  return type == nullptr ? sizeof(float) : static_cast<double>(type->bytes);
}

std::int64_t most_bytes_of_mesh(const std::string& name, std::int64_t vertices, std::int64_t triangles) {
  const MeshFormat* format = find_mesh_format(name);
  return format == nullptr ? 0 : format->most_bytes(vertices, triangles);
}

bool has_output(const JobOrder& order, std::string_view output) {
  return std::ranges::count(order.outputs, output) > 0;
}

}  // namespace

std::int64_t most_bytes_of_dicom(const std::string& output, std::int64_t vertices, std::int64_t triangles) {
  constexpr std::int64_t kHead = 1 << 16;  // what is said of the patient, and references to the originals
  if (output == "dicom-stl") return kHead + most_bytes_of_mesh("stl", vertices, triangles);
  if (output == "dicom-obj") return kHead + most_bytes_of_mesh("obj", vertices, triangles);
  return kHead + most_bytes_of_mesh("glb", vertices, triangles);  // the same three arrays
}

ResultsSize held_for_results(const JobOrder& order, const VolumeFacts& volume, std::size_t methods,
                             std::size_t surfaces) {
  constexpr double kSlack = 1.02;
  constexpr std::int64_t kPictureAndReport = 8 << 20;
  const auto voxels = static_cast<double>(voxel_count(volume.size));
  const double stored = order.voxel_type == "float32" ? 4 : bytes_of_voxel(volume.voxel_type);
  const double bytes_per_voxel =
      (has_output(order, "nifti") ? stored : 0) + (has_output(order, "dicom-series") ? 4 : 0);

  const auto in_mesh_files = [&](std::int64_t vertices) {
    std::int64_t bytes = 0;
    for (const std::string& format : order.mesh_formats)
      bytes += most_bytes_of_mesh(format, vertices, 2 * vertices);
    return bytes;
  };
  const std::int64_t of_result = vertices_in(voxels, kOfResult);
  std::int64_t surface = in_mesh_files(of_result);
  for (const char* output : {"dicom-stl", "dicom-obj", "dicom-surface-segmentation"})
    if (has_output(order, output)) surface += most_bytes_of_dicom(output, of_result, 2 * of_result);
  // Of several methods' original there are mesh files as well.
  const std::int64_t original = methods > 1 ? in_mesh_files(vertices_in(voxels, kOfOriginal)) : 0;

  ResultsSize held;
  held.beside_surfaces =
      static_cast<std::int64_t>(std::ceil(kSlack * bytes_per_voxel * voxels)) + kPictureAndReport;
  held.all = static_cast<std::int64_t>(methods) *
                 (held.beside_surfaces + static_cast<std::int64_t>(surfaces) * surface) +
             static_cast<std::int64_t>(surfaces) * original;
  return held;
}

}  // namespace volsmooth
