#include "algorithms/formats/picture.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

#include "algorithms/formats/png_writer.h"
#include "algorithms/formats/slice_views.h"
#include "algorithms/volume/parallel.h"

namespace volsmooth {
namespace {

constexpr double kLongestSide = 440;  // pixels of the longest side of a panel
constexpr std::int64_t kGap = 10;     // pixels between panels
constexpr std::int64_t kFine = 3;     // contours are found on a grid this many times finer than the pixels
constexpr std::int64_t kWindow = 5;  // fine points a side, about the middle of a pixel, that tell its contour
constexpr std::int64_t kBand = 16;   // rows of pixels that are drawn at once: their fine points stay in cache

constexpr std::array<Colour, 6> kContourColours{
    {{255, 120, 60}, {70, 190, 255}, {120, 230, 90}, {255, 215, 70}, {225, 110, 235}, {70, 230, 220}}};

struct Raster {
  std::int64_t width, height;
  std::vector<Colour> pixels;

  Raster(std::int64_t w, std::int64_t h) : width(w), height(h), pixels(static_cast<std::size_t>(w * h)) {}
  Colour& at(std::int64_t x, std::int64_t y) { return pixels[static_cast<std::size_t>(y * width + x)]; }
};

/// Intensities that become black and white: the 1st and 99.5th percentile of the slices' voxels.
struct GreyWindow {
  double black, white;

  explicit GreyWindow(const MiddleSlices& volume) {
    std::vector<float> voxels;
    for (const auto& slice : volume.slices) voxels.insert(voxels.end(), slice.begin(), slice.end());
    const auto percentile = [&voxels](double part) {
      const auto place =
          voxels.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(voxels.size() - 1));
      std::ranges::nth_element(voxels, place);
      return double{*place};
    };
    black = percentile(0.01);
    white = percentile(0.995);
  }

  std::uint8_t grey(double intensity) const {
    const double part = white > black ? (intensity - black) / (white - black) : 0.5;
    return static_cast<std::uint8_t>(255 * std::clamp(part, 0.0, 1.0) + 0.5);
  }
};

using Points = std::vector<SliceView::Between>;

/// Element `kFine p + i` is point i of the window of pixel p; one more follows the last window.
Points fine_points(const SliceView::Direction& direction, std::int64_t pixels, double pixels_per_mm) {
  Points points(static_cast<std::size_t>(kFine * (pixels - 1) + kWindow + 1));
  double place = 0.5 - static_cast<double>((kWindow - kFine) / 2);
  for (auto& point : points)
    point = direction.between(place++ / (static_cast<double>(kFine) * pixels_per_mm));
  return points;
}

/// Where one slice of one volume is drawn.
struct Panel {
  SliceVoxels voxels;
  std::int64_t left, top, width, height;
  Points across, down;
};

/// The intensities at the fine points of some rows of a panel's pixels, and where they cross an isovalue.
class FineBand {
 public:
  FineBand(const Panel& panel, std::int64_t first_row, std::int64_t rows)
      : stride_(panel.across.size()),
        rows_(static_cast<std::size_t>(kFine * (rows - 1) + kWindow + 1)),
        intensities_(stride_ * rows_) {
    std::array<std::vector<float>, 2> voxel_rows;  // at the points across, of an even and an odd row
    std::array<std::int64_t, 2> held{-1, -1};
    const auto row_of_voxels = [&](std::int64_t row) {
      std::vector<float>& values = voxel_rows[row % 2];
      if (std::exchange(held[row % 2], row) == row) return values.data();
      values.resize(stride_);
      std::ranges::transform(panel.across, values.begin(), [&](const SliceView::Between& place) {
        const float from = panel.voxels.at(place.low, row);
        return from + place.part * (panel.voxels.at(place.next, row) - from);
      });
      return values.data();
    };
    for (std::size_t y = 0; y < rows_; ++y) {
      const auto& [low, next, part] = panel.down[static_cast<std::size_t>(kFine * first_row) + y];
      const float *from = row_of_voxels(low), *to = row_of_voxels(next);
      const float fraction = part;
      float* row = &intensities_[y * stride_];
      for (std::size_t x = 0; x < stride_; ++x) row[x] = from[x] + fraction * (to[x] - from[x]);
    }
  }

  double at_pixel(std::int64_t x, std::int64_t y) const {
    const auto column = static_cast<std::size_t>(kFine * x + kWindow / 2);
    return double{intensities_[static_cast<std::size_t>(kFine * y + kWindow / 2) * stride_ + column]};
  }

  /// How much of each pixel of row y a contour covers, 0..1: a line through it meets a row of its window.
  std::vector<float> coverage(std::int64_t y, const std::vector<std::uint8_t>& crossings) const {
    std::vector<std::uint8_t> columns(stride_);
    for (std::int64_t j = 0; j < kWindow; ++j) {
      const auto row =
          std::span(crossings).subspan(static_cast<std::size_t>(kFine * y + j) * stride_, stride_);
      std::transform(columns.begin(), columns.end(), row.begin(), columns.begin(), std::plus<std::uint8_t>{});
    }
    std::vector<float> parts;
    for (std::size_t first = 0; first + kWindow < stride_; first += kFine) {
      const int sum = std::accumulate(&columns[first], &columns[first] + kWindow, 0);
      parts.push_back(std::min(1.0F, static_cast<float>(sum) / float{kWindow}));
    }
    return parts;
  }

  /// 1 where the contour passes between a point and its neighbour to the right or below, else 0.
  std::vector<std::uint8_t> crossings(double isovalue) const {
    std::vector<std::uint8_t> inside(intensities_.size()), crossed(intensities_.size());
    std::ranges::transform(intensities_, inside.begin(),
                           [level = static_cast<float>(isovalue)](float value) { return value >= level; });
    // Local, since the compiler must take bytes that are written for parts of anything else.
    const std::size_t below = stride_, count = inside.size() - stride_;
    const std::uint8_t* from = inside.data();
    std::uint8_t* to = crossed.data();
    for (std::size_t i = 0; i < count; ++i) {
      to[i] = static_cast<std::uint8_t>((from[i] ^ from[i + 1]) | (from[i] ^ from[i + below]));
    }
    return crossed;
  }

 private:
  std::size_t stride_, rows_;
  std::vector<float> intensities_;
};

void draw(const Panel& panel, std::int64_t first_row, const GreyWindow& window,
          std::span<const double> isovalues, Raster& raster) {
  const std::int64_t rows = std::min(kBand, panel.height - first_row);
  const FineBand band(panel, first_row, rows);
  const auto pixel = [&](std::int64_t x, std::int64_t y) -> Colour& {
    return raster.at(panel.left + x, panel.top + first_row + y);
  };
  for (std::int64_t y = 0; y < rows; ++y) {
    for (std::int64_t x = 0; x < panel.width; ++x) pixel(x, y).fill(window.grey(band.at_pixel(x, y)));
  }
  for (std::size_t k = 0; k < isovalues.size(); ++k) {
    const Colour& colour = kContourColours[k % kContourColours.size()];
    const auto crossings = band.crossings(isovalues[k]);
    for (std::int64_t y = 0; y < rows; ++y) {
      const std::vector<float> coverage = band.coverage(y, crossings);
      for (std::int64_t x = 0; x < panel.width; ++x) {
        const float part = coverage[static_cast<std::size_t>(x)];
        for (std::size_t channel = 0; part > 0 && channel < 3; ++channel) {
          std::uint8_t& value = pixel(x, y)[channel];
          value = static_cast<std::uint8_t>((1 - part) * value + part * colour[channel] + 0.5F);
        }
      }
    }
  }
}

}  // namespace

void write_picture(const std::filesystem::path& file, const MiddleSlices& before, const MiddleSlices& after,
                   std::span<const double> isovalues) {
  const auto views = radiological_views(before.size, before.map);
  double longest = 0;
  for (const SliceView& view : views)
    longest = std::max({longest, view.right.extent_mm(), view.down.extent_mm()});
  const double pixels_per_mm = kLongestSide / longest;
  const auto pixels = [&](const SliceView::Direction& direction) {
    return std::max<std::int64_t>(1, std::lround(direction.extent_mm() * pixels_per_mm));
  };

  std::int64_t width = kGap, height = 0;
  for (const SliceView& view : views) height = std::max(height, pixels(view.down));
  std::vector<Panel> panels;
  for (const SliceView& view : views) {
    const std::int64_t across = pixels(view.right), down = pixels(view.down);
    std::int64_t top = kGap + (height - down) / 2;
    for (const MiddleSlices* volume : {&before, &after}) {
      panels.push_back({SliceVoxels(*volume, view), width, top, across, down,
                        fine_points(view.right, across, pixels_per_mm),
                        fine_points(view.down, down, pixels_per_mm)});
      top += height + kGap;
    }
    width += across + kGap;
  }

  Raster raster(width, 2 * height + 3 * kGap);
  const GreyWindow window(before);
  std::vector<std::pair<const Panel*, std::int64_t>> bands;
  for (const Panel& panel : panels) {
    for (std::int64_t row = 0; row < panel.height; row += kBand) bands.emplace_back(&panel, row);
  }
  parallel_for(std::ssize(bands), 1, [&](std::int64_t band, std::int64_t) {
    const auto& [panel, first_row] = bands[static_cast<std::size_t>(band)];
    draw(*panel, first_row, window, isovalues, raster);
  });
  write_png(file, raster.width, raster.pixels);
}

}  // namespace volsmooth
