#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>

#include "service/jobs/pacs.h"
#include "service/pacs/nodes.h"

namespace volsmooth {

/// Whether a C-STORE response says success or a warning.
bool is_stored(std::uint16_t status);

/// What the status of a C-STORE response (DICOM PS3.4, B.2.3, and PS3.7, annex C) says of an instance. A peer
/// that is out of resources is a passing failure: nothing is said of the instance yet.
tl::expected<InstanceAnswer, NodeFailure> outcome_of(const Node& node, const std::string& sop_instance_uid,
                                                     std::uint16_t status);

/// What a failure that volsmooth-dimse tells (dimse/channel.h) means.
NodeFailure failure_from(const Node& node, const nlohmann::json& told);

/// For want of processes, descriptors or memory, which passes.
NodeFailure not_started(const Node& node);

/// For a peer that is gone, or whose bytes brought volsmooth-dimse down.
NodeFailure connection_lost(const Node& node);

}  // namespace volsmooth
