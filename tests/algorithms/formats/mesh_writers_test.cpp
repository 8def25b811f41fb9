#include "algorithms/formats/mesh_writers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <system_error>

#include "algorithms/formats/mesh_files.h"
#include "algorithms/surface/isosurface.h"
#include "algorithms/surface/measures.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/world_phantoms.h"

namespace volsmooth {
namespace {

using namespace test;
using nlohmann::json;
using testing::HasSubstr;

class MeshWriters : public testing::Test {
 protected:
  MeshWriters() { std::filesystem::create_directories(folder_); }
  ~MeshWriters() override { std::filesystem::remove_all(folder_); }

  std::string written(const std::string& format, std::span<const Mesh> meshes) const {
    const std::filesystem::path file = folder_ / ("mesh." + format);
    find_mesh_format(format)->write(file, meshes, no_progress);
    return file;
  }
  std::string written(const std::string& format, const Mesh& mesh) const {
    return written(format, {&mesh, 1});
  }

  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("mesh_writers." + std::to_string(::getpid()));
};

/// A ball cut by the border, in the frame asked for.
Mesh cut_ball(Frame frame = Frame::kRas, double isovalue = -5) {
  const Size3 size{14, 13, 12};
  const VoxelToWorld map = in_frame(centred_map(scaling(0.9, 1, 1.1), size), frame);
  const auto volume = sampled_in_world(size, map, [](const Vector3& x) {
    return -norm({x[0], x[1], x[2] + 5});
  });
  return extract_isosurface(*volume, map, isovalue);
}

TEST_F(MeshWriters, StlHoldsTheMesh) {
  const Mesh mesh = cut_ball();
  const std::string file = written("stl", mesh);
  EXPECT_EQ(read_stl(file).triangles, soup_of(mesh).triangles);
  EXPECT_EQ(manifold_fault(merge_by_position(read_stl(file))), "");
  EXPECT_EQ(bytes_of_file(file).rfind("volsmooth SPACE=RAS UNIT=mm ", 0), 0u);
}

TEST_F(MeshWriters, StlHasOutwardUnitNormals) {
  const Mesh mesh = cut_ball();
  const std::string bytes = bytes_of_file(written("stl", mesh));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto n = value_at<Float3>(bytes, 84 + 50 * t);
    const Float3& x = mesh.positions[mesh.triangles[t][0]];
    ASSERT_NEAR(norm({n[0], n[1], n[2]}), 1, 1e-6);
    ASSERT_GT(n[0] * x[0] + n[1] * x[1] + n[2] * (x[2] + 5), 0);
  }
}

TEST_F(MeshWriters, NoFileIsLongerThanItsFormatSaysAndNoneMuchShorter) {
  Mesh long_numbers = cut_ball(Frame::kLps, -16.0 / 3);  // every one of its numbers as long as any in text
  for (auto* vectors : {&long_numbers.positions, &long_numbers.normals})
    std::ranges::fill(*vectors, Float3{-1.01000015e-36F, -1.01000015e-36F, -1.01000015e-36F});
  const Size3 size{48, 47, 46};
  const VoxelToWorld map = centred_map(scaling(0.7, 0.8, 0.9), size);
  const auto ball = sampled_in_world(size, map, [](const Vector3& x) { return -norm(x); });
  const Mesh large = extract_isosurface(*ball, map, -15.25);
  for (const MeshFormat& format : mesh_formats()) {
    const auto most = [&](const Mesh& mesh) {
      return format.most_bytes(std::ssize(mesh.positions), std::ssize(mesh.triangles));
    };
    const auto bytes = [&](std::span<const Mesh> meshes) {
      return static_cast<std::int64_t>(std::filesystem::file_size(written(format.name, meshes)));
    };
    EXPECT_LE(bytes({&long_numbers, 1}), most(long_numbers)) << format.name;
    EXPECT_GT(bytes({&long_numbers, 1}), most(long_numbers) - 2048) << format.name;
    EXPECT_LE(bytes({&large, 1}), most(large)) << format.name;
    EXPECT_GT(bytes({&large, 1}), most(large) * 2 / 3) << format.name;
    const std::array three{long_numbers, large, large};
    if (format.many_surfaces) {
      EXPECT_LE(bytes(three), most(long_numbers) + 2 * most(large)) << format.name;
    }
  }
}

TEST(GlbSize, EndsWithItsThirtyTwoBits) {
  constexpr std::uint64_t kRoom =
      0xFFFF'FFFFU - 12 - 8 - 8;  // beside the heads of the file and of two chunks
  EXPECT_EQ(glb_size(1000, kRoom - 1000), 0xFFFF'FFFFU);
  try {
    glb_size(1000, kRoom - 999);
    FAIL() << "not refused";
  } catch (const MeshFileTooLarge& refused) {
    EXPECT_EQ(refused.needed_bytes, std::uint64_t{1} << 32);
    EXPECT_EQ(refused.limit, 0xFFFF'FFFFU);
  }
  EXPECT_EQ(glb_size(0, 0), 28U);
}

TEST_F(MeshWriters, PlyHoldsTheMesh) {
  const Mesh mesh = cut_ball(Frame::kLps);
  const ReadMesh read = read_ply(written("ply", mesh));
  EXPECT_EQ(read.positions, mesh.positions);
  EXPECT_EQ(read.normals, mesh.normals);
  EXPECT_EQ(read.triangles, mesh.triangles);
  EXPECT_THAT(read.header, HasSubstr("\ncomment SPACE=LPS\n"));
  EXPECT_THAT(read.header, HasSubstr("\ncomment unit mm\n"));
}

TEST_F(MeshWriters, ObjHoldsTheMeshBitForBit) {
  const Mesh mesh = cut_ball(Frame::kLps);
  const ReadMesh read = read_obj(written("obj", mesh));
  EXPECT_EQ(read.positions, mesh.positions);
  EXPECT_EQ(read.normals, mesh.normals);
  EXPECT_EQ(read.triangles, mesh.triangles);
  EXPECT_THAT(read.header, HasSubstr("# SPACE=LPS\n# unit mm\n"));
}

/// The elements of an accessor.
template <typename T>
std::vector<T> accessed(const Glb& glb, const json& document, std::size_t accessor) {
  const json& view =
      document["bufferViews"][document["accessors"][accessor]["bufferView"].get<std::size_t>()];
  std::vector<T> elements(view["byteLength"].get<std::size_t>() / sizeof(T));
  std::memcpy(elements.data(), glb.binary.data() + view["byteOffset"].get<std::size_t>(),
              elements.size() * sizeof(T));
  return elements;
}

TEST_F(MeshWriters, GlbHoldsAllMeshesWithANodeEach) {
  const std::vector<Mesh> meshes{cut_ball(Frame::kRas, -5), cut_ball(Frame::kRas, -2.5)};
  const Glb glb = read_glb(written("glb", meshes));
  const json document = json::parse(glb.json);
  EXPECT_EQ(document["buffers"][0]["byteLength"], glb.binary.size());
  for (std::size_t k = 0; k < meshes.size(); ++k) {
    const json& node = document["nodes"][document["nodes"][0]["children"][k].get<std::size_t>()];
    EXPECT_EQ(node["name"], k == 0 ? "iso-5" : "iso-2.5");
    EXPECT_EQ(node["extras"], (json{{"frame", "RAS"}, {"unit", "mm"}, {"isovalue", meshes[k].isovalue}}));
    const json& primitive = document["meshes"][node["mesh"].get<std::size_t>()]["primitives"][0];
    const auto positions = primitive["attributes"]["POSITION"].get<std::size_t>();
    EXPECT_EQ(accessed<Float3>(glb, document, positions), meshes[k].positions);
    EXPECT_EQ(accessed<Float3>(glb, document, primitive["attributes"]["NORMAL"]), meshes[k].normals);
    EXPECT_EQ(accessed<Triangle>(glb, document, primitive["indices"]), meshes[k].triangles);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto along = [axis](const Float3& x) { return x[axis]; };
      EXPECT_EQ(document["accessors"][positions]["min"][axis],
                std::ranges::min(meshes[k].positions, {}, along)[axis]);
      EXPECT_EQ(document["accessors"][positions]["max"][axis],
                std::ranges::max(meshes[k].positions, {}, along)[axis]);
    }
  }
}

/// In glTF a patient who faces the viewer (+Z) and stands upright (+Y) has the left hand at +X.
TEST_F(MeshWriters, GlbTurnsBothFramesToTheSameAxes) {
  struct Case {
    Frame frame;
    std::array<std::array<double, 4>, 3> left_front_up_mm;
  };
  for (const Case& one : {Case{Frame::kRas, {{{-1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}}},
                          Case{Frame::kLps, {{{1, 0, 0, 0}, {0, -1, 0, 0}, {0, 0, 1, 0}}}}}) {
    const Glb glb = read_glb(written("glb", cut_ball(one.frame)));
    const auto matrix = json::parse(glb.json)["nodes"][0]["matrix"].get<std::vector<double>>();
    const std::array<std::size_t, 3> gltf_axis{0, 2, 1};
    for (std::size_t direction = 0; direction < 3; ++direction) {
      for (std::size_t row = 0; row < 4; ++row) {
        double turned = 0;
        for (std::size_t col = 0; col < 4; ++col)
          turned += matrix[4 * col + row] * one.left_front_up_mm[direction][col];
        EXPECT_EQ(turned, row == gltf_axis[direction] ? 0.001 : 0);
      }
    }
  }
}

TEST_F(MeshWriters, WriteTheSameBytesEveryTime) {
  const Mesh mesh = cut_ball();
  for (const MeshFormat& format : mesh_formats()) {
    EXPECT_EQ(bytes_of_file(written(format.name, mesh)), bytes_of_file(written(format.name, mesh)))
        << format.name;
  }
}

TEST_F(MeshWriters, SayWhyAFileCannotBeWritten) {
  const Mesh mesh = cut_ball();
  for (const MeshFormat& format : mesh_formats()) {
    try {
      format.write(folder_ / "no" / "such" / "folder", {&mesh, 1}, no_progress);
      ADD_FAILURE() << format.name << " did not throw";
    } catch (const std::system_error& error) {
      EXPECT_EQ(error.code(), std::errc::no_such_file_or_directory) << format.name;
    }
    EXPECT_THROW(format.write("/dev/full", {&mesh, 1}, no_progress), std::system_error) << format.name;
  }
}

TEST(MeshFormats, AreFoundByName) {
  EXPECT_EQ(find_mesh_format("ply")->media_type, "model/ply");
  EXPECT_TRUE(find_mesh_format("glb")->many_surfaces);
  EXPECT_EQ(find_mesh_format("step"), nullptr);
}

TEST(IsovalueText, IsTheShortestThatReadsBack) {
  EXPECT_EQ(isovalue_text(300), "300");
  EXPECT_EQ(isovalue_text(-300), "-300");
  EXPECT_EQ(isovalue_text(0.5), "0.5");
  EXPECT_EQ(isovalue_text(0.1), "0.1");
  EXPECT_EQ(isovalue_text(-0.0), "0");
  EXPECT_EQ(isovalue_text(100000), "100000");
  EXPECT_EQ(isovalue_text(0.0001), "0.0001");
  EXPECT_EQ(isovalue_text(-1e-6), "-0.000001");
  EXPECT_EQ(isovalue_text(999999999999999), "999999999999999");
  EXPECT_EQ(isovalue_text(-1.2345678901234567e-6), "-0.0000012345678901234567");
  EXPECT_EQ(isovalue_text(1e15), "1e+15");
  EXPECT_EQ(isovalue_text(-2.5e-7), "-2.5e-07");
}

}  // namespace
}  // namespace volsmooth
