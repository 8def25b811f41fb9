#include <thread>

#include "service/http/openapi.h"
#include "service/http/routes.h"
#include "tests/service/http/running_server.h"

namespace volsmooth {
namespace {

using nlohmann::json;
using Calls = ServerTest;

constexpr const char* kJsonType = "Content-Type: application/json\r\n";

TEST_F(Calls, UploadGivesAVolumeWithItsPlaceAndBytes) {
  const auto answer = ask("POST /v1/volumes?volume_index=0", "voxels");
  ASSERT_EQ(answer.status, 201);
  const auto id = id_of(answer);
  EXPECT_EQ(answer.field("location"), "/v1/volumes/" + id);
  EXPECT_EQ(answer.field("x-content-type-options"), "nosniff");
  EXPECT_EQ(answer.field("cache-control"), "no-store");
  EXPECT_EQ(json::parse(ask("GET /v1/volumes/" + id).body), json::parse(answer.body));
  EXPECT_EQ(json::parse(ask("GET /v1/volumes").body).at("volumes").size(), 1);
  EXPECT_EQ(ask("GET /v1/volumes/" + id + "/content").body, "voxels");
  EXPECT_EQ(ask("DELETE /v1/volumes/" + id).status, 204);
  EXPECT_EQ(ask("GET /v1/volumes/" + id).status, 410);
  EXPECT_EQ(ask("GET /v1/volumes/v-aaaaaaaaaaaaaaaa").status, 404);
}

TEST_F(Calls, BadFileBecomesNoVolume) {
  const auto answer = ask("POST /v1/volumes", "bad file");
  EXPECT_EQ(answer.status, 422);
  EXPECT_EQ(slug(answer), "nifti-bad-header");
  EXPECT_TRUE(jobs_.volumes(kAnyone)->volumes.empty());
}

// SHA-256 of "voxels", by coreutils' sha256sum.
constexpr const char* kDigestOfVoxels = "sha-256=:ONETQueALcRgJH3OyVuUVVfwWhvMdKTbN/QtfiuLQ94=:";

TEST_F(Calls, ABodyIsHeldToItsDigest) {
  for (const std::string name : {"Content-Digest: ", "Repr-Digest: "}) {
    EXPECT_EQ(ask("POST /v1/volumes", "voxels", name + kDigestOfVoxels + "\r\n").status, 201);
    const auto refused = ask("POST /v1/volumes", "voxelS", name + kDigestOfVoxels + "\r\n");
    EXPECT_EQ(refused.status, 422);
    EXPECT_EQ(slug(refused), "digest-mismatch");
  }
  EXPECT_EQ(slug(ask("POST /v1/jobs", "{}",
                     std::string(kJsonType) + "Content-Digest: " + kDigestOfVoxels + "\r\n")),
            "digest-mismatch");
  EXPECT_EQ(slug(ask("POST /v1/volumes", "voxels", "Content-Digest: sha-256=:AAAA:\r\n")), "bad-header");
  EXPECT_EQ(jobs_.volumes(kAnyone)->volumes.size(), 2);
  server_->stop();  // the file goes after the answer
  EXPECT_TRUE(std::filesystem::is_empty(directory_ / "tmp"));
}

TEST_F(Calls, OnlyWhatIfMatchNamesIsDeleted) {
  const auto if_match = [](const std::string& tags) { return "If-Match: " + tags + "\r\n"; };
  const auto volume = "/v1/volumes/" + upload();
  const auto job = "/v1/jobs/" + finished_job(volume.substr(12));
  for (const auto& path : {job, volume}) {
    const auto tag = ask("GET " + path).field("etag");
    ASSERT_EQ(tag.size(), 66) << path;
    for (const std::string& stale :
         {std::string("\"stale\""), "W/" + tag, tag.substr(0, 65), std::string()}) {
      const auto refused = ask("DELETE " + path, "", if_match(stale));
      EXPECT_EQ(refused.status, 412) << path << stale;
      EXPECT_EQ(slug(refused), "precondition-failed");
    }
    EXPECT_EQ(ask("GET " + path, "", "If-None-Match: " + tag + "\r\n").status, 304);
    EXPECT_EQ(ask("DELETE " + path, "", if_match("\"stale\", " + tag)).status, 204);
    EXPECT_EQ(ask("DELETE " + path, "", if_match(tag)).status, 204);  // it is repeatable
    EXPECT_EQ(ask("GET " + path).status, 410);
  }
  EXPECT_EQ(ask("DELETE /v1/volumes/" + upload(), "", if_match("*")).status, 204);
}

TEST_F(Calls, TheTagOfAJobIsItsDocuments) {
  const auto id = id_of(submit(upload(), "gate"));
  const auto early = ask("GET /v1/jobs/" + id).field("etag");
  engine_.open_gate();
  const auto waited = ask("GET /v1/jobs/" + id + "?wait=60").field("etag");
  EXPECT_EQ(slug(ask("DELETE /v1/jobs/" + id, "", "If-Match: " + early + "\r\n")), "precondition-failed");
  EXPECT_EQ(ask("GET /v1/jobs/" + id).field("etag"), waited);
  EXPECT_EQ(ask("DELETE /v1/jobs/" + id, "", "If-Match: " + waited + "\r\n").status, 204);
}

TEST_F(Calls, LargeUploadComesBackAsItWas) {
  std::string bytes;
  for (std::uint32_t i = 0; bytes.size() < 3'000'000; ++i) bytes += static_cast<char>(i * 2654435761U >> 24);
  EXPECT_EQ(ask("GET /v1/volumes/" + upload(bytes) + "/content").body, bytes);
}

TEST_F(Calls, ChunkedUploadOverTheLimitIsStopped) {
  auto client = connect();
  client.send("POST /v1/volumes HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n");
  std::thread sender([&] {
    for (int i = 0; i < 80; ++i)
      if (!client.send("10000\r\n" + std::string(65536, 'x') + "\r\n")) return;
  });
  EXPECT_EQ(slug(client.receive()), "content-too-large");
  sender.join();
  EXPECT_TRUE(jobs_.volumes(kAnyone)->volumes.empty());
}

TEST_F(Calls, JobRunsToItsResults) {
  const auto volume = upload();
  const auto submitted = submit(volume);
  ASSERT_EQ(submitted.status, 202);
  const auto id = id_of(submitted);
  EXPECT_EQ(submitted.field("location"), "/v1/jobs/" + id);
  EXPECT_EQ(json::parse(ask("GET /v1/jobs/" + id + "?wait=60").body).at("state"), "succeeded");
  EXPECT_EQ(json::parse(ask("GET /v1/jobs/" + id + "/results").body).at("results").size(), 2);
  EXPECT_EQ(ask("GET /v1/jobs/" + id + "/results/out.nii.gz").body, "voxels");
  EXPECT_EQ(ask("GET /v1/jobs/" + id + "/results/none").status, 404);
  EXPECT_EQ(ask("DELETE /v1/jobs/" + id).status, 204);
  EXPECT_EQ(ask("DELETE /v1/jobs/" + id).status, 204);
  EXPECT_EQ(ask("GET /v1/jobs/" + id).status, 410);
}

TEST_F(Calls, FailedJobHasAWholeProblem) {
  const auto id = id_of(submit(upload(), "problem"));
  const auto error = json::parse(ask("GET /v1/jobs/" + id + "?wait=60").body).at("error");
  EXPECT_EQ(error.at("type"), "/problems/bad-parameter");
  EXPECT_EQ(error.at("status"), 422);
  EXPECT_TRUE(error.contains("title"));
  EXPECT_EQ(error.at("member"), "x");
}

TEST_F(Calls, AProblemIsTheSameDocumentInEventsAndJobs) {
  const auto id = id_of(submit(upload(), "problem"));
  const auto error = json::parse(ask("GET /v1/jobs/" + id + "?wait=60").body).at("error");
  const auto events = ask("GET /v1/jobs/" + id + "/events").body;
  const auto last = events.substr(events.rfind("data: ") + 6);
  EXPECT_EQ(json::parse(last).at("error"), error);
  EXPECT_EQ(json::parse(ask("GET /v1/jobs").body).at("jobs").at(0).at("error"), error);
}

TEST_F(Calls, VolumeInUseStays) {
  const auto volume = upload();
  const auto job = id_of(submit(volume, "gate"));
  const auto refused = ask("DELETE /v1/volumes/" + volume);
  EXPECT_EQ(refused.status, 409);
  EXPECT_EQ(slug(refused), "volume-in-use");
  EXPECT_EQ(ask("POST /v1/jobs/" + job + "/cancel").status, 202);
  EXPECT_EQ(json::parse(ask("GET /v1/jobs/" + job + "?wait=60").body).at("state"), "cancelled");
  EXPECT_EQ(ask("POST /v1/jobs/" + job + "/cancel").status, 202);
  EXPECT_EQ(ask("DELETE /v1/volumes/" + volume).status, 204);
}

TEST_F(Calls, WaitEndsWithTheTimeOrTheJob) {
  const auto id = id_of(submit(upload(), "gate"));
  EXPECT_NE(json::parse(ask("GET /v1/jobs/" + id + "?wait=0.05").body).at("state"), "succeeded");
  auto waiting = connect();
  waiting.send(request("GET /v1/jobs/" + id + "?wait=60"));
  engine_.open_gate();
  EXPECT_EQ(json::parse(waiting.receive().body).at("state"), "succeeded");
}

TEST_F(Calls, ManyThatWaitKeepNobodyWaiting) {
  const auto id = id_of(submit(upload(), "gate"));
  std::vector<std::unique_ptr<HttpClient>> waiting;
  for (int i = 0; i < 50; ++i) {
    waiting.push_back(std::make_unique<HttpClient>(server_->address()));
    waiting.back()->send(request("GET /v1/jobs/" + id + "?wait=60"));
  }
  EXPECT_EQ(ask("GET /v1/jobs/" + id).status, 200);
  engine_.open_gate();
  for (auto& client : waiting) EXPECT_EQ(json::parse(client->receive().body).at("state"), "succeeded");
}

TEST_F(Calls, ManyThatSubmitKeepNobodyWaitingWhoLooks) {
  const auto volume = upload();
  std::vector<std::unique_ptr<HttpClient>> submitting;
  for (int i = 0; i < 10; ++i) {
    const std::string order = R"({"volume": ")" + volume + R"(", "label": "plan at gate"})";
    submitting.push_back(std::make_unique<HttpClient>(server_->address()));
    submitting.back()->send(request("POST /v1/jobs", order, kJsonType));
  }
  while (engine_.at_gate == 0) std::this_thread::yield();
  EXPECT_EQ(ask("GET /v1/volumes/" + volume).status, 200);
  engine_.open_gate();
  for (auto& client : submitting) EXPECT_EQ(client->receive().status, 202);
}

TEST_F(Calls, ListIsPagedAndFiltered) {
  const auto volume = upload();
  for (const char* label : {"a", "b", "a"}) (void)submit(volume, label);
  const auto page = json::parse(ask("GET /v1/jobs?limit=2").body);
  ASSERT_EQ(page.at("jobs").size(), 2);
  const auto next =
      json::parse(ask("GET /v1/jobs?limit=2&cursor=" + page.at("next_cursor").get<std::string>()).body);
  EXPECT_EQ(next.at("jobs").size(), 1);
  EXPECT_EQ(next.at("next_cursor"), nullptr);
  EXPECT_EQ(json::parse(ask("GET /v1/jobs?label=a").body).at("jobs").size(), 2);
  EXPECT_EQ(json::parse(ask("GET /v1/jobs?method=laplacian").body).at("jobs").size(), 0);
}

TEST_F(Calls, ListFindsTheLongestLabel) {
  std::string label, escaped;
  for (int i = 0; i < 200; ++i) {
    label += "\xF0\x9F\xA7\xA0";  // four bytes, one character
    escaped += "%F0%9F%A7%A0";
  }
  ASSERT_EQ(submit(upload(), label).status, 202);
  EXPECT_EQ(json::parse(ask("GET /v1/jobs?label=" + escaped).body).at("jobs").size(), 1);
  EXPECT_EQ(slug(ask("GET /v1/jobs?label=" + std::string(1025, 'a'))), "bad-query");
}

struct OrderCase {
  std::string order, slug;
  int status;
};
std::ostream& operator<<(std::ostream& out, const OrderCase& one) {
  return out << one.order.substr(0, 60);
}

class BadOrder : public ServerTest, public testing::WithParamInterface<OrderCase> {};

TEST_P(BadOrder, IsRefused) {
  const auto answer = ask("POST /v1/jobs", GetParam().order, kJsonType);
  EXPECT_EQ(answer.status, GetParam().status);
  EXPECT_EQ(slug(answer), GetParam().slug);
}

INSTANTIATE_TEST_SUITE_P(Table, BadOrder,
                         testing::Values(OrderCase{"{", "bad-json", 400}, OrderCase{"{}{}", "bad-json", 400},
                                         OrderCase{"{\"volume\":\"v\",\"volume\":\"v\"}", "bad-json", 400},
                                         OrderCase{"{\"volume\":\"v\",\"tenant\":1}", "unknown-field", 422},
                                         OrderCase{"{\"volume\":\"v-aaaaaaaaaaaaaaaa\"}", "not-found", 404}));

std::string form(const std::string& volume, const std::string& job, bool job_first = false) {
  const std::string first =
      "--B\r\nContent-Disposition: form-data; name=\"volume\"; filename=\"p.nii\"\r\n\r\n" + volume + "\r\n";
  const std::string second = "--B\r\nContent-Disposition: form-data; name=\"job\"\r\n\r\n" + job + "\r\n";
  return (job_first ? second + first : first + second) + "--B--\r\n";
}
constexpr const char* kFormType = "Content-Type: multipart/form-data; boundary=B\r\n";

TEST_F(Calls, FormUploadsAndSubmitsInEitherOrder) {
  for (const bool job_first : {false, true}) {
    const auto answer = ask("POST /v1/jobs", form("voxels", R"({"label":"x"})", job_first), kFormType);
    ASSERT_EQ(answer.status, 202);
    EXPECT_EQ(json::parse(answer.body).at("label"), "x");
  }
}

TEST_F(Calls, RelatedPartsAreKeptAsTheyCame) {
  const std::string body = "--B\r\nContent-Type: application/dicom\r\n\r\nvoxels\r\n--B--\r\n";
  const auto answer = ask("POST /v1/volumes", body,
                          "Content-Type: multipart/related; type=\"application/dicom\"; boundary=B\r\n");
  ASSERT_EQ(answer.status, 201);
  const std::string id = json::parse(answer.body).at("id");
  EXPECT_EQ(ask("GET /v1/volumes/" + id + "/content").body, body);
  EXPECT_EQ(ask("POST /v1/jobs", body, "Content-Type: multipart/related; boundary=B\r\n").status, 415);
}

TEST_F(Calls, FailedFormLeavesNoVolumeBehind) {
  const std::vector<std::pair<std::string, std::string>> forms = {
      {form("voxels", R"({"method":"none"})"), "unknown-algorithm"},
      {form("voxels", "{"), "bad-json"},
      {form("voxels", R"({"volume":"v-1"})"), "unknown-field"},
      {form("voxels", "[]"), "bad-json"},
      {form("bad", "{}"), "nifti-bad-header"},
      {form("voxels", "{}").substr(0, 120), "bad-multipart"}};
  for (const auto& [body, expected] : forms) {
    const auto answer = ask("POST /v1/jobs", body, kFormType);
    EXPECT_GE(answer.status, 400);
    EXPECT_EQ(slug(answer), expected);
  }
  EXPECT_TRUE(jobs_.volumes(kAnyone)->volumes.empty());
}

TEST_F(Calls, FormWhoseSubmissionBreaksLeavesNoVolumeBehind) {
  auto engine = engine_.engine();
  engine.plan = [](const JobOrder&, const VolumeFacts&) -> tl::expected<JobPlan, Problem> {
    throw std::runtime_error("broken");
  };
  const ScratchFolder directory;
  JobService jobs({.data_dir = directory.path()}, engine);
  server_.reset();
  server_.emplace(ServerSettings{.listen = "127.0.0.1:0"}, Api{jobs, metrics_});
  EXPECT_EQ(ask("POST /v1/jobs", form("voxels", "{}"), kFormType).status, 503);
  EXPECT_TRUE(jobs.volumes(kAnyone)->volumes.empty());
  server_.reset();
}

TEST_F(Calls, VolumeMayComeAsAForm) {
  const auto answer =
      ask("POST /v1/volumes", "--B\r\nContent-Disposition: form-data; name=\"volume\"\r\n\r\nabc\r\n--B--",
          kFormType);
  EXPECT_EQ(answer.status, 201);
  EXPECT_EQ(json::parse(answer.body).at("bytes"), 3);
}

TEST_F(Calls, ResultsHaveTagsAndRanges) {
  const std::string path = "/v1/jobs/" + finished_job(upload("0123456789")) + "/results/out.nii.gz";
  const auto whole = ask("GET " + path);
  const auto tag = whole.field("etag");
  EXPECT_EQ(tag.size(), 66);
  EXPECT_EQ(whole.field("content-type"), "application/octet-stream");
  EXPECT_EQ(whole.field("accept-ranges"), "bytes");

  const auto head = ask("HEAD " + path);
  EXPECT_EQ(head.field("content-length"), "10");
  EXPECT_EQ(head.field("etag"), tag);

  const auto part = ask("GET " + path, "", "Range: bytes=2-4\r\n");
  EXPECT_EQ(part.status, 206);
  EXPECT_EQ(part.body, "234");
  EXPECT_EQ(part.field("content-range"), "bytes 2-4/10");
  const auto beyond = ask("GET " + path, "", "Range: bytes=10-\r\n");
  EXPECT_EQ(beyond.status, 416);
  EXPECT_EQ(beyond.field("content-range"), "bytes */10");
  EXPECT_EQ(ask("GET " + path, "", "Range: bytes=9-1\r\n").body, "0123456789");

  EXPECT_EQ(ask("GET " + path, "", "Range: bytes=0-1\r\nIf-Range: " + tag + "\r\n").status, 206);
  EXPECT_EQ(ask("GET " + path, "", "Range: bytes=0-1\r\nIf-Range: \"stale\"\r\n").status, 200);
  EXPECT_EQ(ask("GET " + path, "", "If-None-Match: " + tag + "\r\n").status, 304);
  EXPECT_EQ(ask("GET " + path, "", "If-None-Match: \"stale\"\r\n").status, 200);
  EXPECT_EQ(ask("GET " + path, "", "Accept: image/png\r\n").status, 406);
}

TEST_F(Calls, TheLinesOfAcceptAreOneList) {
  const std::string file = "/v1/jobs/" + finished_job(upload()) + "/results/out.nii.gz";
  const std::vector<std::pair<std::string, std::string>> served = {{"/v1/methods", "application/json"},
                                                                   {file, "application/octet-stream"}};
  for (const auto& [path, type] : served) {
    const auto status = [&](const std::vector<std::string>& lines) {
      std::string fields;
      for (const auto& line : lines) fields += "Accept: " + line + "\r\n";
      return ask("GET " + path, "", fields).status;
    };
    EXPECT_EQ(status({"text/html", type}), 200);
    EXPECT_EQ(status({type, "text/html"}), 200);
    EXPECT_EQ(status({"", type}), 200);
    EXPECT_EQ(status({"*/*", type + ";q=0"}), 406) << "what the second line excludes";
    EXPECT_EQ(status({"text/html", "image/png"}), 406);
  }
}

TEST_F(Calls, SeveralRangesComeAsParts) {
  const std::string path = "/v1/jobs/" + finished_job(upload("0123456789")) + "/results/out.nii.gz";
  const auto answer = ask("GET " + path, "", "Range: bytes=0-1,-2\r\n");
  EXPECT_EQ(answer.status, 206);
  const auto type = answer.field("content-type");
  ASSERT_TRUE(type.starts_with("multipart/byteranges; boundary="));
  const std::string line = "\r\n--" + type.substr(type.find('=') + 1);
  const std::string kind = "\r\nContent-Type: application/octet-stream\r\nContent-Range: bytes ";
  EXPECT_EQ(answer.body,
            line + kind + "0-1/10\r\n\r\n01" + line + kind + "8-9/10\r\n\r\n89" + line + "--\r\n");
}

std::vector<std::string> ids_in(const std::string& events) {
  std::vector<std::string> ids;
  for (std::size_t at = 0; (at = events.find("id: ", at)) != std::string::npos; at = events.find('\n', at))
    ids.push_back(events.substr(at + 4, events.find('\n', at) - at - 4));
  return ids;
}

TEST_F(Calls, EventsEndWithTheFinalStateAndResumeAfterAnyOfThem) {
  const auto id = finished_job(upload());
  const auto all = ask("GET /v1/jobs/" + id + "/events");
  EXPECT_EQ(all.field("content-type"), "text/event-stream");
  const auto ids = ids_in(all.body);
  ASSERT_GE(ids.size(), 2);
  EXPECT_THAT(all.body.substr(all.body.rfind("id: ")), testing::HasSubstr("succeeded"));
  for (std::size_t seen = 0; seen < ids.size(); ++seen) {
    const auto later = ask("GET /v1/jobs/" + id + "/events", "", "Last-Event-ID: " + ids[seen] + "\r\n");
    EXPECT_EQ(ids_in(later.body),
              std::vector<std::string>(ids.begin() + static_cast<std::ptrdiff_t>(seen) + 1, ids.end()));
  }
}

TEST_F(Calls, EventsComeAsTheyHappen) {
  const auto id = id_of(submit(upload(), "gate"));
  auto watching = connect();
  watching.send(request("GET /v1/jobs/" + id + "/events"));
  watching.receive_until("\"running\"");
  watching.receive_until("event: progress");
  engine_.open_gate();
  watching.receive_until("\"succeeded\"");
  watching.receive_until("0\r\n\r\n");
  EXPECT_EQ(watching.exchange(request("GET /healthz")).status, 200);
}

TEST_F(Calls, SilentEventStreamShowsThatItLives) {
  start({.listen = "127.0.0.1:0", .keep_alive_comment_seconds = 0.05});
  const auto volume = upload();
  (void)submit(volume, "gate");
  const auto waiting = id_of(submit(volume));  // one worker: it stays queued
  auto watching = connect();
  watching.send(request("GET /v1/jobs/" + waiting + "/events"));
  EXPECT_NO_THROW(watching.receive_until(": alive\n\n"));
}

TEST_F(Calls, StopEndsWhatWaitsAndFinishesWhatIsUnderWay) {
  const auto id = id_of(submit(upload(), "gate"));
  auto idle = connect(), waiting = connect(), watching = connect();
  EXPECT_EQ(idle.exchange(request("GET /healthz")).status, 200);
  waiting.send(request("GET /v1/jobs/" + id + "?wait=300"));
  watching.send(request("GET /v1/jobs/" + id + "/events"));
  watching.receive_until("\"running\"");
  server_->stop();
  EXPECT_TRUE(idle.is_closed());
  EXPECT_EQ(waiting.receive().status, 200);
  EXPECT_NO_THROW(watching.receive_until("0\r\n\r\n"));
  EXPECT_THROW(connect(), std::runtime_error);
}

TEST_F(Calls, StopTurnsAnUploadAwayThatIsBeingVerified) {
  auto uploading = connect();
  uploading.send(request("POST /v1/volumes", "gate stays shut"));
  while (engine_.at_gate == 0) std::this_thread::yield();
  jobs_.stop();
  const auto answer = uploading.receive();
  EXPECT_EQ(answer.status, 503);
  EXPECT_EQ(slug(answer), "not-ready");
  EXPECT_EQ(answer.field("retry-after"), "5");
}

TEST_F(Calls, HeadAnswersAsGetWithoutTheBody) {
  const auto id = finished_job(upload());
  for (const std::string path : {"/healthz", "/v1/methods", "/v1/volumes"}) {
    const auto got = ask("GET " + path);
    const auto head = ask("HEAD " + path);
    EXPECT_EQ(head.status, got.status);
    EXPECT_EQ(head.field("content-length"), got.field("content-length"));
  }
  auto client = connect();
  EXPECT_EQ(client.exchange(request("HEAD /v1/jobs/" + id + "/events"), true).status, 200);
  EXPECT_EQ(client.exchange(request("GET /healthz")).status, 200);
}

TEST_F(Calls, MetricsCountByPatternAndNeverByPath) {
  const auto id = finished_job(upload());
  const auto metrics = ask("GET /metrics");
  EXPECT_THAT(metrics.field("content-type"), testing::StartsWith("text/plain"));
  EXPECT_THAT(metrics.body, testing::HasSubstr(R"(route="/v1/jobs/{id}",status="200"} 1)"));
  EXPECT_THAT(metrics.body, testing::Not(testing::HasSubstr(id)));
}

/// Asks every GET with a header that changes the answer wherever it counts.
TEST_F(Calls, EveryHeaderThatAGetHeedsIsDeclared) {
  const auto volume = upload();
  const auto job = finished_job(volume);
  const auto last_event = ids_in(ask("GET /v1/jobs/" + job + "/events").body).back();
  const auto paths = openapi_document(jobs_.engine().methods).at("paths");
  for (const auto& route : routes()) {
    if (route.method != "GET" || route.pattern == "/metrics") continue;  // which never stay the same
    std::string path(route.pattern);
    if (const auto at = path.find("{id}"); at != std::string::npos)
      path.replace(at, 4, path.starts_with("/v1/volumes") ? volume : job);
    if (const auto at = path.find("{name}"); at != std::string::npos) path.replace(at, 6, "out.nii.gz");
    const json& operation = paths.at(std::string(route.pattern)).at("get");
    const auto plain = ask("GET " + path);
    ASSERT_EQ(plain.status, 200) << path;
    const std::vector<std::pair<std::string, std::string>> headers = {
        {"Range", "bytes=0-1"}, {"If-None-Match", "*"}, {"Last-Event-ID", last_event}};
    for (const auto& [name, value] : headers) {
      const auto answer = ask("GET " + path, "", name + ": " + value + "\r\n");
      const bool heeded = answer.status != plain.status || answer.body != plain.body;
      const bool declared = std::ranges::any_of(operation.at("parameters"), [&](const json& one) {
        return one.at("in") == "header" && one.at("name") == name;
      });
      EXPECT_EQ(declared, heeded) << path << " " << name;
      EXPECT_TRUE(operation.at("responses").contains(std::to_string(answer.status)))
          << path << " " << answer.status;
    }
  }
}

/// Holds a document to a schema: members and their names; enough of JSON Schema for ours.
void expect_fits(const json& value, json schema, const json& document, const std::string& where) {
  if (schema.contains("$ref"))
    schema = document.at(json::json_pointer(schema.at("$ref").get<std::string>().substr(1)));
  for (const auto& name : schema.value("required", json::array()))
    EXPECT_TRUE(value.contains(name)) << where << name;
  if (schema.contains("enum")) {
    EXPECT_THAT(schema.at("enum"), testing::Contains(value)) << where;
  }
  if (value.is_object() && schema.contains("properties")) {
    const json& properties = schema.at("properties");
    for (const auto& [name, member] : value.items()) {
      EXPECT_TRUE(properties.contains(name)) << where << name << " is not in the schema";
      if (properties.contains(name)) expect_fits(member, properties.at(name), document, where + name + "/");
    }
  }
  if (value.is_array() && schema.contains("items")) {
    for (const auto& item : value) expect_fits(item, schema.at("items"), document, where);
  }
}

TEST_F(Calls, DocumentsFitTheOpenApiDescription) {
  const auto volume = upload();
  const auto job = finished_job(volume);
  const auto document = json::parse(ask("GET /openapi.json").body);
  EXPECT_EQ(document, openapi_document(jobs_.engine().methods));
  for (const auto& route : routes()) {
    if (route.method != "GET" || route.answer.schema.empty()) continue;
    std::string path(route.pattern);
    if (const auto at = path.find("{id}"); at != std::string::npos)
      path.replace(at, 4, path.starts_with("/v1/volumes") ? volume : job);
    const auto answer = ask("GET " + path);
    EXPECT_EQ(answer.status, route.answer.status) << path;
    EXPECT_EQ(answer.field("content-type"), route.answer.media_type) << path;
    expect_fits(json::parse(answer.body),
                {{"$ref", "#/components/schemas/" + std::string(route.answer.schema)}}, document,
                path + ": ");
  }
}

}  // namespace
}  // namespace volsmooth
