#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "service/jobs/job_service.h"

namespace volsmooth {

/// What the daemon counts about itself. Thread-safe. Labels come from tables, never from requests.
class Metrics {
 public:
  Metrics();
  ~Metrics();

  /// `route` is the pattern, or empty when none matched.
  void request_done(std::string_view method, std::string_view route, int status, double seconds);
  void job_done(const Job& job);
  /// Of a job, such as "flow"; or "verify", of an upload.
  void stage_done(std::string_view stage, double seconds);

  /// Counts an upload as being received as long as the handle lives.
  std::shared_ptr<void> upload_begins();

  void handshake_refused();    ///< of TLS, to a stranger who asked for too many
  void association_refused();  ///< of DICOM, to one who may not call

  /// Prometheus' text format, with the gauges as of now.
  std::string text(const ServiceStatistics& now);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volsmooth
