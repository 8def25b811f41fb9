#include "service/dimse/sandbox.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <functional>

#include "tests/support/confined_process.h"

namespace volsmooth {
namespace {

class DimseSandbox : public testing::Test {
 protected:
  void SetUp() override {
    if (!test::kConfines) GTEST_SKIP() << "it is not entered under the address sanitizer";
  }
  ~DimseSandbox() override { ::close(socket_); }

  static int end_of(const std::function<void()>& work) {
    return test::end_of([] { enter_sandbox(std::int64_t{1} << 32); }, work);
  }
  static bool is_forbidden(const std::function<void()>& work) { return test::was_forbidden(end_of(work)); }
  int set(int level, int option) const {
    const int yes = 1;
    return ::setsockopt(socket_, level, option, &yes, sizeof yes);
  }

  const int socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
};

TEST_F(DimseSandbox, ASocketIsMadeWaitingOrNot) {
  EXPECT_EQ(end_of([&] {
              const int flags = ::fcntl(socket_, F_GETFL);
              if (flags < 0 || ::fcntl(socket_, F_SETFL, flags | O_NONBLOCK) != 0) ::_exit(1);
              if (::fcntl(socket_, F_SETFD, ::fcntl(socket_, F_GETFD)) != 0) ::_exit(2);
              if (set(IPPROTO_TCP, TCP_NODELAY) != 0 || set(SOL_SOCKET, SO_SNDBUF) != 0) ::_exit(3);
            }),
            0);
}

/// A descriptor with an owner and O_ASYNC signals whom it likes, the daemon too.
TEST_F(DimseSandbox, NobodyIsSignalled) {
  EXPECT_TRUE(is_forbidden([] { ::kill(::getppid(), 0); }));
  EXPECT_TRUE(is_forbidden([] { ::raise(SIGUSR1); }));
  EXPECT_TRUE(is_forbidden([&] { ::fcntl(socket_, F_SETOWN, 1); }));
  EXPECT_TRUE(is_forbidden([&] { ::fcntl(socket_, F_SETSIG, SIGKILL); }));
  EXPECT_TRUE(is_forbidden([&] { ::fcntl(socket_, F_SETFL, O_ASYNC | O_NONBLOCK); }));
  EXPECT_TRUE(is_forbidden([&] {
    int owner = 1;
    ::ioctl(socket_, FIOSETOWN, &owner);
  }));
}

TEST_F(DimseSandbox, DescriptorsAreNotMultipliedAndSocketsKeepTheirOptions) {
  EXPECT_TRUE(is_forbidden([&] { ::fcntl(socket_, F_DUPFD, 0); }));
  EXPECT_TRUE(is_forbidden([&] { set(SOL_SOCKET, SO_ATTACH_FILTER); }));
  EXPECT_TRUE(is_forbidden([&] { set(IPPROTO_IP, IP_TOS); }));
  EXPECT_TRUE(is_forbidden([&] { set(IPPROTO_TCP, TCP_ULP); }));
}

TEST_F(DimseSandbox, NothingIsOpened) {
  EXPECT_TRUE(is_forbidden([] { (void)::open("/", O_RDONLY); }));
  EXPECT_TRUE(is_forbidden([] { (void)::socket(AF_INET, SOCK_STREAM, 0); }));
  EXPECT_TRUE(is_forbidden([] { (void)::fork(); }));
}

}  // namespace
}  // namespace volsmooth
