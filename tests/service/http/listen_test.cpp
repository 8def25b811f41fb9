#include <ctime>
#include <fstream>
#include <memory>
#include <optional>
#include <thread>

#include "tests/service/http/running_server.h"
#include "tests/support/few_descriptors.h"

namespace volsmooth {
namespace {

using Listen = ServerTest;

TEST_F(Listen, FileAtThePathOfTheUnixSocketIsLeftAlone) {
  const auto path = directory_.path() / "results.csv";
  std::ofstream(path) << "precious";
  const Api api{jobs_, metrics_};
  EXPECT_THROW(Server({.listen = "unix:" + path.string()}, api), std::runtime_error);
  std::string content;
  std::ifstream(path) >> content;
  EXPECT_EQ(content, "precious");
}

TEST_F(Listen, StopLeavesAFileThatTookThePlaceOfTheSocket) {
  const auto path = directory_.path() / "socket";
  start({.listen = "unix:" + path.string()});
  std::filesystem::remove(path);
  std::ofstream(path) << "precious";
  server_.reset();
  EXPECT_TRUE(std::filesystem::exists(path));
}

TEST_F(Listen, SocketOfAKilledDaemonIsReplaced) {
  const auto path = directory_.path() / "socket";
  start({.listen = "unix:" + path.string()});
  const auto kept = directory_.path() / "kept";
  std::filesystem::create_hard_link(path, kept);
  server_.reset();
  std::filesystem::rename(kept, path);
  start({.listen = "unix:" + path.string()});
  EXPECT_EQ(ask("GET /healthz").status, 200);
}

TEST_F(Listen, LivingDaemonKeepsItsSocket) {
  const auto path = directory_.path() / "socket";
  start({.listen = "unix:" + path.string()});
  const Api api{jobs_, metrics_};
  EXPECT_THROW(Server({.listen = "unix:" + path.string()}, api), std::runtime_error);
  EXPECT_EQ(ask("GET /healthz").status, 200);
}

/// What only waits makes way, so that the next caller is served.
TEST_F(Listen, LastsThroughALackOfDescriptors) {
  std::vector<std::unique_ptr<HttpClient>> idle;
  for (int i = 0; i < 10; ++i) {
    idle.push_back(std::make_unique<HttpClient>(server_->address()));
    ASSERT_EQ(idle.back()->exchange(request("GET /healthz")).status, 200);
  }
  std::optional<FewDescriptors> few(1);  // the client's end
  const std::clock_t start = std::clock();
  HttpClient next(server_->address());
  const HttpAnswer answer = next.exchange(request("GET /healthz"));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const double busy = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  few.reset();
  EXPECT_EQ(answer.status, 200);
  EXPECT_LT(busy, 0.2);
  EXPECT_EQ(ask("GET /healthz").status, 200);
}

TEST_F(Listen, OwnAddressIsAnAcceptedHost) {
  start({.listen = "127.0.0.2:0"});
  const std::string host = server_->address().substr(std::string("http://").size());
  EXPECT_EQ(connect().exchange("GET /healthz HTTP/1.1\r\nHost: " + host + "\r\n\r\n").status, 200);
  EXPECT_EQ(connect().exchange("GET /healthz HTTP/1.1\r\nHost: 127.0.0.3\r\n\r\n").status, 421);
}

}  // namespace
}  // namespace volsmooth
