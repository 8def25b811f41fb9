// What an operator does: configure, look, back up, restore.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <thread>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class OperatingTest : public testing::Test {
 protected:
  struct Outcome {
    int exit_code;
    std::string output, errors;
  };
  Outcome run(const std::vector<std::string>& options, const std::vector<std::string>& environment = {}) {
    std::vector<std::string> command{"/usr/bin/env"};
    command.insert(command.end(), environment.begin(), environment.end());
    command.emplace_back(VOLSMOOTHD);
    command.insert(command.end(), options.begin(), options.end());
    const fs::path output = folder_ / (std::to_string(++runs_) + ".out"), errors = output.string() + ".err";
    const int exit_code = ChildProcess(command, output, errors).wait();
    return {exit_code, content_of(output), content_of(errors)};
  }
  std::string file_with(const std::string& text) {
    const fs::path file = folder_ / (std::to_string(++runs_) + ".json");
    std::ofstream(file) << text;
    return file;
  }

  TemporaryDirectory folder_;
  int runs_ = 0;
};

TEST_F(OperatingTest, AMemberThatIsASlipOfThePenIsNamedWithWhatWasMeant) {
  for (const auto& [member, meant] : std::map<std::string, std::string>{
           {"lisen", "listen"}, {"keep_days", "keep-days"}, {"Workers", "workers"}, {"node", "nodes"}}) {
    const auto refused = run({"--data", folder_ / "data", "--config", file_with(json{{member, "1"}}.dump())});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.errors, HasSubstr("'" + member + "'; did you mean '" + meant + "'?"));
  }
  const auto strange = run({"--data", folder_ / "data", "--config", file_with(R"({"xylophone": 1})")});
  EXPECT_EQ(strange.exit_code, 2);
  EXPECT_THAT(strange.errors, Not(HasSubstr("did you mean")));
}

TEST_F(OperatingTest, PrintsTheConfigurationSoThatItCanBeUsedAsOne) {
  const json given{
      {"workers", 5},
      {"host-name", {"one", "two"}},
      {"nodes", {{"pacs", {{"dicomweb", "http://127.0.0.1:1/dicom-web"}, {"tenants", {"ward-a"}}}}}},
      {"presets", {{"head", {{"callers", {"CT1"}}, {"from", {"10.1.0.0/16"}}}}}}};
  const auto printed =
      run({"--data", "/d", "--config", file_with(given.dump()), "--memory", "2GB", "--print-config"},
          {"VOLSMOOTH_KEEP_DAYS=3"});
  ASSERT_EQ(printed.exit_code, 0) << printed.errors;
  const json in_force = json::parse(printed.output);
  EXPECT_EQ(in_force.at("workers"), 5);
  EXPECT_EQ(in_force.at("host-name"), json({"one", "two"}));
  EXPECT_EQ(in_force.at("keep-days"), 3);
  EXPECT_EQ(in_force.at("listen"), "127.0.0.1:8742");
  EXPECT_EQ(in_force.at("nodes"), given.at("nodes"));
  EXPECT_EQ(in_force.at("presets"), given.at("presets"));
  const auto again = run({"--config", file_with(printed.output), "--print-config"});
  ASSERT_EQ(again.exit_code, 0) << again.errors;
  EXPECT_EQ(json::parse(again.output), in_force);
}

TEST_F(OperatingTest, AnOptionComesBeforeAVariableAndThatBeforeTheFile) {
  const std::vector<std::string> options{"--data", "/d", "--print-config", "--config",
                                         file_with(R"({"workers": 3, "require-tokens": false, "queue": 7})")};
  const std::vector<std::string> environment{"VOLSMOOTH_WORKERS=4", "VOLSMOOTH_REQUIRE_TOKENS=true"};
  const json in_force = json::parse(run(options, environment).output);
  EXPECT_EQ(in_force.at("workers"), 4);
  EXPECT_EQ(in_force.at("require-tokens"), true);
  EXPECT_EQ(in_force.at("queue"), 7);
  std::vector<std::string> said = options;
  said.insert(said.end(), {"--workers", "5"});
  EXPECT_EQ(json::parse(run(said, environment).output).at("workers"), 5);
}

TEST_F(OperatingTest, AVariableMayNameAFileThatHoldsTheValue) {
  const std::string file = file_with("11\n");
  const auto read = run({"--data", "/d", "--print-config"}, {"VOLSMOOTH_WORKERS_FILE=" + file});
  EXPECT_EQ(json::parse(read.output).at("workers"), 11);
  const auto both =
      run({"--data", "/d", "--print-config"}, {"VOLSMOOTH_WORKERS=2", "VOLSMOOTH_WORKERS_FILE=" + file});
  EXPECT_EQ(json::parse(both.output).at("workers"), 2);
  const auto missing = run({"--data", "/d", "--print-config"}, {"VOLSMOOTH_WORKERS_FILE=/no/such/file"});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.errors, HasSubstr("VOLSMOOTH_WORKERS_FILE"));
}

TEST_F(OperatingTest, WhatIsWrongWithTlsOfDimseStopsTheStart) {
  const json presets{{"head", json::object()}};
  const json listening{{"dimse-listen", "127.0.0.1:0"},
                       {"dimse-tls-cert", "/nowhere"},
                       {"dimse-tls-key", "/nowhere"},
                       {"dimse-tls-ca", "/nowhere"},
                       {"presets", presets}};
  const auto without = [&](const char* member) {
    json rest = listening;
    rest.erase(member);
    return rest;
  };
  const json peer{{"host", "pacs"}, {"port", 104}, {"aet", "PACS"}, {"tls", {{"ca_file", "/nowhere"}}}};
  const std::vector<std::pair<json, std::string>> table{
      {without("dimse-listen"), "--dimse-tls-cert requires --dimse-listen"},
      {without("dimse-tls-key"), "--dimse-tls-cert requires --dimse-tls-key"},
      {without("dimse-tls-ca"), "--dimse-tls-cert requires --dimse-tls-ca"},
      {without("dimse-tls-cert"), "requires --dimse-tls-cert"},
      {listening, "--dimse-tls-ca cannot be used: it cannot be read"},
      {{{"nodes", {{"pacs", {{"dimse", peer}}}}}},
       "node 'pacs': 'ca_file' cannot be used: it cannot be read"}};
  for (const auto& [configured, expected] : table) {
    const auto refused = run(
        {"--listen", "127.0.0.1:0", "--data", folder_ / "data", "--config", file_with(configured.dump())});
    EXPECT_NE(refused.exit_code, 0);
    EXPECT_THAT(refused.errors, HasSubstr(expected));
  }
}

/// An unset variable of a compose file comes as an empty one.
TEST_F(OperatingTest, AnEmptyVariableIsNone) {
  const std::string file = file_with(R"({"require-tokens": true, "tls-cert": "/a", "keep-days": 3})");
  const auto read = run({"--data", "/d", "--print-config", "--config", file},
                        {"VOLSMOOTH_REQUIRE_TOKENS=", "VOLSMOOTH_TLS_CERT=", "VOLSMOOTH_KEEP_DAYS=",
                         "VOLSMOOTH_QUEUE=", "VOLSMOOTH_QUEUE_FILE=" + file_with("7\n")});
  const json in_force = json::parse(read.output);
  EXPECT_EQ(in_force.at("require-tokens"), true);
  EXPECT_EQ(in_force.at("tls-cert"), "/a");
  EXPECT_EQ(in_force.at("keep-days"), 3);
  EXPECT_EQ(in_force.at("queue"), 7);
}

TEST_F(OperatingTest, AMemberTwiceIsRefused) {
  for (const char* text : {R"({"keep-days": 3, "keep-days": 4})",
                           R"({"presets": {"p": {"from": ["10.1.0.0/16"], "from": ["0.0.0.0/0"]}}})"}) {
    const auto refused = run({"--data", "/d", "--print-config", "--config", file_with(text)});
    EXPECT_EQ(refused.exit_code, 2) << text;
    EXPECT_THAT(refused.errors, HasSubstr("configuration")) << text;
  }
}

/// A start removes what no row points to, and here nothing has one.
TEST_F(OperatingTest, AFolderThatIsNotTheDaemonsIsLeftAsItIs) {
  const fs::path folder = folder_ / "study";
  const std::vector<fs::path> files{folder / "volumes/a", folder / "results/j/b", folder / "arrivals/c",
                                    folder / "tmp/d"};
  for (const fs::path& file : files) {
    fs::remove_all(folder);
    fs::create_directories(file.parent_path());
    std::ofstream(file) << "precious";
    for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
             {"--listen", "127.0.0.1:0"}, {"token", "create", "--name", "a", "--scope", "read"}}) {
      std::vector<std::string> options = command;
      options.insert(options.end(), {"--data", folder});
      const auto refused = run(options);
      EXPECT_EQ(refused.exit_code, 1);
      EXPECT_THAT(refused.errors, HasSubstr("has no volsmooth.db but holds other things"));
    }
    EXPECT_EQ(content_of(file), "precious");
  }
}

TEST_F(OperatingTest, AFolderWhoseDatabaseIsLostKeepsItsVolumes) {
  Daemon daemon(VOLSMOOTHD);
  const std::string id = ServiceClient(daemon).upload(ball_file(16)).at("id");
  ASSERT_EQ(daemon.terminate(), 0);
  const fs::path database = daemon.data() / "volsmooth.db";
  fs::rename(database, folder_ / "aside");
  EXPECT_THROW(daemon.start(), std::runtime_error);
  EXPECT_TRUE(fs::exists(daemon.data() / "volumes" / id));
  fs::rename(folder_ / "aside", database);
  daemon.start();
  EXPECT_EQ(ServiceClient(daemon).call("GET", "/v1/volumes/" + id + "/content").status, 200);
}

TEST_F(OperatingTest, ATokenForANewFolderIsMadeAndListingOneIsNot) {
  const fs::path folder = folder_ / "new";
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"token", "list"}, {"token", "revoke", "--name", "a"}}) {
    std::vector<std::string> options = command;
    options.insert(options.end(), {"--data", folder});
    EXPECT_EQ(run(options).exit_code, 1);
    EXPECT_FALSE(fs::exists(folder));
  }
  const auto made = run({"token", "create", "--name", "a", "--scope", "read", "--data", folder});
  EXPECT_EQ(made.exit_code, 0);
  EXPECT_THAT(made.errors, HasSubstr("is new"));
}

TEST_F(OperatingTest, WhatCannotBePrintedIsAnError) {
  const fs::path folder = folder_ / "new", errors = folder_ / "errors";
  const auto onto_full_disk = [&](std::vector<std::string> command) {
    command.insert(command.begin(), VOLSMOOTHD);
    command.insert(command.end(), {"--data", folder});
    return ChildProcess(command, "/dev/full", errors).wait();
  };
  EXPECT_EQ(onto_full_disk({"token", "create", "--name", "lost", "--scope", "admin"}), 1);
  EXPECT_THAT(run({"token", "list", "--data", folder}).output, testing::ContainsRegex("lost.*revoked"));
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"token", "list"}, {"audit", "export"}, {"audit", "verify"}, {"--print-config"}})
    EXPECT_EQ(onto_full_disk(command), 1) << command.back();
}

TEST_F(OperatingTest, WithoutTheReaderOfDicomItDoesNotStart) {
  const auto refused =
      run({"--listen", "127.0.0.1:0", "--data", folder_ / "data", "--ingest", folder_ / "nothing"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.errors, HasSubstr((folder_ / "nothing").string()));
}

TEST_F(OperatingTest, WithoutTlsAHangUpStopsItInOrder) {
  Daemon daemon(VOLSMOOTHD);
  ::kill(daemon.pid(), SIGHUP);
  EXPECT_EQ(daemon.wait(), 0);
  EXPECT_THAT(daemon.log(), HasSubstr("SIGHUP"));
}

TEST_F(OperatingTest, UnderNohupItOutlivesItsTerminal) {
  ::signal(SIGHUP, SIG_IGN);  // as nohup leaves it to the program that it starts
  Daemon daemon(VOLSMOOTHD);
  ::signal(SIGHUP, SIG_DFL);
  ::kill(daemon.pid(), SIGHUP);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  EXPECT_TRUE(daemon.running());
  EXPECT_EQ(daemon.terminate(), 0);
}

TEST_F(OperatingTest, MetricsHaveTheTimeOfEveryStage) {
  Daemon daemon(VOLSMOOTHD);
  const ServiceClient service(daemon);
  service.run({{"volume", service.upload(ball_file(16)).at("id")}});
  const std::string metrics = service.call("GET", "/metrics").body;
  for (const std::string stage : {"verify", "read", "flow", "surfaces", "write"})
    EXPECT_THAT(metrics, HasSubstr("volsmooth_stage_seconds_count{stage=\"" + stage + "\"} 1")) << stage;
  EXPECT_THAT(metrics, HasSubstr("volsmooth_job_wait_seconds_count 1"));
}

class BackupTest : public OperatingTest {
 protected:
  Outcome back_up(const fs::path& to) { return run({"backup", "--data", daemon_.data(), "--to", to}); }

  /// A daemon on what `bring` puts where its data is.
  static void start_on(Daemon& daemon, const std::function<void(const fs::path& data)>& bring) {
    ASSERT_EQ(daemon.terminate(), 0);
    fs::remove_all(daemon.data());
    bring(daemon.data());
    daemon.start();
  }

  Daemon daemon_{VOLSMOOTHD};
};

TEST_F(BackupTest, WhatIsBackedUpBesideTheDaemonIsThereAfterARestore) {
  const ServiceClient service(daemon_);
  const std::string file = ball_file(16);
  const std::string volume = service.upload(file).at("id");
  const json job = service.run({{"volume", volume}});
  const fs::path backup = folder_ / "backup";
  const auto made = back_up(backup);
  ASSERT_EQ(made.exit_code, 0) << made.errors;
  EXPECT_EQ(service.run({{"volume", volume}}).at("state"), "succeeded");  // it goes on

  Daemon another(VOLSMOOTHD);
  start_on(another, [&](const fs::path& data) {
    const auto brought = run({"restore", "--from", backup, "--data", data});
    EXPECT_EQ(brought.exit_code, 0) << brought.errors;
    EXPECT_EQ(run({"audit", "verify", "--data", data}).exit_code, 0);
  });
  const ServiceClient there(another);
  EXPECT_EQ(there.call("GET", "/v1/volumes/" + volume + "/content").body, file);
  EXPECT_EQ(there.job(job.at("id")), job);
  for (const json& result : job.at("results"))
    EXPECT_EQ(there.fetch(job.at("id"), result.at("name")), service.fetch(job.at("id"), result.at("name")));
  EXPECT_EQ(there.get("/v1/jobs").at("jobs").size(), 1U);
}

TEST_F(BackupTest, TokensOfABackupDoNotComeBackUnlessThatIsAskedFor) {
  const auto token =
      run({"token", "create", "--name", "reader", "--scope", "read", "--data", daemon_.data()});
  ASSERT_EQ(token.exit_code, 0) << token.errors;
  const HeaderFields fields{{"Authorization", "Bearer " + token.output.substr(0, token.output.find('\n'))}};
  ASSERT_EQ(back_up(folder_ / "backup").exit_code, 0);
  ASSERT_EQ(run({"token", "revoke", "--name", "reader", "--data", daemon_.data()}).exit_code, 0);

  for (const bool keep : {false, true}) {
    std::vector<std::string> command{"restore", "--from", folder_ / "backup", "--data",
                                     folder_ / (keep ? "kept" : "data")};
    if (keep) command.emplace_back("--keep-tokens");
    const auto brought = run(command);
    ASSERT_EQ(brought.exit_code, 0) << brought.errors;
    EXPECT_EQ(brought.errors.find("1 tokens were revoked") != std::string::npos, !keep) << brought.errors;
    const Daemon another(VOLSMOOTHD, {}, command[4]);
    const ServiceClient there(another);
    EXPECT_EQ(there.call("GET", "/v1/jobs", "", fields).status, keep ? 200 : 401);
    EXPECT_EQ(there.call("GET", "/v1/jobs").status, 401);
    EXPECT_EQ(run({"audit", "verify", "--data", command[4]}).exit_code, 0);
    const std::string audit = run({"audit", "export", "--data", command[4]}).output;
    const std::string user = R"("token":"uid:)" + std::to_string(::geteuid());
    for (const std::string action : {"backup begun", "restored from a backup"})
      EXPECT_THAT(audit, testing::ContainsRegex("\"" + action + "\".*" + user)) << audit;
    EXPECT_EQ(audit.find("token revoked") != std::string::npos, !keep);
  }
}

TEST_F(BackupTest, ABackupWithoutTokensSaysWhomItLetsIn) {
  ASSERT_EQ(back_up(folder_ / "backup").exit_code, 0);
  const auto brought = run({"restore", "--from", folder_ / "backup", "--data", folder_ / "data"});
  EXPECT_EQ(brought.exit_code, 0);
  EXPECT_THAT(brought.errors, HasSubstr("--require-tokens"));
  EXPECT_EQ(run({"backup", "--data", folder_ / "nowhere", "--to", folder_ / "x"}).exit_code, 1);
  EXPECT_FALSE(fs::exists(folder_ / "nowhere"));
}

TEST_F(BackupTest, NeverOverwritesAndNamesWhatIsDamaged) {
  const ServiceClient service(daemon_);
  const std::string volume = service.upload(ball_file(16)).at("id");
  ASSERT_EQ(back_up(folder_ / "one").exit_code, 0);
  const auto again = back_up(folder_ / "one");
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.errors, HasSubstr("not empty"));

  std::fstream(daemon_.data() / "volumes" / volume, std::ios::in | std::ios::out).put('x');
  const auto damaged = back_up(folder_ / "two");
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_THAT(damaged.errors, HasSubstr(volume));
}

TEST_F(BackupTest, AFileThatIsLostIsNamedAndNothingIsTakenForDeleted) {
  const ServiceClient service(daemon_);
  const std::string lost = service.upload(ball_file(16)).at("id"),
                    kept = service.upload(ball_file(16)).at("id");
  fs::remove(daemon_.data() / "volumes" / lost);
  const auto made = back_up(folder_ / "backup");
  EXPECT_EQ(made.exit_code, 1);
  EXPECT_THAT(made.errors, HasSubstr(lost));

  fs::remove(folder_ / "backup" / "volumes" / kept);
  Daemon another(VOLSMOOTHD);
  start_on(another, [&](const fs::path& data) {
    const auto brought = run({"restore", "--from", folder_ / "backup", "--data", data});
    EXPECT_EQ(brought.exit_code, 1);
    EXPECT_THAT(brought.errors, HasSubstr(kept));
  });
  EXPECT_EQ(ServiceClient(another).call("GET", "/v1/volumes/" + kept).status, 200);
}

TEST_F(BackupTest, WhatIsDeletedMeanwhileIsLeftOutWhole) {
  const ServiceClient service(daemon_);
  const std::string file = ball_file(48), kept = service.upload(file).at("id");
  std::vector<std::string> volumes;
  for (int k = 0; k < 30; ++k) volumes.push_back(service.upload(file).at("id"));
  Daemon another(VOLSMOOTHD);
  start_on(another, [&](const fs::path& data) {
    std::jthread deleting([&] {
      for (const std::string& volume : volumes) service.call("DELETE", "/v1/volumes/" + volume);
    });
    const auto made = back_up(data);
    EXPECT_EQ(made.exit_code, 0) << made.errors;
  });
  const ServiceClient there(another);
  EXPECT_EQ(there.call("GET", "/v1/volumes/" + kept + "/content").body, file);
  for (const json& volume : there.get("/v1/volumes").at("volumes")) {
    const std::string id = volume.at("id");
    EXPECT_EQ(there.call("GET", "/v1/volumes/" + id + "/content").body, file);
  }
}

}  // namespace
}  // namespace volsmooth::test
