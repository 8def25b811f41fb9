#include "tests/figures/rendering.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "algorithms/surface/vector_math.h"

namespace volsmooth {
namespace {

constexpr Vector3 kBackground{238, 238, 242};
constexpr std::int64_t kSamples = 2;  // per pixel and axis

Vector3 unit(const Vector3& v) {
  return (1 / length(v)) * v;
}

Vector3 as_vector(const Colour& colour) {
  return {static_cast<double>(colour[0]), static_cast<double>(colour[1]), static_cast<double>(colour[2])};
}

Colour as_colour(const Vector3& vector) {
  Colour colour;
  for (std::size_t c = 0; c < 3; ++c)
    colour[c] = static_cast<std::uint8_t>(std::lround(std::clamp(vector[c], 0.0, 255.0)));
  return colour;
}

/// Twice the area of a triangle in the picture's plane, positive counter-clockwise.
double turn(const Vector3& a, const Vector3& b, const Vector3& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

}  // namespace

View turned(View view, double azimuth, double elevation) {
  const double around = azimuth * std::numbers::pi / 180, above = elevation * std::numbers::pi / 180;
  view.to_eye = {std::sin(around) * std::cos(above), std::cos(around) * std::cos(above), std::sin(above)};
  view.right = unit(cross({0, 0, 1}, view.to_eye));
  view.up = cross(view.to_eye, view.right);
  return view;
}

View view_of(const Mesh& mesh, double azimuth, double elevation) {
  constexpr double kMargin = 1.04, kFar = std::numeric_limits<double>::infinity();
  View view = turned({.side_mm = 0}, azimuth, elevation);
  for (const Vector3& axis : {view.right, view.up, view.to_eye}) {
    double low = kFar, high = -kFar;
    for (const Float3& position : mesh.positions) {
      low = std::min(low, dot(to_double(position), axis));
      high = std::max(high, dot(to_double(position), axis));
    }
    view.middle = view.middle + (low + high) / 2 * axis;
    view.side_mm = std::max(view.side_mm, kMargin * (high - low));
  }
  return view;
}

std::function<double(double x, double y)> cut(const Volume& volume, const VoxelToWorld& map,
                                              const View& view) {
  const Matrix3 to_index = inverse(map.linear);
  return [=, rho = Interpolated(voxels_of(volume), grid_of(volume))](double x, double y) {
    const Vector3 from_origin =
        view.middle + (x - 0.5) * view.side_mm * view.right + (y - 0.5) * view.side_mm * view.up - map.origin;
    Vector3 place;
    for (std::size_t e = 0; e < 3; ++e) {
      place[e] = (dot(to_index[e], from_origin) + 0.5) * rho.grid().spacing_mm[e];
      if (place[e] < 0 || place[e] > rho.extent_mm()[e]) return std::numeric_limits<double>::lowest();
    }
    return rho.at(place);
  };
}

Rendering::Rendering(const View& view, std::int64_t side)
    : view_(view),
      samples_(kSamples * side),
      depths_(static_cast<std::size_t>(samples_ * samples_), -std::numeric_limits<double>::infinity()),
      colours_(depths_.size(), kBackground) {}

void Rendering::draw(const Mesh& mesh, const VertexColour& colour) {
  constexpr double kAmbient = 0.25;
  const Vector3 to_light = unit(view_.to_eye + 0.6 * view_.up - 0.5 * view_.right);
  const double scale = static_cast<double>(samples_) / view_.side_mm;
  std::vector<Corner> corners;
  corners.reserve(mesh.positions.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Vector3 from_middle = to_double(mesh.positions[v]) - view_.middle;
    const double light = std::max(0.0, dot(to_double(mesh.normals[v]), to_light));
    corners.push_back({{scale * dot(from_middle, view_.right) + static_cast<double>(samples_) / 2,
                        scale * dot(from_middle, view_.up) + static_cast<double>(samples_) / 2,
                        dot(from_middle, view_.to_eye)},
                       (kAmbient + (1 - kAmbient) * light) * as_vector(colour(v))});
  }
  for (const Triangle& triangle : mesh.triangles)
    fill({corners[triangle[0]], corners[triangle[1]], corners[triangle[2]]});
}

void Rendering::draw(const Mesh& mesh, const Colour& colour) {
  draw(mesh, [&](std::size_t) { return colour; });
}

void Rendering::fill(const std::array<Corner, 3>& corners) {
  const auto& [a, b, c] = corners;
  const double area = turn(a.place, b.place, c.place);
  if (area <= 0) return;  // seen from behind
  std::array<std::int64_t, 2> first, last;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto [low, high] = std::minmax({a.place[axis], b.place[axis], c.place[axis]});
    first[axis] = std::max<std::int64_t>(0, std::llround(std::ceil(low - 0.5)));
    last[axis] = std::min(samples_ - 1, std::int64_t{std::llround(std::floor(high - 0.5))});
  }
  for (std::int64_t y = first[1]; y <= last[1]; ++y)
    for (std::int64_t x = first[0]; x <= last[0]; ++x) {
      const Vector3 here{static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5, 0};
      const double of_a = turn(here, b.place, c.place) / area, of_b = turn(a.place, here, c.place) / area,
                   of_c = 1 - of_a - of_b;
      if (std::min({of_a, of_b, of_c}) < 0) continue;
      const double depth = of_a * a.place[2] + of_b * b.place[2] + of_c * c.place[2];
      const auto sample = static_cast<std::size_t>(y * samples_ + x);
      if (depth <= depths_[sample]) continue;
      depths_[sample] = depth;
      colours_[sample] = of_a * a.coloured + of_b * b.coloured + of_c * c.coloured;
    }
}

Colour Rendering::operator()(double x, double y) const {
  const auto first_of = [&](double place) {
    return kSamples * static_cast<std::int64_t>(place * static_cast<double>(samples_ / kSamples));
  };
  Vector3 sum{};
  for (std::int64_t j = 0; j < kSamples; ++j)
    for (std::int64_t i = 0; i < kSamples; ++i)
      sum = sum + colours_[static_cast<std::size_t>((first_of(y) + j) * samples_ + first_of(x) + i)];
  return as_colour((1.0 / (kSamples * kSamples)) * sum);
}

Colour mixed(const Colour& first, const Colour& second, double part) {
  return as_colour(part * as_vector(first) + (1 - part) * as_vector(second));
}

Colour diverging(double value, double limit) {
  const double part = std::clamp(value / limit, -1.0, 1.0);
  const Vector3 white{240, 240, 240}, end = part < 0 ? Vector3{40, 70, 230} : Vector3{225, 40, 30};
  return as_colour(white + std::abs(part) * (end - white));
}

}  // namespace volsmooth
