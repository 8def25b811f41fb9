#include "service/http/idempotency.h"

#include <algorithm>

namespace volsmooth {
namespace {

constexpr std::size_t kLongestKey = 255;

}  // namespace

tl::expected<std::unique_ptr<BodyReceiver>, Problem> with_idempotency_key(
    JobService& jobs, const Route& route, Request& request, std::unique_ptr<BodyReceiver> receiver) {
  if (!route.keyed) return receiver;
  const auto& fields = request.head.fields;
  const auto field = std::ranges::find(fields, "idempotency-key", &HeaderField::name);
  if (field == fields.end()) return receiver;
  const bool is_only = std::ranges::count(fields, "idempotency-key", &HeaderField::name) == 1;
  if (!is_only || field->value.empty() || field->value.size() > kLongestKey)
    return tl::unexpected(
        Problem{"bad-header", "Idempotency-Key must be there once, with 1 to 255 characters."});
  auto claim = jobs.claim_key(request.caller, field->value);
  if (!claim) return tl::unexpected(claim.error());
  request.idempotency_key = field->value;
  request.key_claim = *std::move(claim);
  return receiver;
}

}  // namespace volsmooth
