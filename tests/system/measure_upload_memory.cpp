// measure_upload_memory [SLICES]: uploads a raw NIfTI of 1024 x 1024 x SLICES int16 voxels (1000: 2 GB), made
// on the fly, and prints the daemon's resident memory before, at the peak and after, in MB.
#include <cstdio>

#include "tests/system/streamed_upload.h"

using namespace volsmooth::test;

namespace {

constexpr std::size_t kSliceVoxels = 1024 * 1024;

/// Smooth enough to be a volume, noisy enough not to be all one block: a linear congruential sequence.
Slice slice(std::uint32_t& state) {
  Slice voxels(kSliceVoxels);
  for (std::int16_t& voxel : voxels)
    voxel = static_cast<std::int16_t>((state = state * 1664525 + 1013904223) >> 20);
  return voxels;
}

double megabytes(std::int64_t bytes) {
  return static_cast<double>(bytes) / (1 << 20);
}

}  // namespace

int main(int argc, char** argv) {
  const int slices = argc > 1 ? std::stoi(argv[1]) : 1000;
  const Daemon daemon(VOLSMOOTHD);
  const std::int64_t before = daemon.resident_bytes();
  const auto start = std::chrono::steady_clock::now();
  std::uint32_t state = 1;
  const json volume = streamed_upload(daemon, {1024, 1024, slices}, [&](int) { return slice(state); });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("upload of %.0f MB in %.1f s: resident before %.1f MB, peak %.1f MB, after %.1f MB\n",
              megabytes(volume.at("bytes")), seconds, megabytes(before),
              megabytes(daemon.peak_resident_bytes()), megabytes(daemon.resident_bytes()));
}
