#pragma once

#include "service/http/message.h"

namespace volsmooth {

/// Answers a GET or HEAD of a stored, immutable file whose entity tag is its SHA-256: whole, in ranges (206,
/// several as multipart/byteranges), or not at all (304, 406, 416; integrity-failure when the block that goes
/// first is damaged). Throws std::system_error when the disk fails.
Reply reply_with_file(const Request& request, const StoredFile& file);

}  // namespace volsmooth
