#include "algorithms/formats/dicom/slice_stack.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "algorithms/formats/dicom/geometry.h"
#include "algorithms/formats/dicom/refused.h"
#include "algorithms/formats/nifti_limits.h"

namespace volsmooth {
namespace {

constexpr double kMostDeviation = 0.02;     ///< of a slice from an even row, in mean distances between slices
constexpr double kToldDeviation_mm = 1e-3;  ///< below that, positions differ by their decimals
constexpr double kSamePlace = 0.01;         ///< closer slices, in mean distances, are the same
constexpr double kSameDirection = 1e-4;     ///< of direction cosines and, relative, of pixel spacings
constexpr double kLeastLean = 0.1;          ///< cosine between normal and step: 84 degrees

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.4g", value);
  return text;
}

bool same_plane(const DicomFrame& a, const DicomFrame& b) {
  const auto near = [](double x, double y, double unit) { return std::abs(x - y) <= kSameDirection * unit; };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!near(a.row_direction[axis], b.row_direction[axis], 1)) return false;
    if (!near(a.column_direction[axis], b.column_direction[axis], 1)) return false;
  }
  return near(a.row_step_mm, b.row_step_mm, a.row_step_mm) &&
         near(a.column_step_mm, b.column_step_mm, a.column_step_mm);
}

void check_consistent(const std::vector<DicomImage>& images) {
  const DicomImage& first = images.front();
  for (const DicomImage& image : images) {
    const bool same =
        image.format == first.format && image.frame_of_reference_uid == first.frame_of_reference_uid &&
        std::ranges::all_of(image.frames,
                            [&](const DicomFrame& frame) { return same_plane(frame, first.frames.front()); });
    if (same) continue;
    refuse_dicom(
        "dicom-inconsistent-series",
        "Slices of the series differ in size, pixel type, pixel spacing, orientation or frame of reference.");
  }
}

void check_instances(const std::vector<DicomImage>& images) {
  std::set<std::string_view> seen;
  for (const DicomImage& image : images) {
    if (!seen.insert(image.frames.front().slice.sop_instance_uid).second)
      refuse_dicom("dicom-duplicate-slice", "Two files have the same SOPInstanceUID (0008,0018).");
  }
}

std::vector<DicomSlice> in_order(std::vector<DicomImage> images, const Vector3& normal) {
  std::vector<DicomSlice> slices;
  for (DicomImage& image : images) {
    for (DicomFrame& frame : image.frames) slices.push_back(std::move(frame.slice));
  }
  std::ranges::stable_sort(slices, {},
                           [&](const DicomSlice& slice) { return dot(slice.position_mm, normal); });
  return slices;
}

void check_duplicates(const std::vector<double>& depths) {
  const double mean = (depths.back() - depths.front()) / static_cast<double>(depths.size() - 1);
  for (std::size_t k = 1; k < depths.size(); ++k) {
    if (depths[k] - depths[k - 1] > kSamePlace * mean) continue;
    throw Refused{
        {"dicom-duplicate-slice",
         "Slices " + std::to_string(k) + " and " + std::to_string(k + 1) +
             ", counted along the normal, are at the same place. A series of several volumes must be "
             "uploaded one by one.",
         {{"slice", static_cast<double>(k)}}}};
  }
}

[[noreturn]] void refuse_uneven(const std::vector<double>& depths, double residual, const char* remedy) {
  const OddGap odd = oddest_gap(depths);
  throw Refused{{"dicom-nonuniform-spacing",
                 "Slices lie up to " + number(residual) +
                     " mm from an even row. The distance between slices " + std::to_string(odd.before + 1) +
                     " and " + std::to_string(odd.before + 2) + ", counted along the normal, is " +
                     number(odd.gap_mm) + " mm where " + number(odd.usual_mm) + " mm are usual. " + remedy,
                 {{"slice", static_cast<double>(odd.before + 1)},
                  {"gap_mm", odd.gap_mm},
                  {"usual_gap_mm", odd.usual_mm},
                  {"deviation_mm", residual}}}};
}

/// How far slices lie beside the line from the first to the last, each at its own depth.
double sideways_residual(const std::vector<Vector3>& positions, const std::vector<double>& depths) {
  const Vector3 way = sum(positions.back(), positions.front(), -1);
  double largest = 0;
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const double share = (depths[k] - depths.front()) / (depths.back() - depths.front());
    const Vector3 there = sum(positions.front(), way, share);
    largest = std::max(largest, length(sum(positions[k], there, -1)));
  }
  return largest;
}

/// Decides where the volume's slices lie; what it gives is the step from one to the next.
UniformSlices place(DicomSeries& series, const Vector3& normal, bool resample) {
  std::vector<Vector3> positions;
  std::vector<double> depths;
  for (const DicomSlice& slice : series.slices) {
    positions.push_back(slice.position_mm);
    depths.push_back(dot(slice.position_mm, normal));
  }
  check_duplicates(depths);
  const UniformSlices fit = fit_uniform(positions);
  series.position_residual_mm = fit.residual_mm;
  const double most = kMostDeviation * length(fit.step_mm);
  if (fit.residual_mm <= most) return fit;
  if (!resample)
    refuse_uneven(depths, fit.residual_mm, "Upload the slices that are missing, or say resample=uniform.");
  if (const double sideways = sideways_residual(positions, depths); sideways > most)
    refuse_uneven(depths, sideways, "They lie beside each other as well, which resampling does not undo.");
  series.blends = even_blends(depths);
  const Vector3 way = sum(positions.back(), positions.front(), -1);
  return {positions.front(), sum({}, way, 1 / static_cast<double>(series.blends.size() - 1)),
          fit.residual_mm};
}

void check_grid(const DicomSeries& series, const Vector3& normal, const ReadLimits& limits) {
  const std::int64_t slices = series.size[2];
  if (slices > limits.max_axis_voxels || slices > limits.max_voxels / (series.size[0] * series.size[1])) {
    refuse_dicom("volume-too-large", "The series has more than the " + std::to_string(limits.max_voxels) +
                                         " voxels, or " + std::to_string(limits.max_axis_voxels) +
                                         " along an axis, that this server takes.");
  }
  const auto [least, largest] = std::ranges::minmax(series.spacing_mm);
  if (!std::ranges::all_of(series.spacing_mm, is_spacing) || largest > kLargestSpacingRatio * least)
    refuse_dicom("dicom-bad-spacing",
                 "The distances between pixels and slices are more than 1000 to 1 apart.");
  const Vector3 step{series.map.linear[0][2], series.map.linear[1][2], series.map.linear[2][2]};
  if (dot(step, normal) < kLeastLean * length(step))
    refuse_dicom("dicom-bad-orientation", "The slices lie beside each other, not one above the other.");
}

std::vector<std::string> told_of(const std::vector<DicomImage>& images) {
  std::set<std::string> all;
  for (const DicomImage& image : images) all.insert(image.warnings.begin(), image.warnings.end());
  return {all.begin(), all.end()};
}

void warn_of_places(DicomSeries& series, const Vector3& normal) {
  if (series.resampled()) {
    series.warnings.push_back("resampled: " + std::to_string(series.slices.size()) +
                              " uneven slices were interpolated to " + std::to_string(series.size[2]) +
                              " even ones.");
  } else if (series.position_residual_mm > kToldDeviation_mm) {
    series.warnings.push_back("uneven-slices: slices lie up to " + number(series.position_residual_mm) +
                              " mm from the even row they are taken for.");
  }
  const Vector3 step{series.map.linear[0][2], series.map.linear[1][2], series.map.linear[2][2]};
  const double cosine = std::clamp(dot(step, normal) / length(step), -1.0, 1.0);
  constexpr double kToldTilt = 0.1, kDegrees = 57.29577951308232;
  if (const double tilt = std::acos(cosine) * kDegrees; tilt > kToldTilt)
    series.warnings.push_back("gantry-tilt: the slices are stacked at " + number(tilt) +
                              " degrees to their normal; the volume is kept as sheared as it is.");
}

}  // namespace

DicomSeries stack_slices(std::vector<DicomImage> images, const SeriesOptions& options) {
  check_consistent(images);
  check_instances(images);
  DicomSeries series;
  const DicomFrame first = images.front().frames.front();
  series.format = images.front().format;
  series.modality = images.front().modality;
  series.frame_of_reference_uid = images.front().frame_of_reference_uid;
  series.row_direction = first.row_direction;
  series.column_direction = first.column_direction;
  const Vector3 across = cross(first.row_direction, first.column_direction);
  const Vector3 normal = sum({}, across, 1 / length(across));
  series.warnings = told_of(images);
  series.slices = in_order(std::move(images), normal);
  if (series.slices.size() < 2)
    refuse_dicom("dicom-too-few-slices", "A volume takes two slices at the least; the series has one.");
  const UniformSlices placed = place(series, normal, options.resample_uniform);
  series.map = {.origin = placed.origin_mm, .frame = Frame::kLps};
  for (std::size_t row = 0; row < 3; ++row) {
    series.map.linear[row] = {first.row_direction[row] * first.column_step_mm,
                              first.column_direction[row] * first.row_step_mm, placed.step_mm[row]};
  }
  series.spacing_mm = spacing_of(series.map);
  const std::size_t count = series.resampled() ? series.blends.size() : series.slices.size();
  series.size = {series.format.columns, series.format.rows, static_cast<std::int64_t>(count)};
  check_grid(series, normal, options.limits);
  warn_of_places(series, normal);
  return series;
}

}  // namespace volsmooth
