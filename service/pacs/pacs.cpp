#include "service/pacs/pacs.h"

#include <algorithm>
#include <stdexcept>

#include "service/pacs/dimse_child.h"
#include "service/pacs/dimse_sending.h"
#include "service/pacs/instances.h"
#include "service/pacs/retrieval.h"
#include "service/pacs/sending.h"

namespace volsmooth {
namespace {

/// A job that was accepted under another configuration may name a node that is not there any more, that is
/// not its tenant's any more, or that is a DIMSE peer now.
NodeFailure gone(const std::string& node) {
  return {{"node-unreachable",
           "The configuration has no node '" + node + "' any more that can do this.",
           {{"node", node}}},
          false};
}

}  // namespace

Pacs make_pacs(std::vector<Node> nodes, std::vector<Preset> presets, std::int64_t max_bytes) {
  if (std::ranges::any_of(nodes, [](const Node& node) { return node.dimse.has_value(); })) dimse_program();
  for (const Node& node : nodes)
    if (node.dimse && node.dimse->tls)
      check(*node.dimse->tls, [&](const std::string& member, const std::string& why) {
        throw std::runtime_error("configuration, node '" + node.name + "': '" + member +
                                 "' cannot be used: " + why);
      });
  Pacs pacs;
  pacs.presets = std::move(presets);
  for (const Node& node : nodes) pacs.nodes.push_back({node.name, !node.dimse, node.tenants});
  const auto find = [nodes = std::move(nodes)](const std::string& tenant,
                                               const std::string& name) -> tl::expected<Node, NodeFailure> {
    const auto found = std::ranges::find(nodes, name, &Node::name);
    if (found != nodes.end() && is_for(found->tenants, tenant)) return *found;
    return tl::unexpected(gone(name));
  };
  pacs.retrieve = [find, max_bytes](const std::string& tenant, const DicomSource& source, IncomingFile& file,
                                    const Progress& report) {
    return find(tenant, source.node).and_then([&](const Node& node) -> tl::expected<void, NodeFailure> {
      if (node.dimse) return tl::unexpected(gone(node.name));
      return retrieve_series(node, source, file, max_bytes, report);
    });
  };
  pacs.instances_in = [](const std::filesystem::path& file) {
    std::vector<DicomInstance> instances;
    for_each_instance(file, [&](const DicomInstance& instance, auto) { instances.push_back(instance); });
    return instances;
  };
  pacs.send = [find](const std::string& tenant, const std::string& name, const std::filesystem::path& file,
                     std::span<const DicomInstance> instances, const auto& on_answers,
                     const auto& keep_going) {
    return find(tenant, name).and_then([&](const Node& node) {
      return node.dimse ? store_instances(node, file, instances, on_answers, keep_going)
                        : send_instances(node, file, instances, on_answers, keep_going);
    });
  };
  return pacs;
}

}  // namespace volsmooth
