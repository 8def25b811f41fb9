#pragma once

#include <nlohmann/json.hpp>
#include <string_view>

namespace volsmooth {

/// What the program ends with: sysexits.h where it has a word for it.
enum class ExitCode {
  kDone = 0,
  kUsage = 2,
  kBadData = 65,
  kNoInput = 66,
  kUnreachable = 69,
  kInternal = 70,
  kCannotWrite = 73,
  kTryLater = 75,
  kNotAllowed = 77,
  kInterrupted = 130,
};

/// For an answer that is not a success: its HTTP status, and the slug of its problem type where it has one.
ExitCode exit_code_for(long status, std::string_view slug);

/// For a job that failed: whether its input and order are to blame, or the service.
ExitCode exit_code_for_failed_job(const nlohmann::json& problem);

/// The last part of a problem's `type`, such as "bad-parameter"; empty when it has none.
std::string slug_of(const nlohmann::json& problem);

}  // namespace volsmooth
