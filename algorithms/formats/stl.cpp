#include <cmath>

#include "algorithms/formats/buffered_file.h"
#include "algorithms/formats/mesh_files.h"
#include "algorithms/surface/vector_math.h"

namespace volsmooth {
namespace {

constexpr std::size_t kHeaderSize = 80;

#pragma pack(push, 1)
struct Facet {
  Float3 normal;
  std::array<Float3, 3> corners;
  std::uint16_t attributes = 0;
};
#pragma pack(pop)
static_assert(sizeof(Facet) == 50);

Facet facet_of(const Mesh& mesh, const Triangle& triangle) {
  const Vector3 normal = area_normal(corners_of(mesh, triangle));
  const double size = length(normal);
  Facet facet{};
  for (std::size_t k = 0; k < 3; ++k) {
    facet.normal[k] = size > 0 ? static_cast<float>(normal[k] / size) : 0.0F;
    facet.corners[k] = mesh.positions[triangle[k]];
  }
  return facet;
}

}  // namespace

void write_stl(const std::filesystem::path& file, std::span<const Mesh> meshes, const Progress& report) {
  const Mesh& mesh = meshes.front();
  BufferedFile out(file);
  // Must not begin with "solid": that is how readers know the text form.
  std::string header = "volsmooth SPACE=" + std::string(name_of(mesh.frame)) + " UNIT=mm";
  header.resize(kHeaderSize, ' ');
  out.text(header);
  out.value(static_cast<std::uint32_t>(mesh.triangles.size()));
  for_each_reported(
      mesh.triangles, [&](const Triangle& triangle) { out.value(facet_of(mesh, triangle)); }, report);
  out.close();
}

std::int64_t most_bytes_of_stl(std::int64_t /*vertices*/, std::int64_t triangles) {
  return static_cast<std::int64_t>(kHeaderSize + sizeof(std::uint32_t)) +
         static_cast<std::int64_t>(sizeof(Facet)) * triangles;
}

}  // namespace volsmooth
