#include "algorithms/formats/picture.h"

#include <png.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <system_error>
#include <vector>

#include "algorithms/formats/buffered_file.h"
#include "algorithms/formats/slice_views.h"

namespace volsmooth {
namespace {

constexpr double kLongestSide = 440;  // pixels of the longest side of a panel
constexpr std::int64_t kGap = 10;     // pixels between panels
constexpr std::int64_t kFine = 3;     // contours are found on a grid this many times finer than the pixels

using Colour = std::array<std::uint8_t, 3>;

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
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(part, 0.0, 1.0)));
  }
};

/// One slice on a grid of points `kFine` times finer than its pixels, with two points more on every side.
class FineSlice {
 public:
  static constexpr std::int64_t kMargin = 2;

  FineSlice(const MiddleSlices& volume, const SliceView& view, double pixels_per_mm)
      : width_(pixels(view.right, pixels_per_mm)),
        height_(pixels(view.down, pixels_per_mm)),
        stride_(width_ * kFine + 2 * kMargin),
        intensities_(static_cast<std::size_t>(stride_ * (height_ * kFine + 2 * kMargin))) {
    const auto mm = [&](std::int64_t place) {
      return (static_cast<double>(place - kMargin) + 0.5) / (static_cast<double>(kFine) * pixels_per_mm);
    };
    std::size_t next = 0;
    for (std::int64_t y = 0; y < height_ * kFine + 2 * kMargin; ++y) {
      const double along_down = view.down.index_at(mm(y));
      for (std::int64_t x = 0; x < stride_; ++x) {
        intensities_[next++] =
            static_cast<float>(intensity_at(volume, view, view.right.index_at(mm(x)), along_down));
      }
    }
  }

  static std::int64_t pixels(const SliceView::Direction& direction, double pixels_per_mm) {
    return std::max<std::int64_t>(1, std::lround(direction.extent_mm() * pixels_per_mm));
  }
  std::int64_t width() const { return width_; }
  std::int64_t height() const { return height_; }

  double at_pixel(std::int64_t x, std::int64_t y) const {
    return at(x * kFine + kFine / 2, y * kFine + kFine / 2);
  }

  /// How much of a pixel a contour covers, 0..1: a line through it meets a row of a window of 5 x 5 points.
  double coverage(std::int64_t x, std::int64_t y, double isovalue) const {
    constexpr std::int64_t kReach = 2;
    const std::int64_t cx = x * kFine + kFine / 2, cy = y * kFine + kFine / 2;
    int crossings = 0;
    for (std::int64_t j = cy - kReach; j <= cy + kReach; ++j) {
      for (std::int64_t i = cx - kReach; i <= cx + kReach; ++i) {
        const bool inside = at(i, j) >= isovalue;
        crossings += inside != (at(i + 1, j) >= isovalue) || inside != (at(i, j + 1) >= isovalue) ? 1 : 0;
      }
    }
    return std::min(1.0, crossings / (2.0 * kReach + 1));
  }

 private:
  double at(std::int64_t x, std::int64_t y) const {
    return double{intensities_[static_cast<std::size_t>((y + kMargin) * stride_ + x + kMargin)]};
  }

  std::int64_t width_, height_, stride_;
  std::vector<float> intensities_;
};

void draw(const FineSlice& slice, const GreyWindow& window, std::span<const double> isovalues,
          std::int64_t left, std::int64_t top, Raster& raster) {
  for (std::int64_t y = 0; y < slice.height(); ++y) {
    for (std::int64_t x = 0; x < slice.width(); ++x) {
      Colour& pixel = raster.at(left + x, top + y);
      pixel.fill(window.grey(slice.at_pixel(x, y)));
      for (std::size_t k = 0; k < isovalues.size(); ++k) {
        const double part = slice.coverage(x, y, isovalues[k]);
        const Colour& colour = kContourColours[k % kContourColours.size()];
        for (std::size_t channel = 0; channel < 3; ++channel) {
          pixel[channel] =
              static_cast<std::uint8_t>(std::lround((1 - part) * pixel[channel] + part * colour[channel]));
        }
      }
    }
  }
}

void write_png(const std::filesystem::path& file, const Raster& raster) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(raster.width);
  image.height = static_cast<png_uint_32>(raster.height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::byte> bytes(size);
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, raster.pixels.data(), 0, nullptr) == 0) {
    throw std::system_error(EIO, std::generic_category(), "cannot encode a PNG");
  }
  BufferedFile out(file);
  out.bytes(bytes.data(), size);
  out.close();
}

}  // namespace

void write_picture(const std::filesystem::path& file, const MiddleSlices& before, const MiddleSlices& after,
                   std::span<const double> isovalues) {
  const auto views = radiological_views(before.size, before.map);
  double longest = 0;
  for (const SliceView& view : views)
    longest = std::max({longest, view.right.extent_mm(), view.down.extent_mm()});
  const double pixels_per_mm = kLongestSide / longest;

  std::int64_t width = kGap, height = 0;
  for (const SliceView& view : views) {
    width += FineSlice::pixels(view.right, pixels_per_mm) + kGap;
    height = std::max(height, FineSlice::pixels(view.down, pixels_per_mm));
  }
  Raster raster(width, 2 * height + 3 * kGap);
  const GreyWindow window(before);
  std::int64_t top = kGap;
  for (const MiddleSlices* volume : {&before, &after}) {
    std::int64_t left = kGap;
    for (const SliceView& view : views) {
      const FineSlice slice(*volume, view, pixels_per_mm);
      draw(slice, window, isovalues, left, top + (height - slice.height()) / 2, raster);
      left += slice.width() + kGap;
    }
    top += height + kGap;
  }
  write_png(file, raster);
}

}  // namespace volsmooth
