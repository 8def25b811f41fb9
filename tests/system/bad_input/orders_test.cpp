#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <sstream>

#include "tests/system/bad_input/survivor.h"

namespace volsmooth::test {
namespace {

struct BadOrder {
  std::string name;
  std::string text;  ///< VOLUME stands for the id of a good one
  int status;
  std::string slug;
  std::string member = {};  ///< that the problem names
};

std::string nested_arrays(std::size_t depth) {
  return std::string(depth, '[') + std::string(depth, ']');
}

std::string million_keys() {
  std::ostringstream text;
  text << R"({"k":0)";
  for (int i = 0; i < 1'000'000; ++i) text << ",\"k" << i << "\":0";
  text << '}';
  return text.str();
}

std::string thousand_isovalues() {
  std::ostringstream text;
  text << R"({"volume":"VOLUME","isovalues":[0)";
  for (int i = 1; i < 1000; ++i) text << ',' << i / 4.0;
  text << "]}";
  return text.str();
}

std::string with_parameters(const std::string& parameters) {
  return R"({"volume":"VOLUME","parameters":{)" + parameters + "}}";
}

const std::vector<BadOrder> kBadOrders = {
    {"J1InvalidUtf8", "{\"volume\":\"VOLUME\",\"label\":\"\xff\xfe\"}", 400, "bad-json"},
    {"J1Bom", "\xef\xbb\xbf{\"volume\":\"VOLUME\"}", 400, "bad-json"},
    {"J1TrailingComma", R"({"volume":"VOLUME",})", 400, "bad-json"},
    {"J1TwoDocuments", R"({"volume":"VOLUME"}{"volume":"VOLUME"})", 400, "bad-json"},
    {"J1Empty", "", 400, "bad-json"},
    {"J2Deep", nested_arrays(100'000), 400, "bad-json"},
    {"J2DeepButSmall", R"({"volume":"VOLUME","isovalues":)" + nested_arrays(17) + "}", 400, "bad-json"},
    {"J2MillionKeys", million_keys(), 413, "content-too-large"},
    {"J2LongString", R"({"volume":"VOLUME","label":")" + std::string(2 << 20, 'x') + "\"}", 413,
     "content-too-large"},
    {"J3Duplicate", R"({"volume":"VOLUME","volume":"VOLUME"})", 400, "bad-json"},
    {"J3DuplicateBelow", with_parameters(R"("flow_time_mm2":1,"flow_time_mm2":2)"), 400, "bad-json"},
    {"J4Tenant", R"({"volume":"VOLUME","tenant":"x"})", 422, "unknown-field", "tenant"},
    {"J4State", R"({"volume":"VOLUME","state":"succeeded"})", 422, "unknown-field", "state"},
    {"J4IsAdmin", R"({"volume":"VOLUME","is_admin":true})", 422, "unknown-field", "is_admin"},
    {"J5NanLiteral", with_parameters(R"("flow_time_mm2":NaN)"), 400, "bad-json"},
    {"J5Text", with_parameters(R"("flow_time_mm2":"5")"), 422, "bad-parameter", "flow_time_mm2"},
    {"P1Negative", with_parameters(R"("flow_time_mm2":-1)"), 422, "bad-parameter", "flow_time_mm2"},
    {"P1NegativeRadius", with_parameters(R"("feature_radius_mm":-1)"), 422, "bad-parameter",
     "feature_radius_mm"},
    {"P1Tiny", with_parameters(R"("flow_time_mm2":1e-300)"), 422, "bad-parameter", "flow_time_mm2"},
    {"P1Huge", with_parameters(R"("flow_time_mm2":1e9)"), 422, "bad-parameter", "flow_time_mm2"},
    {"P1HugeRadius", with_parameters(R"("feature_radius_mm":1e9)"), 422, "bad-parameter",
     "feature_radius_mm"},
    {"P1Both", with_parameters(R"("flow_time_mm2":1,"feature_radius_mm":1)"), 422, "bad-parameter"},
    {"P1IsovalueOutside", R"({"volume":"VOLUME","isovalues":[1e9]})", 422, "bad-parameter", "isovalues"},
    {"P1IsovalueNegative", R"({"volume":"VOLUME","isovalues":[-1]})", 422, "bad-parameter", "isovalues"},
    {"P2MeshFormat", R"({"volume":"VOLUME","mesh_formats":["vrml"]})", 422, "bad-parameter", "mesh_formats"},
    {"P2MeshFrame", R"({"volume":"VOLUME","mesh_frame":"XYZ"})", 422, "bad-parameter", "mesh_frame"},
    {"P2ThousandIsovalues", thousand_isovalues(), 422, "bad-parameter", "isovalues"},
    {"P2VoxelType", R"({"volume":"VOLUME","voxel_type":"int4"})", 422, "bad-parameter", "voxel_type"},
    {"P2Outputs", R"({"volume":"VOLUME","outputs":["floppy"]})", 422, "bad-parameter", "outputs"},
    {"P3Steps", with_parameters(R"("steps":10)"), 422, "unknown-field", "steps"},
    {"P3Iterations", with_parameters(R"("iterations":10)"), 422, "unknown-field", "iterations"},
    {"P3OtherMethods", with_parameters(R"("distance_mm":1)"), 422, "unknown-field", "distance_mm"},
    {"P6Method", R"({"volume":"VOLUME","method":"median"})", 422, "unknown-algorithm"},
    {"P8Unknown", R"({"volume":"v-aaaaaaaaaaaaaaaa"})", 404, "not-found"},
    {"P8Sql", R"({"volume":"' OR 1=1 --"})", 400, "bad-id"},
    {"P8Path", R"({"volume":"../../etc/passwd"})", 400, "bad-id"},
};

HttpResponse submit(const std::string& text) {
  return survivor().service().call("POST", "/v1/jobs", text, {{"Content-Type", "application/json"}});
}

TEST(BadOrders, EveryOrderGetsItsAnswer) {
  for (const auto& [name, text, status, slug, member] : kBadOrders) {
    SCOPED_TRACE(name);
    static const std::regex volume("VOLUME");
    const std::string order = text.find("VOLUME") == std::string::npos
                                  ? text
                                  : std::regex_replace(text, volume, survivor().good_volume());
    const HttpResponse answer = submit(order);
    expect_problem(answer, status, slug);
    EXPECT_NE(answer.body.find(member), std::string::npos) << answer.body;
  }
}

/// Numbers that JSON allows but no quantity can be.
TEST(BadOrders, NumbersBeyondDoubleAreRefused) {
  for (const std::string& number : std::vector<std::string>{"1e400", "-1e400", std::string(400, '9')}) {
    const HttpResponse answer = submit("{\"volume\":\"" + survivor().good_volume() +
                                       "\",\"parameters\":{\"flow_time_mm2\":" + number + "}}");
    EXPECT_THAT(answer.status, testing::AnyOf(400, 422)) << answer.body;
    EXPECT_EQ(answer.header("content-type"), "application/problem+json");
  }
}

TEST(BadOrders, ADeletedVolumeCannotBeOrdered) {
  const ServiceClient service = survivor().service();
  const std::string id = service.upload(ball_file(8)).at("id");
  EXPECT_EQ(service.call("DELETE", "/v1/volumes/" + id).status, 204);
  EXPECT_THAT(submit("{\"volume\":\"" + id + "\"}").status, testing::AnyOf(404, 410));
}

TEST(BadOrders, ATooExpensiveJobIsRefusedWithItsEstimate) {
  // 10^4 mm^2 on voxels of a thousandth of a millimetre would take 10^10 steps.
  const Bytes fine = edited(ball_file(64), {put(nifti1::kXyztUnits, char{3})});
  const std::string id = survivor().service().upload(fine).at("id");
  const HttpResponse answer = submit("{\"volume\":\"" + id + "\",\"parameters\":{\"flow_time_mm2\":10000}}");
  expect_problem(answer, 422, "job-too-expensive");
  EXPECT_NE(answer.body.find("estimate"), std::string::npos);
  EXPECT_NE(answer.body.find("limit"), std::string::npos);
}

}  // namespace
}  // namespace volsmooth::test
