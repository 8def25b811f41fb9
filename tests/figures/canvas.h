#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "algorithms/formats/png_writer.h"
#include "algorithms/volume/geometry.h"

namespace volsmooth {

/// Square pictures in rows and columns, a margin between them, on white.
class Canvas {
 public:
  Canvas(std::int64_t columns, std::int64_t rows, std::int64_t side);

  /// Paints one of the squares: `colour(x, y)` at a place in [0, 1]^2, y upwards.
  void paint(std::int64_t column, std::int64_t row, const std::function<Colour(double x, double y)>& colour);

  /// The line where `value` crosses `level`, over what was painted.
  void trace(std::int64_t column, std::int64_t row, const std::function<double(double x, double y)>& value,
             double level, const Colour& colour);

  /// Straight lines from place to place, three pixels wide.
  void plot(std::int64_t column, std::int64_t row, std::span<const std::array<double, 2>> places,
            const Colour& colour);

  void save(const std::filesystem::path& file) const;

 private:
  static constexpr std::int64_t kMargin = 8;

  Colour& pixel(std::int64_t column, std::int64_t row, std::int64_t x, std::int64_t y);
  double centre(std::int64_t pixel) const;

  std::int64_t side_, width_;
  std::vector<Colour> pixels_;
};

/// A grey between black at `low` and white at `high`.
Colour grey(double value, double low, double high);

/// A volume between its voxel centres, linear; the border voxels' beyond them.
class Interpolated {
 public:
  Interpolated(std::span<const float> voxels, const Grid& grid) : voxels_(voxels), grid_(grid) {}

  /// At a position in mm from the outer corner of voxel (0,0,0).
  double at(const Vector3& position) const;

  const Grid& grid() const { return grid_; }
  Vector3 extent_mm() const;

 private:
  std::span<const float> voxels_;
  Grid grid_;
};

}  // namespace volsmooth
