#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

namespace volsmooth {

/// vtkFlyingEdges3D on a volume that stays the caller's. (Its headers are C++17, so they stay behind this
/// one.)
class FlyingEdges {
 public:
  FlyingEdges(const float* voxels, const std::array<std::int64_t, 3>& size);
  ~FlyingEdges();

  /// The isosurface with normals, open where it meets the border. Returns the number of triangles.
  std::int64_t extract(double isovalue, int threads);

  /// The last one, as binary STL.
  void write_stl(const std::string& file) const;

 private:
  struct Pipeline;
  std::unique_ptr<Pipeline> pipeline_;
};

}  // namespace volsmooth
