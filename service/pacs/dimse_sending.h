#pragma once

#include "service/jobs/pacs.h"
#include "service/pacs/nodes.h"

namespace volsmooth {

/// Sends instances of a result file by C-STORE, in one association, and tells what the node says of each
/// (DICOM PS3.4, annex B).
tl::expected<void, NodeFailure> store_instances(
    const Node& node, const std::filesystem::path& file, std::span<const DicomInstance> instances,
    const std::function<void(std::span<const InstanceAnswer>)>& on_answers,
    const std::function<void()>& keep_going);

}  // namespace volsmooth
