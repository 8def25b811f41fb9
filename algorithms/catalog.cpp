#include "algorithms/catalog.h"

#include <algorithm>
#include <cmath>

#include "algorithms/flows/laplacian.h"
#include "algorithms/flows/mean_curvature_flow.h"

namespace volsmooth {
namespace {

/// Strength is asked for in one of two ways: the radius of the balls that vanish, or the flow time r^2/4.
std::vector<ParameterInfo> strength_parameters() {
  return {{.name = "feature_radius_mm",
           .description = "Balls of a smaller radius vanish under mean curvature flow; cylinders of this "
                          "radius shrink to 0.71 of it.",
           .unit = "mm",
           .minimum = 1e-6,
           .maximum = 2000,
           .default_text = "twice the geometric mean of the spacing",
           .excludes = "flow_time_mm2"},
          {.name = "flow_time_mm2",
           .description = "Time the flow runs, a quarter of the feature radius squared.",
           .unit = "mm^2",
           .minimum = 2.5e-13,
           .maximum = 1e6,
           .default_text = "a quarter of feature_radius_mm squared",
           .excludes = "feature_radius_mm"}};
}

double number(const ParameterValues& values, const std::string& name, double otherwise) {
  const auto found = values.find(name);
  return found == values.end() ? otherwise : std::get<double>(found->second);
}

ParameterValues resolve_strength(const ParameterValues& asked, const Grid& grid) {
  const double default_radius = 2 * std::cbrt(voxel_volume_mm3(grid));
  const double radius = number(asked, "feature_radius_mm", default_radius);
  const double flow_time = number(asked, "flow_time_mm2", radius * radius / 4);
  return {{"flow_time_mm2", flow_time}, {"feature_radius_mm", 2 * std::sqrt(flow_time)}};
}

/// The row of a flow whose strength is its flow time.
template <class Flow>
Method flow_method(std::string name, std::string description) {
  return {.info = {.name = std::move(name),
                   .description = std::move(description),
                   .parameters = strength_parameters()},
          .resolve =
              [](const ParameterValues& asked, const Grid& grid) {
                ParameterValues resolved = resolve_strength(asked, grid);
                const StepPlan steps =
                    plan(Flow{.flow_time_mm2 = std::get<double>(resolved["flow_time_mm2"])}, grid);
                resolved["step_mm2"] = steps.step_mm2;
                resolved["steps"] = static_cast<double>(steps.steps);
                return resolved;
              },
          .run =
              [](Volume& volume, const ParameterValues& resolved, const Progress& report) {
                smooth(volume, Flow{.flow_time_mm2 = std::get<double>(resolved.at("flow_time_mm2"))}, report);
              },
          .extra_bytes_per_voxel = sizeof(float)};
}

std::vector<Method> make_catalog() {
  return {flow_method<MeanCurvatureFlow>("mean-curvature-flow",
                                         "Moves every isosurface along its normal at the speed of its mean "
                                         "curvature: small features and noise vanish, edges stay sharp."),
          flow_method<Laplacian>("laplacian",
                                 "The heat equation, a Gaussian of variance twice the flow time: smooths "
                                 "across edges as well as along them."),
          {.info = {.name = "compare",
                    .description = "Mean curvature flow and Laplacian of the same strength side by side, "
                                   "with the surfaces of the original beside them.",
                    .parameters = strength_parameters(),
                    .parts = {"mean-curvature-flow", "laplacian"}},
           .resolve = resolve_strength}};
}

}  // namespace

const std::vector<Method>& catalog() {
  static const std::vector<Method> methods = make_catalog();
  return methods;
}

const Method* find_method(std::string_view name) {
  const auto found =
      std::ranges::find_if(catalog(), [&](const Method& method) { return method.info.name == name; });
  return found == catalog().end() ? nullptr : &*found;
}

}  // namespace volsmooth
