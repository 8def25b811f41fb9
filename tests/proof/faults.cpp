// proof_faults SHIM [STRIDE]: lets the n-th call of the daemon on its data directory fail, for n = 1, 1 +
// STRIDE, ... until the whole of upload, job, results and deletion happens before the n-th; once and until
// further notice, with every error that the call can have; also while the daemon starts. Nothing acknowledged
// may be lost, no call may take longer than 5 s, every refusal is a problem document, and 5 s after the fault
// all is well again. Every kind of fault meets a data directory of its own: what earlier ones left in it
// would only add calls to each.
#include <cstdio>
#include <cstring>
#include <functional>

#include "tests/proof/fault_plan.h"
#include "tests/proof/store_check.h"
#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

using namespace volsmooth::test;

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPatience = std::chrono::seconds(5);

struct Fault {
  std::string name;
  std::uint32_t calls;
  int error;
  bool lasting;
};

const std::vector<Fault> kFaults{
    {"disk full once", kDiskCalls & ~(kReadCall | kSyncCall | kRemoveCall), ENOSPC, false},
    {"disk full", kDiskCalls & ~(kReadCall | kSyncCall | kRemoveCall), ENOSPC, true},
    {"quota used up", kDiskCalls & ~(kReadCall | kSyncCall | kRemoveCall), EDQUOT, true},
    {"I/O error once", kDiskCalls, EIO, false},
    {"I/O errors", kDiskCalls, EIO, true},
    {"no descriptor once", kOpenCall | kAcceptCall | kNewDescriptorCall, EMFILE, false},
    {"no descriptors", kOpenCall | kNewDescriptorCall, EMFILE, true},  // else nobody could be told
};

struct Tally {
  std::int64_t injected = 0, orderly_ends = 0, refusals = 0;
  double slowest = 0, slowest_recovery = 0;
  std::size_t findings = 0;
};

enum class Moment { kRequests, kStart };

/// One kind of fault at one moment, for every n.
class Sweep {
 public:
  Sweep(const std::filesystem::path& shim, const Fault& fault, Moment moment, Tally& tally)
      : fault_(fault),
        moment_(moment),
        name_(fault.name + (moment == Moment::kStart ? " at the start" : "")),
        tally_(tally),
        faults_(directory_ / "plan"),
        daemon_(start_under(shim)),
        file_(gzip(ball_file(12))) {}

  void run(std::int64_t stride) {
    for (number_ = 1;; number_ += stride) {
      faults_.fail(fault_.calls, fault_.error, number_, fault_.lasting ? INT64_MAX : number_);
      moment_ == Moment::kStart ? restart() : live();
      faults_.disarm();
      const bool met = faults_.counted() >= number_;
      recover();
      if (!met) break;
      ++tally_.injected;
    }
    std::printf("%s: to call %lld\n", name_.c_str(), static_cast<long long>(number_));
    std::fflush(stdout);
    finish();
  }

 private:
  Daemon start_under(const std::filesystem::path& shim) {
    const auto data = directory_ / "data";
    ::setenv("FAULT_PLAN", (directory_ / "plan").c_str(), 1);
    ::setenv("FAULT_DIRECTORY", data.c_str(), 1);
    ::setenv("LD_PRELOAD", shim.c_str(), 1);
    return Daemon(VOLSMOOTHD, {}, data);
  }

  void find(const std::string& what) {
    ++tally_.findings;
    std::printf("FOUND, %s, call %lld: %s\n", name_.c_str(), static_cast<long long>(number_), what.c_str());
    std::fflush(stdout);
  }

  /// Calls like a client does: none when there was no answer.
  std::optional<HttpResponse> call(const std::string& method, const std::string& target,
                                   std::string_view body = {}, const HeaderFields& headers = {}) {
    const auto start = Clock::now();
    std::optional<HttpResponse> answer;
    try {
      HttpConnection connection(daemon_.port());
      connection.set_patience(10);
      answer = connection.exchange(method, target, body, headers);
    } catch (const std::runtime_error&) {
    }
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    tally_.slowest = std::max(tally_.slowest, seconds);
    if (seconds > 5) find(method + " " + target + " took " + std::to_string(seconds) + " s");
    if (answer && answer->status >= 400) look_at_refusal(method + " " + target, *answer);
    return answer;
  }

  void look_at_refusal(const std::string& what, const HttpResponse& answer) {
    ++tally_.refusals;
    static const std::set<std::string> sensible{
        "/problems/insufficient-storage", "/problems/internal",          "/problems/not-ready",
        "/problems/store-unavailable",    "/problems/integrity-failure", "/problems/volume-in-use",
        "/problems/too-many-connections"};
    const json problem = json::parse(answer.body, nullptr, false);
    if (answer.header("content-type") != "application/problem+json" || !problem.is_object() ||
        !sensible.contains(problem.value("type", "")))
      find(what + " was answered " + std::to_string(answer.status) + " " + answer.body);
  }

  /// Upload, job, results, deletion; goes on after every refusal as far as it can.
  void live() {
    const auto uploaded = call("POST", "/v1/volumes", file_);
    if (!uploaded || uploaded->status != 201) return;
    const std::string volume = uploaded->document().at("id");
    volumes_.insert(volume);
    const json order{{"volume", volume}, {"parameters", {{"flow_time_mm2", 1}}}, {"isovalues", {500}}};
    const auto submitted = call("POST", "/v1/jobs", order.dump(), {{"Content-Type", "application/json"}});
    if (submitted && submitted->status == 202) {
      const std::string id = submitted->document().at("id");
      jobs_.insert(id);
      const auto job = call("GET", "/v1/jobs/" + id + "?wait=1");
      if (job && job->status == 200) fetch_results(job->document());
      forget(jobs_, "/v1/jobs/", id);
    }
    fetch_content(volume);
    forget(volumes_, "/v1/volumes/", volume);
  }

  void fetch_results(const json& job) {
    if (!job.contains("results")) return;
    for (const json& result : job.at("results")) {
      const std::string name = result.at("name"), id = job.at("id");
      const auto answer = call("GET", "/v1/jobs/" + id + "/results/" + name);
      if (answer && answer->status == 200 && sha256_hex(answer->body) != result.at("sha256"))
        find(name + ": wrong bytes");
    }
  }

  void fetch_content(const std::string& volume) {
    const auto answer = call("GET", "/v1/volumes/" + volume + "/content");
    if (answer && answer->status == 200 && answer->body != file_) find("the volume has other bytes");
  }

  void forget(std::set<std::string>& known, const std::string& place, const std::string& id) {
    const auto answer = call("DELETE", place + id);
    // Without an answer, or with 5xx, it may be gone or not.
    if (answer && answer->status == 204) known.erase(id), deleted_.push_back(place + id);
    if (!answer || answer->status >= 500) known.erase(id);
  }

  void restart() {
    if (daemon_.running() && daemon_.terminate() > 1) find("a stop ended with a crash");
    try {
      daemon_.start();
    } catch (const std::runtime_error& error) {
      if (daemon_.running()) return find("the start hangs");
      if (daemon_.wait() != 1) find("the start ended with " + std::to_string(daemon_.wait()));
    }
  }

  /// After the fault: within 5 s all that was acknowledged is there and everything works.
  void recover() {
    const auto start = Clock::now();
    if (!eventually([&] { return comes_back(); }, kPatience)) {
      find("not healthy 5 s after the fault");
      daemon_.kill();
      daemon_.start();
    }
    tally_.slowest_recovery =
        std::max(tally_.slowest_recovery, std::chrono::duration<double>(Clock::now() - start).count());
    const ServiceClient service(daemon_);
    try {
      service.run({{"volume", service.upload(file_).at("id")},
                   {"parameters", {{"flow_time_mm2", 1}}},
                   {"isovalues", json::array()}});
      for (const std::string& id : volumes_)
        if (service.call("GET", "/v1/volumes/" + id + "/content").body != file_) find(id + " is lost");
      for (const std::string& id : jobs_) look_at_end(service.wait(id), service);
      for (const std::string& target : deleted_)
        if (service.call("GET", target).status != 410) find(target + " is there, or forgotten");
      deleted_.clear();
      empty(service);
    } catch (const std::runtime_error& error) {
      find(std::string("afterwards: ") + error.what());
    }
  }

  /// An end by exit code 1 is in order when the daemon says so: the supervisor starts it again.
  bool comes_back() {
    if (!daemon_.running()) {
      const int code = daemon_.wait();
      if (code != 1) find("the daemon ended with " + std::to_string(code) + "\n" + daemon_.log());
      ++tally_.orderly_ends;
      daemon_.start();
    }
    try {
      return ServiceClient(daemon_).call("GET", "/readyz").status == 200;
    } catch (const std::runtime_error&) {
      return false;
    }
  }

  void look_at_end(const json& job, const ServiceClient& service) {
    if (job.at("state") == "succeeded") {
      for (const json& result : job.at("results"))
        if (sha256_hex(service.fetch(job.at("id"), result.at("name"))) != result.at("sha256"))
          find("wrong bytes");
    } else if (job.at("state") != "failed") {
      find("a job ended as " + job.dump());
    } else if (const std::string type = job.at("error").at("type");
               type != "/problems/internal" && type != "/problems/insufficient-storage") {
      find("a job failed as " + job.dump());
    }
  }

  void empty(const ServiceClient& service) {
    const json jobs = service.get("/v1/jobs?limit=200"), volumes = service.get("/v1/volumes");
    for (const json& job : jobs.at("jobs"))
      expect_status(service.call("DELETE", "/v1/jobs/" + job.at("id").get<std::string>()), 204);
    for (const json& volume : volumes.at("volumes"))
      expect_status(service.call("DELETE", "/v1/volumes/" + volume.at("id").get<std::string>()), 204);
    jobs_.clear();
    volumes_.clear();
  }

  /// Rows and files agree after the last start has swept what faults left behind.
  void finish() {
    name_ += ", the end";
    if (daemon_.terminate() != 0) find("exit code");
    daemon_.start();
    const ServiceClient service(daemon_);
    service.run({{"volume", service.upload(file_).at("id")},
                 {"parameters", {{"flow_time_mm2", 1}}},
                 {"isovalues", {500}}});
    if (daemon_.terminate() != 0) find("exit code");
    for (const std::string& fault : faults_of_store(daemon_.data())) find(fault);
    if (daemon_.log().find("audit was shortened") != std::string::npos)
      find("the audit is not what was sealed");
  }

  Fault fault_;
  Moment moment_;
  std::string name_;
  Tally& tally_;
  TemporaryDirectory directory_;
  Faults faults_;
  Daemon daemon_;
  Bytes file_;
  std::set<std::string> volumes_, jobs_;  ///< acknowledged, not deleted
  std::vector<std::string> deleted_;      ///< acknowledged to be
  std::int64_t number_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const std::int64_t stride = argc > 2 ? std::stoll(argv[2]) : 1;
  Tally tally;
  for (const Fault& fault : kFaults)
    for (const Moment moment : {Moment::kRequests, Moment::kStart})
      Sweep(argv[1], fault, moment, tally).run(stride);
  std::printf(
      "%lld faults, %lld orderly ends, %lld refusals, slowest call %.2f s, slowest recovery %.2f s, %zu "
      "findings\n",
      static_cast<long long>(tally.injected), static_cast<long long>(tally.orderly_ends),
      static_cast<long long>(tally.refusals), tally.slowest, tally.slowest_recovery, tally.findings);
  return tally.findings == 0 ? 0 : 1;
}
