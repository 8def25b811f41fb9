#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/system/client_run.h"
#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"
#include "tests/system/tenants.h"

namespace volsmooth::test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;

/// A command of volsmoothd on a data folder, beside a daemon or without one.
struct Command {
  int exit_code;
  std::string output, error;

  static Command run(std::vector<std::string> arguments, const std::filesystem::path& data) {
    const TemporaryDirectory folder;
    arguments.insert(arguments.begin(), VOLSMOOTHD);
    arguments.insert(arguments.end(), {"--data", data.string()});
    const int code = ChildProcess(arguments, folder / "out", folder / "err").wait();
    return {code, content_of(folder / "out"), content_of(folder / "err")};
  }
};

std::string make_token(const std::filesystem::path& data, const std::string& name, const std::string& scope,
                       std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {"token", "create", "--name", name, "--scope", scope};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const Command made = Command::run(arguments, data);
  EXPECT_EQ(made.exit_code, 0) << made.error;
  return made.output.substr(0, made.output.find('\n'));
}

int status_with(const Daemon& daemon, const std::string& token, const std::string& target = "/v1/jobs") {
  return HttpConnection(daemon.port())
      .exchange("GET", target, {}, {{"Authorization", "Bearer " + token}})
      .status;
}

TEST(Tokens, AreMadeAndRevokedWhileTheDaemonRuns) {
  Daemon daemon(VOLSMOOTHD);
  EXPECT_EQ(ServiceClient(daemon).call("GET", "/v1/jobs").status, 200);
  const std::string reader = make_token(daemon.data(), "reader", "read");
  EXPECT_EQ(ServiceClient(daemon).call("GET", "/v1/jobs").status, 401);
  EXPECT_EQ(status_with(daemon, reader), 200);
  EXPECT_EQ(status_with(daemon, reader, "/metrics"), 403);

  ASSERT_EQ(Command::run({"token", "revoke", "--name", "reader"}, daemon.data()).exit_code, 0);
  EXPECT_EQ(status_with(daemon, reader), 401);
  const Command listed = Command::run({"token", "list"}, daemon.data());
  EXPECT_THAT(listed.output, testing::MatchesRegex("reader\tdefault\tread\trevoked 20.*Z\n"));
  EXPECT_EQ(Command::run({"token", "revoke", "--name", "nobody"}, daemon.data()).exit_code, 1);
}

TEST(Tokens, AreMadeAndRevokedWithoutADaemon) {
  Daemon daemon(VOLSMOOTHD);
  daemon.terminate();
  const std::string kept = make_token(daemon.data(), "kept", "read,submit", {"--tenant", "ward-a"});
  const std::string revoked = make_token(daemon.data(), "revoked", "admin");
  const std::string passing = make_token(daemon.data(), "passing", "admin", {"--expires", "1s"});
  ASSERT_EQ(Command::run({"token", "revoke", "--name", "revoked"}, daemon.data()).exit_code, 0);
  daemon.start();
  EXPECT_EQ(status_with(daemon, kept), 200);
  EXPECT_EQ(status_with(daemon, revoked), 401);
  EXPECT_TRUE(eventually([&] { return status_with(daemon, passing) == 401; }));
  EXPECT_EQ(ServiceClient(daemon).call("GET", "/healthz").status, 200);
}

/// Each row of the audit that names `object`: who did what.
std::vector<std::pair<std::string, std::string>> audited(const std::filesystem::path& data,
                                                         const std::string& object) {
  std::vector<std::pair<std::string, std::string>> rows;
  std::istringstream lines(Command::run({"audit", "export"}, data).output);
  for (std::string line; std::getline(lines, line);)
    if (const json row = json::parse(line); row.at("object") == object)
      rows.emplace_back(row.at("token"), row.at("action"));
  return rows;
}

/// Who probes with a valid token is whom an audit is for.
TEST(Tokens, WhatTheirScopeDoesNotAllowIsAuditedWithWhoAndWhat) {
  Daemon daemon(VOLSMOOTHD);
  const std::string sender = make_token(daemon.data(), "sender", "submit");
  const std::string volume = "v-aaaaaaaaaaaaaaaa";
  EXPECT_EQ(
      HttpConnection(daemon.port())
          .exchange("GET", "/v1/volumes/" + volume + "/content", {}, {{"Authorization", "Bearer " + sender}})
          .status,
      403);
  EXPECT_THAT(audited(daemon.data(), volume),
              testing::ElementsAre(testing::Pair("sender", "GET /v1/volumes/{id}/content")));
}

TEST(Tokens, AreAuditedAsTheDoingOfTheUserWhoGaveTheCommand) {
  const std::string user = "uid:" + std::to_string(::geteuid());
  Daemon daemon(VOLSMOOTHD);
  make_token(daemon.data(), "beside", "read");
  daemon.terminate();
  make_token(daemon.data(), "alone", "read");
  ASSERT_EQ(Command::run({"token", "revoke", "--name", "beside"}, daemon.data()).exit_code, 0);
  using testing::ElementsAre;
  using testing::Pair;
  EXPECT_THAT(audited(daemon.data(), "beside"),
              ElementsAre(Pair(user, "token created"), Pair(user, "token revoked")));
  EXPECT_THAT(audited(daemon.data(), "alone"), ElementsAre(Pair(user, "token created")));
  EXPECT_THAT(
      audited(daemon.data(), "audit"),
      ElementsAre(Pair(user, "audit exported"), Pair(user, "audit exported"), Pair(user, "audit exported")));
}

TEST(Tokens, AnswerToMistakes) {
  const TemporaryDirectory folder;
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"token", "create", "--scope", "read"},
        {"token", "create", "--name", "x", "--scope", "write"},
        {"token", "create", "--name", "a b", "--scope", "read"},
        {"token", "create", "--name", "x", "--scope", "read", "--expires", "soon"},
        {"token"},
        {"status"}}) {
    const Command run = Command::run(wrong, folder / "data");
    EXPECT_NE(run.exit_code, 0);
    EXPECT_FALSE(run.error.empty());
    EXPECT_TRUE(run.output.empty()) << run.output;
  }
  EXPECT_EQ(make_token(folder / "data", "x", "read").substr(0, 12), "volsmooth_x_");
}

TEST(Tokens, StatusIsTheDaemons) {
  Daemon daemon(VOLSMOOTHD);
  EXPECT_EQ(Command::run({"status"}, daemon.data()).output, "ready\n");
  daemon.kill();
  EXPECT_EQ(Command::run({"status"}, daemon.data()).exit_code, 1);
}

/// What the client needs: a token by file or environment; exit code 77 without.
TEST(Tokens, LetTheClientIn) {
  Daemon daemon(VOLSMOOTHD);
  const TemporaryDirectory folder;
  const std::string token = make_token(daemon.data(), "client", "read,submit");
  write_file(folder / "token", token + "\n");
  write_file(folder / "ball.nii", ball_file());
  ClientRun refused({"volumes", "--server", daemon.url()});
  EXPECT_EQ(refused.exit_code(), 77);
  EXPECT_THAT(refused.error(), HasSubstr("token"));
  ClientRun smooth({"smooth", (folder / "ball.nii").string(), "-o", (folder / "out").string(), "--server",
                    daemon.url(), "--token-file", (folder / "token").string()});
  EXPECT_EQ(smooth.exit_code(), 0) << smooth.error();
}

TEST(Tokens, AreNotSentToAnotherMachineInTheClear) {
  const TemporaryDirectory folder;
  write_file(folder / "token", "secret");
  const std::vector<std::string> asking{"volumes", "--server", "http://192.0.2.1:1", "--token-file",
                                        (folder / "token").string()};
  ClientRun refused(asking);
  EXPECT_EQ(refused.exit_code(), 77);
  EXPECT_THAT(refused.error(), HasSubstr("--plain-token"));
}

/// The long form is measure_tenants.
TEST(Tokens, LeaveNoWayToAnotherTenantsThings) {
  Daemon daemon(VOLSMOOTHD);
  const std::string owner = make_token(daemon.data(), "owner", "admin", {"--tenant", "ward-a"});
  const std::string stranger = make_token(daemon.data(), "stranger", "admin", {"--tenant", "ward-b"});
  TwoTenants tenants(daemon, owner, stranger);
  EXPECT_EQ(tenants.leaks(300, 1), 0);
  EXPECT_TRUE(tenants.is_untouched());
}

/// Nobody listens at either node: what is accepted waits.
TEST(Tokens, LeaveNoWayToAnotherTenantsNodes) {
  const TemporaryDirectory folder;
  const auto configure = [&](const std::string& tenant) {
    const json url = {{"dicomweb", "http://127.0.0.1:1"}};
    json theirs = url;
    theirs["tenants"] = {tenant};
    const json preset = {{"destination", "theirs"}, {"tenant", tenant}};
    write_file(
        folder / "configuration.json",
        json{{"nodes", {{"common", url}, {"theirs", theirs}}}, {"presets", {{"head", preset}}}}.dump());
  };
  configure("ward-a");
  Daemon daemon(VOLSMOOTHD, {"--config", (folder / "configuration.json").string()});
  const std::string owner = make_token(daemon.data(), "owner", "admin", {"--tenant", "ward-a"});
  const std::string stranger = make_token(daemon.data(), "stranger", "admin", {"--tenant", "ward-b"});
  const auto call = [&](const std::string& token, const std::string& method, const std::string& target,
                        const std::string& body = {}) {
    const char* const type = target == "/v1/jobs" ? "application/json" : "application/dicom";
    return HttpConnection(daemon.port())
        .exchange(method, target, body, {{"Authorization", "Bearer " + token}, {"Content-Type", type}});
  };
  const auto submit = [&](const std::string& token, const std::string& from, const std::string& to) {
    const json source = {{"dicomweb", from}, {"study", "1.2.3"}, {"series", "1.2.3.4"}};
    return call(token, "POST", "/v1/jobs",
                json{{"source", source}, {"destination", to}, {"outputs", {"dicom-series"}}}.dump());
  };
  for (const auto& [from, to] : {std::pair("theirs", "common"), {"common", "theirs"}}) {
    EXPECT_EQ(submit(owner, from, to).status, 202);
    const HttpResponse refused = submit(stranger, from, to);
    const auto or_none = [](std::string node) { return node == "theirs" ? "nobody" : node; };
    EXPECT_EQ(refused.status, 422);
    EXPECT_EQ(refused.body, submit(stranger, or_none(from), or_none(to)).body);
    EXPECT_THAT(refused.body, Not(HasSubstr("theirs")));
  }
  EXPECT_EQ(call(stranger, "POST", "/dicomweb/head/studies", "x").body,
            call(stranger, "POST", "/dicomweb/foot/studies", "x").body);
  EXPECT_EQ(call(owner, "POST", "/dicomweb/head/studies", "x").status, 422) << "no DICOM, but its preset";

  daemon.terminate();
  configure("ward-b");
  daemon.start();
  const auto failed = [&] { return call(owner, "GET", "/v1/jobs?state=failed").document().at("jobs"); };
  ASSERT_TRUE(eventually([&] { return failed().size() == 1; }));
  EXPECT_EQ(failed()[0].at("order").at("source").at("dicomweb"), "theirs");
  EXPECT_EQ(failed()[0].at("error").at("detail"),
            "The configuration has no node 'theirs' any more that can do this.");
  EXPECT_EQ(submit(owner, "theirs", "common").status, 422);
  EXPECT_EQ(submit(stranger, "theirs", "common").status, 202);
}

TEST(Tls, IsWhatTheClientAndTheDaemonSpeak) {
  const TemporaryDirectory folder;
  const std::string certificate = folder / "cert.pem", key = folder / "key.pem";
  const auto make = [&] {
    EXPECT_EQ(
        ChildProcess({"/usr/bin/openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                      "ec_paramgen_curve:P-256", "-nodes", "-days", "1", "-subj", "/CN=localhost", "-addext",
                      "subjectAltName=DNS:localhost,IP:127.0.0.1", "-keyout", key, "-out", certificate},
                     folder / "openssl.out", folder / "openssl.err")
            .wait(),
        0);
  };
  make();
  Daemon daemon(VOLSMOOTHD, {"--tls-cert", certificate, "--tls-key", key});
  EXPECT_THAT(daemon.url(), testing::StartsWith("https://"));
  write_file(folder / "ball.nii", ball_file());
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {
        "smooth",    (folder / "ball.nii").string(), "-o", (folder / "out").string(), "--force", "--server",
        daemon.url()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    ClientRun client(arguments);
    const int code = client.exit_code();
    return std::pair(code, client.error());
  };
  EXPECT_EQ(run({"--ca-file", certificate}).first, 0) << run({"--ca-file", certificate}).second;
  const auto [code, error] = run({});
  EXPECT_EQ(code, 69);
  EXPECT_THAT(error, HasSubstr("--ca-file"));
  EXPECT_EQ(HttpConnection(daemon.port()).exchange("GET", "/healthz").status, 400) << "in the clear";

  const std::string old = content_of(certificate);
  make();
  write_file(folder / "old.pem", old);
  ::kill(daemon.pid(), SIGHUP);
  EXPECT_TRUE(eventually([&] { return daemon.log().find("tls-reloaded") != std::string::npos; }));
  EXPECT_EQ(run({"--ca-file", (folder / "old.pem").string()}).first, 69);
  EXPECT_EQ(run({"--ca-file", certificate}).first, 0);
}

TEST(Tokens, AreInNoLogMetricOrAnswer) {
  Daemon daemon(VOLSMOOTHD);
  const std::string token = make_token(daemon.data(), "admin", "admin");
  const std::string secret = token.substr(token.rfind('_') + 1);
  for (const std::string& target : {std::string("/v1/jobs"), "/v1/jobs?access_token=" + token,
                                    "/v1/jobs/" + token, "/v1/volumes/" + secret, "/" + token})
    for (const std::string& sent : {token, "x" + token, token + "x"})
      EXPECT_THAT(HttpConnection(daemon.port())
                      .exchange("GET", target, {}, {{"Authorization", "Bearer " + sent}})
                      .body,
                  Not(HasSubstr(secret)));
  const HttpResponse metrics =
      HttpConnection(daemon.port()).exchange("GET", "/metrics", {}, {{"Authorization", "Bearer " + token}});
  EXPECT_EQ(metrics.status, 200);
  EXPECT_THAT(metrics.body, Not(HasSubstr(secret)));
  EXPECT_THAT(daemon.log(), Not(HasSubstr(secret)));
  EXPECT_THAT(Command::run({"token", "list"}, daemon.data()).output, Not(HasSubstr(secret)));
}

}  // namespace
}  // namespace volsmooth::test
