#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "tests/system/client_run.h"
#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {
namespace {

/// Four people at once, each with a volume of another size: everybody gets their own files.
TEST(ManyClients, EachGetsItsOwnFiles) {
  const Daemon daemon(VOLSMOOTHD);
  const TemporaryDirectory directory;
  std::vector<std::unique_ptr<ClientRun>> clients;
  for (int i = 0; i < 4; ++i) {
    const std::string stem = "ball" + std::to_string(i);
    write_file(directory / (stem + ".nii.gz"), gzip(ball_file(40 + i)));
    clients.push_back(std::make_unique<ClientRun>(std::vector<std::string>{
        "smooth", directory / (stem + ".nii.gz"), "-o", directory / stem, "--server", daemon.url(),
        "--isovalue", "300,500", "--mesh", "stl,glb", "--flow-time", "9mm2"}));
  }
  for (int i = 0; i < 4; ++i) {
    const std::string stem = "ball" + std::to_string(i);
    ClientRun& client = *clients[static_cast<std::size_t>(i)];
    ASSERT_EQ(client.exit_code(), 0) << client.error();
    const std::vector<std::string> names{
        stem + "_mean-curvature-flow.nii.gz",     stem + "_mean-curvature-flow_iso300.stl",
        stem + "_mean-curvature-flow_iso500.stl", stem + "_mean-curvature-flow.glb",
        stem + "_mean-curvature-flow.png",        stem + "_report.json"};
    EXPECT_THAT(names_in(directory / stem), testing::UnorderedElementsAreArray(names));
    EXPECT_EQ(client.output_lines().size(), names.size()) << "a path a line";

    const int side = 40 + i;
    const json report = json::parse(content_of(directory / stem / (stem + "_report.json")));
    EXPECT_EQ(report.at("input").at("size"), json({side, side, side}));
    const Bytes result = gunzip(content_of(directory / stem / (stem + "_mean-curvature-flow.nii.gz")));
    EXPECT_EQ(result.size(), ball_file(side).size());
  }
}

}  // namespace
}  // namespace volsmooth::test
