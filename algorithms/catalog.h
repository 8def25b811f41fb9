#pragma once

#include <functional>
#include <vector>

#include "algorithms/method_info.h"
#include "algorithms/progress.h"
#include "algorithms/volume/volume.h"

namespace volsmooth {

/// What parameters are resolved for.
struct MethodInput {
  Grid grid;
  double intensity_min = 0, intensity_max = 1;  ///< of the valid voxels
};

/// One row of the catalogue: what is declared outside, and what runs.
struct Method {
  MethodInfo info;

  /// Resolves parameters that were checked against `info.parameters` into all that `run` will do: defaults
  /// filled in from the input, `flow_time_mm2`, `feature_radius_mm`, `step_mm2`, `steps`.
  std::function<ParameterValues(const ParameterValues& asked, const MethodInput& input)> resolve = {};

  /// Transforms `volume` in place; takes what `resolve` gave, and gives what only the run could tell. Empty
  /// for a method that is made of `parts`.
  std::function<ParameterValues(Volume& volume, const ParameterValues& resolved, const Progress& report)>
      run = {};

  /// What `run` costs, about, in explicit steps over the volume; of what `resolve` gave.
  std::function<double(const ParameterValues& resolved, const Grid& grid)> passes = {};

  /// Bytes held at the peak of `run` beyond the volume itself, per voxel; of what `resolve` gave.
  std::function<double(const ParameterValues& resolved)> extra_bytes_per_voxel = {};
};

/// Every method that is offered, in the order of `GET /v1/methods`.
const std::vector<Method>& catalog();

/// The row called `name`, or null.
const Method* find_method(std::string_view name);

}  // namespace volsmooth
