#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "service/jobs/problem.h"

namespace volsmooth {

/// What every problem of one kind has in common (RFC 9457): its URI is `/problems/<slug>`.
struct ProblemType {
  std::string_view slug;
  int status;
  std::string_view title;
};

std::span<const ProblemType> problem_types();

/// The row of `slug`; throws std::logic_error for one that the table does not have.
const ProblemType& problem_type(std::string_view slug);

/// The `application/problem+json` document of a problem.
nlohmann::json problem_document(const Problem& problem);
/// The same of one that has all but title and status already (`to_json` of jobs).
nlohmann::json completed_problem(nlohmann::json document);

}  // namespace volsmooth
