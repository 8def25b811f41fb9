// measure_throughput [SMALL [LONG]]: queues LONG (3) jobs of a minute or so, then SMALL (60) of a fraction of
// a second, and prints how long the small ones took together, how many of them a minute, how long all took,
// and the slowest and the 99th percentile of the answers to GET /v1/jobs/{id} meanwhile.
#include <algorithm>
#include <cstdio>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

using namespace volsmooth::test;

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

json order(const json& volume, double flow_time_mm2) {
  return {
      {"volume", volume.at("id")}, {"parameters", {{"flow_time_mm2", flow_time_mm2}}}, {"isovalues", {500}}};
}

}  // namespace

int main(int argc, char** argv) {
  const int small = argc > 1 ? std::stoi(argv[1]) : 60, lasting = argc > 2 ? std::stoi(argv[2]) : 3;
  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  const json large_volume = service.upload(ball_file(256)), small_volume = service.upload(ball_file(64));
  const auto start = Clock::now();
  std::vector<std::string> long_jobs, small_jobs;
  for (int i = 0; i < lasting; ++i) long_jobs.push_back(service.submit(order(large_volume, 150)));
  for (int i = 0; i < small; ++i) small_jobs.push_back(service.submit(order(small_volume, 1)));

  std::vector<double> answers;
  const auto finish = [&](const std::vector<std::string>& jobs) {
    for (const std::string& id : jobs) {
      while (true) {
        const auto asked = Clock::now();
        const json job = service.job(id);
        answers.push_back(seconds_since(asked));
        if (ServiceClient::is_final(job)) {
          if (job.at("state") != "succeeded") throw std::runtime_error("the job ended as " + job.dump());
          break;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    }
    return seconds_since(start);
  };
  const double small_seconds = finish(small_jobs), all_seconds = finish(long_jobs);
  std::ranges::sort(answers);
  std::printf("%d small jobs in %.1f s (%.0f a minute) beside %d long ones, all in %.1f s\n", small,
              small_seconds, 60 * small / small_seconds, lasting, all_seconds);
  std::printf("GET /v1/jobs/{id}, %zu times: p99 %.2f ms, slowest %.2f ms\n", answers.size(),
              1000 * answers[answers.size() * 99 / 100], 1000 * answers.back());
}
