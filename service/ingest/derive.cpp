#include <sys/mman.h>
#include <unistd.h>

#include <charconv>
#include <stdexcept>

#include "algorithms/formats/dicom/derived_series.h"
#include "algorithms/formats/dicom/encapsulated_mesh.h"
#include "algorithms/formats/dicom/surface_segmentation.h"
#include "algorithms/formats/zip_writer.h"
#include "service/ingest/commands.h"
#include "service/process/check.h"

namespace volsmooth {
namespace {

using Json = nlohmann::json;
using Bytes = std::span<const std::byte>;
using Made = tl::expected<Json, Refusal>;

/// What the command needs beside the upload.
Bytes map_input() {
  const off_t end = ::lseek(kInputDescriptor, 0, SEEK_END);
  check(end >= 0, "the size of the input");
  const auto size = static_cast<std::size_t>(end);
  if (size == 0) return {};
  void* mapped = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, kInputDescriptor, 0);
  check(mapped != MAP_FAILED, "mapping the input");
  return {static_cast<const std::byte*>(mapped), size};
}

UidSeed seed_from(const std::string& hexadecimal) {
  UidSeed seed{};
  if (hexadecimal.size() != 2 * seed.size()) throw std::invalid_argument("a seed of another length");
  for (std::size_t i = 0; i < seed.size(); ++i)
    std::from_chars(hexadecimal.data() + 2 * i, hexadecimal.data() + 2 * i + 2, seed[i], 16);
  return seed;
}

Derivation derivation_from(const Json& options) {
  Derivation derivation;
  options.at("description").get_to(derivation.description);
  options.at("series_description").get_to(derivation.series_description);
  derivation.code = derivation_code(options.at("method").get<std::string>());
  options.at("series_number").get_to(derivation.series_number);
  options.at("instance_number").get_to(derivation.instance_number);
  derivation.series_seed = seed_from(options.at("series_seed").get<std::string>());
  derivation.instance_seed = seed_from(options.at("instance_seed").get<std::string>());
  options.at("date").get_to(derivation.date);
  options.at("time").get_to(derivation.time);
  options.at("software_version").get_to(derivation.software_version);
  return derivation;
}

/// `count` numbers off the front of the input.
template <class T>
std::span<const T> take(Bytes& input, std::size_t count) {
  const auto taken = input.first(count * sizeof(T));
  input = input.subspan(count * sizeof(T));
  return {reinterpret_cast<const T*>(taken.data()), count};
}

/// The input: float32 intensities, x fastest. The output: a zip.
Made derive_series(const DicomSeries& series, const Derivation& derivation, const Json&,
                   const Execution& execution) {
  Bytes input = map_input();
  const auto voxels = static_cast<std::size_t>(voxel_count(series.size));
  if (input.size() != voxels * sizeof(float)) throw std::invalid_argument("voxels of another volume");
  ZipWriter zip(write_output);
  const auto pack_up = [&zip](const std::string& name, Bytes file) {
    return [&zip, name, packed = pack(file)] { zip.add(name, packed); };
  };
  const auto made = write_derived_series(series, take<float>(input, voxels), derivation, pack_up, execution);
  if (!made) return tl::unexpected(made.error());
  zip.finish();
  return Json{{"clipped_voxels", made->clipped_voxels}};
}

/// The input and the output: a file.
template <MeshEncoding encoding>
Made derive_mesh(const DicomSeries& series, const Derivation& derivation, const Json& options,
                 const Execution&) {
  const auto object =
      encapsulated_mesh(series, encoding, map_input(), options.at("title").get<std::string>(), derivation);
  if (!object) return tl::unexpected(object.error());
  write_output(*object);
  return Json::object();
}

/// The input: of every surface positions and normals as float32, then vertex numbers as uint32.
Made derive_segmentation(const DicomSeries& series, const Derivation& derivation, const Json& options,
                         const Execution&) {
  Bytes input = map_input();
  std::vector<SegmentSurface> surfaces;
  for (const Json& surface : options.at("surfaces")) {
    const auto vertices = surface.at("vertices").get<std::size_t>();
    const auto triangles = surface.at("triangles").get<std::size_t>();
    const auto positions = take<float>(input, 3 * vertices), normals = take<float>(input, 3 * vertices);
    surfaces.push_back({surface.at("label").get<std::string>(), positions, normals,
                        take<std::uint32_t>(input, 3 * triangles)});
  }
  const auto object = surface_segmentation(series, surfaces, derivation);
  if (!object) return tl::unexpected(object.error());
  write_output(*object);
  return Json::object();
}

struct Product {
  std::string_view name;
  Made (*make)(const DicomSeries& series, const Derivation& derivation, const Json& options,
               const Execution& execution);
};

constexpr Product kProducts[] = {{"dicom-series", derive_series},
                                 {"dicom-stl", derive_mesh<MeshEncoding::kStl>},
                                 {"dicom-obj", derive_mesh<MeshEncoding::kObj>},
                                 {"dicom-surface-segmentation", derive_segmentation}};

}  // namespace

nlohmann::json answer_derive(const IngestCall& call) {
  const Json& options = call.options.at("derive");
  const auto output = options.at("output").get<std::string>();
  for (const Product& product : kProducts) {
    if (product.name != output) continue;
    const auto series = read_series(call.upload, call.series);
    if (!series) return answer_of(series.error());
    const auto made = product.make(*series, derivation_from(options), options, call.second_half);
    return made ? Json{{"made", *made}} : answer_of(made.error());
  }
  throw std::invalid_argument("no such output");
}

}  // namespace volsmooth
