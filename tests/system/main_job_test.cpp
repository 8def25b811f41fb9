#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/system/client_run.h"
#include "tests/system/nifti_bytes.h"
#include "tests/system/surface_file.h"

namespace volsmooth::test {
namespace {

using nlohmann::json;

const std::filesystem::path kHead = "/usr/share/mricron/templates/ch2.nii.gz";
const std::vector<std::string> kMethods = {"original", "mean-curvature-flow", "laplacian"};
const std::vector<std::string> kSmoothed = {"mean-curvature-flow", "laplacian"};
const std::vector<std::string> kIsovalues = {"40", "90"};

/// The job that the project exists for, once for all tests: a real MRI head, no server running.
class MainJob : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!std::filesystem::exists(kHead)) return;
    directory_.emplace();
    printed_ = smooth("same", "stl,glb");
    smooth("float32", "stl");
  }

  /// Runs the job into a directory called as the voxel type; returns what the client printed.
  static std::vector<std::string> smooth(const std::string& voxel_type, const std::string& meshes) {
    ClientRun client({"smooth", kHead, "-o", *directory_ / voxel_type, "--method", "compare",
                      "--feature-radius", "2mm", "--isovalue", "40,90", "--mesh", meshes, "--voxel-type",
                      voxel_type});
    EXPECT_EQ(client.exit_code(), 0) << client.error();
    return client.output_lines();
  }
  static void TearDownTestSuite() { directory_.reset(); }

  void SetUp() override {
    if (!std::filesystem::exists(kHead)) GTEST_SKIP() << kHead << " is missing (package mricron-data)";
  }

  static std::filesystem::path path(const std::string& voxel_type, const std::string& name) {
    return *directory_ / voxel_type / ("ch2_" + name);
  }
  /// Read once: these files hold a million triangles each.
  static const MergedMesh& surface(const std::string& voxel_type, const std::string& method,
                                   const std::string& isovalue) {
    const std::string stl = path(voxel_type, method + "_iso" + isovalue + ".stl");
    const auto known = surfaces_.find(stl);
    return known != surfaces_.end() ? known->second
                                    : surfaces_.emplace(stl, merge_by_position(read_stl(stl))).first->second;
  }

  inline static std::map<std::string, MergedMesh> surfaces_;
  inline static std::optional<TemporaryDirectory> directory_;
  inline static std::vector<std::string> printed_;
};

TEST_F(MainJob, LeavesEveryFileAndPrintsItsPath) {
  std::vector<std::string> names{"ch2_report.json"};
  for (const std::string& method : kMethods) {
    names.push_back("ch2_" + method + ".glb");
    for (const std::string& isovalue : kIsovalues)
      names.push_back("ch2_" + method + "_iso" + isovalue + ".stl");
  }
  for (const std::string& method : kSmoothed)
    for (const char* extension : {".nii.gz", ".png"}) names.push_back("ch2_" + method + extension);
  EXPECT_THAT(names_in(*directory_ / "same"), testing::UnorderedElementsAreArray(names));

  std::vector<std::string> paths;
  for (const std::string& name : names) paths.push_back((*directory_ / "same" / name).string());
  EXPECT_THAT(printed_, testing::UnorderedElementsAreArray(paths));
  for (const std::string& method : kSmoothed)
    EXPECT_TRUE(content_of(path("same", method + ".png")).starts_with("\x89PNG\r\n"));
}

/// The head is cut by the border of the volume, and thousands of its voxels equal 40 exactly.
TEST_F(MainJob, EverySurfaceIsAClosedOrientedManifold) {
  for (const std::string& method : kMethods) {
    for (const std::string& isovalue : kIsovalues) {
      SCOPED_TRACE(method + " " + isovalue);
      const MergedMesh& mesh = surface("same", method, isovalue);
      EXPECT_GT(mesh.triangles.size(), 100'000U);
      EXPECT_EQ(manifold_fault(mesh), "");
      EXPECT_GT(volume_mm3(mesh), 1e6) << "a head has more than a litre, and a positive one";
    }
  }
}

TEST_F(MainJob, GlbHoldsTheSurfacesOfTheStlFiles) {
  for (const std::string& method : kMethods) {
    const GlbContent glb = glb_content(path("same", method + ".glb"));
    ASSERT_EQ(glb.meshes.size(), kIsovalues.size());
    for (std::size_t i = 0; i < kIsovalues.size(); ++i) {
      const TriangleSoup stl = read_stl(path("same", method + "_iso" + kIsovalues[i] + ".stl"));
      EXPECT_TRUE(glb.meshes[i].triangles == stl.triangles) << method << " " << kIsovalues[i];
    }
  }
}

TEST_F(MainJob, GlbNamesItsSurfacesAndItsFrame) {
  const json document = glb_content(path("same", "mean-curvature-flow.glb")).document;
  const json& root = document["nodes"][document["scenes"][0]["nodes"][0].get<std::size_t>()];
  EXPECT_THAT(document.dump(), testing::HasSubstr("RAS"));
  std::vector<std::string> names;
  for (const json& child : root.at("children"))
    names.push_back(document["nodes"][child.get<std::size_t>()]["name"]);
  ASSERT_EQ(names.size(), kIsovalues.size());
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_THAT(names[i], testing::HasSubstr(kIsovalues[i]));
}

/// Trilinear interpolation of a written float32 volume in its own world.
class WrittenVolume {
 public:
  explicit WrittenVolume(const Bytes& compressed) : file_(gunzip(compressed)) {
    using namespace nifti1;
    if (read_at<std::int16_t>(file_, kDatatype) != kDatatypeCode<float>)
      throw std::runtime_error("not float32");
    double rows[3][3];
    for (std::size_t row = 0; row < 3; ++row) {
      size_[row] = read_at<std::int16_t>(file_, kDim + 2 + 2 * row);
      for (std::size_t column = 0; column < 3; ++column)
        rows[row][column] = static_cast<double>(read_at<float>(file_, kSrow + 16 * row + 4 * column));
      origin_[row] = static_cast<double>(read_at<float>(file_, kSrow + 16 * row + 12));
    }
    invert(rows);
    const std::size_t count = (file_.size() - kData) / sizeof(float);
    voxels_.resize(count);
    std::memcpy(voxels_.data(), file_.data() + kData, count * sizeof(float));
  }

  double range() const {
    const auto [low, high] = std::minmax_element(voxels_.begin(), voxels_.end());
    return static_cast<double>(*high - *low);
  }

  /// The place of a world position in voxels.
  std::array<double, 3> index_of(const std::array<double, 3>& world) const {
    std::array<double, 3> index{};
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 3; ++column)
        index[row] += inverse_[row][column] * (world[column] - origin_[column]);
    return index;
  }

  /// In the plane of the outermost voxel centres, where a cap may lie; positions in float are this exact.
  bool on_border(const std::array<double, 3>& index) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (std::min(index[axis], static_cast<double>(size_[axis] - 1) - index[axis]) < 1e-4) return true;
    return false;
  }

  double value(const std::array<double, 3>& index) const {
    std::array<int, 3> lower{};
    std::array<double, 3> part{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      lower[axis] = std::clamp(static_cast<int>(index[axis]), 0, size_[axis] - 2);
      part[axis] = index[axis] - lower[axis];
    }
    double sum = 0;
    for (unsigned corner = 0; corner < 8; ++corner) {
      double weight = 1;
      std::size_t voxel = 0;
      for (std::size_t axis = 3; axis-- > 0;) {
        const int upper = static_cast<int>(corner >> axis & 1U);
        weight *= upper != 0 ? part[axis] : 1 - part[axis];
        voxel = voxel * static_cast<std::size_t>(size_[axis]) + static_cast<std::size_t>(lower[axis] + upper);
      }
      sum += weight * static_cast<double>(voxels_[voxel]);
    }
    return sum;
  }

 private:
  void invert(const double (&m)[3][3]) {
    const double determinant = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                               m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                               m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        const std::size_t a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
        inverse_[i][j] = (m[a][c] * m[b][d] - m[a][d] * m[b][c]) / determinant;
      }
  }

  Bytes file_;
  std::array<int, 3> size_{};
  std::array<double, 3> origin_{};
  double inverse_[3][3]{};
  std::vector<float> voxels_;
};

TEST_F(MainJob, EveryVertexLiesOnItsIsovalueOfTheWrittenVolume) {
  for (const std::string& method : kSmoothed) {
    const WrittenVolume volume(content_of(path("float32", method + ".nii.gz")));
    for (const std::string& isovalue : kIsovalues) {
      SCOPED_TRACE(method + " " + isovalue);
      const MergedMesh& mesh = surface("float32", method, isovalue);
      double largest = 0;
      std::size_t checked = 0;
      for (std::uint32_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
        const auto index = volume.index_of(position_of(mesh, vertex));
        if (volume.on_border(index)) continue;
        ++checked;
        largest = std::max(largest, std::abs(volume.value(index) - std::stod(isovalue)));
      }
      EXPECT_LE(largest / volume.range(), 1e-3);
      EXPECT_GT(checked, mesh.positions.size() / 2);
    }
  }
}

/// `report` says what a reader of the files finds. Positions are float: areas and volumes agree to 1e-4.
TEST_F(MainJob, TheReportDescribesTheSurfaces) {
  const json report = json::parse(content_of(path("same", "report.json")));
  EXPECT_EQ(report.at("method"), "compare");
  EXPECT_EQ(report.at("input").at("format"), "nifti-1");
  EXPECT_EQ(report.at("input").at("size"), json({181, 217, 181}));
  EXPECT_DOUBLE_EQ(report.at("parameters").at("flow_time_mm2"), 1) << "2 mm: r^2 / 4";
  for (const char* member : {"version", "warnings", "timing", "threads", "peak_memory_bytes"})
    EXPECT_TRUE(report.contains(member)) << member;

  ASSERT_EQ(report.at("surfaces").size(), kSmoothed.size() * kIsovalues.size());
  for (const json& row : report.at("surfaces")) {
    SCOPED_TRACE(row.dump());
    const std::string isovalue = std::to_string(row.at("isovalue").get<int>());
    const MergedMesh& before = surface("same", "original", isovalue);
    const MergedMesh& after = surface("same", row.at("method"), isovalue);
    EXPECT_EQ(row.at("triangles"), after.triangles.size());
    EXPECT_EQ(row.at("closed"), true);
    const auto agree = [&](const char* member, double first, double second) {
      EXPECT_NEAR(row.at(member).at("before").get<double>(), first, 1e-4 * std::abs(first)) << member;
      EXPECT_NEAR(row.at(member).at("after").get<double>(), second, 1e-4 * std::abs(second)) << member;
    };
    agree("area_mm2", area_mm2(before), area_mm2(after));
    agree("volume_mm3", volume_mm3(before), volume_mm3(after));
    EXPECT_EQ(row.at("euler_characteristic").at("before"), euler_characteristic(before));
    EXPECT_EQ(row.at("euler_characteristic").at("after"), euler_characteristic(after));
    EXPECT_LT(row.at("area_mm2").at("after"), row.at("area_mm2").at("before"))
        << "smoothing makes surfaces smaller";
    EXPECT_LT(row.at("components").at("after"), row.at("components").at("before"));
    EXPECT_GT(row.at("cap_area_mm2"), 0) << "the neck is cut";
    EXPECT_LE(row.at("displacement_mm").at("min"), row.at("displacement_mm").at("mean"));
    EXPECT_LE(row.at("displacement_mm").at("mean"), row.at("displacement_mm").at("max"));
    EXPECT_TRUE(row.at("curvature_per_mm").at("mean").contains("after"));
    EXPECT_LT(row.at("curvature_per_mm").at("rms").at("after"),
              row.at("curvature_per_mm").at("rms").at("before"));
  }

  ASSERT_EQ(report.at("foliation").size(), kSmoothed.size());
  for (const json& row : report.at("foliation")) {
    SCOPED_TRACE(row.dump());
    EXPECT_LT(row.at("area").at("after"), row.at("area").at("before"));
    EXPECT_GE(row.at("intensity_min").at("after"), row.at("intensity_min").at("before")) << "no new extremes";
    EXPECT_LE(row.at("intensity_max").at("after"), row.at("intensity_max").at("before"));
    EXPECT_EQ(row.at("clipped_voxels"), 0);
    EXPECT_NEAR(row.at("rounding_rms").get<double>(), 0.29, 0.15) << "whole numbers: 1/sqrt(12), less in air";
    if (row.at("method") == "laplacian") {
      const double mass = row.at("mass").at("before");
      EXPECT_NEAR(row.at("mass").at("after").get<double>(), mass, 1e-6 * mass)
          << "the heat equation keeps it";
    }
  }
}

/// Smoothing twice into one directory overwrites nothing unless told so.
TEST_F(MainJob, OverwritesNothing) {
  ClientRun again(
      {"smooth", kHead, "-o", *directory_ / "same", "--method", "compare", "--isovalue", "40,90"});
  EXPECT_EQ(again.exit_code(), 73) << again.error();
}

}  // namespace
}  // namespace volsmooth::test
