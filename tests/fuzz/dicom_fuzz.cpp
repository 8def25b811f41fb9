// links: algorithms_dicom
//
// An upload of DICOM through all that volsmooth-ingest does with one: listed, verified, decoded, and made
// into every object that can be derived of it. What was derived must be read again.
#include <cstdlib>

#include "algorithms/formats/dicom/derived_series.h"
#include "algorithms/formats/dicom/encapsulated_mesh.h"
#include "algorithms/formats/dicom/instances.h"
#include "algorithms/formats/dicom/series_voxels.h"
#include "algorithms/formats/dicom/surface_segmentation.h"
#include "algorithms/formats/zip_writer.h"
#include "tests/fuzz/fuzz_target.h"

namespace volsmooth {
namespace {

using Bytes = std::span<const std::byte>;

/// Small enough that no input takes long.
constexpr ReadLimits kLimits{.max_voxels = 1 << 20, .max_axis_voxels = 4096, .free_inflated_bytes = 1 << 22};

void demand(bool holds) {
  if (!holds) std::abort();
}

std::vector<std::byte> derived_zip(const DicomSeries& series, std::span<const float> voxels) {
  std::vector<std::byte> archive;
  ZipWriter zip([&](Bytes bytes) { archive.insert(archive.end(), bytes.begin(), bytes.end()); });
  const auto take = [&zip](const std::string& name, Bytes file) {
    return [&zip, name, packed = pack(file)] { zip.add(name, packed); };
  };
  if (!write_derived_series(series, voxels, {}, take)) return {};
  zip.finish();
  return archive;
}

void derive_surfaces(const DicomSeries& series) {
  const std::array<std::byte, 84> mesh{};
  const std::array<float, 9> vectors{0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::array<std::uint32_t, 3> triangle{0, 1, 2};
  const SegmentSurface surface{"surface", vectors, vectors, triangle};
  (void)encapsulated_mesh(series, MeshEncoding::kStl, mesh, "mesh", {});
  (void)surface_segmentation(series, std::span(&surface, 1), {});
}

void read_and_derive(Bytes upload, const SeriesOptions& options) {
  const auto series = read_series(upload, options);
  if (!series) {
    if (series.error().slug == "dicom-nonuniform-spacing" && !options.resample_uniform)
      read_and_derive(upload, {.resample_uniform = true, .limits = kLimits});
    return;
  }
  std::vector<float> voxels;
  const auto take = [&](std::int64_t, std::span<const float> slice, std::span<const std::uint8_t> padding) {
    demand(padding.empty() || padding.size() == slice.size());
    voxels.insert(voxels.end(), slice.begin(), slice.end());
  };
  if (!decode_series(*series, take)) return;
  demand(std::ssize(voxels) == voxel_count(series->size));
  const auto archive = derived_zip(*series, voxels);
  if (!archive.empty()) {
    const auto again = read_series(archive, options);
    demand(again && again->size == series->size);
  }
  derive_surfaces(*series);
}

}  // namespace
}  // namespace volsmooth

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto upload = std::as_bytes(std::span(data, size));
  (void)volsmooth::read_instances(upload, volsmooth::kLimits);
  volsmooth::read_and_derive(upload, {.limits = volsmooth::kLimits});
  return 0;
}
