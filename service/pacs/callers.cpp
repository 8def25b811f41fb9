#include "service/pacs/callers.h"

#include <algorithm>

#include "service/pacs/ae_title.h"
#include "service/pacs/configured.h"

namespace volsmooth {
namespace {

namespace ip = boost::asio::ip;

ip::network_v4 network_in(const Preset& preset, const std::string& text) {
  const std::string full = text.find('/') == std::string::npos ? text + "/32" : text;
  boost::system::error_code error;
  const ip::network_v4 network = ip::make_network_v4(full, error);
  if (error)
    refuse_preset(preset.name,
                  "'from' must be a list of IPv4 addresses and networks, such as 10.1.2.3 and "
                  "10.1.0.0/16, and '" +
                      text + "' is neither");
  const std::string canonical = network.canonical().to_string();
  if (canonical != full)
    refuse_preset(preset.name,
                  "'from' has '" + text + "', which is no network; did you mean '" + canonical + "'?");
  return network;
}

bool contains(const ip::network_v4& network, const ip::address_v4& address) {
  return ip::network_v4(address, network.prefix_length()).canonical() == network;
}

}  // namespace

Callers::Callers(const Preset& preset) : titles_(preset.callers) {
  if (!std::ranges::all_of(titles_, is_ae_title))
    refuse_preset(preset.name, std::string("each of 'callers' must be ") + kAeTitleRule);
  for (const std::string& text : preset.from) networks_.push_back(network_in(preset, text));
}

bool Callers::may_be(std::string_view title) const {
  return titles_.empty() || std::ranges::find(titles_, title) != titles_.end();
}

bool Callers::may_come_from(const ip::address_v4& address) const {
  return networks_.empty() ||
         std::ranges::any_of(networks_, [&](const auto& network) { return contains(network, address); });
}

}  // namespace volsmooth
