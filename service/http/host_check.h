#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "service/http/head_check.h"

namespace volsmooth {

/// The names under which this daemon may be addressed. A web page that had its own name point at 127.0.0.1
/// (DNS rebinding) is stopped here: as long as there are no tokens, Host is all that tells it from a client.
struct HostNames {
  std::vector<std::string> names = {"localhost", "127.0.0.1", "[::1]"};  ///< in lower case, without a port
};

/// bad-host for none or two, misdirected-request for one that is not ours.
tl::expected<void, Problem> check_host(const Head& head, const HostNames& ours);

/// cross-origin for what a browser sends on behalf of a page that is not ours: it asks nobody before a simple
/// POST (https://fetch.spec.whatwg.org/#http-origin). Clients that are no browsers send neither field.
tl::expected<void, Problem> check_origin(const Head& head, const HostNames& ours);

}  // namespace volsmooth
