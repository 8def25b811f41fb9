#pragma once

#include <nlohmann/json.hpp>
#include <tl/expected.hpp>

#include "service/jobs/job_service.h"

namespace volsmooth {

/// The documents of the REST contract. Times are RFC 3339 UTC with milliseconds.
nlohmann::json to_json(const StoredVolume& volume);
nlohmann::json to_json(const Job& job);
nlohmann::json to_json(const Delivery& delivery);
nlohmann::json to_json(const LedgerEntry& entry);
nlohmann::json to_json(const Result& result);
nlohmann::json to_json(const JobOrder& order);
nlohmann::json to_json(const JobProgress& progress);
nlohmann::json to_json(const ParameterValues& parameters);
nlohmann::json to_json(const ParameterInfo& info);
nlohmann::json to_json(const MethodInfo& method);
/// `type`, `detail` and the problem's own members; title and status are HTTP's to add.
nlohmann::json to_json(const Problem& problem);
std::string rfc3339(Time time);

/// Reads an order: every member checked, unknown ones refused (unknown-field), wrong ones by name with what
/// would be right (bad-parameter). Whether the parameters fit the method is `check_parameters`' to say.
tl::expected<JobOrder, Problem> order_from(const nlohmann::json& document);

/// Checks `parameters` against the method's declaration: unknown-field, bad-parameter with the member, its
/// unit and its limits, two that exclude each other.
tl::expected<void, Problem> check_parameters(const ParameterValues& parameters, const MethodInfo& method);

}  // namespace volsmooth
