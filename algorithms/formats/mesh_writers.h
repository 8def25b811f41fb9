#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/progress.h"
#include "algorithms/surface/mesh.h"

namespace volsmooth {

/// A file would be longer than its format can say. Thrown before any of it is written.
class MeshFileTooLarge : public std::length_error {
 public:
  MeshFileTooLarge(std::uint64_t needed, std::uint64_t most)
      : std::length_error("a mesh file beyond its format"), needed_bytes(needed), limit(most) {}
  std::uint64_t needed_bytes, limit;
};

/// Writes one mesh to one file. Throws std::system_error when the file cannot be written, MeshFileTooLarge.
using MeshWriter = void (*)(const std::filesystem::path& file, std::span<const Mesh> meshes,
                            const Progress& report);

/// The most bytes that a file of so many may take, for any coordinates; within a kilobyte or two for binary
/// formats, and a third for text.
using MeshFileSize = std::int64_t (*)(std::int64_t vertices, std::int64_t triangles);

/// One row of the format table.
struct MeshFormat {
  std::string name;        ///< "stl": also the file's extension
  std::string media_type;  ///< "model/stl"
  std::string description;
  bool many_surfaces;       ///< one file holds all isovalues of a method, a named node each (GLB)
  MeshWriter write;         ///< takes exactly one mesh unless `many_surfaces`
  MeshFileSize most_bytes;  ///< of one mesh; a file with many takes no more than the sum
};

const std::vector<MeshFormat>& mesh_formats();
const MeshFormat* find_mesh_format(std::string_view name);

/// The shortest text that reads back as `isovalue`, as in file and node names: "300", "-300", "0.0001".
/// Without an exponent as long as 1e-6 <= |isovalue| < 1e15.
std::string isovalue_text(double isovalue);

}  // namespace volsmooth
