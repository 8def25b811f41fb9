#pragma once

#include <algorithm>
#include <random>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {

/// One tenant's things, and another who tries to get at them.
class TwoTenants {
 public:
  /// The tokens may do everything, each in its tenant.
  TwoTenants(const Daemon& daemon, std::string owner, std::string stranger)
      : owner_(daemon.port(), std::move(owner)), stranger_(daemon.port(), std::move(stranger)) {
    for (int i = 0; i < 3; ++i) make_things();
    const json volume = owner_.document("POST", "/v1/volumes", ball_file(8)), job = submit(volume.at("id"));
    gone_ = {volume.at("id"), job.at("id")};
    owner_.document("GET", "/v1/jobs/" + gone_[1] + "?wait=60");
    owner_.call("DELETE", "/v1/jobs/" + gone_[1]);
    owner_.call("DELETE", "/v1/volumes/" + gone_[0]);
  }

  /// Calls by the stranger that name the owner's ids, living and gone, each beside the same call with an id
  /// that never was; returns in how many the two answers differ, or a list holds anything.
  int leaks(int tries, unsigned seed) {
    std::mt19937 random(seed);
    int found = 0;
    for (int i = 0; i < tries; ++i) found += leaks_once(random) ? 1 : 0;
    return found;
  }

  /// Whether the owner still has everything, as it was.
  bool is_untouched() {
    for (const auto& [target, document] : documents_)
      if (owner_.call("GET", target).body != document) return false;
    return true;
  }

 private:
  /// A kept connection with a token.
  struct Side {
    Side(int port, std::string given) : connection(port), token(std::move(given)) {}
    HttpResponse call(const std::string& method, const std::string& target, std::string_view body = {},
                      HeaderFields fields = {}) {
      fields["Authorization"] = "Bearer " + token;
      return connection.exchange(method, target, body, fields);
    }
    json document(const std::string& method, const std::string& target, std::string_view body = {},
                  const HeaderFields& fields = {}) {
      const HttpResponse response = call(method, target, body, fields);
      if (response.status >= 300) throw std::runtime_error(target + ": " + response.body);
      return response.document();
    }
    HttpConnection connection;
    std::string token;
  };

  json submit(const std::string& volume) {
    return owner_.document("POST", "/v1/jobs", order(volume), {{"Content-Type", "application/json"}});
  }
  static std::string order(const std::string& volume) {
    return json{{"volume", volume}, {"label", "secret"}}.dump();
  }

  void make_things() {
    const std::string volume = owner_.document("POST", "/v1/volumes", ball_file(8)).at("id");
    const std::string job = submit(volume).at("id");
    owner_.document("GET", "/v1/jobs/" + job + "?wait=60");
    things_.push_back({volume, job});
    for (const std::string& target : {"/v1/volumes/" + volume, "/v1/volumes/" + volume + "/content",
                                      "/v1/jobs/" + job, "/v1/jobs/" + job + "/results/report.json"})
      documents_[target] = owner_.call("GET", target).body;
  }

  bool leaks_once(std::mt19937& random) {
    const std::size_t which = random() % (things_.size() + 1);
    const auto& [volume, job] = which < things_.size() ? things_[which] : gone_;
    static const std::vector<std::pair<std::string, std::string>> calls = {
        {"GET", "/v1/volumes/V"},
        {"HEAD", "/v1/volumes/V"},
        {"GET", "/v1/volumes/V/content"},
        {"DELETE", "/v1/volumes/V"},
        {"GET", "/v1/jobs/J"},
        {"GET", "/v1/jobs/J?wait=1"},
        {"GET", "/v1/jobs/J/events"},
        {"POST", "/v1/jobs/J/cancel"},
        {"DELETE", "/v1/jobs/J"},
        {"GET", "/v1/jobs/J/results"},
        {"GET", "/v1/jobs/J/results/report.json"},
        {"GET", "/v1/jobs/J/delivery"},
        {"POST", "/v1/jobs/J/deliver"},
        {"POST", "/v1/jobs"},
        {"GET", "/v1/jobs?label=secret&limit=9"},
        {"GET", "/v1/volumes"}};
    const auto& [method, pattern] = calls[random() % calls.size()];
    const HttpResponse theirs = with(method, pattern, volume, job, random);
    if (pattern.find_first_of("VJ") == std::string::npos && method == "GET")
      return std::ranges::any_of(theirs.document(), [](const json& member) { return !member.empty(); });
    const HttpResponse none = with(method, pattern, "v-aaaaaaaaaaaaaaaa", "j-aaaaaaaaaaaaaaaa", random);
    return theirs.status != 404 || theirs.status != none.status || theirs.body != none.body ||
           theirs.header("etag") != none.header("etag") || theirs.headers.size() != none.headers.size();
  }

  HttpResponse with(const std::string& method, std::string target, const std::string& volume,
                    const std::string& job, std::mt19937& random) {
    if (const auto at = target.find('V'); at != target.npos) target.replace(at, 1, volume);
    if (const auto at = target.find('J'); at != target.npos) target.replace(at, 1, job);
    const bool is_order = method == "POST" && target == "/v1/jobs";
    HeaderFields fields;
    if (is_order) fields["Content-Type"] = "application/json";
    if (method == "GET" && random() % 2 == 0) fields["If-None-Match"] = "*";
    if (method == "DELETE" && random() % 2 == 0) fields["If-Match"] = "*";
    return stranger_.call(method, target, is_order ? order(volume) : "", fields);
  }

  Side owner_, stranger_;
  std::vector<std::array<std::string, 2>> things_;  ///< volume and job
  std::array<std::string, 2> gone_;
  std::map<std::string, std::string> documents_;
};

}  // namespace volsmooth::test
