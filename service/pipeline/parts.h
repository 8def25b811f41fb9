#pragma once

#include <optional>
#include <vector>

#include "algorithms/catalog.h"
#include "service/jobs/job.h"

namespace volsmooth {

/// One of the methods that an order runs side by side, with the parameters that its `run` takes.
struct Part {
  const Method* method;
  ParameterValues parameters;
};

/// What methods need to know of a stored volume.
MethodInput input_of(const VolumeFacts& volume);

/// The row of the catalogue called `name`. Throws std::logic_error: an order was checked long before.
const Method& method_called(const std::string& name);

/// The methods behind `order`, which resolve to `resolved` as a whole: the one that it names, or its parts.
std::vector<Part> parts_of(const JobOrder& order, const ParameterValues& resolved, const MethodInput& input);

/// Whether the order speaks of a single surface, and which.
std::optional<double> surface_of(const ParameterValues& parameters);

/// What a part costs, about, in explicit steps over the volume.
double passes_of(const Part& part, const Grid& grid);

}  // namespace volsmooth
