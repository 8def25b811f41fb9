#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "service/jobs/job.h"

namespace volsmooth {

/// What the log says of a request. Nothing a client wrote gets in: the route is its pattern.
struct RequestRecord {
  std::string id;  ///< unique, also across restarts
  std::string method;
  std::string_view route;  ///< empty: none matched
  int status = 0;          ///< 0: the client went away before an answer
  std::int64_t bytes_in = 0;
  std::int64_t bytes_out = 0;
  double seconds = 0;
};

/// Sets up the log: one JSON object a line on stderr. `level` is spdlog's name of one.
void start_log(const std::string& level);

void log_request(const RequestRecord& request);
void log_fault(std::string_view request_id, std::string_view route, std::string_view what);
void log_job(const Job& job);
void log_event(std::string_view event, std::string_view message);
void log_warning(std::string_view event, std::string_view message);  ///< somebody should look at it
void log_error(std::string_view event, std::string_view message);    ///< something does not work

}  // namespace volsmooth
