#pragma once

#include "service/http/message.h"

namespace volsmooth {

/// Answers a GET or HEAD of a stored, immutable file whose entity tag is its SHA-256: whole, in ranges (206,
/// several as multipart/byteranges), or not at all (304, 416; 410 when it was deleted meanwhile). Opens the
/// file; throws std::system_error.
Reply reply_with_file(const Request& request, const StoredFile& file);

}  // namespace volsmooth
