#include <string>

#include "algorithms/formats/buffered_file.h"
#include "algorithms/formats/mesh_files.h"
#include "algorithms/formats/mesh_writers.h"

namespace volsmooth {

void write_obj(const std::filesystem::path& file, std::span<const Mesh> meshes, const Progress& report) {
  const Mesh& mesh = meshes.front();
  BufferedFile out(file);
  out.text("# volsmooth\n# SPACE=");
  out.text(name_of(mesh.frame));
  out.text("\n# unit mm\no iso");
  out.text(isovalue_text(mesh.isovalue));
  out.text("\n");
  const auto write_vector = [&out](std::string_view keyword) {
    return [&out, keyword](const Float3& vector) {
      out.text(keyword);
      for (float component : vector) {
        out.text(" ");
        out.decimal(component);
      }
      out.text("\n");
    };
  };
  for_each_reported(mesh.positions, write_vector("v"), part_of(report, 0, 0.35));
  for_each_reported(mesh.normals, write_vector("vn"), part_of(report, 0.35, 0.7));
  for_each_reported(
      mesh.triangles,
      [&](const Triangle& triangle) {
        out.text("f");
        for (std::uint32_t vertex : triangle) {
          const std::uint64_t number = std::uint64_t{vertex} + 1;
          out.text(" ");
          out.decimal(number);
          out.text("//");
          out.decimal(number);
        }
        out.text("\n");
      },
      part_of(report, 0.7, 1));
  out.close();
}

std::int64_t most_bytes_of_obj(std::int64_t vertices, std::int64_t triangles) {
  constexpr std::int64_t kMostOfHead = 512, kMostOfFloat = 15;  // "-1.01000015e-36"
  constexpr std::int64_t kVector = 3 * (1 + kMostOfFloat) + 1;  // behind its keyword
  const auto digits = static_cast<std::int64_t>(std::to_string(vertices).size());
  const std::int64_t face = 1 + 3 * (1 + digits + 2 + digits) + 1;
  return kMostOfHead + (1 + kVector + 2 + kVector) * vertices + face * triangles;
}

}  // namespace volsmooth
