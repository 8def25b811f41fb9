#include "service/pipeline/parts.h"

#include <stdexcept>

namespace volsmooth {

MethodInput input_of(const VolumeFacts& volume) {
  VoxelToWorld map;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column) map.linear[row][column] = volume.affine[row][column];
  Grid grid = grid_of(volume.size, map);
  grid.spacing_mm = volume.spacing_mm;
  return {grid, volume.intensity_min, volume.intensity_max};
}

const Method& method_called(const std::string& name) {
  const Method* method = find_method(name);
  if (method == nullptr) throw std::logic_error("a method that is not in the catalogue");
  return *method;
}

std::vector<Part> parts_of(const JobOrder& order, const ParameterValues& resolved, const MethodInput& input) {
  const Method& whole = method_called(order.method);
  if (whole.info.parts.empty()) return {{&whole, resolved}};
  std::vector<Part> parts;
  for (const std::string& name : whole.info.parts) {
    const Method& method = method_called(name);
    parts.push_back({&method, method.resolve(order.parameters, input)});
  }
  return parts;
}

std::optional<double> surface_of(const ParameterValues& parameters) {
  const auto found = parameters.find("surface");
  if (found == parameters.end()) return {};
  return std::get<double>(found->second);
}

double passes_of(const Part& part, const Grid& grid) {
  return part.method->passes(part.parameters, grid);
}

}  // namespace volsmooth
