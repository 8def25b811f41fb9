#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "service/http/message.h"

namespace volsmooth {

/// The entity tag of a job's document: another one as soon as a byte changes, so all the time while it runs.
std::string entity_tag(std::string_view document);
/// That of a volume, which never changes, and of its bytes.
std::string entity_tag(const StoredVolume& volume);

/// Whether If-None-Match names `tag`: weakly, so that W/ before it does not count (RFC 9110, section 13.1.2).
bool if_none_match_names(const Head& head, std::string_view tag);
/// Whether If-Match names `tag`, or is not there: strongly, so that a weak tag is never ours
/// (section 13.1.1).
bool if_match_holds(const Head& head, std::string_view tag);

/// Answers a GET with a document and its tag, or with 304 to who has it already.
Response tagged_response(const Request& request, const nlohmann::json& document, const std::string& tag);

/// precondition-failed.
Problem has_changed();

}  // namespace volsmooth
