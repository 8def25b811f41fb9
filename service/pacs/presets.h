#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "service/jobs/pacs.h"

namespace volsmooth {

/// Reads the member "presets" of the configuration: `{name: {"job": order without volume, "destination":
/// node, "quiet_seconds": 10, "aet": AE title, "tenant": name, "callers": [AE title], "from": [network]}}`.
/// Without outputs in the order, its result is a derived series; without a title, its own is the name in
/// capitals, if that fits. Throws std::runtime_error with what is wrong and where.
std::vector<Preset> presets_from(const nlohmann::json& configured);

}  // namespace volsmooth
