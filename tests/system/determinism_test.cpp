#include <gtest/gtest.h>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {
namespace {

/// The bytes of every result but the report, which tells the time.
std::map<std::string, Bytes> results_with_threads(int threads, const Bytes& file) {
  const Daemon daemon(VOLSMOOTHD, {"--threads", std::to_string(threads)});
  const ServiceClient service(daemon);
  const json job = service.run({{"volume", service.upload(file).at("id")},
                                {"method", "compare"},
                                {"parameters", {{"flow_time_mm2", 6.5}}},
                                {"isovalues", {250, 700}},
                                {"mesh_formats", {"stl", "ply", "obj", "glb"}}});
  std::map<std::string, Bytes> results;
  for (const json& result : job.at("results")) {
    const std::string name = result.at("name");
    if (result.at("kind") != "report") results[name] = service.fetch(job.at("id"), name);
  }
  return results;
}

/// Byte for byte: no result depends on how the work was cut into pieces. Odd sizes, so that pieces are
/// uneven.
TEST(Determinism, ResultsDoNotDependOnTheNumberOfThreads) {
  std::vector<std::int16_t> voxels;
  for (int i = 0; i < 61 * 53 * 47; ++i) {
    const int x = i % 61, y = i / 61 % 53, z = i / (61 * 53);
    const double wave = std::sin(0.31 * x) + std::sin(0.23 * y + 1) + std::sin(0.41 * z + 2);
    voxels.push_back(static_cast<std::int16_t>(500 + 150 * wave + i * 2654435761U % 31));
  }
  const Bytes file = gzip(make_nifti1<std::int16_t>({61, 53, 47}, {1, 1.25, 2}, voxels));

  const auto alone = results_with_threads(1, file);
  EXPECT_EQ(alone.size(), 2U + 2U + 3U * (2U * 3U + 1U)) << "volumes, pictures, surfaces";
  for (const int threads : {2, 3}) {
    const auto together = results_with_threads(threads, file);
    ASSERT_EQ(together.size(), alone.size());
    for (const auto& [name, bytes] : alone)
      EXPECT_TRUE(bytes == together.at(name)) << name << ", " << threads;
  }
}

}  // namespace
}  // namespace volsmooth::test
