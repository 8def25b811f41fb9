#include "algorithms/catalog.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include "algorithms/flows/conservative_mean_curvature_flow.h"
#include "algorithms/flows/laplacian.h"
#include "algorithms/flows/mean_curvature_flow.h"
#include "algorithms/flows/offset.h"
#include "algorithms/flows/sharpening.h"
#include "algorithms/volume/density.h"

namespace volsmooth {
namespace {

double number(const ParameterValues& values, const std::string& name) {
  return std::get<double>(values.at(name));
}

double number(const ParameterValues& values, const std::string& name, double otherwise) {
  return values.contains(name) ? number(values, name) : otherwise;
}

std::string text(const ParameterValues& values, const std::string& name, const std::string& otherwise) {
  const auto found = values.find(name);
  return found == values.end() ? otherwise : std::get<std::string>(found->second);
}

using Parameters = std::vector<ParameterInfo>;

Parameters joined(Parameters some, Parameters more) {
  std::ranges::move(more, std::back_inserter(some));
  return some;
}

// ---- strength: the radius of the balls that vanish, or the flow time r^2/4
// -----------------------------------

Parameters strength_parameters() {
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

double mean_spacing(const Grid& grid) {
  return std::cbrt(voxel_volume_mm3(grid));
}

ParameterValues resolve_strength(const ParameterValues& asked, const MethodInput& input) {
  const double radius = number(asked, "feature_radius_mm", 2 * mean_spacing(input.grid));
  const double flow_time = number(asked, "flow_time_mm2", radius * radius / 4);
  return {{"flow_time_mm2", flow_time}, {"feature_radius_mm", 2 * std::sqrt(flow_time)}};
}

// ---- single-surface mode: a density made around one isovalue
// --------------------------------------------------

ParameterInfo surface_parameter() {
  return {.name = "surface",
          .description =
              "The isovalue of the one surface that counts: the volume becomes a density around it, "
              "and intensities away from it are flattened.",
          .unit = "intensity",
          .minimum = std::numeric_limits<double>::lowest(),
          .maximum = std::numeric_limits<double>::max(),
          .default_text = "none: all surfaces count alike",
          .is_isovalue = true};
}

ParameterInfo half_width_parameter() {
  return {.name = "half_width",
          .description = "Intensities this far below and above the surface become 0 and 1 in the density.",
          .unit = "intensity",
          .minimum = 1e-30,
          .maximum = std::numeric_limits<float>::max(),
          .default_text = "a tenth of the range of the valid intensities",
          .needs = "surface"};
}

void resolve_surface(ParameterValues& resolved, const ParameterValues& asked, const MethodInput& input) {
  if (!asked.contains("surface")) return;
  const double tenth = (input.intensity_max - input.intensity_min) / 10;
  resolved["surface"] = asked.at("surface");
  resolved["half_width"] = number(asked, "half_width", tenth > 0 ? tenth : 1);
}

/// Steps of sharpening after a flow gather what it has spread: a surface then encloses its mass again.
ParameterInfo sharpening_reach_parameter() {
  return {.name = "sharpening_reach_mm",
          .description =
              "How far, when the flow is over, the isosurfaces at the ends of the density move "
              "towards the surface at the most; 0: not at all.",
          .unit = "mm",
          .minimum = 0,
          .maximum = 2000,
          .default_text = "the geometric mean of the spacing, where a surface is given",
          .needs = "surface"};
}

void resolve_sharpening(ParameterValues& resolved, const ParameterValues& asked, const MethodInput& input) {
  const double reach = number(asked, "sharpening_reach_mm", mean_spacing(input.grid));
  resolved["sharpening_reach_mm"] = reach;
  resolved["sharpening_steps"] =
      reach > 0 ? static_cast<double>(plan(Sharpening{reach}, input.grid).steps) : 0;
}

/// What a flow that chooses its time steps as it goes took. `steps` are what they stand for.
ParameterValues as_values(const StepsTaken& taken) {
  return {{"evaluations", static_cast<double>(taken.evaluations)},
          {"explicit_steps", static_cast<double>(taken.explicit_steps)},
          {"long_steps", static_cast<double>(taken.long_steps)},
          {"rejected_steps", static_cast<double>(taken.rejected)},
          {"displacement_voxels", taken.displacement_voxels}};
}

template <class Flow>
ParameterValues smooth_and_tell(Volume& volume, const Flow& flow, const Progress& report) {
  if constexpr (std::is_same_v<decltype(smooth(volume, flow, report)), StepsTaken>) {
    return as_values(smooth(volume, flow, report));
  } else {
    smooth(volume, flow, report);
    return {};
  }
}

/// Runs `flow` on the volume, or on the density around its surface where one is named, which may be sharpened
/// then.
template <class Flow>
ParameterValues smooth_as_asked(Volume& volume, const Flow& flow, const ParameterValues& resolved,
                                const Progress& report) {
  if (!resolved.contains("surface")) return smooth_and_tell(volume, flow, report);
  const DensityWindow window{number(resolved, "surface"), number(resolved, "half_width")};
  const double steps = number(resolved, "steps"), sharpening_steps = number(resolved, "sharpening_steps", 0);
  const double flow_ends = 0.02 + 0.96 * steps / (steps + sharpening_steps);
  to_density(volume, window, part_of(report, 0, 0.02));
  ParameterValues told = smooth_and_tell(volume, flow, part_of(report, 0.02, flow_ends));
  if (sharpening_steps > 0)
    smooth(volume, Sharpening{number(resolved, "sharpening_reach_mm")}, part_of(report, flow_ends, 0.98));
  to_intensity(volume, window, part_of(report, 0.98, 1));
  return told;
}

// ---- rows
// -----------------------------------------------------------------------------------------------------

/// A choice of a parameter, and what it stands for.
template <class Meaning>
using Choices = std::vector<std::pair<std::string, Meaning>>;

template <class Meaning>
ParameterInfo choice_parameter(std::string name, std::string description, const Choices<Meaning>& choices) {
  ParameterInfo info{.name = std::move(name), .description = std::move(description), .unit = {}};
  for (const auto& choice : choices) info.choices.push_back(choice.first);
  info.default_value = info.choices.front();
  return info;
}

template <class Meaning>
Meaning chosen(const Choices<Meaning>& choices, const std::string& name) {
  return std::ranges::find(choices, name, &std::pair<std::string, Meaning>::first)->second;
}

const Choices<MeanCurvatureScheme>& mean_curvature_schemes() {
  static const Choices<MeanCurvatureScheme> schemes{{"face-centred", MeanCurvatureScheme::kFaceCentred},
                                                    {"thesis", MeanCurvatureScheme::kThesis},
                                                    {"thesis-weno", MeanCurvatureScheme::kThesisWeno}};
  return schemes;
}

MeanCurvatureFlow mean_curvature_flow(const ParameterValues& resolved) {
  return {.flow_time_mm2 = number(resolved, "flow_time_mm2"),
          .scheme = chosen(mean_curvature_schemes(), text(resolved, "scheme", "face-centred")),
          .tolerance_voxels = number(resolved, "tolerance_voxels", 0)};
}

/// The schemes of the thesis take short steps only.
void resolve_scheme(ParameterValues& resolved, const ParameterValues& asked) {
  if (asked.contains("scheme")) resolved["scheme"] = asked.at("scheme");
  if (text(asked, "scheme", "face-centred") == "face-centred")
    resolved["tolerance_voxels"] = number(asked, "tolerance_voxels", MeanCurvatureFlow{}.tolerance_voxels);
}

ParameterInfo tolerance_parameter() {
  return {.name = "tolerance_voxels",
          .description =
              "How far a long time step of the face-centred scheme may displace isosurfaces (root mean "
              "square, by its estimate), in units of the shortest spacing; 0: short steps only.",
          .unit = "voxels",
          .minimum = 0,
          .maximum = 1,
          .default_value = MeanCurvatureFlow{}.tolerance_voxels};
}

ConservativeMeanCurvatureFlow conservative_flow(const ParameterValues& resolved) {
  return {.flow_time_mm2 = number(resolved, "flow_time_mm2")};
}

Laplacian laplacian(const ParameterValues& resolved) {
  return {.flow_time_mm2 = number(resolved, "flow_time_mm2")};
}

double counted_steps(const ParameterValues& resolved, const Grid&) {
  return number(resolved, "steps");
}

double bytes_of_one_volume(const ParameterValues&) {
  return sizeof(float);
}

/// How many volumes a flow holds beside the one that flows.
template <class Flow>
double volumes_beside(const Flow& flow, double steps) {
  if constexpr (std::is_same_v<Flow, MeanCurvatureFlow>) {
    if (takes_long_steps(flow, static_cast<std::int64_t>(steps))) return kVolumesOfLongSteps;
  }
  return 1;
}

/// The row of a flow whose strength is its flow time.
template <class Flow>
Method flow_method(std::string name, std::string description, Parameters more,
                   Flow (*flow_of)(const ParameterValues& resolved)) {
  return {.info = {.name = std::move(name),
                   .description = std::move(description),
                   .parameters = joined(strength_parameters(), std::move(more))},
          .resolve =
              [flow_of](const ParameterValues& asked, const MethodInput& input) {
                ParameterValues resolved = resolve_strength(asked, input);
                if constexpr (std::is_same_v<Flow, MeanCurvatureFlow>) resolve_scheme(resolved, asked);
                resolve_surface(resolved, asked, input);
                if constexpr (std::is_same_v<Flow, ConservativeMeanCurvatureFlow>)
                  if (asked.contains("surface")) resolve_sharpening(resolved, asked, input);
                const StepPlan steps = plan(flow_of(resolved), input.grid);
                resolved["step_mm2"] = steps.step_mm2;
                resolved["steps"] = static_cast<double>(steps.steps);
                return resolved;
              },
          .run =
              [flow_of](Volume& volume, const ParameterValues& resolved, const Progress& report) {
                return smooth_as_asked(volume, flow_of(resolved), resolved, report);
              },
          .passes =
              [flow_of](const ParameterValues& resolved, const Grid& grid) {
                const Flow flow = flow_of(resolved);
                const double after = number(resolved, "sharpening_steps", 0);
                if constexpr (requires { passes(flow, grid); }) return passes(flow, grid) + after;
                return static_cast<double>(plan(flow, grid).steps) + after;
              },
          .extra_bytes_per_voxel =
              [flow_of](const ParameterValues& resolved) {
                return sizeof(float) * volumes_beside(flow_of(resolved), number(resolved, "steps"));
              }};
}

const Choices<Reconstruction>& offset_gains() {
  static const Choices<Reconstruction> gains{{"weno", Reconstruction::kWeno7},
                                             {"weno5", Reconstruction::kWeno5},
                                             {"piecewise-constant", Reconstruction::kPiecewiseConstant}};
  return gains;
}

const Choices<UpwindGradient>& upwind_gradients() {
  static const Choices<UpwindGradient> gradients{{"godunov", UpwindGradient::kGodunov},
                                                 {"engquist-osher", UpwindGradient::kEngquistOsher}};
  return gradients;
}

Offset offset(const ParameterValues& resolved) {
  return {.distance_mm = number(resolved, "distance_mm"),
          .gains = chosen(offset_gains(), text(resolved, "gains", "weno")),
          .upwind = chosen(upwind_gradients(), text(resolved, "upwind", "godunov"))};
}

Method offset_method() {
  Parameters parameters{
      {.name = "distance_mm",
       .description = "How far every isosurface moves towards lower intensities; negative: "
                      "towards higher ones.",
       .unit = "mm",
       .minimum = -2000,
       .maximum = 2000,
       .default_text = "none: it must be given",
       .required = true},
      choice_parameter("gains", "How the mass that a voxel gains is reconstructed.", offset_gains()),
      choice_parameter("upwind", "How gains of the axes become the gradient's length.", upwind_gradients()),
      surface_parameter(),
      half_width_parameter()};
  return {.info = {.name = "offset",
                   .description = "Moves every isosurface along its normal by one distance: outward edges "
                                  "become round, inward ones stay sharp.",
                   .parameters = std::move(parameters)},
          .resolve =
              [](const ParameterValues& asked, const MethodInput& input) {
                ParameterValues resolved = asked;
                resolve_surface(resolved, asked, input);
                const OffsetPlan steps = plan(offset(resolved), input.grid);
                resolved["step_mm"] = steps.step_mm;
                resolved["steps"] = static_cast<double>(steps.steps);
                return resolved;
              },
          .run =
              [](Volume& volume, const ParameterValues& resolved, const Progress& report) {
                return smooth_as_asked(volume, offset(resolved), resolved, report);
              },
          .passes = counted_steps,
          .extra_bytes_per_voxel = bytes_of_one_volume};
}

Sharpening sharpening(const ParameterValues& resolved) {
  return {.reach_mm = number(resolved, "reach_mm")};
}

Method sharpening_method() {
  ParameterInfo surface = surface_parameter();
  surface.description = "The isovalue of the surface to sharpen: the volume becomes a density around it.";
  surface.default_text = "none: it must be given";
  surface.required = true;
  ParameterInfo reach{.name = "reach_mm",
                      .description =
                          "How far the isosurfaces at the ends of the density move towards the "
                          "surface at the most.",
                      .unit = "mm",
                      .minimum = 1e-6,
                      .maximum = 2000,
                      .default_text = "three times the geometric mean of the spacing"};
  return {.info = {.name = "sharpening",
                   .description = "Gathers the isosurfaces around one of them and keeps the mass: blurred "
                                  "edges become steep, and its volume becomes what the mass says.",
                   .parameters = {std::move(surface), half_width_parameter(), std::move(reach)}},
          .resolve =
              [](const ParameterValues& asked, const MethodInput& input) {
                ParameterValues resolved;
                resolve_surface(resolved, asked, input);
                resolved["reach_mm"] = number(asked, "reach_mm", 3 * mean_spacing(input.grid));
                const SharpeningPlan steps = plan(sharpening(resolved), input.grid);
                resolved["step_mm"] = steps.step_mm;
                resolved["steps"] = static_cast<double>(steps.steps);
                return resolved;
              },
          .run =
              [](Volume& volume, const ParameterValues& resolved, const Progress& report) {
                return smooth_as_asked(volume, sharpening(resolved), resolved, report);
              },
          .passes = counted_steps,
          .extra_bytes_per_voxel = bytes_of_one_volume};
}

std::vector<Method> make_catalog() {
  return {
      flow_method("mean-curvature-flow",
                  "Moves every isosurface along its normal at the speed of its mean curvature: small "
                  "features and noise vanish, edges stay sharp.",
                  {choice_parameter("scheme",
                                    "How curvature and gradient are discretised: 'face-centred' is of second "
                                    "order; 'thesis' is that of the method's source, of first order, and "
                                    "'thesis-weno' the same with gains of high order.",
                                    mean_curvature_schemes()),
                   tolerance_parameter(), surface_parameter(), half_width_parameter()},
                  mean_curvature_flow),
      flow_method("conservative-mean-curvature-flow",
                  "Mean curvature flow from which the mean speed is taken off, so that the mass of the "
                  "whole volume does not change: noise goes, sizes stay.",
                  {surface_parameter(), half_width_parameter(), sharpening_reach_parameter()},
                  conservative_flow),
      flow_method("laplacian",
                  "The heat equation, a Gaussian of variance twice the flow time: smooths across edges as "
                  "well as along them.",
                  {}, laplacian),
      {.info = {.name = "compare",
                .description = "Mean curvature flow and Laplacian of the same strength side by side, "
                               "with the surfaces of the original beside them.",
                .parameters = joined(strength_parameters(), {tolerance_parameter()}),
                .parts = {"mean-curvature-flow", "laplacian"}},
       .resolve = resolve_strength},
      offset_method(),
      sharpening_method()};
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
