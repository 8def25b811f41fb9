#include "service/control/control_socket.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <ctime>
#include <stdexcept>
#include <thread>

#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

std::string echo(const std::string& request, uid_t) {
  return "you said " + request;
}

TEST(ControlSocket, AnswersEachRequest) {
  const ScratchFolder scratch;
  const ControlSocket control(scratch.path(), echo);
  for (const std::string request : {"status", "list", ""})
    EXPECT_EQ(ask_daemon(scratch.path(), request), "you said " + request);
}

TEST(ControlSocket, KnowsWhoAsks) {
  const ScratchFolder scratch;
  const ControlSocket control(scratch.path(),
                              [](const std::string&, uid_t user) { return std::to_string(user); });
  EXPECT_EQ(ask_daemon(scratch.path(), ""), std::to_string(::geteuid()));
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

/// With no descriptor left it waits, without turning round and round, and goes on when there is one.
TEST(ControlSocket, LastsThroughALackOfDescriptors) {
  const ScratchFolder scratch;
  const ControlSocket control(scratch.path(), echo);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  const int client = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  (scratch.path() / "control.sock").string().copy(address.sun_path, sizeof address.sun_path - 1);
  const rlimit none{static_cast<rlim_t>(client) + 1, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
  ASSERT_EQ(::connect(client, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  const std::clock_t start = std::clock();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const double busy = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  ::setrlimit(RLIMIT_NOFILE, &before);
  ::close(client);
  EXPECT_LT(busy, 0.2);
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
