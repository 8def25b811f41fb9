#include "client/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace volsmooth {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

tl::expected<Options, NoCommand> parse(const std::string& line) {
  unsetenv("VOLSMOOTH_SERVER");
  std::istringstream stream(line);
  return parse_command_line({std::istream_iterator<std::string>(stream), {}});
}

nlohmann::json order_of(const std::string& more) {
  const auto options = parse("smooth x.nii -o out " + more);
  return options ? order_document(options->order, "v1") : nlohmann::json(options.error().text);
}

TEST(CommandLine, OfTheMainJob) {
  const auto options = parse(
      "smooth a.nii b.nii.gz -o out --method compare --feature-radius 2mm --isovalue 40,90 --mesh stl,glb");
  ASSERT_TRUE(options) << options.error().text;
  EXPECT_EQ(options->command, "smooth");
  EXPECT_THAT(options->inputs, ElementsAre("a.nii", "b.nii.gz"));
  EXPECT_EQ(options->output_folder, "out");
  EXPECT_EQ(
      order_document(options->order, "v1"),
      nlohmann::json::parse(R"({"volume": "v1", "method": "compare", "parameters": {"feature_radius_mm": 2.0},
                                      "isovalues": [40, 90], "mesh_formats": ["stl", "glb"], "outputs": ["nifti"]})"));
}

TEST(CommandLine, HasTheContractsDefaults) {
  EXPECT_EQ(order_of(""),
            nlohmann::json::parse(R"({"volume": "v1", "method": "mean-curvature-flow", "parameters": {},
                              "isovalues": "auto", "mesh_formats": ["stl"], "outputs": ["nifti"]})"));
}

TEST(CommandLine, PutsEveryOptionIntoTheOrder) {
  const auto order = order_of(
      "--flow-time 1mm2 --isovalue none --mesh-frame LPS --voxel-type float32 --outputs nifti,dicom-series "
      "--set surface=300 --set mode=fast --label mine");
  EXPECT_EQ(order, nlohmann::json::parse(R"({"volume": "v1", "method": "mean-curvature-flow",
      "parameters": {"flow_time_mm2": 1.0, "surface": 300.0, "mode": "fast"}, "isovalues": [], "mesh_formats": ["stl"],
      "mesh_frame": "LPS", "voxel_type": "float32", "outputs": ["nifti", "dicom-series"], "label": "mine"})"));
}

TEST(CommandLine, TakesNegativeIsovaluesForValues) {
  EXPECT_EQ(order_of("--isovalue -300,300")["isovalues"], nlohmann::json({-300, 300}));
  EXPECT_EQ(order_of("--isovalue -.5")["isovalues"], nlohmann::json({-0.5}));
  EXPECT_EQ(parse("upload x.nii --non-finite -1024")->query.front().second, "-1024");
}

TEST(CommandLine, TakesCommonOptionsBeforeAndAfterTheCommand) {
  for (const char* line :
       {"--server http://h:1 --json -q -v show 7", "show 7 --server http://h:1 --json -q -v",
        "-q show --json 7 --server=http://h:1 -v"}) {
    const auto options = parse(line);
    ASSERT_TRUE(options) << line << options.error().text;
    EXPECT_EQ(options->server, "http://h:1");
    EXPECT_TRUE(options->json && options->quiet && options->verbose) << line;
    EXPECT_EQ(options->id, "7");
  }
}

TEST(CommandLine, TakesTheServerFromTheEnvironmentUnlessItIsGiven) {
  setenv("VOLSMOOTH_SERVER", "unix:/a", 1);
  EXPECT_EQ(parse_command_line({"volumes"})->server, "unix:/a");
  EXPECT_EQ(parse_command_line({"volumes", "--server", "unix:/b"})->server, "unix:/b");
  unsetenv("VOLSMOOTH_SERVER");
}

TEST(CommandLine, TurnsUploadOptionsIntoAQuery) {
  EXPECT_THAT(parse("upload x.nii --volume-index 3 --series 1.2.3 --resample uniform --non-finite 0")->query,
              ElementsAre(Pair("volume_index", "3"), Pair("series", "1.2.3"), Pair("resample", "uniform"),
                          Pair("non_finite", "0")));
  EXPECT_THAT(parse("jobs --state running --limit 5")->query,
              ElementsAre(Pair("state", "running"), Pair("limit", "5")));
}

TEST(CommandLine, ReadsAnInputThatIsNamedLikeACommand) {
  EXPECT_THAT(parse("smooth jobs show -o out")->inputs, ElementsAre("jobs", "show"));
}

class EndsWithZero : public testing::TestWithParam<const char*> {};

TEST_P(EndsWithZero, AndAText) {
  const auto options = parse(GetParam());
  ASSERT_FALSE(options);
  EXPECT_EQ(options.error().code, ExitCode::kDone);
  EXPECT_THAT(options.error().text, HasSubstr("volsmooth"));
}

INSTANTIATE_TEST_SUITE_P(Lines, EndsWithZero,
                         testing::Values("--help", "--version", "smooth --help", "jobs --version",
                                         "fetch -h"));

class UsageError : public testing::TestWithParam<const char*> {};

TEST_P(UsageError, EndsWithTwoAndASentence) {
  const auto options = parse(GetParam());
  ASSERT_FALSE(options);
  EXPECT_EQ(static_cast<int>(options.error().code), 2);
  EXPECT_THAT(options.error().text, HasSubstr("volsmooth: "));
}

INSTANTIATE_TEST_SUITE_P(
    Lines, UsageError,
    testing::Values("", "nonsense", "smooth", "smooth x.nii", "smooth -o out",
                    "smooth x.nii -o out --nonsense", "smooth x.nii -o out --feature-radius 2cm",
                    "smooth x.nii -o out --feature-radius 1mm --flow-time 1mm2",
                    "smooth x.nii -o out --feature-radius 1mm --set feature_radius_mm=2",
                    "smooth x.nii -o out --set a=1 --set a=2", "smooth x.nii -o out --set a",
                    "smooth x.nii -o out --isovalue 40,x", "smooth x.nii -o out --isovalue 40,40.0",
                    "smooth x.nii -o out --mesh stl,vtk", "smooth x.nii -o out --mesh-frame LAS",
                    "smooth x.nii -o out --voxel-type int8", "smooth x.nii -o out --volume-index -1",
                    "smooth x.nii -o out --resample yes", "smooth x.nii -o out --non-finite x",
                    "smooth x.nii -o out --label \xff", "upload", "upload a b", "submit", "show", "show a b",
                    "wait", "cancel", "fetch 7", "delete", "methods now", "jobs --limit 0"));

}  // namespace
}  // namespace volsmooth
