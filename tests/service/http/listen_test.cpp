#include <ctime>
#include <fstream>
#include <iomanip>
#include <memory>
#include <optional>
#include <sstream>
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

/// Bytes that the kernel keeps for the peers of the connections to `port`.
std::int64_t bytes_to_send(int port) {
  std::ostringstream local;
  local << "0100007F:" << std::hex << std::uppercase << std::setw(4) << std::setfill('0') << port;
  std::ifstream connections("/proc/net/tcp");
  std::int64_t bytes = 0;
  for (std::string line; std::getline(connections, line);) {
    std::istringstream fields(line);
    std::string number, address, peer, state, queues;
    fields >> number >> address >> peer >> state >> queues;
    if (address == local.str() && state == "01") bytes += std::stoll(queues, nullptr, 16);
  }
  return bytes;
}

TEST_F(Listen, KernelKeepsLittleForAPeerThatReadsNothing) {
  const std::string volume = upload(std::string(std::size_t{4} << 20, 'v'));
  const std::string address = server_->address();
  const int port = std::stoi(address.substr(address.rfind(':') + 1));
  HttpClient idle(address);
  idle.send(request("GET /v1/volumes/" + volume + "/content"));
  std::int64_t most = 0;
  for (int look = 0; look < 50; ++look) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    most = std::max(most, bytes_to_send(port));
  }
  EXPECT_GT(most, 0);
  EXPECT_LT(most, 1 << 19);
}

TEST_F(Listen, OwnAddressIsAnAcceptedHost) {
  start({.listen = "127.0.0.2:0"});
  const std::string host = server_->address().substr(std::string("http://").size());
  EXPECT_EQ(connect().exchange("GET /healthz HTTP/1.1\r\nHost: " + host + "\r\n\r\n").status, 200);
  EXPECT_EQ(connect().exchange("GET /healthz HTTP/1.1\r\nHost: 127.0.0.3\r\n\r\n").status, 421);
}

}  // namespace
}  // namespace volsmooth
