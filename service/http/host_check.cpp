#include "service/http/host_check.h"

#include <algorithm>

#include "service/http/ascii.h"

namespace volsmooth {
namespace {

/// `host` without its port; empty when it is malformed.
std::string_view name_of_host(std::string_view host) {
  const auto bracket = host.starts_with('[') ? host.find(']') : 0;
  if (bracket == std::string_view::npos) return {};
  const auto colon = host.find(':', bracket);
  if (colon == std::string_view::npos) return host;
  const auto port = host.substr(colon + 1);
  const bool good =
      !port.empty() && port.size() <= 5 && std::ranges::all_of(port, [](char c) { return is_digit(c); });
  return good ? host.substr(0, colon) : std::string_view();
}

bool is_ours(std::string_view host, const HostNames& ours) {
  return std::ranges::find(ours.names, lowered(name_of_host(host))) != ours.names.end();
}

/// Whether the field says that a page from elsewhere sends this.
bool is_foreign(const HeaderField& field, const HostNames& ours) {
  if (field.name == "sec-fetch-site") return lowered(field.value) == "cross-site";
  if (field.name != "origin") return false;
  const auto scheme = field.value.find("://");  // an origin without one is "null": a page that may not say
  return scheme == std::string::npos || !is_ours(std::string_view(field.value).substr(scheme + 3), ours);
}

}  // namespace

tl::expected<void, Problem> check_host(const Head& head, const HostNames& ours) {
  const auto is_host = [](const HeaderField& field) { return field.name == "host"; };
  const auto host = head.header("host");
  if (std::ranges::count_if(head.fields, is_host) != 1 || name_of_host(host).empty())
    return tl::unexpected(
        Problem{"bad-host", "A request must have one Host field: a name and maybe a port."});
  if (!is_ours(host, ours))
    return tl::unexpected(
        Problem{"misdirected-request",
                "Address the daemon as localhost or 127.0.0.1, or start it with --host-name "
                "and the name you use."});
  return {};
}

tl::expected<void, Problem> check_origin(const Head& head, const HostNames& ours) {
  if (std::ranges::any_of(head.fields, [&](const HeaderField& field) { return is_foreign(field, ours); }))
    return tl::unexpected(Problem{"cross-origin", "A page of another site may not use this service."});
  return {};
}

}  // namespace volsmooth
