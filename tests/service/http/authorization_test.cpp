#include "service/jobs/tokens.h"
#include "tests/service/http/running_server.h"

namespace volsmooth {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

/// What each call needs, written by hand: whoever adds a route says here who may call it.
const std::map<std::string, std::string> kScopes = {
    {"get /healthz", ""},
    {"get /readyz", ""},
    {"get /metrics", "admin"},
    {"get /openapi.json", "read"},
    {"get /v1/methods", "read"},
    {"get /v1/formats", "read"},
    {"get /v1/volumes", "read"},
    {"get /v1/volumes/{id}", "read"},
    {"get /v1/volumes/{id}/content", "read"},
    {"get /v1/jobs", "read"},
    {"get /v1/jobs/{id}", "read"},
    {"get /v1/jobs/{id}/events", "read"},
    {"get /v1/jobs/{id}/results", "read"},
    {"get /v1/jobs/{id}/results/{name}", "read"},
    {"get /v1/jobs/{id}/delivery", "read"},
    {"post /v1/volumes", "submit"},
    {"post /v1/jobs", "submit"},
    {"post /v1/jobs/{id}/cancel", "submit"},
    {"post /v1/jobs/{id}/deliver", "submit"},
    {"post /dicomweb/{preset}/studies", "submit"},
    {"delete /v1/volumes/{id}", "submit"},
    {"delete /v1/jobs/{id}", "submit"},
};

class Authorization : public ServerTest {
 protected:
  std::string make(const std::string& name, std::vector<Scope> scopes,
                   const std::string& tenant = kDefaultTenant, std::optional<Time> expires = {}) {
    Token token;
    token.name = name;
    token.scopes = std::move(scopes);
    token.tenant = tenant;
    token.expires_at = expires;
    return jobs_.tokens().create(token).value();
  }

  static std::string bearer(const std::string& token) {
    return token.empty() ? "" : "Authorization: Bearer " + token + "\r\n";
  }
  HttpAnswer get(const std::string& target, const std::string& fields) {
    return ask("GET " + target, "", fields);
  }

  /// A volume and a finished job of it, of the tenant of `admin`.
  struct Things {
    std::string volume, job;
  };
  Things make_things(const std::string& admin) {
    Things made;
    made.volume = id_of(ask("POST /v1/volumes", "voxels", bearer(admin)));
    made.job = id_of(ask("POST /v1/jobs", json{{"volume", made.volume}}.dump(),
                         bearer(admin) + "Content-Type: application/json\r\n"));
    EXPECT_EQ(get("/v1/jobs/" + made.job + "?wait=60", bearer(admin)).status, 200);
    return made;
  }

  /// The call of an operation of the OpenAPI document on these.
  HttpAnswer call(std::string method, std::string path, const Things& things, const std::string& token) {
    const auto put = [&](const std::string& placeholder, const std::string& value) {
      if (const auto at = path.find(placeholder); at != path.npos)
        path.replace(at, placeholder.size(), value);
    };
    const bool is_job = path.starts_with("/v1/jobs");
    const bool is_order = method == "post" && path == "/v1/jobs";
    const bool is_file = method == "post" && (path == "/v1/volumes" || path.starts_with("/dicomweb"));
    put("{id}", is_job ? things.job : things.volume);
    put("{name}", "report.json");
    put("{preset}", "head");
    std::ranges::transform(method, method.begin(), [](char c) { return static_cast<char>(std::toupper(c)); });
    return ask(method + " " + path,
               is_order  ? json{{"volume", things.volume}}.dump()
               : is_file ? "voxels"
                         : "",
               bearer(token) + (is_order ? "Content-Type: application/json\r\n" : ""));
  }
};

TEST_F(Authorization, EveryRouteByEveryKindOfToken) {
  const std::string admin = make("admin", {Scope::kAdmin});
  const std::string other = make("other", {Scope::kAdmin}, "elsewhere");
  const auto expires = now_in_milliseconds() + 50ms;
  const std::map<std::string, std::string> invalid = {
      {"none", ""},
      {"bad", "volsmooth_admin_aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"},
      {"expired", make("expired", {Scope::kAdmin}, kDefaultTenant, expires)},
      {"revoked", make("revoked", {Scope::kAdmin})}};
  ASSERT_TRUE(jobs_.tokens().revoke("revoked"));
  std::this_thread::sleep_until(expires);
  const std::map<std::string, std::string> of_scope = {
      {"read", make("read", {Scope::kRead})}, {"submit", make("submit", {Scope::kSubmit})}, {"admin", admin}};

  const json document = json::parse(get("/openapi.json", bearer(admin)).body);
  ASSERT_EQ(document.at("/components/securitySchemes/token/scheme"_json_pointer), "bearer");
  std::size_t operations = 0;
  Things things = make_things(admin);
  for (const auto& [path, methods] : document.at("paths").items())
    for (const auto& [method, operation] : methods.items()) {
      const std::string name = method + " " + path;
      SCOPED_TRACE(name);
      ++operations;
      ASSERT_TRUE(kScopes.contains(name)) << "a route without a row";
      const std::string needed = kScopes.at(name);
      EXPECT_EQ(operation.at("security"),
                needed.empty() ? json::array() : json::array({json{{"token", json::array({needed})}}}));

      for (const auto& [kind, token] : invalid) {
        const HttpAnswer answer = call(method, path, things, token);
        EXPECT_EQ(answer.status, needed.empty() ? 200 : 401) << kind;
        EXPECT_EQ(slug(answer), needed.empty() ? "" : "unauthenticated") << kind;
        EXPECT_EQ(answer.field("www-authenticate").empty(), needed.empty()) << kind;
      }
      for (const auto& [scope, token] : of_scope) {
        const HttpAnswer answer = call(method, path, things, token);
        if (needed.empty() || scope == needed || scope == "admin") {
          const bool no_preset = path.starts_with("/dicomweb");
          EXPECT_TRUE(no_preset ? slug(answer) == "not-found" : answer.status < 300)
              << scope << " " << answer.status;
        } else {
          EXPECT_EQ(answer.status, 403) << scope;
          EXPECT_EQ(slug(answer), "insufficient-scope") << scope;
          EXPECT_THAT(answer.field("www-authenticate"), testing::HasSubstr("scope=\"" + needed + "\""));
        }
        if (method == "delete") things = make_things(admin);
      }
      const HttpAnswer answer = call(method, path, things, other);
      if (path.find("{id}") != std::string::npos || name == "post /v1/jobs") {
        const HttpAnswer unknown = call(method, path, {"v-aaaaaaaaaaaaaaaa", "j-aaaaaaaaaaaaaaaa"}, other);
        EXPECT_EQ(answer.status, 404);
        EXPECT_EQ(answer.body, unknown.body);
      }
      if (method == "get" && (path == "/v1/volumes" || path == "/v1/jobs")) {
        const json listed = json::parse(answer.body);
        EXPECT_TRUE(listed.at(path.substr(4)).empty()) << answer.body;
      }
    }
  EXPECT_EQ(operations, kScopes.size());
}

TEST_F(Authorization, WhoMayOnlySubmitIsToldAJobsIdAndStateAlone) {
  const std::string submit = make("submit", {Scope::kSubmit}), admin = make("admin", {Scope::kAdmin});
  const Things things = make_things(admin);
  const std::string order = json{{"volume", things.volume}, {"label", "a name"}}.dump();
  const std::string fields = "Content-Type: application/json\r\nIdempotency-Key: k\r\n";
  const HttpAnswer first = ask("POST /v1/jobs", order, bearer(submit) + fields);
  ASSERT_EQ(first.status, 202);
  const std::string id = id_of(first);
  get("/v1/jobs/" + id + "?wait=60", bearer(admin));
  for (const HttpAnswer& answer : {first, ask("POST /v1/jobs", order, bearer(submit) + fields),
                                   ask("POST /v1/jobs/" + id + "/cancel", "", bearer(submit)),
                                   ask("POST /v1/jobs/" + id + "/deliver", "", bearer(submit))}) {
    EXPECT_EQ(answer.status, 202);
    json document = json::parse(answer.body);
    EXPECT_TRUE(document.erase("id") == 1 && document.erase("state") == 1 && document.empty()) << answer.body;
  }
  EXPECT_EQ(json::parse(ask("POST /v1/jobs/" + id + "/cancel", "", bearer(admin)).body).at("label"),
            "a name");
}

TEST_F(Authorization, IsTheOneFieldOfTheHead) {
  const std::string token = make("read", {Scope::kRead});
  for (const std::string& good : {"Bearer " + token, "bearer   " + token, "BEARER " + token})
    EXPECT_EQ(get("/v1/jobs", "Authorization: " + good + "\r\n").status, 200) << good;
  for (const std::string& bad : {token + "", "Basic " + token, std::string("Bearer"), std::string("Bearer "),
                                 "Bearer x" + token, "Bearer " + token + " x", "Bearer\t" + token})
    EXPECT_EQ(get("/v1/jobs", "Authorization: " + bad + "\r\n").status, 401) << bad;
  EXPECT_EQ(get("/v1/jobs", bearer(token) + bearer(token)).status, 401);
  for (const char* name : {"access_token", "token"})
    EXPECT_EQ(get("/v1/jobs?" + std::string(name) + "=" + token, "").status, 401);
}

TEST_F(Authorization, IsLookedAtBeforeTheBodyIsAskedFor) {
  const std::string read = make("read", {Scope::kRead});
  for (const auto& [token, status] : {std::pair<std::string, int>{"", 401}, {read, 403}}) {
    const HttpAnswer answer =
        connect().exchange("POST /v1/volumes HTTP/1.1\r\nHost: localhost\r\n" + bearer(token) +
                           "Expect: 100-continue\r\nContent-Length: 1000000\r\n\r\n");
    EXPECT_EQ(answer.status, status);
    EXPECT_EQ(answer.field("connection"), "close");
  }
}

TEST_F(Authorization, OfATrailerIsNone) {
  const std::string token = make("submit", {Scope::kSubmit});
  EXPECT_EQ(connect()
                .exchange("POST /v1/volumes HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n"
                          "6\r\nvoxels\r\n0\r\n" +
                          bearer(token) + "\r\n")
                .status,
            401);
}

TEST_F(Authorization, ARevokedTokensStreamAndLongPollEndWithinASecond) {
  const std::string admin = make("admin", {Scope::kAdmin});
  const std::string read = make("read", {Scope::kRead});
  const std::string volume = id_of(ask("POST /v1/volumes", "voxels", bearer(admin)));
  const std::string job = id_of(ask("POST /v1/jobs", json{{"volume", volume}, {"label", "gate"}}.dump(),
                                    bearer(admin) + "Content-Type: application/json\r\n"));
  auto stream = connect(), poll = connect();
  stream.send(request("GET /v1/jobs/" + job + "/events", "", bearer(read)));
  stream.receive_until("event: state");
  poll.send(request("GET /v1/jobs/" + job + "?wait=300", "", bearer(read)));
  std::this_thread::sleep_for(50ms);
  const auto revoked = std::chrono::steady_clock::now();
  ASSERT_TRUE(jobs_.tokens().revoke("read"));
  EXPECT_EQ(poll.receive().status, 401);
  stream.receive_until("\r\n0\r\n\r\n");
  EXPECT_LT(std::chrono::steady_clock::now() - revoked, 1s);
}

TEST_F(Authorization, AnUploadWhoseTokenIsRevokedOnTheWayIsNotKept) {
  const std::string submit = make("submit", {Scope::kSubmit});
  auto client = connect();
  client.send("POST /v1/volumes HTTP/1.1\r\nHost: localhost\r\n" + bearer(submit) +
              "Content-Length: 6\r\n\r\nvox");
  std::this_thread::sleep_for(50ms);
  ASSERT_TRUE(jobs_.tokens().revoke("submit"));
  client.send("els");
  EXPECT_EQ(client.receive().status, 401);
  EXPECT_TRUE(jobs_.volumes(kAnyone)->volumes.empty());
}

/// The peer neither sends nor reads: the deadlines are half a minute away.
TEST_F(Authorization, ARevocationEndsTransfersAtOnce) {
  const std::string submit = make("submit", {Scope::kSubmit}), read = make("read", {Scope::kRead});
  const std::size_t size = 4'000'000;
  const std::string volume = id_of(ask("POST /v1/volumes", std::string(size, 'v'), bearer(submit)));
  auto upload = connect(), download = connect();
  upload.send("POST /v1/volumes HTTP/1.1\r\nHost: localhost\r\n" + bearer(submit) +
              "Content-Length: 1000\r\n\r\nvox");
  download.send(request("GET /v1/volumes/" + volume + "/content", "",
                        bearer(read) + "Range: bytes=0-,1-,2-,3-,4-,5-,6-,7-\r\n"));
  download.receive_until("\r\n\r\n");
  std::this_thread::sleep_for(100ms);
  const auto revoked = std::chrono::steady_clock::now();
  for (const char* name : {"submit", "read"}) ASSERT_TRUE(jobs_.tokens().revoke(name));
  EXPECT_EQ(upload.receive().status, 401);
  EXPECT_LT(download.receive_to_end().size(), size / 2) << "what waits to be sent was sent after all";
  EXPECT_LT(std::chrono::steady_clock::now() - revoked, 1s);
}

/// The peer has much to read and does not; what it has not got yet it never gets.
TEST_F(Authorization, ARevocationBreaksOffEventsOnTheirWay) {
  const std::string submit = make("submit", {Scope::kSubmit}), read = make("read", {Scope::kRead});
  const std::string volume = id_of(ask("POST /v1/volumes", "voxels", bearer(submit)));
  const std::string job =
      id_of(ask("POST /v1/jobs", json{{"volume", volume}, {"label", "much to tell"}}.dump(),
                bearer(submit) + "Content-Type: application/json\r\n"));
  while (engine_.at_gate == 0) std::this_thread::sleep_for(1ms);
  auto stream = connect();
  stream.send(request("GET /v1/jobs/" + job + "/events", "", bearer(read)));
  stream.receive_until("event: progress");
  std::this_thread::sleep_for(100ms);
  const auto revoked = std::chrono::steady_clock::now();
  ASSERT_TRUE(jobs_.tokens().revoke("read"));
  EXPECT_LT(stream.receive_to_end().size(), 2'600'000) << "of 5.2 MB";
  EXPECT_LT(std::chrono::steady_clock::now() - revoked, 1s);
}

TEST_F(Authorization, TheFirstTokenClosesTheDoor) {
  EXPECT_EQ(get("/v1/jobs", "").status, 200);
  const std::string token = make("read", {Scope::kRead});
  EXPECT_EQ(get("/v1/jobs", "").status, 401);
  EXPECT_EQ(get("/v1/jobs", bearer(token)).status, 200);
}

}  // namespace
}  // namespace volsmooth
