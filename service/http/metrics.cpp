#include "service/http/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

namespace volsmooth {
namespace {

using prometheus::Counter;
using prometheus::Family;
using prometheus::Gauge;
using prometheus::Histogram;

const Histogram::BucketBoundaries kRequestSeconds = {0.001, 0.005, 0.02, 0.1, 0.5, 2, 10, 60};
const Histogram::BucketBoundaries kStageSeconds = {0.01, 0.05, 0.1, 0.5, 1, 2, 5, 10, 30, 60, 300, 1800};
const Histogram::BucketBoundaries kJobSeconds = {0.1, 0.5, 1, 2, 5, 10, 30, 60, 300, 1800, 7200};

template <typename Metric>
Family<Metric>& family(prometheus::Registry& registry, auto builder, const char* name,
                       const char* description) {
  return builder().Name(name).Help(description).Register(registry);
}

}  // namespace

struct Metrics::State {
  prometheus::Registry registry;
  Family<Counter>& requests =
      family<Counter>(registry, prometheus::BuildCounter, "volsmooth_http_requests_total",
                      "Requests by method, route pattern and status.");
  Family<Histogram>& request_seconds =
      family<Histogram>(registry, prometheus::BuildHistogram, "volsmooth_http_request_seconds",
                        "From the head of a request to the end of its answer.");
  Family<Counter>& jobs = family<Counter>(registry, prometheus::BuildCounter, "volsmooth_jobs_total",
                                          "Jobs that became final, by state and method.");
  Family<Histogram>& job_seconds =
      family<Histogram>(registry, prometheus::BuildHistogram, "volsmooth_job_seconds",
                        "From the start of a job to its final state.");
  Histogram& wait_seconds =
      family<Histogram>(registry, prometheus::BuildHistogram, "volsmooth_job_wait_seconds",
                        "From the submission of a job to its last start.")
          .Add({}, kJobSeconds);
  Family<Histogram>& stage_seconds =
      family<Histogram>(registry, prometheus::BuildHistogram, "volsmooth_stage_seconds",
                        "Each stage of the jobs that ran to their end, and the verification of uploads.");
  Family<Gauge>& gauges(const char* name, const char* description) {
    return family<Gauge>(registry, prometheus::BuildGauge, name, description);
  }
  Gauge& queued = gauges("volsmooth_jobs_queued", "Jobs that wait.").Add({});
  Gauge& running = gauges("volsmooth_jobs_running", "Jobs that run.").Add({});
  Gauge& volumes = gauges("volsmooth_volumes", "Volumes that are kept.").Add({});
  Gauge& stored = gauges("volsmooth_stored_bytes", "Bytes of volumes and results.").Add({});
  Gauge& free_disk = gauges("volsmooth_free_disk_bytes", "Free bytes where the data is.").Add({});
  Gauge& damaged =
      gauges("volsmooth_damaged_files", "Stored files that are not what was stored; the log names them.")
          .Add({});
  Counter& refused_handshakes =
      family<Counter>(registry, prometheus::BuildCounter, "volsmooth_refused_handshakes_total",
                      "TLS connections of strangers that were closed because they were too many.")
          .Add({});
  Counter& refused_associations =
      family<Counter>(registry, prometheus::BuildCounter, "volsmooth_refused_associations_total",
                      "DICOM associations of callers whom no preset, or not the one they called, expects.")
          .Add({});
  Gauge& uploads = gauges("volsmooth_uploads_receiving", "Uploads that are being received.").Add({});
};

Metrics::Metrics() : state_(std::make_unique<State>()) {}
Metrics::~Metrics() = default;

void Metrics::request_done(std::string_view method, std::string_view route, int status, double seconds) {
  const std::string label(route.empty() ? "none" : route);
  const std::string verb(method.empty() ? "none" : method);
  state_->requests.Add({{"method", verb}, {"route", label}, {"status", std::to_string(status)}}).Increment();
  state_->request_seconds.Add({{"route", label}}, kRequestSeconds).Observe(seconds);
}

void Metrics::job_done(const Job& job) {
  const std::string state(name_of(job.state));
  state_->jobs.Add({{"state", state}, {"method", job.order.method}}).Increment();
  if (!job.started_at || !job.finished_at) return;
  const std::chrono::duration<double> taken = *job.finished_at - *job.started_at;
  state_->job_seconds.Add({{"state", state}}, kJobSeconds).Observe(taken.count());
  const std::chrono::duration<double> waited = *job.started_at - job.created_at;
  state_->wait_seconds.Observe(waited.count());
}

void Metrics::stage_done(std::string_view stage, double seconds) {
  state_->stage_seconds.Add({{"stage", std::string(stage)}}, kStageSeconds).Observe(seconds);
}

std::shared_ptr<void> Metrics::upload_begins() {
  state_->uploads.Increment();
  return {this, [](Metrics* metrics) { metrics->state_->uploads.Decrement(); }};
}

void Metrics::handshake_refused() {
  state_->refused_handshakes.Increment();
}

void Metrics::association_refused() {
  state_->refused_associations.Increment();
}

std::string Metrics::text(const ServiceStatistics& now) {
  state_->queued.Set(static_cast<double>(now.queued));
  state_->running.Set(static_cast<double>(now.running));
  state_->volumes.Set(static_cast<double>(now.volumes));
  state_->stored.Set(static_cast<double>(now.stored_bytes));
  state_->free_disk.Set(static_cast<double>(now.free_disk_bytes));
  state_->damaged.Set(static_cast<double>(now.damaged_files));
  return prometheus::TextSerializer().Serialize(state_->registry.Collect());
}

}  // namespace volsmooth
