#include "service/http/routes.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "service/http/ascii.h"
#include "service/http/handlers.h"

namespace volsmooth {
namespace {

using Kind = QueryParameter::Kind;

constexpr std::nullopt_t kOpen = std::nullopt;
constexpr std::string_view kJson = "application/json";
constexpr std::size_t kMaxQueryText = 1024;  // a label has 200 characters of up to 4 bytes
constexpr double kLargestInteger = 2147483647;

std::vector<Route> make_routes() {
  const std::vector<QueryParameter> upload = {
      {"volume_index", "Which volume of a 4-D file, counted from 0.", Kind::kInteger, 0, kLargestInteger},
      {"series", "Which series of several, by its DICOM series UID."},
      {"resample", "Allows slices that are unevenly spaced.", Kind::kText, 0, 0, {"uniform"}},
      {"non_finite", "Replaces voxels that are NaN or infinite.", Kind::kNumber, -1e30, 1e30}};
  const std::vector<QueryParameter> listing = {
      {"state",
       "Only jobs in this state.",
       Kind::kText,
       0,
       0,
       {"queued", "running", "succeeded", "failed", "cancelled"}},
      {"method", "Only jobs of this method."},
      {"label", "Only jobs with exactly this label."},
      {"limit", "At most this many jobs.", Kind::kInteger, 1, 500},
      {"cursor", "Continues after the page that gave this as next_cursor."}};
  const std::vector<QueryParameter> volume_listing = {
      {"limit", "At most this many volumes; 1,000 unless it is said.", Kind::kInteger, 1, 1000},
      {"cursor", "Continues after the page that gave this as next_cursor."}};
  const std::vector<QueryParameter> waiting = {
      {"wait", "Seconds to wait for the job to become final before answering.", Kind::kNumber, 0, 300}};

  return {
      {"POST",
       "/v1/volumes",
       Scope::kSubmit,
       "Uploads a volume; the body is the file itself.",
       post_volume,
       {201, kJson, "Volume", "The verified volume."},
       upload,
       BodyKind::kFile,
       "",
       true},
      {"GET",
       "/v1/volumes",
       Scope::kRead,
       "Lists volumes, newest first.",
       get_volumes,
       {200, kJson, "VolumePage", "A page of volumes."},
       volume_listing},
      {"GET",
       "/v1/volumes/{id}",
       Scope::kRead,
       "One volume.",
       get_volume,
       {200, kJson, "Volume", "The volume.", true}},
      {"GET",
       "/v1/volumes/{id}/content",
       Scope::kRead,
       "The bytes as uploaded.",
       get_volume_content,
       {200, "*/*", "", "The file; in ranges when asked.", true}},
      {"DELETE",
       "/v1/volumes/{id}",
       Scope::kSubmit,
       "Deletes a volume that no unfinished job needs.",
       delete_volume,
       {204, "", "", "It is gone."}},

      {"POST",
       "/v1/jobs",
       Scope::kSubmit,
       "Submits a job; durable before the answer.",
       post_job,
       {202, kJson, "AcceptedJob", "The queued job."},
       {},
       BodyKind::kOrder,
       "JobOrder",
       true},
      {"GET",
       "/v1/jobs",
       Scope::kRead,
       "Lists jobs, newest first.",
       get_jobs,
       {200, kJson, "JobPage", "A page of jobs."},
       listing},
      {"GET",
       "/v1/jobs/{id}",
       Scope::kRead,
       "One job, now or when it is final.",
       get_job,
       {200, kJson, "Job", "The job.", true},
       waiting},
      {"GET",
       "/v1/jobs/{id}/events",
       Scope::kRead,
       "The job's events, as they happen, to its final state.",
       get_job_events,
       {200, "text/event-stream", "", "Events `state` and `progress`; resumes after Last-Event-ID."}},
      {"POST",
       "/v1/jobs/{id}/cancel",
       Scope::kSubmit,
       "Cancels a job; a final one stays as it is.",
       cancel_job,
       {202, kJson, "AcceptedJob", "The job."}},
      {"DELETE",
       "/v1/jobs/{id}",
       Scope::kSubmit,
       "Deletes a job and its results, cancelling it first.",
       delete_job,
       {204, "", "", "It is gone."}},
      {"GET",
       "/v1/jobs/{id}/results",
       Scope::kRead,
       "What a job has made.",
       get_results,
       {200, kJson, "ResultList", "Its results."}},
      {"GET",
       "/v1/jobs/{id}/results/{name}",
       Scope::kRead,
       "The bytes of one result.",
       get_result,
       {200, "*/*", "", "The file; in ranges when asked.", true}},
      {"GET",
       "/v1/jobs/{id}/delivery",
       Scope::kRead,
       "What became of each DICOM instance that goes to the job's destination.",
       get_delivery,
       {200, kJson, "Ledger", "The ledger."}},
      {"POST",
       "/v1/jobs/{id}/deliver",
       Scope::kSubmit,
       "Begins a failed delivery again.",
       deliver_again,
       {202, kJson, "AcceptedJob", "The job."}},

      {"POST",
       "/dicomweb/{preset}/studies",
       Scope::kSubmit,
       "Takes DICOM instances (STOW-RS); a job of the preset runs on each series when it is whole.",
       post_studies,
       {200, "application/dicom+json", "", "What was stored."},
       {},
       BodyKind::kFile},

      {"GET",
       "/v1/methods",
       Scope::kRead,
       "The methods with their parameters, units, limits and defaults.",
       get_methods,
       {200, kJson, "MethodList", "All methods."}},
      {"GET",
       "/v1/formats",
       Scope::kRead,
       "The formats that are read and written.",
       get_formats,
       {200, kJson, "FormatList", "All formats."}},
      {"GET",
       "/healthz",
       kOpen,
       "Whether the process answers.",
       get_healthz,
       {200, kJson, "Status", "It does."}},
      {"GET",
       "/readyz",
       kOpen,
       "Whether jobs can be taken now.",
       get_readyz,
       {200, kJson, "Status", "They can."}},
      {"GET",
       "/metrics",
       Scope::kAdmin,
       "Metrics in Prometheus' text format.",
       get_metrics,
       {200, "text/plain", "", "The metrics."}},
      {"GET",
       "/openapi.json",
       Scope::kRead,
       "This description.",
       get_openapi,
       {200, kJson, "", "OpenAPI 3.1."}},
  };
}

bool is_placeholder(std::string_view part) {
  return part.starts_with('{');
}

/// The values of the placeholders when `segments` has the form of `pattern`.
std::optional<RouteMatch> match_one(const Route& route, const std::vector<std::string>& segments) {
  const auto parts = split(route.pattern.substr(1), '/');
  if (parts.size() != segments.size()) return std::nullopt;
  RouteMatch match{&route, {}};
  for (std::size_t at = 0; at < parts.size(); ++at) {
    if (is_placeholder(parts[at]) && !segments[at].empty())
      match.path.emplace(parts[at].substr(1, parts[at].size() - 2), segments[at]);
    else if (parts[at] != segments[at])
      return std::nullopt;
  }
  return match;
}

tl::unexpected<Problem> bad_query(const QueryParameter& parameter, std::string_view expected) {
  return tl::unexpected(Problem{
      "bad-query",
      "The query parameter " + std::string(parameter.name) + " must be " + std::string(expected) + ".",
      {{"parameter", parameter.name}}});
}

std::string joined(const std::vector<std::string_view>& words) {
  std::string text;
  for (const auto word : words) text += (text.empty() ? "" : ", ") + std::string(word);
  return text;
}

std::string as_text(double value) {
  return nlohmann::json(value).dump();
}

template <typename Number>
bool is_number_in_limits(const QueryParameter& parameter, std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const auto as_double = static_cast<double>(value);
  return error == std::errc() && end == text.data() + text.size() && as_double >= parameter.minimum &&
         as_double <= parameter.maximum;
}

tl::expected<void, Problem> check_value(const QueryParameter& parameter, std::string_view value) {
  const auto limits = " from " + as_text(parameter.minimum) + " to " + as_text(parameter.maximum);
  switch (parameter.kind) {
    case Kind::kInteger:
      if (!is_number_in_limits<std::int64_t>(parameter, value))
        return bad_query(parameter, "a whole number" + limits);
      break;
    case Kind::kNumber:
      if (!is_number_in_limits<double>(parameter, value)) return bad_query(parameter, "a number" + limits);
      break;
    case Kind::kText:
      if (!parameter.choices.empty() &&
          std::ranges::find(parameter.choices, value) == parameter.choices.end())
        return bad_query(parameter, "one of: " + joined(parameter.choices));
      if (value.size() > kMaxQueryText)
        return bad_query(parameter, "at most " + std::to_string(kMaxQueryText) + " bytes long");
  }
  return {};
}

}  // namespace

const std::vector<Route>& routes() {
  static const std::vector<Route> table = make_routes();
  return table;
}

tl::expected<RouteMatch, Problem> match_route(std::string_view method,
                                              const std::vector<std::string>& segments) {
  const auto wanted = method == "HEAD" ? std::string_view("GET") : method;
  std::vector<std::string_view> allowed;
  for (const auto& route : routes()) {
    auto match = match_one(route, segments);
    if (!match) continue;
    if (route.method == wanted) return std::move(*match);
    allowed.push_back(route.method);
    if (route.method == "GET") allowed.push_back("HEAD");
  }
  if (allowed.empty())
    return tl::unexpected(
        Problem{"not-found", "There is nothing at this path; /openapi.json lists what there is."});
  return tl::unexpected(Problem{
      "method-not-allowed", "This path takes " + joined(allowed) + ".", {{"allow", joined(allowed)}}});
}

tl::expected<void, Problem> check_query(const Route& route, const QueryValues& query) {
  for (const auto& [name, value] : query) {
    const auto parameter = std::ranges::find(route.query, std::string_view(name), &QueryParameter::name);
    if (parameter == route.query.end())
      return tl::unexpected(Problem{"bad-query", "The query has a parameter that this call does not take."});
    if (auto checked = check_value(*parameter, value); !checked) return checked;
  }
  return {};
}

}  // namespace volsmooth
