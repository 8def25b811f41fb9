#pragma once

#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "service/http/body_receiver.h"
#include "service/http/message.h"

namespace volsmooth {

struct Api;

/// One parameter of a query: validation and the OpenAPI document both read this.
struct QueryParameter {
  enum class Kind { kText, kInteger, kNumber };
  std::string_view name;
  std::string_view description;
  Kind kind = Kind::kText;
  double minimum = 0;                          ///< inclusive; numbers only
  double maximum = 0;                          ///< inclusive; numbers only
  std::vector<std::string_view> choices = {};  ///< not empty: a text that is one of these
};

/// What a route answers when all is well.
struct Answer {
  int status;
  std::string_view media_type;  ///< empty: no body; "*/*": that of the file
  std::string_view schema;      ///< its name among the OpenAPI document's schemas, or empty
  std::string_view description;
  bool tagged = false;  ///< whether it has an ETag
};

/// One call of the interface. Matching, validation of the query, Allow, the metrics' labels and the OpenAPI
/// document are all made from this table.
struct Route {
  std::string_view method;
  std::string_view pattern;    ///< such as "/v1/jobs/{id}"
  std::optional<Scope> scope;  ///< that a caller needs; none: anybody may
  std::string_view summary;
  Reply (*handle)(Api&, Request&);  ///< may block; given an uploaded file, it may take seconds
  Answer answer;
  std::vector<QueryParameter> query = {};
  BodyKind body = BodyKind::kNone;
  std::string_view body_schema = {};
  bool keyed = false;  ///< whether it takes an Idempotency-Key
};

const std::vector<Route>& routes();

struct RouteMatch {
  const Route* route = nullptr;
  std::map<std::string, std::string, std::less<>> path;
};

/// The route of a request; HEAD is answered by GET's. not-found, or method-not-allowed with the member
/// `allow`.
tl::expected<RouteMatch, Problem> match_route(std::string_view method,
                                              const std::vector<std::string>& segments);

/// bad-query for a parameter that the route does not have or a value that is not in its limits.
tl::expected<void, Problem> check_query(const Route& route, const QueryValues& query);

}  // namespace volsmooth
