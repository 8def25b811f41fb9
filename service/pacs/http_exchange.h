#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "service/jobs/pacs.h"
#include "service/pacs/nodes.h"

namespace volsmooth {

inline constexpr long kOk = 200;

struct NodeRequest {
  std::string target;  ///< appended to the node's address
  std::vector<std::string> headers = {};
  const std::string* body = nullptr;  ///< makes it a POST
  /// Gets the body of a success piece by piece, in place of `NodeAnswer::body`; what it throws ends the
  /// exchange and comes out of it.
  std::function<void(std::string_view)> sink = {};
  std::function<void()> keep_going = [] {};  ///< called often; what it throws likewise
};

struct NodeAnswer {
  long status = 0;
  std::string content_type;
  std::string body;
};

/// One request to a node, by HTTP 1.1. An answer of any status is an answer. No redirect is followed: it
/// could lead where the configuration does not.
tl::expected<NodeAnswer, NodeFailure> exchange(const Node& node, const NodeRequest& request);

/// What an unwelcome status means; passing for 408, 429 and 5xx.
NodeFailure failure_of_status(const Node& node, long status);

}  // namespace volsmooth
