#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "tests/support/dicom_maker.h"
#include "tests/system/nifti_bytes.h"
#include "tests/system/schema_check.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> members_of(const json& document) {
  std::vector<std::string> names;
  for (const auto& [name, value] : document.items()) names.push_back(name);
  return names;
}

std::vector<std::string> ids_of(const json& jobs) {
  std::vector<std::string> ids;
  for (const json& job : jobs) ids.push_back(job.at("id"));
  return ids;
}

const std::vector<std::string> kVolumeMembers = {
    "id",        "format", "size",   "spacing_mm", "affine",     "frame",     "voxel_type",
    "intensity", "bytes",  "sha256", "warnings",   "created_at", "expires_at"};
const std::vector<std::string> kJobMembers = {"id",          "state", "method",     "parameters",
                                              "progress",    "label", "created_at", "started_at",
                                              "finished_at", "error", "results"};
const std::vector<std::string> kResultMembers = {"name",  "kind",       "method", "isovalue",
                                                 "frame", "media_type", "bytes",  "sha256"};

MATCHER_P(HasMembers, names, "") {
  const auto there = members_of(arg);
  return testing::ExplainMatchResult(testing::IsSupersetOf(names), there, result_listener);
}

/// One daemon with one finished job for all tests.
class Api : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const TemporaryDirectory folder;
    const std::string configuration = folder / "configuration.json";
    std::ofstream(configuration) << R"({"presets": {"head": {}}})";
    daemon_.emplace(VOLSMOOTHD, std::vector<std::string>{"--config", configuration});
    const ServiceClient service(*daemon_);
    volume_ = service.upload(ball_file());
    job_ = service.run({{"volume", volume_.at("id")},
                        {"method", "compare"},
                        {"isovalues", {300, 500.5}},
                        {"mesh_formats", {"stl", "glb"}},
                        {"label", "the first"}});
  }
  static void TearDownTestSuite() { daemon_.reset(); }

  static std::string job_path() { return "/v1/jobs/" + job_.at("id").get<std::string>(); }
  static std::string volume_path() { return "/v1/volumes/" + volume_.at("id").get<std::string>(); }
  static std::string long_job(const ServiceClient& service) {
    return service.submit({{"volume", service.upload(ball_file(128)).at("id")},
                           {"parameters", {{"flow_time_mm2", 5000}}},
                           {"isovalues", json::array()}});
  }

  inline static std::optional<Daemon> daemon_;
  inline static json volume_, job_;
  ServiceClient service_{*daemon_};
};

TEST_F(Api, AVolumeSaysWhatWasFound) {
  EXPECT_THAT(volume_, HasMembers(kVolumeMembers));
  EXPECT_EQ(volume_.at("format"), "nifti-1");
  EXPECT_EQ(volume_.at("size"), json({24, 24, 24}));
  EXPECT_EQ(volume_.at("frame"), "RAS");
  EXPECT_EQ(volume_.at("voxel_type"), "int16");
  EXPECT_EQ(volume_.at("affine").size(), 4U);
  EXPECT_EQ(volume_.at("intensity").at("min"), 0);
  EXPECT_EQ(volume_.at("bytes"), ball_file().size());
  EXPECT_THAT(volume_.at("created_at"), testing::MatchesRegex(R"(....-..-..T..:..:..(\.[0-9]+)?Z)"));
  EXPECT_EQ(service_.get(volume_path()), volume_);
  EXPECT_EQ(service_.call("GET", volume_path() + "/content").body, ball_file());

  const HttpResponse created = service_.call("POST", "/v1/volumes", ball_file());
  EXPECT_EQ(created.header("location"), "/v1/volumes/" + created.document().at("id").get<std::string>());
  EXPECT_THAT(ids_of(service_.get("/v1/volumes").at("volumes")),
              testing::Contains(created.document().at("id")));
}

TEST_F(Api, AJobSaysWhatItDidAndMade) {
  EXPECT_THAT(job_, HasMembers(kJobMembers));
  EXPECT_EQ(job_.at("state"), "succeeded");
  EXPECT_EQ(job_.at("label"), "the first");
  EXPECT_EQ(job_.at("error"), nullptr);
  EXPECT_EQ(job_.at("progress").at("fraction"), 1);
  EXPECT_TRUE(job_.at("parameters").contains("flow_time_mm2"));
  EXPECT_EQ(service_.get(job_path() + "/results").at("results"), job_.at("results"));
  std::vector<std::string> names;
  for (const json& result : job_.at("results")) {
    EXPECT_THAT(result, HasMembers(kResultMembers));
    names.push_back(result.at("name"));
    const HttpResponse file = service_.call("GET", job_path() + "/results/" + names.back());
    EXPECT_EQ(file.header("content-type"), result.at("media_type"));
    EXPECT_EQ(file.body.size(), result.at("bytes").get<std::size_t>());
    if (names.back().ends_with(".glb")) {
      EXPECT_EQ(result.at("isovalue"), json({300, 500.5}));
    }
  }
  EXPECT_THAT(names, testing::IsSupersetOf({"original_iso300.stl", "original_iso500.5.stl", "original.glb",
                                            "laplacian_iso500.5.stl", "mean-curvature-flow.nii.gz",
                                            "mean-curvature-flow.png", "report.json"}));
}

TEST_F(Api, ABareOrderIsAGoodJob) {
  const json job = service_.run({{"volume", volume_.at("id")}});
  EXPECT_EQ(job.at("method"), "mean-curvature-flow");
  EXPECT_DOUBLE_EQ(job.at("parameters").at("flow_time_mm2"), 1) << "radius 2 x 1 mm: r^2 / 4";
  EXPECT_EQ(job.at("results").size(), 4U) << "volume, surface, picture, report";
}

TEST_F(Api, AMultipartJobBringsItsVolume) {
  const std::string body =
      "--b\r\nContent-Disposition: form-data; name=\"volume\"; filename=\"x\"\r\n\r\n" + ball_file() +
      "\r\n--b\r\nContent-Disposition: form-data; name=\"job\"\r\n\r\n{\"isovalues\":[]}\r\n--b--\r\n";
  const HttpResponse answer =
      service_.call("POST", "/v1/jobs", body, {{"Content-Type", "multipart/form-data; boundary=b"}});
  ASSERT_EQ(answer.status, 202) << answer.body;
  EXPECT_EQ(service_.wait(answer.document().at("id")).at("state"), "succeeded");
}

TEST_F(Api, ListingsComeInPagesNewestFirst) {
  std::vector<std::string> submitted;
  for (int i = 0; i < 5; ++i) {
    submitted.insert(
        submitted.begin(),
        service_.submit({{"volume", volume_.at("id")}, {"isovalues", json::array()}, {"label", "page"}}));
  }
  const json first = service_.get("/v1/jobs?label=page&limit=3");
  ASSERT_TRUE(first.at("next_cursor").is_string());
  const json second =
      service_.get("/v1/jobs?label=page&limit=3&cursor=" + first.at("next_cursor").get<std::string>());
  EXPECT_TRUE(second.at("next_cursor").is_null());
  std::vector<std::string> listed = ids_of(first.at("jobs"));
  std::ranges::move(ids_of(second.at("jobs")), std::back_inserter(listed));
  EXPECT_EQ(listed, submitted);

  for (const std::string& id : submitted) service_.wait(id);
  EXPECT_EQ(service_.get("/v1/jobs?label=page&state=succeeded").at("jobs").size(), 5U);
  EXPECT_EQ(service_.get("/v1/jobs?label=page&state=failed").at("jobs").size(), 0U);
  EXPECT_EQ(service_.get("/v1/jobs?method=compare").at("jobs").size(), 1U);
}

TEST_F(Api, WaitingEndsWithTheJobOrTheTime) {
  const std::string id = long_job(service_);
  const json unfinished = service_.get("/v1/jobs/" + id + "?wait=0.2");
  EXPECT_FALSE(ServiceClient::is_final(unfinished));
  HttpConnection waiting(daemon_->port());
  waiting.send("GET /v1/jobs/" + id + "?wait=60 HTTP/1.1\r\nHost: localhost\r\n\r\n");
  service_.call("POST", "/v1/jobs/" + id + "/cancel");
  EXPECT_EQ(waiting.read().value().document().at("state"), "cancelled");
}

struct ServerSentEvent {
  std::string id, event;
  json data;
};

std::vector<ServerSentEvent> events_in(const std::string& stream) {
  std::vector<ServerSentEvent> events;
  ServerSentEvent current;
  std::istringstream lines(stream);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("id: ")) current.id = line.substr(4);
    if (line.starts_with("event: ")) current.event = line.substr(7);
    if (line.starts_with("data: ")) current.data = json::parse(line.substr(6));
    if (line.empty() && !current.event.empty()) events.push_back(std::exchange(current, {}));
  }
  return events;
}

TEST_F(Api, EventsEndWithTheFinalStateAndResume) {
  const auto events_after = [&](const std::string& last_id) {
    HeaderFields headers{{"Connection", "close"}};
    if (!last_id.empty()) headers["Last-Event-ID"] = last_id;
    const HttpResponse answer = service_.call("GET", job_path() + "/events", {}, headers);
    EXPECT_THAT(answer.header("content-type"), HasSubstr("text/event-stream"));
    return events_in(answer.body);
  };
  const auto all = events_after("");
  ASSERT_GE(all.size(), 3U);
  EXPECT_EQ(all.front().data.at("state"), "queued");
  EXPECT_EQ(all.back().event, "state");
  EXPECT_EQ(all.back().data.at("state"), "succeeded");
  std::set<std::string> ids;
  for (const ServerSentEvent& event : all) {
    EXPECT_THAT(event.event, testing::AnyOf("state", "progress"));
    EXPECT_TRUE(!event.id.empty() && ids.insert(event.id).second) << "an id of its own";
  }
  for (std::size_t seen = 1; seen < all.size(); ++seen) {
    std::vector<std::string> rest, expected;
    for (const ServerSentEvent& event : events_after(all[seen - 1].id)) rest.push_back(event.id);
    for (std::size_t i = seen; i < all.size(); ++i) expected.push_back(all[i].id);
    EXPECT_EQ(rest, expected);
  }
}

TEST_F(Api, ResultsAreServedInRanges) {
  const std::string path = job_path() + "/results/mean-curvature-flow.nii.gz";
  const HttpResponse whole = service_.call("GET", path);
  const std::string etag = whole.header("etag");
  ASSERT_FALSE(etag.empty());
  const std::string size = std::to_string(whole.body.size());

  const HttpResponse head = service_.call("HEAD", path);
  EXPECT_EQ(head.header("content-length"), size);
  EXPECT_EQ(head.header("etag"), etag);

  const auto range = [&](const std::string& value, const HeaderFields& more = {}) {
    HeaderFields headers{{"Range", value}};
    headers.insert(more.begin(), more.end());
    return service_.call("GET", path, {}, headers);
  };
  const HttpResponse part = range("bytes=10-19");
  EXPECT_EQ(part.status, 206);
  EXPECT_EQ(part.body, whole.body.substr(10, 10));
  EXPECT_EQ(part.header("content-range"), "bytes 10-19/" + size);
  EXPECT_EQ(range("bytes=-7").body, whole.body.substr(whole.body.size() - 7));
  EXPECT_EQ(range("bytes=" + size + "-").status, 416);
  EXPECT_EQ(range("bytes=9-1").status, 200) << "bad syntax is no range";
  EXPECT_EQ(range("bytes=0-4", {{"If-Range", etag}}).status, 206);
  EXPECT_EQ(range("bytes=0-4", {{"If-Range", "\"stale\""}}).status, 200);
  EXPECT_EQ(service_.call("GET", path, {}, {{"If-None-Match", etag}}).status, 304);
}

TEST_F(Api, AVolumeInUseStaysAndAnIdleOneGoes) {
  const std::string volume = service_.upload(ball_file(128)).at("id");
  const std::string job = service_.submit(
      {{"volume", volume}, {"parameters", {{"flow_time_mm2", 5000}}}, {"isovalues", json::array()}});
  const HttpResponse refused = service_.call("DELETE", "/v1/volumes/" + volume);
  EXPECT_EQ(refused.status, 409);
  EXPECT_EQ(refused.document().at("type"), "/problems/volume-in-use");
  service_.call("POST", "/v1/jobs/" + job + "/cancel");
  service_.wait(job);
  EXPECT_EQ(service_.call("DELETE", "/v1/volumes/" + volume).status, 204);
  EXPECT_EQ(service_.call("GET", "/v1/volumes/" + volume).status, 410);
  EXPECT_EQ(service_.call("DELETE", "/v1/jobs/" + job).status, 204);
  EXPECT_EQ(service_.call("GET", "/v1/jobs/" + job).status, 410);
}

TEST_F(Api, UnknownIdsAre404) {
  for (const char* path :
       {"/v1/volumes/v-aaaaaaaaaaaaaaaa", "/v1/volumes/v-aaaaaaaaaaaaaaaa/content",
        "/v1/jobs/j-aaaaaaaaaaaaaaaa", "/v1/jobs/j-aaaaaaaaaaaaaaaa/events",
        "/v1/jobs/j-aaaaaaaaaaaaaaaa/results", "/v1/jobs/j-aaaaaaaaaaaaaaaa/results/report.json"})
    EXPECT_EQ(service_.call("GET", path).status, 404) << path;
  EXPECT_EQ(service_.call("GET", job_path() + "/results/no-such-file.stl").status, 404);
}

TEST_F(Api, TheCatalogueIsWhatOrdersAreHeldTo) {
  std::vector<std::string> names;
  const json catalogue = service_.get("/v1/methods");
  for (const json& method : catalogue.at("methods")) {
    names.push_back(method.at("name"));
    json parameters = json::object();  // what must be given: an isovalue of the ball, or 1 of the unit
    for (const json& parameter : method.at("parameters"))
      if (parameter.value("required", false))
        parameters[parameter.at("name").get<std::string>()] =
            parameter.contains("minimum") ? json(1) : volume_.at("intensity").at("max");
    json order = {{"volume", volume_.at("id")},
                  {"method", names.back()},
                  {"parameters", parameters},
                  {"isovalues", json::array()}};
    const HttpResponse answer = service_.try_submit(order);
    ASSERT_EQ(answer.status, 202) << answer.body;
    EXPECT_EQ(service_.wait(answer.document().at("id")).at("state"), "succeeded");
    if (parameters.empty()) continue;
    order.erase("parameters");
    EXPECT_EQ(service_.try_submit(order).status, 422) << names.back() << " without what it needs";
  }
  EXPECT_THAT(names, testing::IsSupersetOf({"mean-curvature-flow", "conservative-mean-curvature-flow",
                                            "laplacian", "compare", "offset", "sharpening"}));
  EXPECT_THAT(service_.get("/v1/formats").dump(),
              testing::AllOf(HasSubstr("stl"), HasSubstr("glb"), HasSubstr("dicom-series")));
}

TEST_F(Api, MetricsAndHealth) {
  EXPECT_EQ(service_.call("GET", "/healthz").status, 200);
  EXPECT_EQ(service_.call("GET", "/readyz").status, 200);
  const HttpResponse metrics = service_.call("GET", "/metrics");
  EXPECT_THAT(metrics.header("content-type"), HasSubstr("text/plain"));
  EXPECT_THAT(metrics.body, HasSubstr("# TYPE volsmooth_"));
}

struct SchemaCase {
  const char *schema, *fits, *does_not;  ///< JSON; the last two are arrays of documents
};

/// The checker itself, keyword by keyword.
TEST(SchemaCheck, TellsWhatFitsFromWhatDoesNot) {
  const SchemaCheck check(json::parse(R"({"components": {"schemas": {"Small": {"maximum": 3}}}})"));
  const std::vector<SchemaCase> cases = {
      {R"({"type": "integer"})", "[1, -2, 3.0]", R"([1.5, "1", null, true, []])"},
      {R"({"type": ["number", "null"]})", "[1.5, 1, null]", R"(["1", false, {}])"},
      {R"({"enum": ["a", null]})", R"(["a", null])", R"(["b", 0])"},
      {R"({"const": "auto"})", R"(["auto"])", R"(["Auto", null, ["auto"]])"},
      {R"({"minimum": 0, "maximum": 1})", R"([0, 0.5, 1, "2"])", "[-0.1, 1.1, 2]"},
      {R"({"exclusiveMinimum": 0})", "[0.1, 1]", "[0, -1]"},
      {R"({"pattern": "^[0-9a-f]{2}$"})", R"(["0f", 7])", R"(["0F", "0f0", ""])"},
      {R"({"format": "date-time"})", R"(["2026-11-26T21:18:36Z", "2026-11-26T21:18:36.5+01:00", null])",
       R"(["2026-11-26", "2026-13-26T21:18:36Z", "2026-11-26 21:18:36Z", "2026-11-26T21:18:36", ""])"},
      {R"({"minItems": 1, "maxItems": 2})", R"([[1], [1, 2], "text"])", "[[], [1, 2, 3]]"},
      {R"({"items": {"type": "string"}})", R"([[], ["a"], 1])", R"([[1], ["a", null]])"},
      {R"({"required": ["a"]})", R"([{"a": null}, 1])", R"([{}, {"b": 1}])"},
      {R"({"properties": {"a": {"type": "string"}}})", R"([{}, {"a": ""}, {"b": 1}])", R"([{"a": 1}])"},
      {R"({"properties": {"a": {}}, "additionalProperties": false})", R"([{}, {"a": 1}])",
       R"([{"b": 1}, {"a": 1, "b": 1}])"},
      {R"({"additionalProperties": {"type": "number"}})", R"([{}, {"a": 1}])", R"([{"a": "1"}])"},
      {R"({"anyOf": [{"const": "auto"}, {"type": "array"}]})", R"(["auto", []])", R"(["other", 1])"},
      {R"({"anyOf": [{"type": "null"}, {"type": "string"}], "pattern": "a"})", R"([null, "a"])",
       R"(["b", 1])"},
      {R"({"oneOf": [{"minimum": 1}, {"minimum": 2}]})", "[1]", "[0, 2]"},
      {R"({"$ref": "#/components/schemas/Small"})", "[3]", "[4]"},
      {R"({"$ref": "#/components/schemas/Small", "minimum": 1})", "[1]", "[0, 4]"}};
  for (const SchemaCase& one : cases) {
    const json schema = json::parse(one.schema);
    for (const json& value : json::parse(one.fits))
      EXPECT_THAT(check.faults(value, schema), IsEmpty()) << one.schema << " " << value;
    for (const json& value : json::parse(one.does_not))
      EXPECT_THAT(check.faults(value, schema), testing::Not(IsEmpty())) << one.schema << " " << value;
  }
}

TEST(SchemaCheck, RefusesWhatItDoesNotKnow) {
  const SchemaCheck check(json::object());
  for (const char* schema :
       {R"({"maxLength": 3})", R"({"format": "uuid"})", R"({"items": {"maxLength": 3}})",
        R"({"properties": {"a": {"not": {}}}})", R"({"anyOf": [{}, {"uniqueItems": true}]})"})
    EXPECT_THROW((void)check.faults(1, json::parse(schema)), std::invalid_argument) << schema;
  EXPECT_THROW(SchemaCheck(json::parse(R"({"components": {"schemas": {"A": {"maxLength": 3}}}})")),
               std::invalid_argument);
}

/// Every call of the OpenAPI document, made: the answer has the documented status and satisfies its schema.
TEST_F(Api, TheDaemonKeepsToItsOpenApiDocument) {
  const json openapi = service_.get("/openapi.json");
  EXPECT_THAT(openapi.at("openapi").get<std::string>(), testing::StartsWith("3.1"));
  const SchemaCheck check(openapi);
  std::size_t calls = 0;
  for (const auto& [pattern, operations] : openapi.at("paths").items()) {
    for (const auto& [lower_method, operation] : operations.items()) {
      SCOPED_TRACE(lower_method + " " + pattern);
      std::string method = lower_method;
      std::ranges::transform(method, method.begin(),
                             [](char c) { return static_cast<char>(std::toupper(c)); });
      // What may be deleted is made for that; all else is asked of the finished job and its volume.
      const bool of_jobs = pattern.starts_with("/v1/jobs");
      const json fresh_volume = service_.upload(ball_file(8));
      std::string id = of_jobs ? job_.at("id") : volume_.at("id");
      if (method == "DELETE") id = fresh_volume.at("id");
      if (method == "DELETE" && of_jobs) id = service_.submit({{"volume", id}});
      std::string target = std::regex_replace(pattern, std::regex(R"(\{id\})"), id);
      target = std::regex_replace(target, std::regex(R"(\{name\})"), "report.json");
      target = std::regex_replace(target, std::regex(R"(\{preset\})"), "head");

      std::string body;
      HeaderFields headers{{"Connection", "close"}};
      if (operation.contains("requestBody")) {
        body = of_jobs ? json{{"volume", fresh_volume.at("id")}}.dump() : ball_file(8);
        headers["Content-Type"] = of_jobs ? "application/json" : "application/octet-stream";
      }
      if (pattern.starts_with("/dicomweb")) body = files_of(series_of({})).front();
      const HttpResponse answer = service_.call(method, target, body, headers);
      ++calls;
      const std::string status = std::to_string(answer.status);
      ASSERT_TRUE(operation.at("responses").contains(status))
          << status << " is not documented: " << answer.body;
      const json& response = operation["responses"][status];
      if (!response.contains("content")) {
        EXPECT_EQ(answer.body, "");
        continue;
      }
      const auto content = response["content"].begin();
      const std::string& media_type = content.key();
      EXPECT_TRUE(media_type == "*/*" || answer.header("content-type").starts_with(media_type));
      if (content->contains("schema") && media_type == "application/json") {
        EXPECT_THAT(check.faults(answer.document(), (*content)["schema"]), IsEmpty()) << answer.body;
      }
    }
  }
  EXPECT_GE(calls, 19U) << "the calls of the contract";
}

/// Refusals satisfy the documented schema too.
TEST_F(Api, ProblemsKeepToTheirSchema) {
  const SchemaCheck check(service_.get("/openapi.json"));
  const json schema = {{"$ref", "#/components/schemas/Problem"}};
  for (const HttpResponse& answer :
       {service_.call("GET", "/v1/jobs/j-aaaaaaaaaaaaaaaa"), service_.call("POST", "/v1/volumes", "nonsense"),
        service_.try_submit({{"a", 1}})}) {
    EXPECT_GE(answer.status, 400);
    EXPECT_THAT(check.faults(answer.document(), schema), IsEmpty());
  }
}

}  // namespace
}  // namespace volsmooth::test
