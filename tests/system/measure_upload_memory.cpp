// measure_upload_memory [SLICES]: uploads a raw NIfTI of 1024 x 1024 x SLICES int16 voxels (1000: 2 GB), made
// on the fly, and prints the daemon's resident memory before, at the peak and after, in MB.
#include <cstdio>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

using namespace volsmooth::test;

namespace {

constexpr std::size_t kSliceVoxels = 1024 * 1024;

/// Smooth enough to be a volume, noisy enough not to be all one block: a linear congruential sequence.
std::string slice(std::uint32_t& state) {
  std::vector<std::int16_t> voxels(kSliceVoxels);
  for (std::int16_t& voxel : voxels)
    voxel = static_cast<std::int16_t>((state = state * 1664525 + 1013904223) >> 20);
  return {reinterpret_cast<const char*>(voxels.data()), voxels.size() * sizeof(std::int16_t)};
}

double megabytes(std::int64_t bytes) {
  return static_cast<double>(bytes) / (1 << 20);
}

}  // namespace

int main(int argc, char** argv) {
  const int slices = argc > 1 ? std::stoi(argv[1]) : 1000;
  const Daemon daemon(VOLSMOOTHD);
  const Bytes header = make_nifti1<std::int16_t>({1024, 1024, slices}, {1, 1, 1}, {});
  const std::size_t length = header.size() + static_cast<std::size_t>(slices) * kSliceVoxels * 2;

  const std::int64_t before = daemon.resident_bytes();
  const auto start = std::chrono::steady_clock::now();
  HttpConnection connection(daemon.port());
  connection.set_patience(600);
  connection.send("POST /v1/volumes HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
                  std::to_string(length) + "\r\n\r\n" + header);
  std::uint32_t state = 1;
  for (int z = 0; z < slices; ++z)
    if (!connection.send(slice(state))) throw std::runtime_error("the upload was cut off");
  const auto answer = connection.read();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!answer || answer->status != 201) throw std::runtime_error("the upload was refused");
  std::printf("upload of %.0f MB in %.1f s: resident before %.1f MB, peak %.1f MB, after %.1f MB\n",
              megabytes(static_cast<std::int64_t>(length)), seconds, megabytes(before),
              megabytes(daemon.peak_resident_bytes()), megabytes(daemon.resident_bytes()));
}
