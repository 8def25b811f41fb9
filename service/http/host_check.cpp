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

}  // namespace

tl::expected<void, Problem> check_host(const Head& head, const HostNames& ours) {
  const auto is_host = [](const HeaderField& field) { return field.name == "host"; };
  const std::string name = lowered(name_of_host(head.header("host")));
  if (std::ranges::count_if(head.fields, is_host) != 1 || name.empty())
    return tl::unexpected(
        Problem{"bad-host", "A request must have one Host field: a name and maybe a port."});
  if (std::ranges::find(ours.names, name) == ours.names.end())
    return tl::unexpected(
        Problem{"misdirected-request",
                "Address the daemon as localhost or 127.0.0.1, or start it with --host-name "
                "and the name you use."});
  return {};
}

}  // namespace volsmooth
