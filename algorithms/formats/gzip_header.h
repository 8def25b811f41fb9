#pragma once

#include <optional>

#include "algorithms/formats/input_file.h"
#include "algorithms/formats/refusal.h"

namespace volsmooth {

/// Takes a gzip member's header (RFC 1952, 2.3) from the file, names and comments unseen. nullopt: it was
/// good and `file` stands at the deflated data. Refusals: gzip-truncated, gzip-corrupt (also for a header of
/// 16 KiB or more).
std::optional<Refusal> take_gzip_header(InputFile& file);

}  // namespace volsmooth
