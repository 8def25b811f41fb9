#include "service/pipeline/dicom_reading.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

#include "algorithms/formats/dicom_upload.h"
#include "algorithms/formats/nifti_header_for.h"
#include "algorithms/volume/parallel.h"
#include "service/pipeline/ingest_child.h"
#include "service/process/check.h"

namespace volsmooth {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kMiB = std::int64_t{1} << 20;
constexpr int kMostThreads = 8;  ///< of a child: slices are handed over one by one
constexpr std::int64_t kStackBytes = 16 * kMiB;

Descriptor open_upload(const std::filesystem::path& file) {
  Descriptor upload(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  check(static_cast<bool>(upload), "cannot open the input file");
  return upload;
}

std::int64_t size_of(const Descriptor& file) {
  struct stat status {};
  check(::fstat(file.get(), &status) == 0, "cannot see the size of the input file");
  return status.st_size;
}

std::filesystem::path program_of(const PipelineLimits& limits) {
  return limits.ingest_program.empty() ? ingest_beside_this_program() : limits.ingest_program;
}

/// Runs `command` on an upload; `output` may be none.
tl::expected<Json, Problem> ask(const char* command, const Descriptor& upload, int output,
                                std::int64_t voxels, const UploadOptions& options,
                                const PipelineLimits& limits, const Progress& report) {
  IngestOrder order{.command = command, .upload = upload.get(), .output = output};
  order.options = ingest_options(options, limits, size_of(upload), voxels);
  order.patience = patience_for(order.options);
  return run_ingest(program_of(limits), order, report);
}

VolumeDescription description_from(const Json& volume) {
  VolumeDescription description;
  description.format = "dicom";
  volume.at("size").get_to(description.size);
  description.map.frame = Frame::kLps;
  for (std::size_t row = 0; row < 3; ++row) {
    const auto four = volume.at("affine").at(row).get<std::array<double, 4>>();
    std::ranges::copy_n(four.begin(), 3, description.map.linear[row].begin());
    description.map.origin[row] = four[3];
  }
  description.spacing_mm = spacing_of(description.map);
  volume.at("voxel_type").get_to(description.voxel_type);
  volume.at("intensity_min").get_to(description.intensity_min);
  volume.at("intensity_max").get_to(description.intensity_max);
  volume.at("warnings").get_to(description.warnings);
  if (volume.contains("unmarked_padding"))
    description.padding_value = volume["unmarked_padding"].get<float>();
  description.header =
      nifti_header_for(description.size, description.map, description.voxel_type,
                       {volume.at("slope").get<double>(), volume.at("intercept").get<double>()});
  return description;
}

/// Reads a memory file from front to back.
class MemoryReader {
 public:
  /// `spend`: gives back its memory on the way, so that no byte is held twice.
  MemoryReader(const Descriptor& file, bool spend) : file_(file), spend_(spend) {}

  void read(std::span<std::byte> out, const Progress& report) {
    constexpr std::size_t kChunk = 16 * kMiB;
    for (std::size_t done = 0; done < out.size();) {
      const auto part = out.subspan(done, std::min(kChunk, out.size() - done));
      const ssize_t got = ::pread(file_.get(), part.data(), part.size(), at_);
      check(got > 0, "the decoded voxels");
      if (spend_) ::fallocate(file_.get(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, at_, got);
      at_ += got;
      done += static_cast<std::size_t>(got);
      report(static_cast<double>(done) / static_cast<double>(out.size()));
    }
  }

 private:
  const Descriptor& file_;
  const bool spend_;
  off_t at_ = 0;
};

template <class T>
std::vector<T> read_values(MemoryReader& reader, std::size_t count) {
  std::vector<T> values(count);
  reader.read(std::as_writable_bytes(std::span(values)), no_progress);
  return values;
}

}  // namespace

bool is_dicom_upload(const std::filesystem::path& file) {
  std::array<std::byte, 256> head;
  const ssize_t got = ::pread(open_upload(file).get(), head.data(), head.size(), 0);
  check(got >= 0, "cannot read the input file");
  return looks_like_dicom_upload(std::span(head).first(static_cast<std::size_t>(got)));
}

Json ingest_options(const UploadOptions& options, const PipelineLimits& limits, std::int64_t upload_bytes,
                    std::int64_t voxels) {
  // The upload is mapped; what is unpacked of it is held file by file, while it grows in two copies.
  const std::int64_t unpacked = std::min(400 * upload_bytes + 256 * kMiB, 4 * limits.max_voxels + 64 * kMiB);
  const std::int64_t written = 9 * voxels;
  std::int64_t held = 3 * unpacked + 2 * written;
  if (limits.max_memory_bytes > 0) held = std::min(held, limits.max_memory_bytes);
  const int threads = std::min(thread_count(), kMostThreads);
  return {{"series", options.series},
          {"resample", options.resample},
          {"max_voxels", limits.max_voxels},
          {"threads", threads},
          {"address_space_bytes", 1024 * kMiB + upload_bytes + held + threads * kStackBytes},
          {"output_bytes", written + 64 * kMiB},
          {"cpu_seconds", 60 + upload_bytes / kMiB}};
}

tl::expected<VolumeDescription, Problem> describe_dicom(const std::filesystem::path& file,
                                                        const UploadOptions& options,
                                                        const PipelineLimits& limits,
                                                        const Progress& report) {
  return ask("inspect", open_upload(file), -1, 0, options, limits, report).map([](const Json& answer) {
    return description_from(answer.at("volume"));
  });
}

tl::expected<InputVolume, Problem> read_dicom(const std::filesystem::path& file, const StoredVolume& stored,
                                              const PipelineLimits& limits, const Progress& report,
                                              const Descriptor* kept) {
  const Descriptor own = kept == nullptr ? memory_file("voxels") : Descriptor();
  const Descriptor& voxels = kept == nullptr ? own : *kept;
  const std::int64_t count = voxel_count(stored.facts.size);
  constexpr double kDecoded = 0.8;
  const auto answer = ask("decode", open_upload(file), voxels.get(), count, stored.options, limits,
                          part_of(report, 0, kDecoded));
  if (!answer) return tl::unexpected(answer.error());
  const Json& decoded = answer->at("volume");
  InputVolume input{description_from(decoded), nullptr};
  if (voxel_count(input.description.size) != count)
    throw std::runtime_error("a volume of another size was decoded");
  input.volume = make_volume(input.description.size, input.description.map);
  MemoryReader reader(voxels, kept == nullptr);
  reader.read(std::as_writable_bytes(voxels_of(*input.volume)), part_of(report, kDecoded, 1));
  if (const auto padded = decoded.at("padded_voxels").get<std::size_t>(); padded > 0) {
    auto bits = read_values<std::uint8_t>(reader, (static_cast<std::size_t>(count) + 7) / 8);
    input.padding = Padding(std::move(bits), read_values<float>(reader, padded));
  }
  const auto bytes = static_cast<off_t>(voxels_of(*input.volume).size_bytes());
  check(::ftruncate(voxels.get(), bytes) == 0, "giving back the memory of the padding");
  return input;
}

tl::expected<std::vector<ArrivedInstance>, Problem> list_instances(const std::filesystem::path& file,
                                                                   const PipelineLimits& limits,
                                                                   const Progress& report) {
  const auto instances_in = [](const Json& answer) {
    std::vector<ArrivedInstance> instances;
    for (const Json& one : answer.at("instances"))
      instances.push_back({one.at("sop_class_uid"), one.at("sop_instance_uid"), one.at("study_uid"),
                           one.at("series_uid"), one.at("offset"), one.at("bytes")});
    return instances;
  };
  if (!is_dicom_upload(file))
    return tl::unexpected(Problem{"dicom-no-images", "The body holds no DICOM file."});
  return ask("instances", open_upload(file), -1, 0, {}, limits, report).map(instances_in);
}

}  // namespace volsmooth
