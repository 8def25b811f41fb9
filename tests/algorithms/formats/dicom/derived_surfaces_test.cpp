#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>

#include "algorithms/formats/dicom/encapsulated_mesh.h"
#include "algorithms/formats/dicom/surface_segmentation.h"
#include "tests/support/dicom_results.h"

namespace volsmooth {
namespace {

using test::SeriesInMemory;
using testing::IsEmpty;

SeriesInMemory source() {
  return test::read_into_memory(test::multipart_of(test::files_of(test::series_of({}))));
}

std::string text(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string value(const gdcm::DataSet& set, std::uint16_t group, std::uint16_t element) {
  const gdcm::ByteValue* bytes = set.GetDataElement(gdcm::Tag(group, element)).GetByteValue();
  return bytes == nullptr ? "" : std::string(bytes->GetPointer(), bytes->GetLength());
}

template <class T>
std::vector<T> numbers(const gdcm::DataSet& set, std::uint16_t group, std::uint16_t element) {
  const std::string bytes = value(set, group, element);
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

constexpr std::array<float, 12> kPositions{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1.5F};
constexpr std::array<float, 12> kNormals{0, 0, -1, 1, 0, 0, 0, 1, 0, 0, 0, 1};
constexpr std::array<std::uint32_t, 12> kTriangles{0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
const SegmentSurface kSurface{"isosurface 300", kPositions, kNormals, kTriangles};

/// What every object has in common with the series that it was made of.
void expect_in_the_study(const gdcm::DataSet& set, const SeriesInMemory& from, const std::string& modality) {
  EXPECT_EQ(text_of(set, 0x0020000d), from.series.study_uid);
  EXPECT_EQ(text_of(set, 0x00200052), from.series.frame_of_reference_uid);
  EXPECT_EQ(text_of(set, 0x00100020), "PLANTED-ID");
  EXPECT_EQ(text_of(set, 0x00080060), modality);
  EXPECT_NE(text_of(set, 0x0020000e), from.series.series_uid);
  const auto referenced = items_of(set, 0x00081115).at(0);
  EXPECT_EQ(text_of(referenced, 0x0020000e), from.series.series_uid);
  EXPECT_EQ(items_of(referenced, 0x0008114a).size(), from.series.slices.size());
}

class EncapsulatedMesh : public testing::TestWithParam<MeshEncoding> {};

/// PS3.3, tables C.24-2 and C.35.1-1, attribute by attribute.
TEST_P(EncapsulatedMesh, HoldsTheFileAndWhatTheStandardRequires) {
  const bool is_stl = GetParam() == MeshEncoding::kStl;
  const SeriesInMemory from = source();
  const std::string file = "an odd number of bytes.";
  const auto object = encapsulated_mesh(from.series, GetParam(), test::as_upload(file), "isosurface 300",
                                        test::some_derivation());
  ASSERT_TRUE(object);
  const auto set = public_attributes(*object);
  expect_in_the_study(set, from, "M3D");
  EXPECT_EQ(text_of(set, 0x00080016),
            is_stl ? "1.2.840.10008.5.1.4.1.1.104.3" : "1.2.840.10008.5.1.4.1.1.104.4");
  EXPECT_EQ(text_of(set, 0x00420012), is_stl ? "model/stl" : "model/obj");
  EXPECT_EQ(value(set, 0x0042, 0x0011).substr(0, file.size()), file);
  EXPECT_EQ(value(set, 0x0042, 0x0011).substr(file.size()), is_stl ? std::string(1, '\0') : "\n");
  EXPECT_THAT(numbers<std::uint32_t>(set, 0x0042, 0x0015), testing::ElementsAre(file.size()));
  EXPECT_EQ(text_of(set, 0x00420010), "isosurface 300");
  EXPECT_EQ(text_of(set, 0x00280301), "NO");
  EXPECT_TRUE(has(set, 0x0008002a));
  EXPECT_EQ(text_of(set, 0x00200013), "1");
  EXPECT_EQ(text_of(items_of(set, 0x0040a043).at(0), 0x00080100), "85040-4");
  EXPECT_EQ(items_of(set, 0x00420013).size(), from.series.slices.size());
  const auto unit = items_of(set, 0x004008ea).at(0);
  EXPECT_EQ(text_of(unit, 0x00080100), "mm");
  EXPECT_EQ(text_of(unit, 0x00080102), "UCUM");
  EXPECT_EQ(text_of(set, 0x00687002), "NO");
  for (const std::uint32_t equipment : {0x00080070U, 0x00081090U, 0x00181000U, 0x00181020U})
    EXPECT_FALSE(text_of(set, equipment).empty()) << std::hex << equipment;
}

INSTANTIATE_TEST_SUITE_P(Both, EncapsulatedMesh, testing::Values(MeshEncoding::kStl, MeshEncoding::kObj));

TEST(EncapsulatedStl, HasNoErrorThatOtherReadersKnow) {
  const auto object = encapsulated_mesh(source().series, MeshEncoding::kStl, test::as_upload("stl"), "title",
                                        test::some_derivation());
  EXPECT_THAT(test::errors_of_other_readers(text(*object)), IsEmpty());
}

TEST(SurfaceSegmentation, HasASegmentAndASurfaceForEachIsovalue) {
  const SeriesInMemory from = source();
  const std::array surfaces{kSurface, kSurface};
  const auto object = surface_segmentation(from.series, surfaces, test::some_derivation());
  ASSERT_TRUE(object);
  const auto set = public_attributes(*object);
  expect_in_the_study(set, from, "SEG");
  EXPECT_EQ(text_of(set, 0x00080016), "1.2.840.10008.5.1.4.1.1.66.5");
  EXPECT_THAT(numbers<std::uint32_t>(set, 0x0066, 0x0001), testing::ElementsAre(2));
  const auto segments = items_of(set, 0x00620002), meshes = items_of(set, 0x00660002);
  ASSERT_EQ(segments.size(), 2u);
  ASSERT_EQ(meshes.size(), 2u);
  for (std::uint32_t i = 0; i < 2; ++i) {
    EXPECT_EQ(text_of(segments[i], 0x00620005), "isosurface 300");
    EXPECT_THAT(numbers<std::uint16_t>(segments[i], 0x0062, 0x0004), testing::ElementsAre(i + 1));
    const auto reference = items_of(segments[i], 0x0066002b).at(0);
    EXPECT_THAT(numbers<std::uint32_t>(reference, 0x0066, 0x002c), testing::ElementsAre(i + 1));
    EXPECT_THAT(numbers<std::uint32_t>(meshes[i], 0x0066, 0x0003), testing::ElementsAre(i + 1));
    const auto points = items_of(meshes[i], 0x00660011).at(0);
    EXPECT_THAT(numbers<std::uint32_t>(points, 0x0066, 0x0015), testing::ElementsAre(4));
    EXPECT_THAT(numbers<float>(points, 0x0066, 0x0016), testing::ElementsAreArray(kPositions));
    EXPECT_THAT(numbers<float>(items_of(meshes[i], 0x00660012).at(0), 0x0066, 0x0021),
                testing::ElementsAreArray(kNormals));
    EXPECT_THAT(numbers<std::uint32_t>(items_of(meshes[i], 0x00660013).at(0), 0x0066, 0x0041),
                testing::ElementsAre(1, 3, 2, 1, 2, 4, 2, 3, 4, 1, 4, 3));
  }
}

TEST(SurfaceSegmentation, HasNoErrorThatOtherReadersKnow) {
  const auto object = surface_segmentation(source().series, std::span(&kSurface, 1), test::some_derivation());
  EXPECT_THAT(test::errors_of_other_readers(text(*object)), IsEmpty());
}

}  // namespace
}  // namespace volsmooth
