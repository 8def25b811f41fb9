#pragma once

#include "service/pacs/http_exchange.h"

namespace volsmooth {

/// Sends instances of a result file by STOW-RS, a few in a request, and tells what the node says of each
/// (DICOM PS3.18, 10.5).
tl::expected<void, NodeFailure> send_instances(
    const Node& node, const std::filesystem::path& file, std::span<const DicomInstance> instances,
    const std::function<void(std::span<const InstanceAnswer>)>& on_answers,
    const std::function<void()>& keep_going);

/// What a STOW-RS answer says of each of the instances that were sent.
std::vector<InstanceAnswer> answers_from(const NodeAnswer& answer, std::span<const std::string> sent_uids);

}  // namespace volsmooth
