#include "client/http.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <fstream>

#include "client/descriptor.h"
#include "tests/client/canned_server.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using testing::HasSubstr;
using testing::Not;

class Http : public testing::Test {
 protected:
  Expected<Response> send(const CannedServer& server, const Request& request, const std::string& token = "") {
    HttpClient http(*parse_server(server.url()), token, interruption_);
    return http.send(request);
  }

  const Interruption interruption_;
};

TEST_F(Http, GivesStatusTypeAndBodyOfAnyAnswer) {
  for (const int status : {200, 404, 503}) {
    const CannedServer server([&](const auto&) { return canned(status, "{}", "application/problem+json"); });
    const auto response = send(server, {.target = "/v1/jobs/7?wait=1"});
    ASSERT_TRUE(response);
    EXPECT_EQ(response->status, status);
    EXPECT_EQ(response->content_type, "application/problem+json");
    EXPECT_EQ(response->body, "{}");
    EXPECT_TRUE(server.saw("GET /v1/jobs/7?wait=1"));
  }
}

TEST_F(Http, SendsTheTokenOnlyWhenThereIsOne) {
  const CannedServer server([](const auto&) { return canned(200, "{}"); });
  ASSERT_TRUE(send(server, {.target = "/"}, "secret"));
  ASSERT_TRUE(send(server, {.target = "/"}));
  EXPECT_THAT(server.seen()[0].head, HasSubstr("Authorization: Bearer secret"));
  EXPECT_THAT(server.seen()[1].head, Not(HasSubstr("Authorization")));
}

TEST_F(Http, NeverFollowsARedirect) {
  const CannedServer server([](const auto&) {
    return CannedAnswer{
        "HTTP/1.1 302 -\r\nLocation: /elsewhere\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"};
  });
  EXPECT_EQ(send(server, {.target = "/"}, "secret")->status, 302);
  EXPECT_EQ(server.seen().size(), 1u);
}

TEST_F(Http, SendsADocument) {
  const CannedServer server([](const auto&) { return canned(202, "{}"); });
  ASSERT_TRUE(send(
      server, {.method = "POST", .target = "/v1/jobs", .content_type = "application/json", .body = "{1}"}));
  EXPECT_EQ(server.seen()[0].line, "POST /v1/jobs");
  EXPECT_EQ(server.seen()[0].body, "{1}");
  EXPECT_THAT(server.seen()[0].head, HasSubstr("Content-Type: application/json"));
}

TEST_F(Http, StreamsAFileOfKnownLength) {
  const ScratchFolder folder;
  const std::string content(3'000'000, 'x');
  const Descriptor file(open(folder.put("volume", content).c_str(), O_RDONLY));
  const CannedServer server([](const auto&) { return canned(201, "{}"); });
  std::int64_t told = 0;
  const FileBody body{file.get(), 3'000'000, [&](std::int64_t sent) { told = sent; }};
  ASSERT_TRUE(send(server, {.method = "POST", .target = "/v1/volumes", .file = &body}));
  EXPECT_THAT(server.seen()[0].head, HasSubstr("Content-Length: 3000000"));
  EXPECT_EQ(server.seen()[0].body, content);
  EXPECT_EQ(told, 3'000'000);
}

TEST_F(Http, TellsWhenAFileBecameShorter) {
  const ScratchFolder folder;
  const Descriptor file(open(folder.put("volume", "short").c_str(), O_RDONLY));
  const CannedServer server([](const auto&) { return canned(201, "{}"); });
  const FileBody body{file.get(), 100};
  const auto response = send(server, {.method = "POST", .target = "/v1/volumes", .file = &body});
  ASSERT_FALSE(response);
  EXPECT_EQ(response.error().code, ExitCode::kNoInput);
}

TEST_F(Http, GivesOnlyASuccessToTheSink) {
  std::string taken;
  const Request request{.target = "/", .sink = [&](std::string_view piece) {
                          taken += piece;
                          return Expected<void>{};
                        }};
  const CannedServer good([](const auto&) { return canned(200, "bytes"); });
  ASSERT_TRUE(send(good, request));
  EXPECT_EQ(taken, "bytes");
  const CannedServer bad([](const auto&) { return canned(404, "problem"); });
  EXPECT_EQ(send(bad, request)->body, "problem");
  EXPECT_EQ(taken, "bytes");
}

TEST_F(Http, EndsWithTheFailureOfTheSink) {
  const CannedServer server([](const auto&) { return canned(200, "bytes"); });
  const auto response = send(server, {.target = "/", .sink = [](std::string_view) -> Expected<void> {
                                        return fail(ExitCode::kCannotWrite, "Full.");
                                      }});
  ASSERT_FALSE(response);
  EXPECT_EQ(response.error().code, ExitCode::kCannotWrite);
}

class BrokenAnswer : public Http, public testing::WithParamInterface<const char*> {};

TEST_P(BrokenAnswer, IsUnreachable) {
  const CannedServer server([](const auto&) { return CannedAnswer{GetParam()}; });
  const auto response = send(server, {.target = "/"});
  ASSERT_FALSE(response);
  EXPECT_EQ(response.error().code, ExitCode::kUnreachable);
}

INSTANTIATE_TEST_SUITE_P(Bytes, BrokenAnswer,
                         testing::Values("", "SSH-2.0-OpenSSH\r\n",
                                         "HTTP/1.1 200 -\r\nContent-Length: 10\r\n\r\nhalf",
                                         "HTTP/1.1 200 -\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhalf"));

TEST_F(Http, TellsWhenNobodyListens) {
  std::string url;
  {
    url = CannedServer([](const auto&) { return canned(200, ""); }).url();
  }
  HttpClient http(*parse_server(url), "", interruption_);
  const auto response = http.send({.target = "/"});
  ASSERT_FALSE(response);
  EXPECT_EQ(response.error().code, ExitCode::kUnreachable);
  EXPECT_THAT(response.error().sentence, HasSubstr(url));
}

TEST_F(Http, SpeaksOverAUnixSocket) {
  const ScratchFolder folder;
  const CannedServer server([](const auto&) { return canned(200, "{}"); }, folder / "socket");
  HttpClient http(*parse_server("unix:" + (folder / "socket").string()), "", interruption_);
  EXPECT_EQ(http.send({.target = "/healthz"})->status, 200);
  EXPECT_THAT(server.seen()[0].head, HasSubstr("Host: localhost"));
}

TEST_F(Http, AnInterruptionEndsAWaitAndEveryLaterCall) {
  const CannedServer server([](const auto&) {
    kill(getpid(), SIGINT);
    return CannedAnswer{.bytes = "", .hold = true};
  });
  const auto response = send(server, {.target = "/"});
  ASSERT_FALSE(response);
  EXPECT_EQ(response.error().code, ExitCode::kInterrupted);
  EXPECT_FALSE(send(server, {.target = "/"}));
  EXPECT_EQ(server.seen().size(), 1u);
}

TEST_F(Http, WhatMustGoThroughIsNotInterrupted) {
  const CannedServer server([](const auto&) { return canned(202, "{}"); });
  kill(getpid(), SIGTERM);
  EXPECT_TRUE(send(server, {.method = "POST", .target = "/v1/jobs/7/cancel", .interruptible = false}));
}

std::string key_in(const SeenRequest& request) {
  const auto at = request.head.find("Idempotency-Key: ");
  return at == std::string::npos ? "" : request.head.substr(at, request.head.find('\r', at) - at);
}

TEST_F(Http, SendsAKeyedRequestAgainWhenItsAnswerIsLost) {
  std::atomic<int> count = 0;
  const CannedServer server([&](const auto&) { return ++count < 3 ? CannedAnswer{} : canned(201, "{}"); });
  const ScratchFolder folder;
  std::ofstream(folder / "file") << "..voxels";
  const Descriptor file(open((folder / "file").c_str(), O_RDONLY));
  lseek(file.get(), 2, SEEK_SET);
  const FileBody body{file.get(), 6};
  const auto response = send(
      server, {.method = "POST", .target = "/", .file = &body, .idempotency_key = new_idempotency_key()});
  ASSERT_TRUE(response);
  EXPECT_EQ(response->status, 201);
  ASSERT_EQ(server.seen().size(), 3U);
  for (const SeenRequest& request : server.seen()) {
    EXPECT_EQ(request.body, "voxels");
    EXPECT_EQ(key_in(request), key_in(server.seen()[0]));
    EXPECT_GT(key_in(request).size(), 30U);
  }
}

/// A server that syncs for longer than the client waits has made the job all the same.
TEST_F(Http, SendsAKeyedRequestAgainThatIsNotAnsweredInTime) {
  std::atomic<int> count = 0;
  const CannedServer server(
      [&](const auto&) { return ++count < 2 ? CannedAnswer{.bytes = "", .hold = true} : canned(202, "{}"); });
  const Request request{.method = "POST",
                        .target = "/",
                        .body = "{}",
                        .idempotency_key = "k",
                        .timeout = std::chrono::seconds(1)};
  EXPECT_EQ(send(server, request)->status, 202);
  EXPECT_EQ(server.seen().size(), 2U);
}

TEST_F(Http, WaitsForARequestOfItsOwnThatIsStillUnderWay) {
  std::atomic<int> count = 0;
  const CannedServer server([&](const auto&) {
    const int now = ++count;
    if (now == 1) return CannedAnswer{};
    return now == 2 ? canned(409, R"({"type": "/problems/idempotency-in-flight"})") : canned(202, "{}");
  });
  EXPECT_EQ(send(server, {.method = "POST", .target = "/", .body = "{}", .idempotency_key = "k"})->status,
            202);
}

TEST_F(Http, SendsNothingTwiceThatHasNoKeyOrWasAnswered) {
  const CannedServer silent([](const auto&) { return CannedAnswer{}; });
  EXPECT_FALSE(send(silent, {.method = "POST", .target = "/", .body = "{}"}));
  EXPECT_EQ(silent.seen().size(), 1U);
  const CannedServer refusing(
      [](const auto&) { return canned(409, R"({"type": "/problems/idempotency-in-flight"})"); });
  EXPECT_EQ(send(refusing, {.method = "POST", .target = "/", .body = "{}", .idempotency_key = "k"})->status,
            409);
  EXPECT_EQ(refusing.seen().size(), 1U);
}

}  // namespace
}  // namespace volsmooth
