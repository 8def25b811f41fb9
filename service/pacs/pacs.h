#pragma once

#include <cstdint>

#include "service/jobs/pacs.h"
#include "service/pacs/nodes.h"

namespace volsmooth {

/// What jobs can do with the nodes of the configuration; a series may have `max_bytes`. Throws
/// std::runtime_error when a node needs volsmooth-dimse and it is not there.
Pacs make_pacs(std::vector<Node> nodes, std::vector<Preset> presets, std::int64_t max_bytes);

}  // namespace volsmooth
