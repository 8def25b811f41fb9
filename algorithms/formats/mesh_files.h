#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "algorithms/progress.h"
#include "algorithms/surface/mesh.h"

namespace volsmooth {

// The rows of the format table, each a `MeshWriter`. All write positions in mm and say the frame.

/// Binary STL. The header names the frame as 3D Slicer reads it: "SPACE=RAS".
void write_stl(const std::filesystem::path& file, std::span<const Mesh> meshes, const Progress& report);

/// Binary little-endian PLY with normals.
void write_ply(const std::filesystem::path& file, std::span<const Mesh> meshes, const Progress& report);

/// Wavefront OBJ with normals.
void write_obj(const std::filesystem::path& file, std::span<const Mesh> meshes, const Progress& report);

/// Binary glTF 2.0: a root node that scales by 0.001 and turns the frame to glTF's axes (+Y up, +Z forward),
/// below it a node "iso<V>" per mesh. The meshes are in one frame. Files of 4 GiB and more do not exist in
/// this format: MeshFileTooLarge.
void write_glb(const std::filesystem::path& file, std::span<const Mesh> meshes, const Progress& report);

/// The length of a GLB file with so many bytes of JSON and of arrays. Throws MeshFileTooLarge.
std::uint32_t glb_size(std::uint64_t json_bytes, std::uint64_t array_bytes);

// What they take at most, each a `MeshFileSize`.

std::int64_t most_bytes_of_stl(std::int64_t vertices, std::int64_t triangles);
std::int64_t most_bytes_of_ply(std::int64_t vertices, std::int64_t triangles);
std::int64_t most_bytes_of_obj(std::int64_t vertices, std::int64_t triangles);
std::int64_t most_bytes_of_glb(std::int64_t vertices, std::int64_t triangles);

/// Calls `write(element)` for all elements and tells `report` how far it is from time to time.
template <typename Range, typename Write>
void for_each_reported(const Range& range, const Write& write, const Progress& report) {
  constexpr std::size_t kBetweenReports = std::size_t{1} << 16;
  std::size_t done = 0;
  for (const auto& element : range) {
    write(element);
    if (++done % kBetweenReports == 0) report(static_cast<double>(done) / static_cast<double>(range.size()));
  }
}

}  // namespace volsmooth
