#include "service/pipeline/pipeline.h"

#include "algorithms/catalog.h"
#include "algorithms/formats/mesh_writers.h"
#include "service/pipeline/dicom_reading.h"
#include "service/pipeline/stages.h"

namespace volsmooth {
namespace {

/// Of `plan_job`, so that both say the same; for a flow so long that it takes long steps, which hold the
/// most.
Engine::MethodCost cost_of(const Method& method) {
  constexpr std::int64_t kSide = 256;
  constexpr double kVoxels = static_cast<double>(kSide * kSide * kSide);
  VolumeFacts volume;
  volume.format = "nifti-1";
  volume.size = {kSide, kSide, kSide};
  volume.spacing_mm = {1, 1, 1};
  for (std::size_t axis = 0; axis < 3; ++axis) volume.affine[axis][axis] = 1;
  volume.voxel_type = "int16";
  volume.intensity_max = 1;
  const auto memory = [&](const std::vector<double>& isovalues) {
    JobOrder order;
    order.method = method.info.name;
    order.isovalues = isovalues;
    for (const ParameterInfo& info : method.info.parameters)
      if (info.name == "flow_time_mm2") {
        order.parameters[info.name] = 1000.0;
      } else if (info.required) {
        order.parameters[info.name] = info.is_isovalue ? 0.5 : 1.0;
      }
    const auto plan = plan_job(order, volume, {});
    return static_cast<double>(plan ? plan->memory_bytes : 0);
  };
  const double none = memory({}), one = memory({0.5});
  return {method.info.name, kFixedBytesOfJob, (none - static_cast<double>(kFixedBytesOfJob)) / kVoxels,
          (one - none) / kVoxels};
}

}  // namespace

Engine make_engine(const PipelineLimits& limits) {
  Engine engine;
  for (const Method& method : catalog()) engine.methods.push_back(method.info);
  for (const MeshFormat& format : mesh_formats()) {
    engine.mesh_formats.push_back({format.name, format.media_type, format.description});
  }
  engine.inspect = [limits](const std::filesystem::path& file, const UploadOptions& options,
                            const Progress& report) { return inspect_upload(file, options, limits, report); };
  engine.instances = [limits](const std::filesystem::path& file, const Progress& report) {
    return list_instances(file, limits, report);
  };
  engine.plan = [limits](const JobOrder& order, const VolumeFacts& volume) {
    return plan_job(order, volume, limits);
  };
  for (const Method& method : catalog()) engine.costs.push_back(cost_of(method));
  engine.compute = [limits](const ComputeTask& task, const StageProgress& report) {
    return run_job(task, report, limits);
  };
  return engine;
}

}  // namespace volsmooth
