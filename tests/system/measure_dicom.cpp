// measure_dicom [SLICES] [FLOW_TIME]: a noisy series of 512 x 512 x SLICES int16 voxels (181) in a zip,
// through the daemon and back as a derived series. Prints for every part the seconds that it took, by the
// clock and of processors (the daemon and its children), and what the way there and back took beside the
// flow.
#include <unistd.h>

#include <cstdio>

#include "tests/support/dicom_maker.h"
#include "tests/system/service_client.h"

using namespace volsmooth::test;

namespace {

/// A shaded ball in air with noise of five bits, of which deflate makes half: as a scanner's slices are.
SeriesPhantom noisy_head(std::int64_t slices) {
  SeriesPhantom phantom{.columns = 512, .rows = 512, .slices = slices, .origin_mm = {-256, -256, 0}};
  const double middle = static_cast<double>(slices) / 2;
  phantom.intensity = [middle, state = 1U](const Point& p) mutable {
    state = state * 1664525 + 1013904223;
    const double squares = p[0] * p[0] + p[1] * p[1] + (p[2] - middle) * (p[2] - middle);
    return (squares < 220 * 220 ? 40 + p[0] : -990) + static_cast<double>(state >> 27) - 16;
  };
  return phantom;
}

/// Of the daemon and of the children that it has waited for.
double processor_seconds(const Daemon& daemon) {
  std::ifstream file("/proc/" + std::to_string(daemon.pid()) + "/stat");
  std::string line;
  std::getline(file, line);
  std::istringstream fields(line.substr(line.rfind(')') + 2));
  std::string skipped;
  for (int field = 3; field < 14; ++field) fields >> skipped;
  long ticks = 0, total = 0;
  for (int field = 14; field < 18 && fields >> ticks; ++field) total += ticks;
  return static_cast<double>(total) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

class Watch {
 public:
  explicit Watch(const Daemon& daemon) : daemon_(daemon) {}

  /// Seconds by the clock that `work` takes.
  template <class Work>
  double time(const char* what, const Work& work) const {
    const auto begin = std::chrono::steady_clock::now();
    const double processors = processor_seconds(daemon_);
    work();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::printf("%-9s %6.2f s, of processors %6.2f s\n", what, seconds,
                processor_seconds(daemon_) - processors);
    return seconds;
  }

 private:
  const Daemon& daemon_;
};

}  // namespace

int main(int argc, char** argv) {
  const std::int64_t slices = argc > 1 ? std::stoll(argv[1]) : 181;
  const double flow_time = argc > 2 ? std::stod(argv[2]) : 1;
  const std::string zip = zip_of(files_of(series_of(noisy_head(slices))));
  const Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  const Watch watch(daemon);
  json volume, job;
  std::string series;
  double seconds = watch.time("upload", [&] { volume = service.upload(zip); });
  seconds += watch.time("job", [&] {
    job = service.run({{"volume", volume.at("id")},
                       {"parameters", {{"flow_time_mm2", flow_time}}},
                       {"isovalues", json::array()},
                       {"outputs", {"dicom-series"}}});
  });
  seconds +=
      watch.time("download", [&] { series = service.fetch(job.at("id"), "mean-curvature-flow_dicom.zip"); });
  const json timing = json::parse(service.fetch(job.at("id"), "report.json")).at("timing");
  std::printf("of the job: %s\n", timing.dump().c_str());
  std::printf("%lld slices, %.1f MB in and %.1f MB out: %.2f s beside the flow\n",
              static_cast<long long>(slices), static_cast<double>(zip.size()) / 1e6,
              static_cast<double>(series.size()) / 1e6, seconds - timing.at("flow_seconds").get<double>());
}
