// links: algorithms_formats
//
// A NIfTI file, gzip or not, verified and read, which must agree; and written again.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "algorithms/formats/nifti.h"
#include "tests/fuzz/fuzz_target.h"

namespace volsmooth {
namespace {

constexpr ReadOptions kOptions{
    .volume_index = {},
    .non_finite = 0,
    .limits = {.max_voxels = 1 << 20, .max_axis_voxels = 4096, .free_inflated_bytes = 1 << 22}};

void demand(bool holds) {
  if (!holds) std::abort();
}

void read_and_write(const std::string& file) {
  const auto described = inspect_nifti(file, kOptions);
  const auto read = read_nifti(file, kOptions);
  demand(described.has_value() == read.has_value());
  if (!read) return demand(described.error().slug == read.error().slug);
  demand(described->size == read->description.size);
  demand(described->intensity_max == read->description.intensity_max);
  write_nifti("/dev/null", *read->volume, read->description.header, OutputVoxelType::kSame);
}

}  // namespace
}  // namespace volsmooth

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const int memory = ::memfd_create("input", 0);
  if (::ftruncate(memory, 0) != 0 || ::pwrite(memory, data, size, 0) != static_cast<ssize_t>(size))
    std::abort();
  volsmooth::read_and_write("/proc/self/fd/" + std::to_string(memory));
  return 0;
}
