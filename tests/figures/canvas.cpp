#include "tests/figures/canvas.h"

#include <algorithm>
#include <cmath>

namespace volsmooth {
namespace {

constexpr Colour kWhite{255, 255, 255};

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

void Canvas::plot(std::int64_t column, std::int64_t row, std::span<const std::array<double, 2>> places,
                  const Colour& colour) {
  const auto dot = [&](double x, double y) {
    const std::int64_t i = std::llround(std::floor(x * static_cast<double>(side_))),
                       j = std::llround(std::floor(y * static_cast<double>(side_)));
    if (i >= 0 && i < side_ && j >= 0 && j < side_) pixel(column, row, i, j) = colour;
  };
  const double width = 1 / static_cast<double>(side_);
  for (std::size_t next = 1; next < places.size(); ++next) {
    const auto [x, y] = places[next - 1];
    const double across = places[next][0] - x, upwards = places[next][1] - y;
    const double steps = std::ceil(2 * std::max(std::abs(across), std::abs(upwards)) / width) + 1;
    for (double step = 0; step <= steps; ++step)
      for (const double beside : {-width, 0.0, width}) {
        const bool is_steep = std::abs(upwards) > std::abs(across);
        dot(x + step / steps * across + (is_steep ? beside : 0),
            y + step / steps * upwards + (is_steep ? 0 : beside));
      }
  }
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

}  // namespace volsmooth
