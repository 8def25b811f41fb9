#include "service/ingest/call.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>

#include "service/process/check.h"
#include "service/process/write_all.h"

namespace volsmooth {
namespace {

using Json = nlohmann::json;

std::size_t size_of(int descriptor) {
  struct stat status {};
  check(::fstat(descriptor, &status) == 0, "the size of a descriptor");
  return static_cast<std::size_t>(status.st_size);
}

void tell_progress(double fraction) {
  // Nothing depends on it.
  [[maybe_unused]] const ssize_t written = ::pwrite(kProgressDescriptor, &fraction, sizeof fraction, 0);
}

SeriesOptions series_options(const Json& options) {
  SeriesOptions series;
  series.series = options.at("series").get<std::string>();
  series.resample_uniform = options.at("resample").get<std::string>() == "uniform";
  series.limits.max_voxels = options.at("max_voxels").get<std::int64_t>();
  return series;
}

}  // namespace

Json read_options() {
  std::string text(size_of(kOptionsDescriptor), '\0');
  if (::pread(kOptionsDescriptor, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size()))
    throw std::runtime_error("the options cannot be read");
  return Json::parse(text);
}

IngestCall open_call(Json options) {
  IngestCall call;
  call.series = series_options(options);
  const int threads = options.at("threads").get<int>();
  call.series.execution = {threads, part_of(tell_progress, 0, 0.5)};
  call.second_half = {threads, part_of(tell_progress, 0.5, 1)};
  call.options = std::move(options);
  const std::size_t bytes = size_of(kUploadDescriptor);
  if (bytes == 0) return call;
  void* mapped = ::mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, kUploadDescriptor, 0);
  check(mapped != MAP_FAILED, "mapping the upload");
  call.upload = {static_cast<const std::byte*>(mapped), bytes};
  return call;
}

void write_output(std::span<const std::byte> bytes) {
  write_all(kOutputDescriptor, bytes, "writing the output");
}

Json answer_of(const Refusal& refusal) {
  Json members = refusal.numbers;
  for (const auto& [name, counts] : refusal.counts) members[name] = counts;
  return {{"refusal", {{"slug", refusal.slug}, {"detail", refusal.detail}, {"members", members}}}};
}

}  // namespace volsmooth
