#include "service/pipeline/dicom_results.h"

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <system_error>
#include <variant>

#include "algorithms/formats/mesh_writers.h"
#include "service/pipeline/dicom_reading.h"
#include "service/pipeline/ingest_child.h"
#include "service/process/check.h"
#include "service/process/write_all.h"

namespace volsmooth {
namespace {

using Json = nlohmann::json;

constexpr int kFirstSeriesNumber = 9001;  ///< behind those that devices give
constexpr std::int64_t kSpareBytes = std::int64_t{256} << 20;

std::string random_seed() {
  std::array<unsigned char, 16> bytes{};
  check(::getrandom(bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()), "random numbers");
  std::string seed;
  for (const unsigned char byte : bytes) {
    std::array<char, 3> digits{};
    std::snprintf(digits.data(), digits.size(), "%02x", byte);
    seed += digits.data();
  }
  return seed;
}

std::string now_as(const char* format) {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  std::array<char, 16> text{};
  std::strftime(text.data(), text.size(), format, &parts);
  return text.data();
}

/// "mean-curvature-flow: flow_time_mm2 1, steps 5, ..."
std::string described(const std::string& method, const ParameterValues& parameters) {
  std::string text = method;
  const char* separator = ": ";
  for (const auto& [name, value] : parameters) {
    text += separator + name + " " + std::visit([](const auto& held) { return Json(held).dump(); }, value);
    separator = ", ";
  }
  return text.substr(0, 1024);
}

template <class Range>
void append(const Descriptor& file, const Range& values) {
  write_all(file.get(), std::as_bytes(std::span(values)), "the input for volsmooth-ingest");
}

std::int64_t size_of(int descriptor) {
  struct stat status {};
  check(::fstat(descriptor, &status) == 0, "the size of a file");
  return status.st_size;
}

std::vector<Float3> in_lps(std::vector<Float3> vectors, Frame frame) {
  if (frame == Frame::kLps) return vectors;
  for (Float3& vector : vectors)
    for (const std::size_t axis : {0, 1}) vector[axis] = -vector[axis];
  return vectors;
}

Mesh in_lps(Mesh mesh) {
  mesh.positions = in_lps(std::move(mesh.positions), mesh.frame);
  mesh.normals = in_lps(std::move(mesh.normals), mesh.frame);
  mesh.frame = Frame::kLps;
  return mesh;
}

std::string label_of(const Mesh& mesh) {
  return "isosurface " + isovalue_text(mesh.isovalue);
}

}  // namespace

const Descriptor& DicomResults::voxel_memory() {
  if (!voxels_) voxels_ = memory_file("voxels");
  return voxels_;
}

void DicomResults::begin_method(const std::string& method, const ParameterValues& parameters) {
  method_ = method;
  description_ = described(method, parameters);
  mesh_series_seed_.clear();
  meshes_ = 0;
}

std::int64_t DicomResults::write_series(const std::filesystem::path& file, const Volume& volume,
                                        const Progress& report) {
  ++series_;
  const Descriptor& input = voxel_memory();
  const auto voxels = voxels_of(volume);
  check(::ftruncate(input.get(), static_cast<off_t>(voxels.size_bytes())) == 0 &&
            ::lseek(input.get(), 0, SEEK_SET) == 0,
        "the input for volsmooth-ingest");
  append(input, voxels);
  const Json options = begin_object("dicom-series", random_seed());
  return derive(file, options, input.get(), report).at("clipped_voxels").get<std::int64_t>();
}

void DicomResults::write_mesh(const std::filesystem::path& file, const std::string& format, const Mesh& mesh,
                              const Progress& report) {
  if (mesh_series_seed_.empty()) {  // all meshes of a method are one series
    mesh_series_seed_ = random_seed();
    mesh_series_ = ++series_;
  }
  const Descriptor input = memory_file("mesh");
  const Mesh turned = in_lps(mesh);
  find_mesh_format(format)->write("/proc/self/fd/" + std::to_string(input.get()), std::span(&turned, 1),
                                  no_progress);
  Json options = begin_object("dicom-" + format, mesh_series_seed_);
  options["series_number"] = kFirstSeriesNumber - 1 + mesh_series_;
  options["instance_number"] = ++meshes_;
  options["title"] = label_of(mesh) + ", " + method_;
  derive(file, options, input.get(), report);
}

void DicomResults::write_segmentation(const std::filesystem::path& file, std::span<const Mesh> meshes,
                                      const Progress& report) {
  ++series_;
  const Descriptor input = memory_file("surfaces");
  Json options = begin_object("dicom-surface-segmentation", random_seed());
  options["surfaces"] = Json::array();
  for (const Mesh& mesh : meshes) {
    const Mesh turned = in_lps(mesh);
    append(input, turned.positions);
    append(input, turned.normals);
    append(input, turned.triangles);
    options["surfaces"].push_back({{"label", label_of(mesh)},
                                   {"vertices", mesh.positions.size()},
                                   {"triangles", mesh.triangles.size()}});
  }
  derive(file, options, input.get(), report);
}

Json DicomResults::begin_object(const std::string& output, const std::string& series_seed) {
  return {{"output", output},
          {"method", method_},
          {"description", description_},
          {"series_description", method_},
          {"series_number", kFirstSeriesNumber - 1 + series_},
          {"instance_number", 1},
          {"series_seed", series_seed},
          {"instance_seed", random_seed()},
          {"date", now_as("%Y%m%d")},
          {"time", now_as("%H%M%S")},
          {"software_version", VOLSMOOTH_VERSION}};
}

Json DicomResults::derive(const std::filesystem::path& file, const Json& options, int input,
                          const Progress& report) {
  const Descriptor upload(::open(task_.volume_file.c_str(), O_RDONLY | O_CLOEXEC));
  check(static_cast<bool>(upload), "cannot open the input file");
  const Descriptor output(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  check(static_cast<bool>(output), "cannot create a file");
  IngestOrder order{.command = "derive", .upload = upload.get(), .output = output.get(), .input = input};
  const std::int64_t voxels = voxel_count(task_.volume.facts.size), given = size_of(input);
  order.options = ingest_options(task_.volume.options, limits_, size_of(upload.get()), voxels);
  order.options["derive"] = options;
  // The input is mapped, and held in the object up to three times while that grows.
  for (const char* const limit : {"address_space_bytes", "output_bytes"})
    order.options[limit] = order.options[limit].get<std::int64_t>() + 4 * given + kSpareBytes;
  order.patience = patience_for(order.options);
  const auto program = limits_.ingest_program.empty() ? ingest_beside_this_program() : limits_.ingest_program;
  const auto answer = run_ingest(program, order, report);
  if (!answer) throw DeriveRefused{answer.error()};
  return answer->at("made");
}

}  // namespace volsmooth
