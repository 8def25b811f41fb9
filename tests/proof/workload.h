#pragma once

#include <array>
#include <atomic>
#include <cstdio>
#include <functional>
#include <mutex>
#include <set>
#include <thread>

#include "tests/proof/store_check.h"
#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {

/// Small jobs from several clients that repeat every request with its Idempotency-Key until it is answered,
/// so that each wanted volume and job must be there exactly once, however often the daemon ends meanwhile.
/// Every third is deleted again.
class Workload {
 public:
  explicit Workload(const Daemon& daemon) : port_(daemon.port()) {
    for (int variant = 0; variant < kVariants; ++variant) learn(daemon, variant);
  }

  /// Does `jobs` of them by four clients while `disturb` is called over and over, until they are done.
  void run(int jobs, const std::function<void()>& disturb) {
    std::atomic<int> next = 0, busy = kClients;
    std::vector<std::jthread> clients;
    for (int client = 0; client < kClients; ++client)
      clients.emplace_back([&] {
        for (int number; (number = next++) < jobs; ++done_) order(number);
        --busy;
      });
    while (busy > 0) disturb();
  }

  int done() const { return done_; }
  /// Where the daemon listens since its last start.
  void moved(const Daemon& daemon) { port_ = daemon.port(); }
  /// The daemon is down for good: the clients give up.
  void give_up(const std::string& why) {
    find(why);
    given_up_ = true;
  }

  /// What is wrong with the daemon's answers after all, and with its files; it is stopped for these.
  std::vector<std::string> findings(Daemon& daemon) {
    if (given_up_) return findings_;
    {
      const ServiceClient service(daemon);
      std::map<std::string, std::string> ids = jobs_by_label(service);
      for (const auto& [number, made] : made_) look_at(service, number, made, ids);
      for (const auto& [label, id] : ids) find("job " + id + ", label " + label + ": nobody knows of it");
      std::set<std::string> volumes;
      for (const json& volume : service.all("volumes")) volumes.insert(volume.at("id"));
      for (const auto& [number, made] : made_)
        if (!made.deleted && volumes.erase(made.volume) == 0) find("volume " + made.volume + " is lost");
      if (volumes.size() != reference_volumes_) find("volumes that nobody knows of");
    }
    if (daemon.terminate() != 0) find("the stop failed");
    daemon.start();  // sweeps what the last end left behind
    if (daemon.terminate() != 0) find("the stop failed");
    for (const std::string& fault : faults_of_store(daemon.data())) find(fault);
    if (daemon.log().find("audit was shortened") != std::string::npos)
      find("the audit is not what was sealed");
    return findings_;
  }

 private:
  static constexpr int kVariants = 4, kClients = 4;

  struct Made {
    std::string volume, job;
    bool deleted = false;
  };

  static Bytes file_of(int variant) { return gzip(ball_file(12 + 2 * (variant % 2))); }
  static json order_of(int variant, const std::string& volume, const std::string& label) {
    return {{"volume", volume},
            {"parameters", {{"flow_time_mm2", 1 + variant}}},
            {"isovalues", {500}},
            {"label", label}};
  }

  /// The sums of the results, but of the report, which tells times.
  static std::map<std::string, std::string> sums_of(const json& job) {
    std::map<std::string, std::string> sums;
    for (const json& result : job.at("results"))
      if (result.at("name") != "report.json") sums[result.at("name")] = result.at("sha256");
    return sums;
  }

  void learn(const Daemon& daemon, int variant) {
    const ServiceClient service(daemon);
    const std::string volume = service.upload(file_of(variant)).at("id");
    expected_[static_cast<std::size_t>(variant)] =
        sums_of(service.run(order_of(variant, volume, "reference")));
    ++reference_volumes_;
  }

  /// Repeats the call until it has one of the statuses; an answer is neither "in flight" nor "not ready".
  HttpResponse insist(const std::string& method, const std::string& target, const std::set<int>& statuses,
                      std::string_view body = {}, const HeaderFields& headers = {}) {
    while (!given_up_) {
      try {
        HttpConnection connection(port_);
        connection.set_patience(10);
        const HttpResponse answer = connection.exchange(method, target, body, headers);
        if (statuses.contains(answer.status)) return answer;
        const bool passes = answer.status == 409 || answer.status == 503 || answer.status == 500;
        if (!passes)
          throw std::logic_error(method + " " + target + ": " + std::to_string(answer.status) + " " +
                                 answer.body);
      } catch (const std::runtime_error&) {
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    throw std::runtime_error("given up");
  }

  void order(int number) try {
    const int variant = number % kVariants;
    const std::string label = std::to_string(number);
    const auto uploaded =
        insist("POST", "/v1/volumes", {201}, file_of(variant), {{"Idempotency-Key", "volume " + label}});
    const std::string volume = uploaded.document().at("id");
    const auto submitted =
        insist("POST", "/v1/jobs", {202}, order_of(variant, volume, label).dump(),
               {{"Content-Type", "application/json"}, {"Idempotency-Key", "job " + label}});
    Made made{volume, submitted.document().at("id")};
    json job;
    do job = insist("GET", "/v1/jobs/" + made.job + "?wait=5", {200}).document();
    while (!ServiceClient::is_final(job));
    if (number % 3 == 0) {
      // 410: deleted by an earlier call that got no answer.
      insist("DELETE", "/v1/jobs/" + made.job, {204, 410});
      insist("DELETE", "/v1/volumes/" + volume, {204, 410});
      made.deleted = true;
    }
    const std::lock_guard lock(mutex_);
    made_[number] = made;
  } catch (const std::exception& error) {
    find(error.what());
  }

  std::map<std::string, std::string> jobs_by_label(const ServiceClient& service) {
    std::map<std::string, std::string> ids;
    for (const json& job : service.all("jobs")) {
      const std::string label = job.at("label");
      if (label != "reference" && !ids.emplace(label, job.at("id")).second)
        find("job " + label + " is there twice");
    }
    return ids;
  }

  void look_at(const ServiceClient& service, int number, const Made& made,
               std::map<std::string, std::string>& ids) try {
    const std::string label = std::to_string(number);
    if (made.deleted) {
      for (const std::string& target : {"/v1/jobs/" + made.job, "/v1/volumes/" + made.volume})
        if (service.call("GET", target).status != 410) find(target + " is there though it was deleted");
      return;
    }
    if (ids[label] != made.job) return find("job " + made.job + " is lost");
    ids.erase(label);
    const json job = service.job(made.job);
    if (job.at("state") != "succeeded") return find(job.dump());
    if (sums_of(job) != expected_[static_cast<std::size_t>(number % kVariants)])
      find("other results: " + job.dump());
    for (const json& result : job.at("results"))
      if (sha256_hex(service.fetch(made.job, result.at("name"))) != result.at("sha256"))
        find("wrong bytes of " + result.dump());
    if (service.call("GET", "/v1/volumes/" + made.volume + "/content").body != file_of(number % kVariants))
      find("wrong bytes of " + made.volume);
  } catch (const std::runtime_error& error) {
    find("job " + made.job + ": " + error.what());
  }

  void find(const std::string& what) {
    const std::lock_guard lock(mutex_);
    findings_.push_back(what);
  }

  std::atomic<int> port_;
  std::atomic<int> done_ = 0;
  std::atomic<bool> given_up_ = false;
  std::array<std::map<std::string, std::string>, kVariants> expected_;
  std::size_t reference_volumes_ = 0;
  std::mutex mutex_;
  std::map<int, Made> made_;
  std::vector<std::string> findings_;
};

}  // namespace volsmooth::test
