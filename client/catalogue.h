#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "client/api.h"

namespace volsmooth {

/// The entry of a method in the server's catalogue; kUsage with what there is when it is unknown.
Expected<nlohmann::json> find_method(Api& api, const std::string& name);

/// The catalogue for a person: every method with its parameters, units, limits and defaults.
std::string catalogue_text(const nlohmann::json& catalogue);

}  // namespace volsmooth
