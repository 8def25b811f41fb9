#include "service/pipeline/ingest_child.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <fstream>

#include "algorithms/progress.h"
#include "service/pipeline/dicom_reading.h"
#include "tests/support/bad_dicom.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using testing::HasSubstr;

std::filesystem::path script(const ScratchFolder& folder, const std::string& body) {
  const auto path = folder.put("reader", "#!/bin/sh\n" + body + "\n");
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

nlohmann::json limits() {
  return ingest_options({}, {}, 1000, 0);
}

tl::expected<nlohmann::json, Problem> run_script(const std::string& body,
                                                 std::chrono::seconds patience = std::chrono::seconds(60)) {
  const ScratchFolder folder;
  IngestOrder order{.command = "inspect"};
  order.options = limits();
  order.patience = patience;
  return run_ingest(script(folder, body), order, no_progress);
}

TEST(IngestChild, AnswerIsWhatTheChildWrites) {
  EXPECT_EQ(run_script(R"(echo '{"volume": {"command": "'$1'"}}')")->at("volume").at("command"), "inspect");
}

TEST(IngestChild, RefusalIsAProblemWithItsMembers) {
  const auto refused = run_script(
      R"(echo '{"refusal": {"slug": "dicom-nesting", "detail": "Deep.", "members": {"levels": 33}}}')");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().slug, "dicom-nesting");
  EXPECT_EQ(refused.error().members.at("levels"), 33);
}

TEST(IngestChild, DeathIsAProblemOfTheUpload) {
  for (const char* death : {"kill -SEGV $$", "kill -SYS $$", "exit 1", "echo no JSON", "exit 0",
                            R"(echo '{"refusal": {"slug": "made-up", "detail": "", "members": {}}}')",
                            R"(echo '{"refusal": {"slug": "internal", "detail": "", "members": {}}}')",
                            R"(echo '{"refusal": {"slug": 5, "detail": "", "members": {}}}')",
                            R"(echo '{"refusal": {"slug": "dicom-nesting"}}')", R"(echo '{"refusal": 5}')"}) {
    const auto refused = run_script(death);
    ASSERT_FALSE(refused) << death;
    EXPECT_EQ(refused.error().slug, "dicom-decode-failed") << death;
  }
}

/// Memory and time are lacking today, damage stays.
TEST(IngestChild, WhatKillsItOrMakesItSlowIsPassing) {
  EXPECT_TRUE(run_script("kill -KILL $$").error().is_passing);
  EXPECT_TRUE(run_script("exec sleep 60", std::chrono::seconds(0)).error().is_passing);
  for (const char* damage : {"kill -SEGV $$", "kill -SYS $$", "exit 1", "echo no JSON"})
    EXPECT_FALSE(run_script(damage).error().is_passing) << damage;
}

/// Ctrl-C and a stop by systemd go to the children as well, whose work the daemon still needs to end in
/// order.
TEST(IngestChild, WhatEndsTheDaemonDoesNotEndIt) {
  EXPECT_TRUE(run_script("kill -INT $$; kill -TERM $$; kill -HUP $$; echo '{}'"));
}

TEST(IngestChild, WithoutASandboxItIsOurFault) {
  EXPECT_THROW((void)run_script("exit 70"), std::runtime_error);
}

TEST(IngestChild, WithoutAProgramItIsOurFault) {
  IngestOrder order{.command = "inspect"};
  order.options = limits();
  EXPECT_THROW((void)run_ingest("/nowhere/volsmooth-ingest", order, no_progress), std::system_error);
}

TEST(IngestChild, IsKilledWhenItTakesTooLong) {
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(run_script("exec sleep 60", std::chrono::seconds(0)).error().slug, "dicom-decode-failed");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

TEST(IngestChild, IsKilledWhenTheWorkIsCancelled) {
  const ScratchFolder folder;
  const auto pid_file = folder / "pid";
  IngestOrder order{.command = "inspect"};
  order.options = limits();
  const auto program = script(folder, "echo $$ > " + pid_file.string() + "; exec sleep 60");
  const auto cancel = [&](double) {
    if (std::ifstream(pid_file).peek() != EOF) throw Cancelled();
  };
  EXPECT_THROW((void)run_ingest(program, order, cancel), Cancelled);
  pid_t pid = 0;
  std::ifstream(pid_file) >> pid;
  EXPECT_EQ(::kill(pid, 0), -1) << "nothing is left of it";
}

TEST(IngestChild, HasNoDescriptorButItsOwn) {
  const auto answer = run_script(R"(n=$(ls /proc/self/fd | wc -l); echo '{"volume": {"open": '$n'}}')");
  EXPECT_LE(answer->at("volume").at("open"), 8) << "0 to 6, and the one that lists them";
}

/// 0.5, 2, -1 and not a number, as doubles.
TEST(IngestChild, ProgressIsToldAndNotBelieved) {
  const std::string half = R"(\0\0\0\0\0\0\340\077)", two = R"(\0\0\0\0\0\0\0\100)",
                    less = R"(\0\0\0\0\0\0\360\277)", none = R"(\0\0\0\0\0\0\370\177)";
  for (const auto& [bytes, expected] : {std::pair{half, 0.5}, {two, 1.0}, {less, 0.0}, {none, 0.0}}) {
    const ScratchFolder folder;
    IngestOrder order{.command = "inspect"};
    order.options = limits();
    double told = -1;
    const auto program = script(folder, "printf '" + bytes + "' >&6; sleep 0.4; echo '{}'");
    EXPECT_TRUE(run_ingest(program, order, [&](double fraction) { told = fraction; }));
    EXPECT_EQ(told, expected) << bytes;
  }
}

class IngestedUploads : public testing::TestWithParam<test::DicomUpload> {};

/// The real child, in its sandbox.
TEST_P(IngestedUploads, GetTheirAnswer) {
  const auto& [name, make, status, slug, query, warning] = GetParam();
  const ScratchFolder folder;
  UploadOptions options;
  if (query.starts_with("series=")) options.series = query.substr(7);
  if (query.starts_with("resample=")) options.resample = query.substr(9);
  const auto described = describe_dicom(folder.put("upload", make()), options, {}, no_progress);
  EXPECT_EQ(described ? "" : described.error().slug, slug) << (described ? "" : described.error().detail);
}

INSTANTIATE_TEST_SUITE_P(All, IngestedUploads, testing::ValuesIn(test::dicom_uploads()),
                         [](const auto& row) { return row.param.name; });

TEST(IngestedUpload, DescribesAndDecodesTheSameVolume) {
  const ScratchFolder folder;
  const auto file = folder.put("upload", test::good_dicom_upload());
  const auto described = describe_dicom(file, {}, {}, no_progress);
  ASSERT_TRUE(described);
  StoredVolume stored;
  stored.facts.size = described->size;
  const auto read = read_dicom(file, stored, {}, no_progress);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->description.map.linear, described->map.linear);
  EXPECT_EQ(described->format, "dicom");
  EXPECT_EQ(described->voxel_type, "int16");
  const test::SeriesPhantom phantom;  // its field
  const auto voxels = voxels_of(std::as_const(*read->volume));
  std::size_t voxel = 0;
  for (std::int64_t z = 0; z < described->size[2]; ++z)
    for (std::int64_t y = 0; y < described->size[1]; ++y)
      for (std::int64_t x = 0; x < described->size[0]; ++x) {
        const Vector3 there = to_world(described->map, {double(x), double(y), double(z)});
        ASSERT_NEAR(voxels[voxel++], phantom.intensity(there), 0.5);
      }
}

TEST(IngestedUpload, PaddingComesBackWhereItWas) {
  auto series = test::series_of({.columns = 5, .rows = 3, .slices = 3});
  for (auto& slice : series) slice.ss(0x00280120, -2000);
  const std::int16_t padding = -2000;
  for (const std::size_t pixel : {0U, 7U, 14U})
    std::memcpy(series[1][0x7fe00010].bytes.data() + 2 * pixel, &padding, 2);
  const ScratchFolder folder;
  const auto file = folder.put("upload", test::multipart_of(test::files_of(series)));
  StoredVolume stored;
  stored.facts.size = {5, 3, 3};
  const Descriptor kept = memory_file("voxels");
  auto read = read_dicom(file, stored, {}, no_progress, &kept);
  ASSERT_TRUE(read);
  EXPECT_EQ(::lseek(kept.get(), 0, SEEK_END), off_t{5 * 3 * 3 * sizeof(float)})
      << "the padding is not held twice";
  const auto voxels = voxels_of(*read->volume);
  const std::vector<float> filled(voxels.begin(), voxels.end());
  for (const std::size_t pixel : {15U, 22U, 29U}) {
    EXPECT_EQ(voxels[pixel], static_cast<float>(read->description.intensity_min));
    voxels[pixel] = 5;  // what a flow makes of it
  }
  read->padding.exchange(*read->volume);
  for (const std::size_t pixel : {15U, 22U, 29U}) EXPECT_EQ(voxels[pixel], -3024);
  EXPECT_EQ(voxels[16], filled[16]);
  read->padding.exchange(*read->volume);
  for (const std::size_t pixel : {15U, 22U, 29U}) EXPECT_EQ(voxels[pixel], 5);
}

}  // namespace
}  // namespace volsmooth
