#include "tests/figures/canvas.h"

#include <algorithm>
#include <cmath>

namespace volsmooth {
namespace {

constexpr Colour kWhite{255, 255, 255};

Vector3 moved(const Vector3& from, double by, const Vector3& along) {
  return {from[0] + by * along[0], from[1] + by * along[1], from[2] + by * along[2]};
}

double dot(const Vector3& a, const Vector3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double length(const Vector3& a) {
  return std::sqrt(dot(a, a));
}

std::uint8_t byte(double value) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

}  // namespace

Canvas::Canvas(std::int64_t columns, std::int64_t rows, std::int64_t side)
    : side_(side),
      width_(columns * (side + kMargin) + kMargin),
      pixels_(static_cast<std::size_t>(width_ * (rows * (side + kMargin) + kMargin)), kWhite) {}

Colour& Canvas::pixel(std::int64_t column, std::int64_t row, std::int64_t x, std::int64_t y) {
  const std::int64_t left = kMargin + column * (side_ + kMargin), top = kMargin + row * (side_ + kMargin);
  return pixels_[static_cast<std::size_t>((top + side_ - 1 - y) * width_ + left + x)];
}

double Canvas::centre(std::int64_t pixel) const {
  return (static_cast<double>(pixel) + 0.5) / static_cast<double>(side_);
}

void Canvas::paint(std::int64_t column, std::int64_t row,
                   const std::function<Colour(double x, double y)>& colour) {
  for (std::int64_t y = 0; y < side_; ++y)
    for (std::int64_t x = 0; x < side_; ++x) pixel(column, row, x, y) = colour(centre(x), centre(y));
}

void Canvas::trace(std::int64_t column, std::int64_t row,
                   const std::function<double(double x, double y)>& value, double level,
                   const Colour& colour) {
  const auto is_above = [&](std::int64_t x, std::int64_t y) { return value(centre(x), centre(y)) > level; };
  for (std::int64_t y = 0; y + 1 < side_; ++y)
    for (std::int64_t x = 0; x + 1 < side_; ++x)
      if (is_above(x, y) != is_above(x + 1, y) || is_above(x, y) != is_above(x, y + 1))
        pixel(column, row, x, y) = colour;
}

void Canvas::save(const std::filesystem::path& file) const {
  write_png(file, width_, pixels_);
}

Colour grey(double value, double low, double high) {
  const std::uint8_t level = byte((value - low) / (high - low));
  return {level, level, level};
}

double Interpolated::at(const Vector3& position) const {
  Size3 low, next;
  Vector3 part;
  for (std::size_t e = 0; e < 3; ++e) {
    const std::int64_t last = grid_.size[e] - 1;
    const double index = std::clamp(position[e] / grid_.spacing_mm[e] - 0.5, 0.0, static_cast<double>(last));
    low[e] = static_cast<std::int64_t>(index);
    next[e] = std::min(low[e] + 1, last);
    part[e] = index - static_cast<double>(low[e]);
  }
  double sum = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    double weight = 1;
    Size3 voxel;
    for (std::size_t e = 0; e < 3; ++e) {
      const bool is_next = (corner >> e & 1U) != 0;
      voxel[e] = is_next ? next[e] : low[e];
      weight *= is_next ? part[e] : 1 - part[e];
    }
    sum += weight * double{voxels_[static_cast<std::size_t>(
                        voxel[0] + grid_.size[0] * (voxel[1] + grid_.size[1] * voxel[2]))]};
  }
  return sum;
}

Vector3 Interpolated::extent_mm() const {
  Vector3 extent;
  for (std::size_t e = 0; e < 3; ++e) extent[e] = static_cast<double>(grid_.size[e]) * grid_.spacing_mm[e];
  return extent;
}

Colour surface_colour(const Interpolated& rho, double isovalue, double x, double y) {
  constexpr Vector3 kRight{0.8, 0.6, 0}, kUp{-0.24, 0.32, 0.9165}, kAway{-0.55, 0.7333, -0.4};
  constexpr Vector3 kToLight{0.45, -0.45, 0.77};
  const Vector3 box = rho.extent_mm();
  const double reach = *std::ranges::max_element(box);
  const double step = 0.4 * *std::ranges::min_element(rho.grid().spacing_mm);
  const Vector3 centre{box[0] / 2, box[1] / 2, box[2] / 2};
  const Vector3 middle = moved(moved(centre, (x - 0.5) * reach, kRight), (y - 0.5) * reach, kUp);
  const auto is_in_box = [&](const Vector3& place) {
    for (std::size_t e = 0; e < 3; ++e)
      if (place[e] < 0 || place[e] > box[e]) return false;
    return true;
  };
  for (double depth = -reach; depth < reach; depth += step) {
    const Vector3 place = moved(middle, depth, kAway);
    if (!is_in_box(place) || rho.at(place) <= isovalue) continue;
    const double before = rho.at(moved(middle, depth - step, kAway)), here = rho.at(place);
    const Vector3 hit =
        before < isovalue ? moved(place, -step * (here - isovalue) / (here - before), kAway) : place;
    Vector3 normal;
    for (std::size_t e = 0; e < 3; ++e) {
      Vector3 axis{};
      axis[e] = rho.grid().spacing_mm[e];
      normal[e] = (rho.at(moved(hit, -1, axis)) - rho.at(moved(hit, 1, axis))) / axis[e];
    }
    const double light = std::max(0.0, dot(normal, kToLight) / std::max(length(normal), 1e-12));
    return {byte(0.20 + 0.70 * light), byte(0.25 + 0.65 * light), byte(0.30 + 0.55 * light)};
  }
  return {235, 235, 240};
}

}  // namespace volsmooth
