#include "service/http/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <nlohmann/json.hpp>

namespace volsmooth {
namespace {

/// Text as a JSON string; what is not UTF-8 is replaced.
std::string quoted(std::string_view text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// The members of a line. What does not come as members already, such as a plain message of a library or of
/// the jobs, is made a `message`.
class Members : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& line, const std::tm&, spdlog::memory_buf_t& into) override {
    const std::string_view payload(line.payload.data(), line.payload.size());
    const std::string members =
        payload.starts_with('"') ? std::string(payload) : R"("event":"message","message":)" + quoted(payload);
    into.append(members.data(), members.data() + members.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<Members>(); }
};

void log_at(spdlog::level::level_enum level, std::string_view event, std::string_view message) {
  spdlog::log(level, R"("event":"{}","message":{})", event, quoted(message));
}

}  // namespace

void start_log(const std::string& level) {
  auto logger = spdlog::stderr_logger_mt("volsmoothd");
  auto formatter = std::make_unique<spdlog::pattern_formatter>(spdlog::pattern_time_type::utc);
  formatter->add_flag<Members>('*').set_pattern(R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",%*})");
  logger->set_formatter(std::move(formatter));
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
}

void log_request(const RequestRecord& request) {
  spdlog::info(
      R"("event":"request","request":"{}","method":"{}","route":"{}","status":{},"bytes_in":{},"bytes_out":{},"ms":{:.1f})",
      request.id, request.method, request.route, request.status, request.bytes_in, request.bytes_out,
      1000 * request.seconds);
}

void log_fault(std::string_view request_id, std::string_view route, std::string_view what) {
  spdlog::error(R"("event":"fault","request":"{}","route":"{}","what":{})", request_id, route, quoted(what));
}

void log_job(const Job& job) {
  const std::chrono::duration<double> taken =
      job.started_at && job.finished_at ? *job.finished_at - *job.started_at : Time::duration::zero();
  spdlog::info(
      R"("event":"job","job":"{}","method":"{}","state":"{}","problem":"{}","attempt":{},"ms":{:.1f})",
      job.id, job.order.method, name_of(job.state), job.error ? job.error->slug : "", job.attempt,
      1000 * taken.count());
}

void log_event(std::string_view event, std::string_view message) {
  log_at(spdlog::level::info, event, message);
}

void log_warning(std::string_view event, std::string_view message) {
  log_at(spdlog::level::warn, event, message);
}

void log_error(std::string_view event, std::string_view message) {
  log_at(spdlog::level::err, event, message);
}

}  // namespace volsmooth
