#include "service/http/idempotency.h"

#include <future>

#include "tests/service/http/running_server.h"

namespace volsmooth {
namespace {

class IdempotencyTest : public ServerTest {
 protected:
  static std::string key(const std::string& value) { return "Idempotency-Key: " + value + "\r\n"; }
  static std::string json_key(const std::string& value) {
    return "Content-Type: application/json\r\n" + key(value);
  }
  HttpAnswer upload_with(const std::string& value, const std::string& bytes = "voxels",
                         const std::string& query = "") {
    return ask("POST /v1/volumes" + query, bytes, key(value));
  }
  std::size_t volumes() { return jobs_.volumes(kAnyone)->volumes.size(); }
  std::size_t jobs() { return jobs_.jobs(kAnyone, {})->jobs.size(); }

  static std::string form(const std::string& bytes, const std::string& order) {
    return "--b\r\nContent-Disposition: form-data; name=\"volume\"; filename=\"x\"\r\n\r\n" + bytes +
           "\r\n--b\r\nContent-Disposition: form-data; name=\"job\"\r\n\r\n" + order + "\r\n--b--\r\n";
  }
  HttpAnswer submit_form(const std::string& value, const std::string& bytes, const std::string& order) {
    return ask("POST /v1/jobs", form(bytes, order),
               "Content-Type: multipart/form-data; boundary=b\r\n" + key(value));
  }
};

TEST_F(IdempotencyTest, TheSameUploadIsKeptOnceAndAnsweredAlike) {
  const auto first = upload_with("k1"), again = upload_with("k1");
  EXPECT_EQ(first.status, 201);
  EXPECT_EQ(again.status, 201);
  EXPECT_EQ(again.field("location"), first.field("location"));
  EXPECT_EQ(again.body, first.body);
  EXPECT_EQ(volumes(), 1U);
  EXPECT_NE(id_of(upload_with("k2")), id_of(first));
  EXPECT_EQ(volumes(), 2U);
}

TEST_F(IdempotencyTest, AnotherUploadWithTheKeyIsRefused) {
  EXPECT_EQ(upload_with("k").status, 201);
  EXPECT_EQ(slug(upload_with("k", "other voxels")), "idempotency-mismatch");
  EXPECT_EQ(upload_with("k", "voxels", "?volume_index=0").status, 422);
  EXPECT_EQ(volumes(), 1U);
}

TEST_F(IdempotencyTest, TheSameOrderIsOneJobHoweverItIsWritten) {
  const std::string volume = upload();
  const auto first = ask("POST /v1/jobs", R"({"volume": ")" + volume + R"(", "label": "x"})", json_key("k"));
  const auto again =
      ask("POST /v1/jobs", R"({"label":"x","isovalues":"auto","volume":")" + volume + "\"}", json_key("k"));
  EXPECT_EQ(first.status, 202);
  EXPECT_EQ(again.status, 202);
  EXPECT_EQ(again.field("location"), first.field("location"));
  EXPECT_EQ(id_of(again), id_of(first));
  EXPECT_EQ(slug(ask("POST /v1/jobs", R"({"volume": ")" + volume + R"(", "label": "y"})", json_key("k"))),
            "idempotency-mismatch");
  EXPECT_EQ(slug(upload_with("k")), "idempotency-mismatch");
  EXPECT_EQ(jobs(), 1U);
}

TEST_F(IdempotencyTest, TheSameFormIsOneVolumeAndOneJob) {
  const auto first = submit_form("k", "voxels", R"({"label": "x"})");
  EXPECT_EQ(first.status, 202);
  EXPECT_EQ(id_of(submit_form("k", "voxels", R"({ "label":"x" })")), id_of(first));
  EXPECT_EQ(slug(submit_form("k", "voxels!", R"({"label": "x"})")), "idempotency-mismatch");
  EXPECT_EQ(slug(submit_form("k", "voxels", R"({"label": "y"})")), "idempotency-mismatch");
  EXPECT_EQ(volumes(), 1U);
  EXPECT_EQ(jobs(), 1U);
}

TEST_F(IdempotencyTest, WhatARefusedRequestDidNotMakeCanBeMadeWithItsKey) {
  EXPECT_EQ(upload_with("k", "bad voxels").status, 422);
  EXPECT_EQ(upload_with("k", "voxels").status, 201);
}

TEST_F(IdempotencyTest, WhatWasDeletedSinceIsGone) {
  const auto first = upload_with("k");
  ask("DELETE " + first.field("location"));
  EXPECT_EQ(slug(upload_with("k")), "gone");
}

TEST_F(IdempotencyTest, AKeyMustBeThereOnceAndOfSomeLength) {
  for (const std::string& bad :
       std::vector<std::string>{"", std::string(256, 'k'), "a\r\nIdempotency-Key: a"}) {
    const auto answer = upload_with(bad);
    EXPECT_EQ(answer.status, 400) << bad;
    EXPECT_EQ(slug(answer), "bad-header");
  }
  EXPECT_EQ(upload_with(std::string(255, 'k')).status, 201);
  EXPECT_EQ(volumes(), 1U);
  EXPECT_EQ(ask("GET /v1/volumes", "", key("")).status, 200);  // no route that has keys
}

TEST_F(IdempotencyTest, WhileTheFirstIsUnderWayTheSameIsRefused) {
  HttpClient slow = connect();
  slow.send(request("POST /v1/volumes", "", key("k") + "Expect: 100-continue\r\nContent-Length: 6\r\n"));
  ASSERT_EQ(slow.receive().status, 100);
  const auto meanwhile = upload_with("k");
  EXPECT_EQ(meanwhile.status, 409);
  EXPECT_EQ(slug(meanwhile), "idempotency-in-flight");
  EXPECT_EQ(upload_with("k2").status, 201);
  slow.send("voxels");
  const auto first = slow.receive();
  EXPECT_EQ(first.status, 201);
  EXPECT_EQ(id_of(upload_with("k")), id_of(first));
}

TEST_F(IdempotencyTest, ABrokenUploadLetsItsKeyGo) {
  {
    HttpClient broken = connect();
    broken.send(request("POST /v1/volumes", "", key("k") + "Expect: 100-continue\r\nContent-Length: 6\r\n"));
    ASSERT_EQ(broken.receive().status, 100);
    broken.send("vox");
  }
  HttpAnswer answer;
  for (int tries = 0; tries < 500 && answer.status != 201; ++tries) {
    answer = upload_with("k");
    if (answer.status == 409) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(answer.status, 201);
}

TEST_F(IdempotencyTest, OfManyAtTheSameTimeOneMakesIt) {
  const std::string volume = upload();
  std::vector<std::future<HttpAnswer>> answers;
  for (int client = 0; client < 16; ++client)
    answers.push_back(std::async(std::launch::async, [&] {
      return ask("POST /v1/jobs", R"({"volume": ")" + volume + "\"}", json_key("k"));
    }));
  for (auto& answer : answers) {
    const auto got = answer.get();
    EXPECT_TRUE(got.status == 202 || slug(got) == "idempotency-in-flight") << got.status;
  }
  EXPECT_EQ(jobs(), 1U);
}

}  // namespace
}  // namespace volsmooth
