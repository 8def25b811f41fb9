#include "algorithms/formats/mesh_writers.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "algorithms/formats/mesh_files.h"

namespace volsmooth {

const std::vector<MeshFormat>& mesh_formats() {
  static const std::vector<MeshFormat> formats{
      {"stl", "model/stl", "STL, binary: triangles for printing and planning", false, write_stl,
       most_bytes_of_stl},
      {"ply", "model/ply", "PLY, binary: vertices with normals", false, write_ply, most_bytes_of_ply},
      {"obj", "model/obj", "Wavefront OBJ, text: vertices with normals", false, write_obj, most_bytes_of_obj},
      {"glb", "model/gltf-binary",
       "glTF 2.0, binary: all surfaces of a method in one scene, a named node each", true, write_glb,
       most_bytes_of_glb},
  };
  return formats;
}

const MeshFormat* find_mesh_format(std::string_view name) {
  const auto found = std::ranges::find(mesh_formats(), name, &MeshFormat::name);
  return found == mesh_formats().end() ? nullptr : &*found;
}

std::string isovalue_text(double isovalue) {
  std::array<char, 32> digits;
  const double size = std::abs(isovalue);
  const bool fixed = size == 0 || (size >= 1e-6 && size < 1e15);
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), isovalue + 0.0,
                                 fixed ? std::chars_format::fixed : std::chars_format::scientific)
                       .ptr;
  return {digits.data(), end};
}

}  // namespace volsmooth
