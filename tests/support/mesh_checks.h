#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "algorithms/surface/mesh.h"

namespace volsmooth::test {

/// Triangles by the positions of their corners, as an STL has them.
struct TriangleSoup {
  std::vector<std::array<Float3, 3>> triangles;
};

/// Vertices at the same position (bit for bit, but 0 == -0) as one.
struct MergedMesh {
  std::vector<Float3> positions;
  std::vector<Triangle> triangles;
};

inline TriangleSoup soup_of(const Mesh& mesh) {
  TriangleSoup soup;
  for (const auto& [a, b, c] : mesh.triangles) {
    soup.triangles.push_back({mesh.positions[a], mesh.positions[b], mesh.positions[c]});
  }
  return soup;
}

inline MergedMesh merge_by_position(const TriangleSoup& soup) {
  const auto hash = [](const Float3& position) {
    std::uint64_t mixed = 0;
    for (float x : position) mixed = (mixed ^ std::bit_cast<std::uint32_t>(x + 0.0F)) * 0x9E3779B97F4A7C15u;
    return static_cast<std::size_t>(mixed ^ mixed >> 32);
  };
  std::unordered_map<Float3, std::uint32_t, decltype(hash)> numbers(soup.triangles.size(), hash);
  MergedMesh merged;
  for (const auto& corners : soup.triangles) {
    Triangle triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto next = static_cast<std::uint32_t>(merged.positions.size());
      const auto [known, is_new] = numbers.emplace(corners[k], next);
      if (is_new) merged.positions.push_back(corners[k]);
      triangle[k] = known->second;
    }
    merged.triangles.push_back(triangle);
  }
  return merged;
}

/// The first reason why a mesh is no closed oriented 2-manifold; empty when it is one. Independent of the
/// code under test: from triangles alone.
inline std::string manifold_fault(const MergedMesh& mesh) {
  // Round every vertex the far sides of its triangles, each from a corner to a corner, must make one ring.
  using Side = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<std::vector<Side>> far_sides(mesh.positions.size());
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (t[k] == t[(k + 1) % 3]) return "a triangle has two corners at one position";
      far_sides[t[k]].emplace_back(t[(k + 1) % 3], t[(k + 2) % 3]);
    }
  }
  for (const auto& sides : far_sides) {
    if (sides.empty()) return "a vertex has no triangle";
    std::set<std::uint32_t> starts, ends;
    for (const auto& [start, end] : sides) {
      if (!starts.insert(start).second || !ends.insert(end).second)
        return "an edge has two triangles on one side";
    }
    if (starts != ends) return "an edge has a triangle on one side only";
    std::size_t steps = 0;
    std::uint32_t at = sides.front().first;
    do {
      at = std::ranges::find(sides, at, &Side::first)->second;
      ++steps;
    } while (at != sides.front().first);
    if (steps != sides.size()) return "the triangles round a vertex make more than one ring";
  }
  return {};
}

inline std::string manifold_fault(const Mesh& mesh) {
  const MergedMesh merged = merge_by_position(soup_of(mesh));
  if (merged.positions.size() != mesh.positions.size())
    return "vertices share a position, or have no triangle";
  return manifold_fault(merged);
}

inline std::string bytes_of_file(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error("cannot read a mesh file");
  return {std::istreambuf_iterator<char>(in), {}};
}

template <typename T>
T value_at(const std::string& bytes, std::size_t offset) {
  T value;
  if (offset + sizeof value > bytes.size()) throw std::runtime_error("the file ends too early");
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

/// What a mesh file holds, of what the format has.
struct ReadMesh {
  std::string header;
  std::vector<Float3> positions, normals;
  std::vector<Triangle> triangles;
};

inline TriangleSoup read_stl(const std::string& file) {
  const std::string bytes = bytes_of_file(file);
  const auto count = value_at<std::uint32_t>(bytes, 80);
  if (bytes.size() != 84 + std::size_t{50} * count) throw std::runtime_error("the size of an STL is wrong");
  TriangleSoup soup;
  for (std::size_t t = 0; t < count; ++t) {
    soup.triangles.push_back(value_at<std::array<Float3, 3>>(bytes, 84 + 50 * t + sizeof(Float3)));
  }
  return soup;
}

inline ReadMesh read_ply(const std::string& file) {
  const std::string bytes = bytes_of_file(file);
  const std::string last = "end_header\n";
  std::size_t at = bytes.find(last) + last.size();
  ReadMesh mesh{.header = bytes.substr(0, at), .positions = {}, .normals = {}, .triangles = {}};
  const auto count_of = [&mesh](const std::string& element) {
    return std::stoul(mesh.header.substr(mesh.header.find("element " + element) + 9 + element.size()));
  };
  for (std::size_t v = count_of("vertex"); v > 0; --v, at += 2 * sizeof(Float3)) {
    mesh.positions.push_back(value_at<Float3>(bytes, at));
    mesh.normals.push_back(value_at<Float3>(bytes, at + sizeof(Float3)));
  }
  for (std::size_t t = count_of("face"); t > 0; --t, at += 1 + sizeof(Triangle)) {
    if (bytes.at(at) != 3) throw std::runtime_error("a face of a PLY is no triangle");
    mesh.triangles.push_back(value_at<Triangle>(bytes, at + 1));
  }
  if (at != bytes.size()) throw std::runtime_error("the size of a PLY is wrong");
  return mesh;
}

inline ReadMesh read_obj(const std::string& file) {
  std::istringstream in(bytes_of_file(file));
  ReadMesh mesh;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string keyword;
    words >> keyword;
    if (keyword == "#") mesh.header += line + "\n";
    if (keyword == "v" || keyword == "vn") {
      Float3 vector;
      words >> vector[0] >> vector[1] >> vector[2];
      (keyword == "v" ? mesh.positions : mesh.normals).push_back(vector);
    }
    if (keyword == "f") {
      Triangle triangle;
      for (std::uint32_t& vertex : triangle) {
        std::uint32_t normal;
        char slash;
        words >> vertex >> slash >> slash >> normal;
        if (vertex != normal) throw std::runtime_error("a corner of an OBJ has another vertex' normal");
        --vertex;
      }
      mesh.triangles.push_back(triangle);
    }
    if (words.fail()) throw std::runtime_error("a line of an OBJ is wrong");
  }
  return mesh;
}

/// The two chunks of a GLB.
struct Glb {
  std::string json, binary;
};

inline Glb read_glb(const std::string& file) {
  const std::string bytes = bytes_of_file(file);
  if (bytes.substr(0, 4) != "glTF" || value_at<std::uint32_t>(bytes, 4) != 2 ||
      value_at<std::uint32_t>(bytes, 8) != bytes.size()) {
    throw std::runtime_error("the header of a GLB is wrong");
  }
  const std::size_t json_size = value_at<std::uint32_t>(bytes, 12);
  const std::size_t binary_size = value_at<std::uint32_t>(bytes, 20 + json_size);
  if (bytes.substr(16, 4) != "JSON" || bytes.substr(24 + json_size, 3) != "BIN" || json_size % 4 != 0 ||
      28 + json_size + binary_size != bytes.size()) {
    throw std::runtime_error("the chunks of a GLB are wrong");
  }
  return {bytes.substr(20, json_size), bytes.substr(28 + json_size)};
}

}  // namespace volsmooth::test
