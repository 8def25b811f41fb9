#include "service/http/answers.h"
#include "service/http/handlers.h"

namespace volsmooth {
namespace {

using nlohmann::json;

json uid_element(const std::string& uid) {
  return {{"vr", "UI"}, {"Value", {uid}}};
}

/// The Store Instances Response of DICOM PS3.18, 10.5.3: all were stored, since one that cannot be refuses
/// the whole request.
json stored_document(const std::vector<ArrivedInstance>& instances) {
  json items = json::array();
  for (const ArrivedInstance& instance : instances)
    items.push_back({{"00081150", uid_element(instance.sop_class_uid)},
                     {"00081155", uid_element(instance.sop_instance_uid)}});
  return {{"00081199", {{"vr", "SQ"}, {"Value", items}}}};
}

}  // namespace

Reply post_studies(Api& api, Request& request) {
  return api.jobs.receive(request.caller, request.path["preset"], std::move(*request.file))
      .map([](const std::vector<ArrivedInstance>& instances) {
        return Response{200, {}, Document{stored_document(instances).dump(), "application/dicom+json"}};
      });
}

}  // namespace volsmooth
