#pragma once

#include <boost/asio/ip/network_v4.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "service/jobs/pacs.h"

namespace volsmooth {

/// Who may send to a preset by C-STORE.
class Callers {
 public:
  /// Those of `Preset::callers` and `Preset::from`; an address there is a network of its own. Throws
  /// std::runtime_error with what is wrong and where, also for a network with bits that its length cuts off.
  explicit Callers(const Preset& preset);

  bool may_be(std::string_view title) const;  ///< a calling AE title without padding
  bool may_come_from(const boost::asio::ip::address_v4& address) const;

 private:
  std::vector<std::string> titles_;
  std::vector<boost::asio::ip::network_v4> networks_;
};

}  // namespace volsmooth
