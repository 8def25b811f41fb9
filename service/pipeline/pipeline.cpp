#include "service/pipeline/pipeline.h"

#include "algorithms/catalog.h"
#include "algorithms/formats/mesh_writers.h"
#include "service/pipeline/dicom_reading.h"
#include "service/pipeline/stages.h"

namespace volsmooth {

Engine make_engine(const PipelineLimits& limits) {
  Engine engine;
  for (const Method& method : catalog()) engine.methods.push_back(method.info);
  for (const MeshFormat& format : mesh_formats()) {
    engine.mesh_formats.push_back({format.name, format.media_type, format.description});
  }
  engine.inspect = [limits](const std::filesystem::path& file, const UploadOptions& options,
                            const Progress& report) { return inspect_upload(file, options, limits, report); };
  engine.instances = [limits](const std::filesystem::path& file) { return list_instances(file, limits); };
  engine.plan = [limits](const JobOrder& order, const VolumeFacts& volume) {
    return plan_job(order, volume, limits);
  };
  engine.compute = [limits](const ComputeTask& task, const StageProgress& report) {
    return run_job(task, report, limits);
  };
  return engine;
}

}  // namespace volsmooth
