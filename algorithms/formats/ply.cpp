#include <string>

#include "algorithms/formats/buffered_file.h"
#include "algorithms/formats/mesh_files.h"

namespace volsmooth {

void write_ply(const std::filesystem::path& file, std::span<const Mesh> meshes, const Progress& report) {
  const Mesh& mesh = meshes.front();
  BufferedFile out(file);
  out.text("ply\nformat binary_little_endian 1.0\ncomment volsmooth\ncomment SPACE=");
  out.text(name_of(mesh.frame));
  out.text("\ncomment unit mm\nelement vertex ");
  out.decimal(std::uint64_t{mesh.positions.size()});
  for (const char* property : {"x", "y", "z", "nx", "ny", "nz"}) {
    out.text("\nproperty float ");
    out.text(property);
  }
  out.text("\nelement face ");
  out.decimal(std::uint64_t{mesh.triangles.size()});
  out.text("\nproperty list uchar uint vertex_indices\nend_header\n");

  std::size_t next = 0;
  for_each_reported(
      mesh.positions,
      [&](const Float3& position) {
        out.value(position);
        out.value(mesh.normals[next++]);
      },
      part_of(report, 0, 0.5));
  for_each_reported(
      mesh.triangles,
      [&](const Triangle& triangle) {
        out.value(std::uint8_t{3});
        out.value(triangle);
      },
      part_of(report, 0.5, 1));
  out.close();
}

std::int64_t most_bytes_of_ply(std::int64_t vertices, std::int64_t triangles) {
  constexpr std::int64_t kMostOfHead = 512, kVertex = 2 * sizeof(Float3), kFace = 1 + sizeof(Triangle);
  return kMostOfHead + kVertex * vertices + kFace * triangles;
}

}  // namespace volsmooth
