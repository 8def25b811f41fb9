#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/daemon.h"
#include "tests/system/http_connection.h"

namespace volsmooth::test {

using nlohmann::json;

/// What the daemon answered was not what a test that relies on it can go on with.
inline HttpResponse expect_status(HttpResponse response, int status) {
  if (response.status == status) return response;
  throw std::runtime_error("status " + std::to_string(response.status) + " instead of " +
                           std::to_string(status) + ": " + response.body);
}

/// The calls of the REST contract, each on a connection of its own; an answer that is not the good one
/// throws.
class ServiceClient {
 public:
  explicit ServiceClient(const Daemon& daemon) : port_(daemon.port()) {}

  HttpResponse call(const std::string& method, const std::string& target, std::string_view body = {},
                    const HeaderFields& headers = {}) const {
    return HttpConnection(port_).exchange(method, target, body, headers);
  }

  json get(const std::string& target) const { return expect_status(call("GET", target), 200).document(); }

  /// All jobs, or volumes: page by page.
  std::vector<json> all(const std::string& what, int per_page = 200) const {
    std::vector<json> all;
    std::string cursor;
    do {
      const json page = get("/v1/" + what + "?limit=" + std::to_string(per_page) + cursor);
      for (const json& item : page.at(what)) all.push_back(item);
      const json& next = page.at("next_cursor");
      cursor = next.is_null() ? "" : "&cursor=" + next.get<std::string>();
    } while (!cursor.empty());
    return all;
  }

  json upload(std::string_view file, const std::string& query = {}) const {
    return expect_status(call("POST", "/v1/volumes" + query, file), 201).document();
  }

  HttpResponse try_submit(const json& order) const {
    return call("POST", "/v1/jobs", order.dump(), {{"Content-Type", "application/json"}});
  }

  std::string submit(const json& order) const {
    return expect_status(try_submit(order), 202).document().at("id");
  }

  json job(const std::string& id) const { return get("/v1/jobs/" + id); }

  /// The job once it is final.
  json wait(const std::string& id) const {
    for (int minute = 0; minute < 5; ++minute) {
      json document = get("/v1/jobs/" + id + "?wait=60");
      if (is_final(document)) return document;
    }
    throw std::runtime_error("the job does not end");
  }

  /// Runs a job that must succeed.
  json run(const json& order) const {
    json done = wait(submit(order));
    if (done.at("state") != "succeeded") throw std::runtime_error("the job ended as " + done.dump());
    return done;
  }

  std::string fetch(const std::string& id, const std::string& name) const {
    return expect_status(call("GET", "/v1/jobs/" + id + "/results/" + name), 200).body;
  }

  static bool is_final(const json& job) {
    return job.at("state") != "queued" && job.at("state") != "running";
  }

 private:
  int port_;
};

}  // namespace volsmooth::test
