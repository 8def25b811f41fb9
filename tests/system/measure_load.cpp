// measure_load [REQUESTS [PER_SECOND]]: so many requests (100,000) by 64 clients on kept connections, so many
// a second (640) together, while jobs keep all cores busy: documents, pages of lists, ranges of results,
// uploads and orders of jobs. Prints the median, the 99th percentile and the longest of each kind in
// milliseconds, of the disk's own fsync in the same time, and how many requests went wrong.
#include <fcntl.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <mutex>
#include <random>
#include <thread>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

using namespace volsmooth::test;

namespace {

using Clock = std::chrono::steady_clock;
constexpr int kClients = 64;

class Times {
 public:
  explicit Times(const char* what) : what_(what) {}

  void add(Clock::time_point since) {
    const double spent = std::chrono::duration<double, std::milli>(Clock::now() - since).count();
    const std::lock_guard lock(mutex_);
    milliseconds_.push_back(spent);
  }

  void print() {
    std::ranges::sort(milliseconds_);
    const std::size_t count = milliseconds_.size();
    if (count == 0) return;
    std::printf("%s: %zu times, p50 %.2f ms, p99 %.2f ms, longest %.1f ms\n", what_, count,
                milliseconds_[count / 2], milliseconds_[count * 99 / 100], milliseconds_.back());
  }

 private:
  const char* what_;
  std::mutex mutex_;
  std::vector<double> milliseconds_;
};

/// What the clients ask for, and how long it took.
struct Load {
  std::string volume, job, result;  ///< of which they ask
  Bytes file = gzip(ball_file(12));
  Times documents{"GET of documents and pages"}, ranges{"GET of ranges of files, with a durable row each"},
      uploads{"durable POST of uploads"}, orders{"durable POST of job orders"};
  std::atomic<std::int64_t> begun = 0;
  std::atomic<int> errors = 0;

  explicit Load(const ServiceClient& service) {
    volume = service.upload(ball_file(24)).at("id");
    const json done = service.run(order(1));
    job = done.at("id");
    result = "/v1/jobs/" + job + "/results/" + done.at("results").at(0).at("name").get<std::string>();
  }

  json order(double flow_time_mm2, const json& isovalues = json::array()) const {
    return {{"volume", volume}, {"parameters", {{"flow_time_mm2", flow_time_mm2}}}, {"isovalues", isovalues}};
  }

  /// One request; which one, twenty dice decide.
  void ask(HttpConnection& connection, std::mt19937& random) {
    const auto which = random() % 20;
    const auto start = Clock::now();
    if (which < 10) {
      expect_status(connection.exchange("GET", "/v1/jobs/" + job), 200);
      documents.add(start);
    } else if (which < 14) {
      expect_status(connection.exchange("GET", "/v1/volumes/" + volume), 200);
      documents.add(start);
    } else if (which < 16) {
      expect_status(connection.exchange("GET", "/v1/jobs?limit=20"), 200);
      documents.add(start);
    } else if (which < 18) {
      const auto from = random() % 1000;
      const std::string range = "bytes=" + std::to_string(from) + "-" + std::to_string(from + 999);
      expect_status(connection.exchange("GET", result, {}, {{"Range", range}}), 206);
      ranges.add(start);
    } else if (which < 19) {
      expect_status(connection.exchange("POST", "/v1/volumes", file), 201);
      uploads.add(start);
    } else {
      expect_status(
          connection.exchange("POST", "/v1/jobs", order(1).dump(), {{"Content-Type", "application/json"}}),
          202);
      orders.add(start);
    }
  }

  /// A client, until all together have asked often enough.
  void work(int port, std::int64_t requests, double seconds_between, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> pause(0.5 * seconds_between, 1.5 * seconds_between);
    std::unique_ptr<HttpConnection> connection;
    while (begun++ < requests) {
      std::this_thread::sleep_for(std::chrono::duration<double>(pause(random)));
      try {
        if (!connection) connection = std::make_unique<HttpConnection>(port);
        ask(*connection, random);
      } catch (const std::exception& error) {
        if (++errors <= 10) std::printf("ERROR: %s\n", error.what());
        connection.reset();
      }
    }
  }
};

/// What the disk takes for a small write and its fsync, now and then.
void measure_disk(const std::filesystem::path& file, Times& times, const std::stop_token& over) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  const std::array<char, 4096> block{};
  for (off_t at = 0; !over.stop_requested(); at += block.size()) {
    const auto start = Clock::now();
    if (::pwrite(descriptor, block.data(), block.size(), at) < 0 || ::fsync(descriptor) != 0) break;
    times.add(start);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  ::close(descriptor);
}

/// Jobs of minutes, one after the other.
void compute(const ServiceClient& service, const std::stop_token& over) {
  const std::string volume = service.upload(ball_file(200)).at("id");
  const json order = {
      {"volume", volume}, {"parameters", {{"flow_time_mm2", 9000}}}, {"isovalues", json::array()}};
  while (!over.stop_requested()) {
    const std::string id = service.submit(order);
    while (!over.stop_requested() && !ServiceClient::is_final(service.job(id)))
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::int64_t requests = argc > 1 ? std::stoll(argv[1]) : 100'000;
  const double per_second = argc > 2 ? std::stod(argv[2]) : 640;
  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  Load load(service);
  Times disk{"the disk's own write and fsync"};
  std::jthread computing([&](const std::stop_token& over) { compute(service, over); });
  const bool busy = eventually([&] { return service.get("/v1/jobs?state=running").at("jobs").size() == 1; });
  if (!busy) throw std::runtime_error("no job begins to compute");
  std::jthread syncing(
      [&](const std::stop_token& over) { measure_disk(daemon.data().parent_path() / "fsync", disk, over); });

  const auto start = Clock::now();
  {
    std::vector<std::jthread> clients;
    for (unsigned client = 0; client < kClients; ++client)
      clients.emplace_back(
          [&, client] { load.work(daemon.port(), requests, kClients / per_second, client); });
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  computing.request_stop();
  syncing.request_stop();
  computing.join();
  syncing.join();
  std::printf("%lld requests by %d clients in %.0f s\n", static_cast<long long>(requests), kClients, seconds);
  for (Times* times : {&load.documents, &load.ranges, &load.uploads, &load.orders, &disk}) times->print();
  std::printf("%d went wrong\n", load.errors.load());
  return load.errors > 0 ? 1 : 0;
}
