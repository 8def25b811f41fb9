#include "client/private_daemon.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Stands in for the daemon with a script; what a real one does is for the system tests.
class PrivateDaemonStart : public testing::Test {
 protected:
  PrivateDaemonStart() {
    std::filesystem::create_directory(temporary_);
    setenv("TMPDIR", temporary_.c_str(), 1);
  }
  ~PrivateDaemonStart() override {
    unsetenv("TMPDIR");
    unsetenv("VOLSMOOTHD");
  }

  Expected<PrivateDaemon> start_script(const std::string& script) {
    const auto path = scratch_.put("daemon", "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    setenv("VOLSMOOTHD", path.c_str(), 1);
    return PrivateDaemon::start(interruption_, false);
  }

  const Interruption interruption_;
  const ScratchFolder scratch_;
  const std::filesystem::path temporary_ = scratch_ / "tmp";
};

TEST_F(PrivateDaemonStart, TellsTheLastWordsOfOneThatDies) {
  const auto daemon = start_script("echo out of luck; exit 3");
  ASSERT_FALSE(daemon);
  EXPECT_EQ(daemon.error().code, ExitCode::kUnreachable);
  EXPECT_THAT(daemon.error().sentence, HasSubstr("out of luck"));
  EXPECT_TRUE(std::filesystem::is_empty(temporary_));
}

TEST_F(PrivateDaemonStart, TellsWhatCannotBeRun) {
  setenv("VOLSMOOTHD", "/nowhere/volsmoothd", 1);
  const auto daemon = PrivateDaemon::start(interruption_, false);
  ASSERT_FALSE(daemon);
  EXPECT_THAT(daemon.error().sentence, HasSubstr("/nowhere/volsmoothd cannot be run"));
}

TEST_F(PrivateDaemonStart, GivesItAFolderOfOnesOwnAndNoDescriptors) {
  const std::string told = (scratch_ / "told").string();
  const Descriptor ours(dup2(STDERR_FILENO, 57));
  const auto daemon = start_script("echo \"$@\" >" + told + "; stat -c %a $(dirname $4) >>" + told +
                                   "; test -e /proc/$$/fd/57 && echo leaked >>" + told + "; exit 3");
  std::istringstream lines(scratch_.content("told"));
  std::string arguments, mode, leaked;
  std::getline(lines, arguments);
  std::getline(lines, mode);
  std::getline(lines, leaked);
  EXPECT_THAT(arguments, testing::MatchesRegex("--listen unix:.*/socket --data .*/data --ephemeral"));
  EXPECT_EQ(mode, "700");
  EXPECT_EQ(leaked, "");
}

TEST_F(PrivateDaemonStart, AnInterruptionEndsIt) {
  const std::string pid_file = (scratch_ / "pid").string();
  const auto daemon =
      start_script("echo $$ >" + pid_file + "; kill -INT " + std::to_string(getpid()) + "; exec sleep 60");
  ASSERT_FALSE(daemon);
  EXPECT_EQ(daemon.error().code, ExitCode::kInterrupted);
  EXPECT_TRUE(std::filesystem::is_empty(temporary_));
  EXPECT_EQ(kill(std::stoi(scratch_.content("pid")), 0), -1);
}

TEST(DaemonProgram, IsFoundInThePath) {
  const ScratchFolder folder;
  const auto program = folder.put("volsmoothd", "");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  const std::string path = std::getenv("PATH");
  setenv("PATH", (path + ":" + folder.path().string()).c_str(), 1);
  const auto found = find_daemon_program();
  setenv("PATH", path.c_str(), 1);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->filename(), "volsmoothd");
}

}  // namespace
}  // namespace volsmooth
