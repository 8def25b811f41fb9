#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "service/http/metrics.h"
#include "service/http/server.h"
#include "tests/service/jobs/service_fixture.h"
#include "tests/support/http_client.h"

namespace volsmooth {

/// A server on a port of its own, with real jobs and an engine that does what the test wants.
class ServerTest : public testing::Test {
 protected:
  ServerTest() { start({.listen = "127.0.0.1:0"}); }

  /// Starts it anew.
  void start(ServerSettings settings) {
    server_.reset();
    settings.max_upload_bytes = jobs_settings_.max_upload_bytes;
    server_.emplace(settings, Api{jobs_, metrics_});
  }

  HttpClient connect() { return HttpClient(server_->address()); }

  /// A request with a body, or none.
  static std::string request(const std::string& line, const std::string& body = "",
                             const std::string& fields = "") {
    const std::string length = body.empty() ? "" : "Content-Length: " + std::to_string(body.size()) + "\r\n";
    return line + " HTTP/1.1\r\nHost: localhost\r\n" + fields + length + "\r\n" + body;
  }
  HttpAnswer ask(const std::string& line, const std::string& body = "", const std::string& fields = "") {
    return connect().exchange(request(line, body, fields), line.starts_with("HEAD"));
  }

  static std::string slug(const HttpAnswer& answer) {
    if (answer.field("content-type") != "application/problem+json") return {};
    const auto type = nlohmann::json::parse(answer.body).at("type").get<std::string>();
    return type.substr(type.rfind('/') + 1);
  }
  static std::string id_of(const HttpAnswer& answer) { return nlohmann::json::parse(answer.body).at("id"); }

  std::string upload(const std::string& bytes = "voxels") { return id_of(ask("POST /v1/volumes", bytes)); }

  /// Submits a job whose label tells the engine what to do.
  HttpAnswer submit(const std::string& volume, const std::string& label = "") {
    const nlohmann::json order = {{"volume", volume}, {"label", label}};
    return ask("POST /v1/jobs", order.dump(), "Content-Type: application/json\r\n");
  }
  std::string finished_job(const std::string& volume) {
    const auto id = id_of(submit(volume));
    EXPECT_EQ(nlohmann::json::parse(ask("GET /v1/jobs/" + id + "?wait=60").body).at("state"), "succeeded");
    return id;
  }

  ScratchFolder directory_;
  FakeEngine engine_;
  Metrics metrics_;
  JobServiceSettings jobs_settings_{
      .data_dir = directory_.path(), .workers = 1, .threads = 1, .max_upload_bytes = std::int64_t{4} << 20};
  JobService jobs_{jobs_settings_, engine_.engine()};
  std::optional<Server> server_;

  void SetUp() override { jobs_.start(); }
  void TearDown() override {
    engine_.open_gate();
    server_.reset();
  }
};

}  // namespace volsmooth
