// links: service_jobs
//
// The JSON of a job order. What is taken must be readable again as it is stored, and mean the same.
#include <cstdlib>
#include <string_view>

#include "service/jobs/job_json.h"
#include "service/jobs/stored_json.h"
#include "service/jobs/strict_json.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using namespace volsmooth;

void require(bool law) {
  if (!law) std::abort();
}

MethodInfo some_method() {
  MethodInfo method{"mean-curvature-flow", "A method to try orders with.", {}};
  method.parameters.push_back({"feature_radius_mm", "Radius.", "mm", 0.01, 200, {}, {}, "", "flow_time_mm2"});
  method.parameters.push_back(
      {"flow_time_mm2", "Time.", "mm^2", 0.001, 10'000, {}, {}, "", "feature_radius_mm"});
  method.parameters.push_back({"edge", "A choice.", "", 0, 0, {"hard", "soft"}, "hard"});
  return method;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const MethodInfo method = some_method();
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const auto document = parse_json(bytes);
  if (!document) {
    (void)to_json(document.error()).dump();
    return 0;
  }
  const auto again = parse_json(document->dump());
  require(again && *again == *document);
  const auto order = order_from(*document);
  if (!order) {
    (void)to_json(order.error()).dump();
    return 0;
  }
  const auto stored = to_json(*order);
  require(to_json(order_from_stored_json(nlohmann::json::parse(stored.dump()))) == stored);
  if (const auto checked = check_parameters(order->parameters, method); !checked)
    (void)to_json(checked.error()).dump();
  return 0;
}
