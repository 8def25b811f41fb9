#include <gtest/gtest.h>

#include <string>

#include "service/jobs/job_json.h"
#include "service/jobs/strict_json.h"
#include "tests/service/jobs/service_fixture.h"

namespace volsmooth {
namespace {

/// What a body comes to, from its bytes to checked parameters.
tl::expected<void, Problem> outcome_of(const std::string& text) {
  const auto document = parse_json(text);
  if (!document) return tl::unexpected(document.error());
  const auto order = order_from(*document);
  if (!order) return tl::unexpected(order.error());
  return check_parameters(order->parameters, blur_method());
}

std::string with(const std::string& members) {
  return R"({"volume": "v-1", )" + members + "}";
}
std::string parameters(const std::string& members) {
  return with(R"("parameters": {)" + members + "}");
}

std::string isovalues(int count) {
  std::string list;
  for (int i = 0; i < count; ++i) list += (i ? "," : "") + std::to_string(i);
  return with("\"isovalues\": [" + list + "]");
}

std::string label(const std::string& text) {
  return with("\"label\": \"" + text + "\"");
}

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

struct OrderRow {
  std::string name;
  std::string text;
  std::string slug;
  std::string member;  ///< that the problem must name
};

const OrderRow kRefused[] = {
    {"not_an_object", "[]", "bad-json", ""},
    {"no_volume", "{}", "bad-parameter", "volume"},
    {"volume_number", R"({"volume": 5})", "bad-parameter", "volume"},
    {"volume_path", R"({"volume": "../../etc/passwd"})", "bad-id", "volume"},
    {"volume_sql", R"({"volume": "' OR 1=1 --"})", "bad-id", "volume"},
    {"volume_empty", R"({"volume": ""})", "bad-id", "volume"},
    {"tenant", with(R"("tenant": "x")"), "unknown-field", "tenant"},
    {"state", with(R"("state": "succeeded")"), "unknown-field", "state"},
    {"is_admin", with(R"("is_admin": true)"), "unknown-field", "is_admin"},
    {"steps", with(R"("steps": 5)"), "unknown-field", "steps"},
    {"iterations", parameters(R"("iterations": 5)"), "unknown-field", "iterations"},
    {"step_size", parameters(R"("step_mm2": 0.1)"), "unknown-field", "step_mm2"},
    {"other_method", parameters(R"("distance_mm": 1)"), "unknown-field", "distance_mm"},
    {"strange_name", with(R"("<script>": 1)"), "unknown-field", ""},
    {"strange_parameter", parameters(R"("a\u0000b": 1)"), "unknown-field", ""},
    {"method_number", with(R"("method": 5)"), "bad-parameter", "method"},
    {"parameters_list", with(R"("parameters": [1])"), "bad-parameter", "parameters"},
    {"parameter_null", parameters(R"("flow_time_mm2": null)"), "bad-parameter", "flow_time_mm2"},
    {"parameter_true", parameters(R"("flow_time_mm2": true)"), "bad-parameter", "flow_time_mm2"},
    {"number_as_text", parameters(R"("flow_time_mm2": "5")"), "bad-parameter", "flow_time_mm2"},
    {"radius_negative", parameters(R"("feature_radius_mm": -2)"), "bad-parameter", "feature_radius_mm"},
    {"radius_zero", parameters(R"("feature_radius_mm": -0)"), "bad-parameter", "feature_radius_mm"},
    {"radius_tiny", parameters(R"("feature_radius_mm": 1e-300)"), "bad-parameter", "feature_radius_mm"},
    {"radius_huge", parameters(R"("feature_radius_mm": 1e9)"), "bad-parameter", "feature_radius_mm"},
    {"time_endless", parameters(R"("flow_time_mm2": 1e400)"), "bad-json", ""},
    {"time_nan", parameters(R"("flow_time_mm2": NaN)"), "bad-json", ""},
    {"both_strengths", parameters(R"("flow_time_mm2": 1, "feature_radius_mm": 2)"), "bad-parameter",
     "feature_radius_mm"},
    {"choice", parameters(R"("edge": "round")"), "bad-parameter", "edge"},
    {"choice_number", parameters(R"("edge": 1)"), "bad-parameter", "edge"},
    {"isovalues_text", with(R"("isovalues": "all")"), "bad-parameter", "isovalues"},
    {"isovalues_null", with(R"("isovalues": null)"), "bad-parameter", "isovalues"},
    {"isovalues_number", with(R"("isovalues": 5)"), "bad-parameter", "isovalues"},
    {"isovalues_of_text", with(R"("isovalues": ["5"])"), "bad-parameter", "isovalues"},
    {"isovalues_twice", with(R"("isovalues": [5, 6, 5.0])"), "bad-parameter", "isovalues"},
    {"isovalues_33", isovalues(33), "bad-parameter", "isovalues"},
    {"isovalues_1000", isovalues(1000), "bad-parameter", "isovalues"},
    {"mesh_formats_text", with(R"("mesh_formats": "stl")"), "bad-parameter", "mesh_formats"},
    {"mesh_formats_number", with(R"("mesh_formats": [1])"), "bad-parameter", "mesh_formats"},
    {"mesh_formats_twice", with(R"("mesh_formats": ["stl", "stl"])"), "bad-parameter", "mesh_formats"},
    {"mesh_frame", with(R"("mesh_frame": "RAI")"), "bad-parameter", "mesh_frame"},
    {"mesh_frame_case", with(R"("mesh_frame": "ras")"), "bad-parameter", "mesh_frame"},
    {"voxel_type", with(R"("voxel_type": "float64")"), "bad-parameter", "voxel_type"},
    {"output_unknown", with(R"("outputs": ["exe"])"), "bad-parameter", "outputs"},
    {"output_twice", with(R"("outputs": ["nifti", "nifti"])"), "bad-parameter", "outputs"},
    {"source_text", R"({"source": "pacs"})", "bad-parameter", "source"},
    {"source_short", R"({"source": {"dicomweb": "pacs", "study": "1.2"}})", "bad-parameter", "source"},
    {"source_uid", R"({"source": {"dicomweb": "pacs", "study": "1.2", "series": "../x"}})", "bad-parameter",
     "source"},
    {"source_more", R"({"source": {"dicomweb": "p", "study": "1", "series": "2", "frame": 1}})",
     "bad-parameter", "source"},
    {"destination_url", with(R"("destination": "http://x")"), "bad-parameter", "destination"},
    {"priority_high", with(R"("priority": 1000000000)"), "bad-parameter", "priority"},
    {"priority_low", with(R"("priority": -61)"), "bad-parameter", "priority"},
    {"priority_half", with(R"("priority": 0.5)"), "bad-parameter", "priority"},
    {"keep_days_negative", with(R"("keep_days": -1)"), "bad-parameter", "keep_days"},
    {"keep_days_million", with(R"("keep_days": 1000000)"), "bad-parameter", "keep_days"},
    {"keep_days_huge", with(R"("keep_days": 18446744073709551615)"), "bad-parameter", "keep_days"},
    {"keep_days_half", with(R"("keep_days": 1.5)"), "bad-parameter", "keep_days"},
    {"keep_days_text", with(R"("keep_days": "7")"), "bad-parameter", "keep_days"},
    {"label_number", with(R"("label": 5)"), "bad-parameter", "label"},
    {"label_201", label(std::string(201, 'a')), "bad-parameter", "label"},
    {"label_newline", label("a\\nb"), "bad-parameter", "label"},
    {"label_nul", label("a\\u0000b"), "bad-parameter", "label"},
    {"label_delete", label("\x7F"), "bad-parameter", "label"},
    {"label_c1", label("\\u0085"), "bad-parameter", "label"}};

class RefusedOrder : public testing::TestWithParam<OrderRow> {};

TEST_P(RefusedOrder, SaysWhichMemberIsWrong) {
  const auto outcome = outcome_of(GetParam().text);
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().slug, GetParam().slug);
  EXPECT_EQ(outcome.error().members.value("member", ""), GetParam().member);
  EXPECT_NE(outcome.error().detail.find(GetParam().member), std::string::npos);
  for (const char* echoed : {"script", "passwd", "OR 1=1"})
    EXPECT_EQ(outcome.error().detail.find(echoed), std::string::npos);
}

std::string named_row(const testing::TestParamInfo<OrderRow>& row) {
  return row.param.name;
}

INSTANTIATE_TEST_SUITE_P(Table, RefusedOrder, testing::ValuesIn(kRefused), named_row);

TEST(RefusedOrder, LacksAParameterThatAnotherNeedsOrThatMustBeGiven) {
  const MethodInfo method{
      .name = "offset",
      .description = "",
      .parameters = {
          {.name = "distance_mm",
           .description = "",
           .unit = "mm",
           .minimum = -5,
           .maximum = 5,
           .required = true},
          {.name = "surface", .description = "", .unit = "intensity", .minimum = -1e9, .maximum = 1e9},
          {.name = "half_width",
           .description = "",
           .unit = "",
           .minimum = 0,
           .maximum = 9,
           .needs = "surface"}}};
  const auto missing_in = [&](const ParameterValues& parameters) -> std::string {
    const auto checked = check_parameters(parameters, method);
    return checked ? "" : checked.error().members.at("member");
  };
  EXPECT_EQ(missing_in({{"surface", 1.0}}), "distance_mm");
  EXPECT_EQ(missing_in({{"distance_mm", 1.0}, {"half_width", 1.0}}), "half_width");
  EXPECT_EQ(missing_in({{"distance_mm", 1.0}, {"half_width", 1.0}, {"surface", 1.0}}), "");
}

TEST(RefusedOrder, NamesUnitAndLimits) {
  const Problem problem = outcome_of(parameters(R"("feature_radius_mm": 201)")).error();
  EXPECT_EQ(problem.members,
            nlohmann::json(
                {{"member", "feature_radius_mm"}, {"minimum", 0.01}, {"maximum", 200.0}, {"unit", "mm"}}));
  for (const char* said : {"mm", "0.01", "200"})
    EXPECT_NE(problem.detail.find(said), std::string::npos) << said;
}

const std::string kTaken[] = {R"({"volume": "v-1"})",
                              with(R"("isovalues": "auto")"),
                              with(R"("isovalues": [])"),
                              with(R"("isovalues": [300, -300, 0.5, -0])"),
                              isovalues(32),
                              parameters(R"("feature_radius_mm": 200, "edge": "soft")"),
                              parameters(R"("flow_time_mm2": 10000)"),
                              with(R"("mesh_formats": ["stl", "glb"], "mesh_frame": "LPS")"),
                              with(R"("voxel_type": "float32", "outputs": ["nifti"])"),
                              with(R"("outputs": ["nifti", "dicom-series"], "destination": "pacs_2")"),
                              R"({"source": {"dicomweb": "pacs", "study": "1.2", "series": "1.2.3"}})",
                              label(repeated("\xC3\xA9", 200)),
                              label("a \\\"quoted\\\" <b> \xF0\x9F\x98\x80")};

class TakenOrder : public testing::TestWithParam<std::string> {};

TEST_P(TakenOrder, ComesBackFromItsDocument) {
  const auto outcome = outcome_of(GetParam());
  ASSERT_TRUE(outcome) << outcome.error().detail;
  const auto order = order_from(parse_json(GetParam()).value()).value();
  const auto again = order_from(to_json(order)).value();
  EXPECT_EQ(again.isovalues, order.isovalues);
  EXPECT_EQ(again.parameters, order.parameters);
  EXPECT_EQ(to_json(again), to_json(order));
}

INSTANTIATE_TEST_SUITE_P(Table, TakenOrder, testing::ValuesIn(kTaken));

TEST(JobOrder, HasTheDefaultsOfTheContract) {
  const auto order = order_from({{"volume", "v-1"}}).value();
  EXPECT_EQ(order.method, "mean-curvature-flow");
  EXPECT_FALSE(order.isovalues);
  EXPECT_EQ(order.mesh_formats, std::vector<std::string>{"stl"});
  EXPECT_EQ(order.mesh_frame, "");
  EXPECT_EQ(order.voxel_type, "same");
  EXPECT_EQ(order.outputs, std::vector<std::string>{"nifti"});
}

}  // namespace
}  // namespace volsmooth
