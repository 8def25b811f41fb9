#pragma once

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/mesh_checks.h"

namespace volsmooth::test {

/// A GLB file: its JSON, and the triangles of each mesh in the units of its positions.
struct GlbContent {
  nlohmann::json document;
  std::vector<TriangleSoup> meshes;
};

inline GlbContent glb_content(const std::string& file) {
  const Glb glb = read_glb(file);
  GlbContent content{nlohmann::json::parse(glb.json), {}};
  const auto accessor = [&](const nlohmann::json& number) {
    return content.document["accessors"][number.get<std::size_t>()];
  };
  const auto place_of = [&](const nlohmann::json& values) {
    const auto& view = content.document["bufferViews"][values["bufferView"].get<std::size_t>()];
    return view.value("byteOffset", std::size_t{0}) + values.value("byteOffset", std::size_t{0});
  };
  for (const auto& mesh : content.document["meshes"]) {
    const auto& primitive = mesh["primitives"][0];
    const auto indices = accessor(primitive["indices"]);
    const std::size_t first_position = place_of(accessor(primitive["attributes"]["POSITION"]));
    const std::size_t first_index = place_of(indices);
    TriangleSoup soup;
    for (std::size_t triangle = 0; triangle < indices["count"].get<std::size_t>() / 3; ++triangle) {
      const auto corners = value_at<Triangle>(glb.binary, first_index + sizeof(Triangle) * triangle);
      auto& positions = soup.triangles.emplace_back();
      for (std::size_t corner = 0; corner < 3; ++corner)
        positions[corner] =
            value_at<Float3>(glb.binary, first_position + sizeof(Float3) * std::size_t{corners[corner]});
    }
    content.meshes.push_back(std::move(soup));
  }
  return content;
}

inline Vector3 position_of(const MergedMesh& mesh, std::uint32_t vertex) {
  const auto& [x, y, z] = mesh.positions[vertex];
  return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}

inline double area_mm2(const MergedMesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto p = position_of(mesh, a), q = position_of(mesh, b), r = position_of(mesh, c);
    const double u[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]},
                 v[3] = {r[0] - p[0], r[1] - p[1], r[2] - p[2]};
    area += std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 2;
  }
  return area;
}

/// By the divergence theorem; negative when the triangles face inwards.
inline double volume_mm3(const MergedMesh& mesh) {
  double volume = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto p = position_of(mesh, a), q = position_of(mesh, b), r = position_of(mesh, c);
    volume += (p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) +
               p[2] * (q[0] * r[1] - q[1] * r[0])) /
              6;
  }
  return volume;
}

/// Of a closed manifold, where each triangle has half of each of its three edges.
inline std::int64_t euler_characteristic(const MergedMesh& mesh) {
  const auto triangles = static_cast<std::int64_t>(mesh.triangles.size());
  return static_cast<std::int64_t>(mesh.positions.size()) - triangles / 2;
}

}  // namespace volsmooth::test
