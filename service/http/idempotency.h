#pragma once

#include <string>
#include <string_view>

#include "service/http/body_receiver.h"
#include "service/http/handlers.h"
#include "service/http/routes.h"
#include "service/storage/digest.h"

namespace volsmooth {

/// Takes the Idempotency-Key of a request (draft-ietf-httpapi-idempotency-key-header) to a route that has
/// one, before its body is read: bad-header for one that is empty, longer than 255 characters or there twice;
/// idempotency-in-flight.
tl::expected<std::unique_ptr<BodyReceiver>, Problem> with_idempotency_key(
    JobService& jobs, const Route& route, Request& request, std::unique_ptr<BodyReceiver> receiver);

/// Answers by `first(key)`, or, when a request with that key has made already what this one asks for, by
/// `again(id of it)`. `wanted` says all that is asked for. The key is free again when this returns.
template <class First, class Again>
auto once(JobService& jobs, Request& request, std::string_view wanted, const First& first, const Again& again)
    -> decltype(first(std::optional<RequestKey>())) {
  if (!request.idempotency_key) return first(std::optional<RequestKey>());
  const auto claim = std::move(request.key_claim);
  const RequestKey key{*request.idempotency_key, sha256_of(wanted)};
  const auto made = jobs.made_by(request.caller, key);
  if (!made) return tl::unexpected(made.error());
  return *made ? again(**made) : first(std::optional(key));
}

}  // namespace volsmooth
