#include "service/http/audit_entry.h"

#include "service/http/problem_types.h"
#include "service/jobs/ids.h"

namespace volsmooth {
namespace {

/// The id in the path. What has not the form of one of ours is the client's text, which has no place in the
/// audit.
std::string object_of(const Request& request) {
  const auto id = request.path.find("id");
  return id != request.path.end() && has_form_of_new_id(id->second) ? id->second : "";
}

bool concerns_data(const Route& route) {
  return route.method != "GET" || route.answer.media_type == "*/*";
}

}  // namespace

std::optional<AuditEntry> audit_entry(const Route* route, const Request& request, const Reply& reply) {
  const std::string what = route ? std::string(route->method) + " " + std::string(route->pattern) : "";
  if (reply) {
    if (!std::holds_alternative<FileBody>(reply->body) || request.head.method == "HEAD") return std::nullopt;
    return AuditEntry{request.path.contains("name") ? "result downloaded" : "volume downloaded",
                      object_of(request)};
  }
  const int status = problem_type(reply.error().slug).status;
  const bool no_right = status == 401 || status == 403;
  if (!no_right && !(route && concerns_data(*route))) return std::nullopt;
  return AuditEntry{what, object_of(request), reply.error().slug};
}

}  // namespace volsmooth
