#pragma once

#include <cstdint>

#include "service/jobs/pacs.h"
#include "service/pacs/nodes.h"

namespace volsmooth {

/// What jobs can do with the nodes of the configuration; a series may have `max_bytes`.
Pacs make_pacs(std::vector<Node> nodes, std::vector<Preset> presets, std::int64_t max_bytes);

}  // namespace volsmooth
