#pragma once

#include <memory>
#include <tl/expected.hpp>

#include "service/http/body_receiver.h"

namespace volsmooth {

/// Holds the body of `head` to the SHA-256 that its Content-Digest or Repr-Digest promises (RFC 9530): what
/// `receiver` becomes gives digest-mismatch at the end. A body has no content coding here, so the two are the
/// same. Digests by other algorithms are left alone; bad-header for a SHA-256 that cannot be one.
tl::expected<std::unique_ptr<BodyReceiver>, Problem> with_digest_check(
    const Head& head, std::unique_ptr<BodyReceiver> receiver);

}  // namespace volsmooth
