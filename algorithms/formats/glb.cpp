#include <algorithm>
#include <array>
#include <initializer_list>
#include <limits>
#include <string>

#include "algorithms/formats/buffered_file.h"
#include "algorithms/formats/mesh_files.h"
#include "algorithms/formats/mesh_writers.h"

namespace volsmooth {
namespace {

// Numbers of the glTF 2.0 specification (Khronos).
constexpr std::uint32_t kMagic = 0x46546C67, kVersion = 2, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr std::uint64_t kHeaderSize = 12, kChunkHeaderSize = 8;

/// Column by column. glTF: +Y up, +Z forward, so a patient who faces +Z has the left hand at +X.
constexpr std::string_view kRasToGltf = "-0.001,0,0,0, 0,0,0.001,0, 0,0.001,0,0, 0,0,0,1";
constexpr std::string_view kLpsToGltf = "0.001,0,0,0, 0,0,-0.001,0, 0,0.001,0,0, 0,0,0,1";

/// One colour per surface, linear RGB; the same hues as the contours of the picture.
constexpr std::array<std::string_view, 6> kColours{"0.87,0.27,0.05", "0.05,0.43,0.80", "0.16,0.62,0.13",
                                                   "0.85,0.65,0.05", "0.62,0.14,0.62", "0.05,0.62,0.60"};

std::string joined(std::initializer_list<std::string_view> parts) {
  std::string all;
  for (std::string_view part : parts) all += part;
  return all;
}

/// The JSON texts of elements 0..count-1 with commas between them.
template <typename Element>
std::string list_of(std::size_t count, const Element& element) {
  std::string list;
  for (std::size_t k = 0; k < count; ++k) {
    if (k > 0) list += ',';
    list += element(k);
  }
  return list;
}

std::string number(auto value) {
  return std::to_string(value);
}

std::string node_name(const Mesh& mesh) {
  return joined({R"("name":"iso)", isovalue_text(mesh.isovalue), "\""});
}

struct Bounds {
  Float3 low, high;
};

Bounds bounds_of(const Mesh& mesh) {
  Bounds bounds{mesh.positions.front(), mesh.positions.front()};
  for (const Float3& position : mesh.positions) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      bounds.low[axis] = std::min(bounds.low[axis], position[axis]);
      bounds.high[axis] = std::max(bounds.high[axis], position[axis]);
    }
  }
  return bounds;
}

std::string json_vector(const Float3& vector) {
  return joined(
      {"[", list_of(3, [&](std::size_t axis) { return isovalue_text(double{vector[axis]}); }), "]"});
}

/// Of each mesh the positions, normals and triangles follow each other in the buffer.
std::array<std::uint64_t, 3> part_sizes(const Mesh& mesh) {
  return {mesh.positions.size() * sizeof(Float3), mesh.normals.size() * sizeof(Float3),
          mesh.triangles.size() * sizeof(Triangle)};
}

std::uint64_t buffer_size(std::span<const Mesh> meshes) {
  std::uint64_t size = 0;
  for (const Mesh& mesh : meshes) {
    for (std::uint64_t part : part_sizes(mesh)) size += part;
  }
  return size;
}

std::string nodes_of(std::span<const Mesh> meshes) {
  const Frame frame = meshes.front().frame;
  const std::string extras = joined({R"("extras":{"frame":")", name_of(frame), R"(","unit":"mm")"});
  const std::string children = list_of(meshes.size(), [](std::size_t k) { return number(k + 1); });
  const std::string nodes = list_of(meshes.size(), [&](std::size_t k) {
    return joined({"{", node_name(meshes[k]), R"(,"mesh":)", number(k), ",", extras, R"(,"isovalue":)",
                   isovalue_text(meshes[k].isovalue), "}}"});
  });
  return joined({R"({"name":"volsmooth","matrix":[)", frame == Frame::kRas ? kRasToGltf : kLpsToGltf,
                 R"(],"children":[)", children, "],", extras, "}},", nodes});
}

std::string meshes_of(std::span<const Mesh> meshes) {
  return list_of(meshes.size(), [&](std::size_t k) {
    return joined({"{", node_name(meshes[k]), R"(,"primitives":[{"attributes":{"POSITION":)", number(3 * k),
                   R"(,"NORMAL":)", number(3 * k + 1), R"(},"indices":)", number(3 * k + 2),
                   R"(,"material":)", number(k), "}]}"});
  });
}

std::string materials_of(std::span<const Mesh> meshes) {
  return list_of(meshes.size(), [&](std::size_t k) {
    return joined({"{", node_name(meshes[k]), R"(,"pbrMetallicRoughness":{"baseColorFactor":[)",
                   kColours[k % kColours.size()], R"(,1],"metallicFactor":0,"roughnessFactor":0.6}})"});
  });
}

std::string accessors_of(std::span<const Mesh> meshes) {
  const auto accessor = [](std::size_t view, int type, std::size_t count, const std::string& rest) {
    return joined({R"({"bufferView":)", number(view), R"(,"componentType":)", number(type), R"(,"count":)",
                   number(count), rest, "}"});
  };
  return list_of(meshes.size(), [&](std::size_t k) {
    const Mesh& mesh = meshes[k];
    const Bounds bounds = bounds_of(mesh);
    const std::string range =
        joined({R"(,"min":)", json_vector(bounds.low), R"(,"max":)", json_vector(bounds.high)});
    const std::string vector = R"(,"type":"VEC3")";
    return joined({accessor(3 * k, kFloat, mesh.positions.size(), vector + range), ",",
                   accessor(3 * k + 1, kFloat, mesh.normals.size(), vector), ",",
                   accessor(3 * k + 2, kUnsignedInt, 3 * mesh.triangles.size(), R"(,"type":"SCALAR")")});
  });
}

std::string buffer_views_of(std::span<const Mesh> meshes) {
  std::uint64_t offset = 0;
  return list_of(3 * meshes.size(), [&](std::size_t k) {
    const std::uint64_t begin = offset, size = part_sizes(meshes[k / 3])[k % 3];
    offset += size;
    return joined({R"({"buffer":0,"byteOffset":)", number(begin), R"(,"byteLength":)", number(size),
                   R"(,"target":)", number(k % 3 == 2 ? kElementArrayBuffer : kArrayBuffer), "}"});
  });
}

std::string json_of(std::span<const Mesh> meshes) {
  std::string json = joined(
      {R"({"asset":{"version":"2.0","generator":"volsmooth"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)",
       nodes_of(meshes), R"(],"meshes":[)", meshes_of(meshes), R"(],"materials":[)", materials_of(meshes),
       R"(],"accessors":[)", accessors_of(meshes), R"(],"bufferViews":[)", buffer_views_of(meshes),
       R"(],"buffers":[{"byteLength":)", number(buffer_size(meshes)), "}]}"});
  json.resize((json.size() + 3) / 4 * 4, ' ');  // chunks begin at multiples of 4
  return json;
}

}  // namespace

std::uint32_t glb_size(std::uint64_t json_bytes, std::uint64_t array_bytes) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
  const std::uint64_t total = kHeaderSize + kChunkHeaderSize + json_bytes + kChunkHeaderSize + array_bytes;
  if (total > kMost) throw MeshFileTooLarge(total, kMost);
  return static_cast<std::uint32_t>(total);
}

void write_glb(const std::filesystem::path& file, std::span<const Mesh> meshes, const Progress& report) {
  const std::string json = json_of(meshes);
  const std::uint64_t binary = buffer_size(meshes);  // a multiple of 4
  const std::uint32_t total = glb_size(json.size(), binary);
  BufferedFile out(file);
  out.value(std::array{kMagic, kVersion, total});
  out.value(std::array{static_cast<std::uint32_t>(json.size()), kJsonChunk});
  out.text(json);
  out.value(std::array{static_cast<std::uint32_t>(binary), kBinaryChunk});
  const auto write = [&out](const auto& element) { out.value(element); };
  for (std::size_t k = 0; k < meshes.size(); ++k) {
    const auto part = [&](double done) {
      const auto count = static_cast<double>(meshes.size());
      return part_of(report, (static_cast<double>(k) + done) / count,
                     (static_cast<double>(k) + done + 1. / 3) / count);
    };
    for_each_reported(meshes[k].positions, write, part(0));
    for_each_reported(meshes[k].normals, write, part(1. / 3));
    for_each_reported(meshes[k].triangles, write, part(2. / 3));
  }
  out.close();
}

std::int64_t most_bytes_of_glb(std::int64_t vertices, std::int64_t triangles) {
  constexpr std::int64_t kMostOfJson = 2048, kVertex = 2 * sizeof(Float3);
  return kMostOfJson + kVertex * vertices + static_cast<std::int64_t>(sizeof(Triangle)) * triangles;
}

}  // namespace volsmooth
