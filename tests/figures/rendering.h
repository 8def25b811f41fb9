#pragma once

#include <functional>
#include <vector>

#include "algorithms/surface/mesh.h"
#include "algorithms/volume/volume.h"
#include "tests/figures/canvas.h"

namespace volsmooth {

/// From where a scene is seen, without perspective. The world's +z is up.
struct View {
  Vector3 middle{};                                       ///< in mm, in the picture's middle
  double side_mm = 1;                                     ///< of the square picture
  Vector3 right{1, 0, 0}, up{0, 0, 1}, to_eye{0, -1, 0};  ///< orthonormal
};

/// The whole of `mesh`, seen from `azimuth` degrees from +y (the front of a head) towards +x, and from
/// `elevation` degrees above.
View view_of(const Mesh& mesh, double azimuth, double elevation);

/// What `view` shows, from elsewhere.
View turned(View view, double azimuth, double elevation);

/// Intensities in the plane through the view's middle, the least there are outside of the volume; for
/// `Canvas::trace`.
std::function<double(double x, double y)> cut(const Volume& volume, const VoxelToWorld& map,
                                              const View& view);

/// Pixels along a side of a square with a surface in it.
inline constexpr std::int64_t kSurfaceSide = 256;

inline constexpr Colour kClay{205, 170, 135};

using VertexColour = std::function<Colour(std::size_t vertex)>;

/// Surfaces in one light from above the eye's left, drawn into a buffer of depths by triangles.
class Rendering {
 public:
  Rendering(const View& view, std::int64_t side);

  void draw(const Mesh& mesh, const VertexColour& colour);
  void draw(const Mesh& mesh, const Colour& colour);

  /// For `Canvas::paint`: the mean of the four samples in a pixel.
  Colour operator()(double x, double y) const;

 private:
  struct Corner {
    Vector3 place;     ///< in samples to the right and up, in mm towards the eye
    Vector3 coloured;  ///< as it is lit
  };
  void fill(const std::array<Corner, 3>& corners);

  View view_;
  std::int64_t samples_;  ///< along a side
  std::vector<double> depths_;
  std::vector<Vector3> colours_;
};

/// `part` of the first and the rest of the second.
Colour mixed(const Colour& first, const Colour& second, double part);

/// Blue at -limit, white at 0, red at limit.
Colour diverging(double value, double limit);

}  // namespace volsmooth
