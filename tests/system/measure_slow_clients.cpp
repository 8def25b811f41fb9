// measure_slow_clients [CONNECTIONS [SECONDS]]: how long good clients wait while so many connections (2,000)
// are as slow as they can be for so long (300 s): a third sends a byte of its head every few seconds, a third
// a byte of a body, a third reads nothing of a large answer. Whoever is cut off comes again. Prints the good
// clients' median and 99th percentile in milliseconds, for kept and for new connections, when the longest
// were, how long the machine held up this program meanwhile, and what was refused.
#include <poll.h>
#include <sys/resource.h>

#include <cstdio>
#include <thread>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

using namespace volsmooth::test;

namespace {

using Clock = std::chrono::steady_clock;

/// A connection that wants to last.
class SlowClient {
 public:
  SlowClient(int port, std::size_t kind, std::string large)
      : port_(port), kind_(kind % 3), large_(std::move(large)) {}

  /// A step of its slowness; true when it had to begin again.
  bool step() {
    const bool anew = !connection_ || !connection_->send(kind_ == 2 ? "" : "x") || is_cut();
    if (anew) begin();
    return anew;
  }

 private:
  void begin() {
    connection_.reset();
    connection_ = std::make_unique<HttpConnection>(port_);
    const std::string host = " HTTP/1.1\r\nHost: localhost\r\n";
    if (kind_ == 0) connection_->send("GET /healthz" + host + "X: ");
    if (kind_ == 1) connection_->send("POST /v1/volumes" + host + "Content-Length: 1000000\r\n\r\n");
    if (kind_ == 2) connection_->send("GET " + large_ + host + "\r\n");
  }
  bool is_cut() const {
    pollfd state{connection_->descriptor(), POLLRDHUP, 0};
    return ::poll(&state, 1, 0) != 0;
  }

  int port_;
  std::size_t kind_;
  std::string large_;
  std::unique_ptr<HttpConnection> connection_;
};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Times {
  std::vector<double> milliseconds;
  double longest = 0, longest_at = 0;  ///< the latter in seconds from the beginning
  int failures = 0;

  void add(Clock::time_point beginning, const auto& exchange) {
    const auto start = Clock::now();
    try {
      expect_status(exchange(), 200);
      const double spent = 1000 * seconds_since(start);
      if (spent > longest) longest = spent, longest_at = seconds_since(beginning);
      milliseconds.push_back(spent);
    } catch (const std::runtime_error&) {
      ++failures;
    }
  }
  void print(const char* what) {
    std::sort(milliseconds.begin(), milliseconds.end());
    const std::size_t count = milliseconds.size();
    if (count == 0) return;
    std::printf("%s: %zu requests, p50 %.2f ms, p99 %.2f ms, longest %.1f ms (after %.1f s), %d failed\n",
                what, count, milliseconds[count / 2], milliseconds[count * 99 / 100], milliseconds.back(),
                longest_at, failures);
  }
};

}  // namespace

int main(int argc, char** argv) {
  const std::size_t connections = argc > 1 ? std::stoul(argv[1]) : 2000;
  const auto seconds = std::chrono::seconds(argc > 2 ? std::stoi(argv[2]) : 300);
  const rlimit files{65536, 65536};
  ::setrlimit(RLIMIT_NOFILE, &files);
  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  const std::string large =
      "/v1/volumes/" + service.upload(ball_file(160)).at("id").get<std::string>() + "/content";

  std::atomic<std::size_t> begun = 0;
  std::jthread slow([&](const std::stop_token& over) {
    std::vector<SlowClient> clients;
    for (std::size_t i = 0; i < connections; ++i) clients.emplace_back(daemon.port(), i, large);
    while (!over.stop_requested()) {
      const auto round = Clock::now();
      for (SlowClient& client : clients) begun += client.step();
      std::this_thread::sleep_until(round + std::chrono::seconds(3));
    }
  });
  while (begun < connections) std::this_thread::sleep_for(std::chrono::milliseconds(10));

  Times kept, fresh;
  HttpConnection connection(daemon.port());
  double held_up = 0;
  const auto beginning = Clock::now();
  while (Clock::now() < beginning + seconds) {
    kept.add(beginning, [&] { return connection.exchange("GET", "/v1/jobs"); });
    fresh.add(beginning, [&] { return service.call("GET", "/v1/volumes"); });
    const auto pause = Clock::now();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    held_up = std::max(held_up, 1000 * seconds_since(pause) - 5);
  }
  std::printf("%zu slow connections, begun %zu times in %ld s\n", connections, begun.load(),
              long(seconds.count()));
  kept.print("a kept connection");
  fresh.print("new connections");
  std::printf("a pause of 5 ms lasted up to %.1f ms longer\n", held_up);
  return kept.failures + fresh.failures > 0 ? 1 : 0;
}
