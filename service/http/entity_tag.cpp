#include "service/http/entity_tag.h"

#include <algorithm>
#include <iterator>
#include <span>
#include <vector>

#include "service/http/answers.h"
#include "service/http/ascii.h"
#include "service/storage/digest.h"

namespace volsmooth {
namespace {

/// The members of all fields of that name; an empty one for a field without any.
std::vector<std::string_view> tags_in(const Head& head, std::string_view name) {
  std::vector<std::string_view> tags;
  for (const HeaderField& field : head.fields)
    if (field.name == name) std::ranges::copy(split(field.value, ','), std::back_inserter(tags));
  return tags;
}

}  // namespace

std::string entity_tag(std::string_view document) {
  Sha256 sha256;
  sha256.update(std::as_bytes(std::span(document)));
  return '"' + sha256.hex() + '"';
}

std::string entity_tag(const StoredVolume& volume) {
  return '"' + volume.sha256 + '"';
}

bool if_none_match_names(const Head& head, std::string_view tag) {
  return std::ranges::any_of(tags_in(head, "if-none-match"), [tag](std::string_view one) {
    if (one.starts_with("W/")) one.remove_prefix(2);
    return one == tag || one == "*";
  });
}

bool if_match_holds(const Head& head, std::string_view tag) {
  const auto tags = tags_in(head, "if-match");
  return tags.empty() ||
         std::ranges::any_of(tags, [tag](std::string_view one) { return one == tag || one == "*"; });
}

Response tagged_response(const Request& request, const nlohmann::json& document, const std::string& tag) {
  Response response = json_response(document);
  response.headers.push_back({"ETag", tag});
  if (if_none_match_names(request.head, tag)) {
    response.status = 304;
    response.body = {};
  }
  return response;
}

Problem has_changed() {
  return {"precondition-failed", "It is not what If-Match names any more; get it again and look."};
}

}  // namespace volsmooth
