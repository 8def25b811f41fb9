#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace volsmooth {

/// A value as a person writes it: text without quotes, whole numbers without a point, lists with spaces, null
/// as nothing; what a terminal would obey is made harmless.
std::string text_of(const nlohmann::json& value);

/// The text of a member; empty when there is none.
std::string member_text(const nlohmann::json& document, const char* name);

}  // namespace volsmooth
