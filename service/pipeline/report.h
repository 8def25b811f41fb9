#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/formats/nifti.h"
#include "algorithms/surface/measures.h"
#include "algorithms/volume/functionals.h"
#include "service/jobs/job.h"

namespace volsmooth {

/// What one method did to the foliation.
struct FoliationRow {
  std::string method;
  ParameterValues parameters;  ///< resolved for this method
  FoliationMeasures before, after;
  WriteOutcome written;
  ParameterValues integration;  ///< what the method's time steps were, where it chooses them as it goes
};

/// What one method did to one isosurface.
struct SurfaceRow {
  std::string method;
  double isovalue = 0;
  SurfaceMeasures before, after;
  std::optional<Displacement> moved;  ///< none: one of the two surfaces is empty
};

struct ReportTiming {
  double read_seconds = 0, flow_seconds = 0, surface_seconds = 0, write_seconds = 0;
};

/// Lets `peak_memory_bytes` of the next report count from now on. The peak is the process's: jobs that run at
/// the same time share it.
void restart_peak_memory();

/// `report.json` of the contract; its `threads` are those of the calling thread's arena (see `with_threads`).
nlohmann::ordered_json report_document(const ComputeTask& task, const std::vector<std::string>& warnings,
                                       const std::vector<FoliationRow>& foliation,
                                       const std::vector<SurfaceRow>& surfaces, const ReportTiming& timing);

}  // namespace volsmooth
