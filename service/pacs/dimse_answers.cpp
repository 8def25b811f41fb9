#include "service/pacs/dimse_answers.h"

#include "service/pacs/hexadecimal.h"

namespace volsmooth {
namespace {

NodeFailure failure(const Node& node, bool is_passing, const std::string& what) {
  return {{is_passing ? "node-unreachable" : "node-refused",
           "The node '" + node.name + "' " + what + ".",
           {{"node", node.name}}},
          is_passing};
}

/// DICOM PS3.8, table 9-21.
const char* reason_text(int source, int reason) {
  constexpr int kUser = 1, kPresentation = 3;
  if (source == kUser && reason == 3) return "it does not know our AE title";
  if (source == kUser && reason == 7) return "it has no such AE title";
  if (source == kPresentation) return "it is busy";
  return "it gives no reason that helps";
}

}  // namespace

bool is_stored(std::uint16_t status) {
  constexpr std::uint16_t kClass = 0xF000, kWarnings = 0xB000;
  constexpr std::uint16_t kSuccess = 0, kWarning = 0x0001, kAttributeList = 0x0107, kValueRange = 0x0116;
  return status == kSuccess || (status & kClass) == kWarnings || status == kWarning ||
         status == kAttributeList || status == kValueRange;
}

tl::expected<InstanceAnswer, NodeFailure> outcome_of(const Node& node, const std::string& sop_instance_uid,
                                                     std::uint16_t status) {
  constexpr std::uint16_t kClass = 0xFF00, kOutOfResources = 0xA700;
  if ((status & kClass) == kOutOfResources)
    return tl::unexpected(failure(node, true, "is out of resources (status " + hexadecimal(status) + ")"));
  return InstanceAnswer{sop_instance_uid, is_stored(status), status == 0 ? "" : hexadecimal(status)};
}

NodeFailure failure_from(const Node& node, const nlohmann::json& told) {
  constexpr int kPermanently = 1;
  const auto what = told.value("failure", "");
  if (what == "unreachable") return failure(node, true, "cannot be reached");
  if (what == "internal")
    return {{"internal",
             "volsmooth-dimse cannot do its work; the fault is the service's.",
             {{"node", node.name}}},
            false};
  if (what == "tls")
    return failure(
        node, true,
        "and this service did not agree on TLS: its certificate is not that of its name, or nobody "
        "vouches for it, or it wants one of ours");
  if (what == "tls-files")
    return failure(node, true, "was not called: the files that its 'tls' names cannot be used");
  if (what != "rejected") return connection_lost(node);
  return failure(node, told.value("result", 0) != kPermanently,
                 std::string("rejected the association: ") +
                     reason_text(told.value("source", 0), told.value("reason", 0)));
}

NodeFailure not_started(const Node& node) {
  return {{"not-ready",
           "There is no room for another process or its descriptors here, so nothing was sent yet.",
           {{"node", node.name}}},
          true};
}

NodeFailure connection_lost(const Node& node) {
  return failure(node, true, "broke off the association");
}

}  // namespace volsmooth
