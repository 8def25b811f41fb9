#include "algorithms/formats/dicom/instances.h"

#include "service/ingest/commands.h"

namespace volsmooth {

nlohmann::json answer_instances(const IngestCall& call) {
  const auto instances = read_instances(call.upload, call.series.limits);
  if (!instances) return answer_of(instances.error());
  auto list = nlohmann::json::array();
  for (const InstanceIdentity& instance : *instances)
    list.push_back({{"sop_class_uid", instance.sop_class_uid},
                    {"sop_instance_uid", instance.sop_instance_uid},
                    {"study_uid", instance.study_uid},
                    {"series_uid", instance.series_uid},
                    {"offset", instance.offset},
                    {"bytes", instance.bytes}});
  return {{"instances", list}};
}

}  // namespace volsmooth
