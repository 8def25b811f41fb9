#include "service/control/control_socket.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <stdexcept>

#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

std::string echo(const std::string& request) {
  return "you said " + request;
}

TEST(ControlSocket, AnswersEachRequest) {
  const ScratchFolder scratch;
  const ControlSocket control(scratch.path(), echo);
  for (const std::string request : {"status", "list", ""})
    EXPECT_EQ(ask_daemon(scratch.path(), request), "you said " + request);
}

TEST(ControlSocket, IsThisUsersAlone) {
  const ScratchFolder scratch;
  const ControlSocket control(scratch.path(), echo);
  struct stat found {};
  ASSERT_EQ(::stat((scratch.path() / "control.sock").c_str(), &found), 0);
  EXPECT_TRUE(S_ISSOCK(found.st_mode));
  EXPECT_EQ(found.st_mode & 0777, 0600U);
}

/// The name of a Unix socket has room for 107 bytes.
TEST(ControlSocket, LiesInFoldersOfAnyLength) {
  const ScratchFolder scratch;
  const auto folder = scratch.path() / std::string(120, 'a') / std::string(120, 'b');
  std::filesystem::create_directories(folder);
  const ControlSocket control(folder, echo);
  EXPECT_EQ(ask_daemon(folder, "x"), "you said x");
}

TEST(ControlSocket, NobodyAnswersWhereNoDaemonIs) {
  const ScratchFolder scratch;
  EXPECT_FALSE(ask_daemon(scratch.path(), "x"));
  EXPECT_FALSE(ask_daemon(scratch.path() / "missing", "x"));
  { const ControlSocket control(scratch.path(), echo); }
  EXPECT_FALSE(ask_daemon(scratch.path(), "x"));
}

TEST(ControlSocket, TakesThePlaceOfADeadDaemons) {
  const ScratchFolder scratch;
  std::filesystem::create_directory_symlink("nowhere", scratch.path() / "control.sock");
  const ControlSocket control(scratch.path(), echo);
  EXPECT_EQ(ask_daemon(scratch.path(), "x"), "you said x");
}

TEST(ControlSocket, RefusesWhatIsTooLong) {
  const ScratchFolder scratch;
  const ControlSocket control(scratch.path(), echo);
  EXPECT_THROW(ask_daemon(scratch.path(), std::string(1 << 20, 'x')), std::runtime_error);
  EXPECT_EQ(ask_daemon(scratch.path(), "x"), "you said x");
}

}  // namespace
}  // namespace volsmooth
