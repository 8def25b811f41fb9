#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace volsmooth {

/// The one of `names` that `name` is most likely a slip of the pen for; empty: none is near.
std::string nearest_match(const std::string& name, const std::vector<std::string>& names);

/// "; did you mean '...'?" with the nearest match, or nothing.
std::string did_you_mean(const std::string& name, const std::vector<std::string>& names);

/// Throws std::runtime_error with what is wrong with a preset of the configuration.
[[noreturn]] void refuse_preset(const std::string& name, const std::string& what);

/// Calls `refuse` with a sentence when an object of the configuration has another member than the `known`.
void know_members(const nlohmann::json& object, const std::vector<std::string>& known,
                  const std::function<void(const std::string& sentence)>& refuse);

/// A list of one text or more; none: it is something else.
std::optional<std::vector<std::string>> texts_in(const nlohmann::json& value);

}  // namespace volsmooth
