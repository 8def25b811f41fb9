#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "tests/support/phantoms.h"

namespace volsmooth {

constexpr std::int64_t kGyroidSize = 280;

/// A gyroid of periods of 80 voxels of 1 mm in a little noise, 280 voxels along each axis: at 100 a surface
/// that branches and curves both ways everywhere, of as many triangles a voxel as those of the MRI head ch2.
inline Volume::Pointer gyroid() {
  constexpr double kWave = 2 * std::numbers::pi / 80;
  std::array<double, kGyroidSize> sine, cosine;
  for (std::size_t x = 0; x < sine.size(); ++x) {
    sine[x] = std::sin(kWave * static_cast<double>(x));
    cosine[x] = std::cos(kWave * static_cast<double>(x));
  }
  const Grid grid{{kGyroidSize, kGyroidSize, kGyroidSize}, {1, 1, 1}};
  auto volume = volume_of(grid, noise(grid.size, 1, -5, 5));
  float* voxel = volume->GetBufferPointer();
  for (std::size_t z = 0; z < sine.size(); ++z)
    for (std::size_t y = 0; y < sine.size(); ++y)
      for (std::size_t x = 0; x < sine.size(); ++x)
        *voxel++ +=
            static_cast<float>(100 + 100 * (sine[x] * cosine[y] + sine[y] * cosine[z] + sine[z] * cosine[x]));
  return volume;
}

}  // namespace volsmooth
