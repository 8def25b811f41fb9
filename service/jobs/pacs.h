#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "algorithms/progress.h"
#include "service/jobs/caller.h"
#include "service/jobs/job.h"
#include "service/storage/incoming_file.h"

namespace volsmooth {

/// Why an exchange with a node did not come about.
struct NodeFailure {
  Problem problem;
  bool is_passing = false;  ///< worth another try: the node is down, busy or out of space
};

/// One DICOM instance among the results of a job.
struct DicomInstance {
  std::string sop_class_uid;
  std::string sop_instance_uid;
  std::string result;  ///< the name of the result file that holds it
};

/// What a node says of one instance that it was sent.
struct InstanceAnswer {
  std::string sop_instance_uid;
  bool stored = false;
  std::string reason;  ///< the node's code, when it was refused or stored with a warning
};

/// An order that is run on every series that devices send to it.
struct Preset {
  std::string name;
  JobOrder order;  ///< without its volume
  /// A series is whole when nothing of it has arrived for so long.
  std::chrono::milliseconds quiet = std::chrono::seconds(10);
  std::string aet = {};                 ///< the AE title that devices call it by; empty: none
  std::string tenant = kDefaultTenant;  ///< whose the series are that come by C-STORE
  // Who may send by C-STORE; empty: everybody, from anywhere.
  std::vector<std::string> callers = {};  ///< AE titles
  std::vector<std::string> from = {};     ///< IPv4 networks, such as "10.1.0.0/16"
};

/// Whether what has these `tenants` in the configuration is that tenant's; without any it is everybody's.
inline bool is_for(const std::vector<std::string>& tenants, std::string_view tenant) {
  return tenants.empty() || std::ranges::find(tenants, tenant) != tenants.end();
}

/// The DICOM nodes and presets that the configuration names, handed to the service by main as plain functions
/// (pacs/pacs.h makes them).
struct Pacs {
  struct Node {
    std::string name;
    bool gives = false;                     ///< series can be retrieved from it
    std::vector<std::string> tenants = {};  ///< who may name it; empty: everybody
  };
  std::vector<Node> nodes;
  std::vector<Preset> presets;

  /// Retrieves a whole series for a tenant into `file`, in a form that `Engine::inspect` reads. Checks that
  /// all instances that the node lists came.
  std::function<tl::expected<void, NodeFailure>(const std::string& tenant, const DicomSource& source,
                                                IncomingFile& file, const Progress& report)>
      retrieve;

  /// The instances that a result file of kind "series" or "dicom" holds.
  std::function<std::vector<DicomInstance>(const std::filesystem::path& file)> instances_in;

  /// Sends those instances of a tenant's result file to a node. `on_answers` gets what the node says of each,
  /// as it says it, and `keep_going` is called several times a second or so, from any thread; what they throw
  /// ends the sending.
  std::function<tl::expected<void, NodeFailure>(
      const std::string& tenant, const std::string& node, const std::filesystem::path& file,
      std::span<const DicomInstance> instances,
      const std::function<void(std::span<const InstanceAnswer>)>& on_answers,
      const std::function<void()>& keep_going)>
      send;

  /// The node of that name that a tenant may use; null: for it there is none.
  const Node* node_of(std::string_view tenant, std::string_view name) const {
    const auto found = std::ranges::find(nodes, name, &Node::name);
    return found != nodes.end() && is_for(found->tenants, tenant) ? &*found : nullptr;
  }
};

}  // namespace volsmooth
