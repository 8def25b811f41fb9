// measure_latency [REQUESTS]: how long GET /v1/jobs/{id} takes on a kept loopback connection while jobs keep
// all cores busy. Prints the median, the 99th percentile and the longest, in milliseconds.
#include <cstdio>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

using namespace volsmooth::test;

namespace {

double milliseconds_of_one_get(HttpConnection& connection, const std::string& target) {
  const auto start = std::chrono::steady_clock::now();
  expect_status(connection.exchange("GET", target), 200);
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

int main(int argc, char** argv) {
  const std::size_t requests = argc > 1 ? std::stoul(argv[1]) : 10'000;
  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  const json order = {{"volume", service.upload(ball_file(256)).at("id")},
                      {"parameters", {{"flow_time_mm2", 9000}}},
                      {"isovalues", json::array()}};
  const std::string first = service.submit(order), second = service.submit(order);
  const auto flows = [&](const std::string& id) {
    return service.job(id).at("progress").at("stage") == "flow";
  };
  if (!eventually([&] { return flows(first); }))
    throw std::runtime_error("the job does not begin to compute");

  HttpConnection connection(daemon.port());
  std::vector<double> times;
  for (std::size_t i = 0; i < requests; ++i)
    times.push_back(milliseconds_of_one_get(connection, "/v1/jobs/" + first));
  if (!flows(first)) throw std::runtime_error("the job ended before the measurement did");

  std::sort(times.begin(), times.end());
  std::printf(
      "GET /v1/jobs/{id}, %zu requests beside a running job: p50 %.3f ms, p99 %.3f ms, longest %.3f ms\n",
      requests, times[requests / 2], times[requests * 99 / 100], times.back());
}
