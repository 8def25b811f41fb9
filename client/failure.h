#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <tl/expected.hpp>

#include "client/exit_code.h"

namespace volsmooth {

/// Why a command did not do what it was asked for.
struct Failure {
  ExitCode code = ExitCode::kInternal;
  std::string sentence;  ///< for a person
  nlohmann::json problem =
      nlohmann::json();  ///< the server's problem document; null when it was not the server
};

template <typename Value>
using Expected = tl::expected<Value, Failure>;

inline tl::unexpected<Failure> fail(ExitCode code, std::string sentence) {
  return tl::unexpected(Failure{code, std::move(sentence), {}});
}

/// What a problem document says to a person.
std::string sentence_of(const nlohmann::json& problem);

}  // namespace volsmooth
