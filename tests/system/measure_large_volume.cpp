// measure_large_volume [SIZE]: smooths SIZE^3 int16 voxels (1024: 2 GB) of noisy spheres by one feature
// radius of two voxels, with one isosurface, and prints the peak of the memory and the report, which has the
// seconds of each stage.
#include <cmath>
#include <cstdio>

#include "tests/system/streamed_upload.h"

using namespace volsmooth::test;

namespace {

/// A ball whose edge is eight voxels wide, and noise of a tenth of its height.
Slice slice(int size, int z, std::uint32_t& state) {
  Slice voxels;
  voxels.reserve(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  const double middle = size / 2.0;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      state = state * 1664525 + 1013904223;
      const double noise = (state >> 16) / 65536.0 - 0.5;
      const double distance = std::hypot(x - middle, y - middle, z - middle) - 0.3 * size;
      voxels.push_back(static_cast<std::int16_t>(1000 / (1 + std::exp(distance / 4)) + 100 * noise));
    }
  }
  return voxels;
}

}  // namespace

int main(int argc, char** argv) {
  const int size = argc > 1 ? std::stoi(argv[1]) : 1024;
  const Daemon daemon(VOLSMOOTHD, {"--memory", "12GB"});
  const ServiceClient service(daemon);
  std::uint32_t state = 1;
  const json volume =
      streamed_upload(daemon, {size, size, size}, [&](int z) { return slice(size, z, state); });
  const std::string id = service.submit({{"volume", volume.at("id")},
                                         {"parameters", {{"feature_radius_mm", 2}}},
                                         {"isovalues", {500}},
                                         {"mesh_formats", {"stl"}}});
  json job;
  do job = service.get("/v1/jobs/" + id + "?wait=60");
  while (!ServiceClient::is_final(job));
  if (job.at("state") != "succeeded") throw std::runtime_error("the job ended as " + job.dump());
  std::printf("peak memory %.2f GB\n%s\n", static_cast<double>(daemon.peak_resident_bytes()) / 1e9,
              json::parse(service.fetch(id, "report.json")).dump(1).c_str());
}
