#include "client/exit_code.h"

#include <array>

namespace volsmooth {
namespace {

struct SlugRow {
  std::string_view slug;
  ExitCode code;
};

/// Problems whose status alone would say something else.
constexpr std::array kSlugs{
    SlugRow{"bad-id", ExitCode::kNoInput},
    SlugRow{"internal", ExitCode::kInternal},
    SlugRow{"attempts-exhausted", ExitCode::kInternal},
    SlugRow{"integrity-failure", ExitCode::kInternal},
};

struct StatusRow {
  long first, last;
  ExitCode code;
};

/// The first row that fits counts.
constexpr std::array kStatuses{
    StatusRow{401, 401, ExitCode::kNotAllowed}, StatusRow{403, 403, ExitCode::kNotAllowed},
    StatusRow{404, 404, ExitCode::kNoInput},    StatusRow{410, 410, ExitCode::kNoInput},
    StatusRow{408, 409, ExitCode::kTryLater},   StatusRow{421, 421, ExitCode::kNotAllowed},
    StatusRow{429, 429, ExitCode::kTryLater},   StatusRow{400, 499, ExitCode::kBadData},
    StatusRow{503, 503, ExitCode::kTryLater},   StatusRow{507, 507, ExitCode::kTryLater},
};

}  // namespace

ExitCode exit_code_for(long status, std::string_view slug) {
  for (const SlugRow& row : kSlugs) {
    if (row.slug == slug) return row.code;
  }
  for (const StatusRow& row : kStatuses) {
    if (row.first <= status && status <= row.last) return row.code;
  }
  return ExitCode::kInternal;
}

ExitCode exit_code_for_failed_job(const nlohmann::json& problem) {
  if (!problem.is_object()) return ExitCode::kInternal;
  const auto status = problem.find("status");
  const bool known = status != problem.end() && status->is_number_integer();
  const long code = known ? status->get<long>() : 422;
  const bool blames_input = exit_code_for(code, slug_of(problem)) != ExitCode::kInternal && code < 500;
  return blames_input ? ExitCode::kBadData : ExitCode::kInternal;
}

std::string slug_of(const nlohmann::json& problem) {
  if (!problem.is_object()) return {};
  const auto type = problem.find("type");
  if (type == problem.end() || !type->is_string()) return {};
  const auto text = type->get<std::string>();
  return text.substr(text.rfind('/') + 1);
}

}  // namespace volsmooth
