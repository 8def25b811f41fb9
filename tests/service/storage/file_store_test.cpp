#include "service/storage/file_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <random>
#include <set>
#include <string>
#include <thread>

#include "service/storage/digest.h"
#include "tests/support/disk_calls.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

const auto kKeepAll = [](std::string_view) { return true; };

std::set<std::string> names_in(const fs::path& directory) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(directory)) names.insert(entry.path().filename());
  return names;
}

IncomingFile received(FileStore& store, const std::string& text) {
  IncomingFile file = store.receive().value();
  file.write(std::as_bytes(std::span(text)));
  return file;
}

TEST(FileStore, AdoptsAFileWhole) {
  const ScratchFolder scratch;
  FileStore store(scratch.path() / "data");
  store.sweep("volumes", kKeepAll);
  store.adopt(received(store, "abc"), "volumes/one");
  EXPECT_EQ(digest_of(store.path_of("volumes/one")).bytes, 3);
  EXPECT_TRUE(names_in(store.path_of("tmp")).empty());
  store.remove("volumes/one");
  EXPECT_FALSE(fs::exists(store.path_of("volumes/one")));
  EXPECT_NO_THROW(store.remove("volumes/one"));
}

TEST(FileStore, AdoptsADirectoryUnderItsName) {
  const ScratchFolder scratch;
  FileStore store(scratch.path() / "data");
  store.sweep("results", kKeepAll);
  std::ofstream(store.begin_directory("results/job.1") / "a") << "first";
  EXPECT_EQ(names_in(store.path_of("results")), std::set<std::string>{"job.1.part"});
  store.adopt_directory("results/job.1");
  EXPECT_EQ(names_in(store.path_of("results")), std::set<std::string>{"job.1"});
}

TEST(FileStore, BeginsADirectoryEmpty) {
  const ScratchFolder scratch;
  FileStore store(scratch.path() / "data");
  store.sweep("results", kKeepAll);
  std::ofstream(store.begin_directory("results/job.1") / "a") << "left over";
  EXPECT_TRUE(names_in(store.begin_directory("results/job.1")).empty());
  store.abandon_directory("results/job.1");
  EXPECT_TRUE(names_in(store.path_of("results")).empty());
}

TEST(FileStore, IsHeldByOneAtATime) {
  const ScratchFolder scratch;
  {
    const FileStore first(scratch.path());
    try {
      const FileStore second(scratch.path());
      FAIL() << "two stores hold the same directory";
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("in use"), std::string::npos);
    }
  }
  EXPECT_NO_THROW(FileStore(scratch.path()));
}

TEST(FileStore, CreatesItsDirectoryForItsOwnerOnly) {
  const ScratchFolder scratch;
  const FileStore store(scratch.path() / "a/b");
  EXPECT_EQ(fs::status(scratch.path() / "a/b").permissions(), fs::perms::owner_all);
}

TEST(FileStore, SweepsWhatNobodyWants) {
  const ScratchFolder scratch;
  {
    FileStore store(scratch.path());
    store.sweep("results", kKeepAll);
    fs::create_directories(scratch.path() / "results/old.1/inner");
    std::ofstream(scratch.path() / "results/old.part") << "x";
    std::ofstream(scratch.path() / "results/wanted") << "x";
    std::ofstream(scratch.path() / "tmp/7") << "x";
    store.sweep("results", [](std::string_view name) { return name == "wanted"; });
    EXPECT_EQ(names_in(scratch.path() / "results"), std::set<std::string>{"wanted"});
  }
  FileStore again(scratch.path());
  EXPECT_TRUE(names_in(scratch.path() / "tmp").empty());
}

// What a power cut leaves is what was synced: a name only when its directory was, and then all that it names.

TEST(FileStore, WhatIsAdoptedIsOnTheDiskBeforeItsNameAndThenThatIs) {
  const ScratchFolder scratch;
  FileStore store(scratch.path());
  for (const char* folder : {"volumes", "results"}) store.sweep(folder, kKeepAll);
  IncomingFile file = received(store, "abc");
  const std::string place = "tmp/" + file.path().filename().string();
  store.begin_directory("results/job.1");
  const DiskCalls disk(scratch.path());
  store.adopt(std::move(file), "volumes/one");
  store.adopt_directory("results/job.1");
  store.remove("volumes/one");
  EXPECT_THAT(disk.seen(),
              testing::ElementsAre("fsync " + place, "rename " + place + " volumes/one", "fsync volumes",
                                   "fsync results/job.1.part", "rename results/job.1.part results/job.1",
                                   "fsync results", "fsync volumes"));
}

TEST(FileStore, ItsFoldersAreOnTheDiskOnceTheyAreMade) {
  const ScratchFolder scratch;
  const DiskCalls disk(scratch.path());
  FileStore store(scratch.path() / "a/b");
  store.sweep("volumes", kKeepAll);
  EXPECT_THAT(disk.seen(), testing::IsSupersetOf({"fsync .", "fsync a", "fsync a/b", "fsync a/b/volumes"}));
  EXPECT_EQ(disk.seen().back(), "fsync a/b");
}

TEST(FileStore, NothingStaysOfWhatCouldNotBeMadeDurable) {
  const ScratchFolder scratch;
  FileStore store(scratch.path());
  for (const char* folder : {"volumes", "results"}) store.sweep(folder, kKeepAll);
  const auto with_failing_call = [&](int failing, const auto& adopt) {
    const DiskCalls disk(scratch.path(), [failing, calls = 0](const std::string&) mutable {
      return ++calls == failing ? EIO : 0;
    });
    EXPECT_THROW(adopt(), std::system_error) << failing;
  };
  for (int failing = 1; failing <= 3; ++failing) {
    IncomingFile file = received(store, "abc");
    with_failing_call(failing, [&] { store.adopt(std::move(file), "volumes/one"); });
    std::ofstream(store.begin_directory("results/job.1") / "a") << "b";
    with_failing_call(failing, [&] { store.adopt_directory("results/job.1"); });
    store.abandon_directory("results/job.1");
    for (const char* folder : {"tmp", "volumes", "results"})
      EXPECT_TRUE(names_in(scratch.path() / folder).empty()) << folder << failing;
  }
}

/// A child adopts files as fast as it can, tells through the pipe which are stored, and is killed.
void adopt_until_killed(const fs::path& root, int tell) {
  FileStore store(root);
  store.sweep("volumes", kKeepAll);
  for (int number = 0;; ++number) {
    const std::string name = std::to_string(::getpid()) + "-" + std::to_string(number);
    store.adopt(received(store, std::string(50'000, 'x')), "volumes/" + name);
    const std::string line = name + "\n";
    if (::write(tell, line.data(), line.size()) < 0) ::_exit(1);
  }
}

TEST(FileStore, AKillNeverLosesAnAdoptedFileNorLeavesHalfOfOne) {
  const ScratchFolder scratch;
  std::mt19937 random(1);
  std::size_t acknowledged = 0;
  for (int round = 0; round < 30; ++round) {
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      ::close(ends[0]);
      adopt_until_killed(scratch.path(), ends[1]);
    }
    ::close(ends[1]);
    // From a kill in the first moments to one after a few files, at any point within the next.
    std::string told;
    const auto wanted = static_cast<std::ptrdiff_t>(random() % 4);
    char block[4096];
    const auto read_more = [&] {
      const ssize_t got = ::read(ends[0], block, sizeof block);
      if (got > 0) told.append(block, static_cast<std::size_t>(got));
      return got > 0;
    };
    while (std::ranges::count(told, '\n') < wanted) ASSERT_TRUE(read_more());
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    while (read_more()) {
    }
    ::close(ends[0]);
    const FileStore store(scratch.path());
    for (std::size_t at = 0, end; (end = told.find('\n', at)) != std::string::npos;
         at = end + 1, ++acknowledged)
      EXPECT_TRUE(fs::exists(scratch.path() / "volumes" / told.substr(at, end - at)));
    EXPECT_TRUE(names_in(scratch.path() / "tmp").empty());
  }
  for (const auto& entry : fs::directory_iterator(scratch.path() / "volumes"))
    EXPECT_EQ(entry.file_size(), 50'000u);
  EXPECT_GT(acknowledged, 0u);
}

}  // namespace
}  // namespace volsmooth
