// measure_many_jobs [JOBS]: how long the daemon takes to start with so many (100,000) finished jobs in its
// store, and to answer pages of the list of jobs, walked through and filtered. The store is made of one real
// job, many times.
#include <sqlite3.h>

#include <algorithm>
#include <cstdio>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

using namespace volsmooth::test;

namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// The store, for rows that no daemon makes.
class Store {
 public:
  explicit Store(const std::filesystem::path& file) {
    if (sqlite3_open(file.c_str(), &database_) != SQLITE_OK)
      throw std::runtime_error("cannot open the store");
  }
  Store(const Store&) = delete;
  ~Store() { sqlite3_close(database_); }

  void run(const std::string& sql) {
    if (sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
      throw std::runtime_error(sqlite3_errmsg(database_));
  }

  std::vector<std::string> texts(const std::string& sql) {
    sqlite3_stmt* rows = nullptr;
    if (sqlite3_prepare_v2(database_, sql.c_str(), -1, &rows, nullptr) != SQLITE_OK)
      throw std::runtime_error(sqlite3_errmsg(database_));
    std::vector<std::string> all;
    while (sqlite3_step(rows) == SQLITE_ROW)
      all.emplace_back(reinterpret_cast<const char*>(sqlite3_column_text(rows, 0)));
    sqlite3_finalize(rows);
    return all;
  }

  /// The rows of a table that fit `where`, for each number in `numbers`, with some columns changed.
  void multiply(const std::string& table, const std::map<std::string, std::string>& changed,
                const std::string& where) {
    std::string into, values;
    for (const std::string& name : texts("SELECT name FROM pragma_table_info('" + table + "')")) {
      const auto found = changed.find(name);
      into += (into.empty() ? "" : ", ") + name;
      values += (values.empty() ? "" : ", ") + (found == changed.end() ? table + "." + name : found->second);
    }
    run("INSERT INTO " + table + " (" + into + ") SELECT " + values + " FROM numbers, " + table + " WHERE " +
        where);
  }

 private:
  sqlite3* database_ = nullptr;
};

/// Copies of the job with the sequence 1; their ids end with their number.
void multiply(const Daemon& daemon, const std::string& id, int jobs) {
  const std::string copy = "'" + id.substr(0, 12) +
                           "' || replace(replace(replace(replace(printf('%06d', n), '0', 'a'), '1', "
                           "'b'), '8', 'i'), '9', 'j')";
  Store store(daemon.data() / "volsmooth.db");
  store.run(
      "BEGIN; CREATE TEMP TABLE numbers AS WITH RECURSIVE c(n) AS (SELECT 2 UNION ALL SELECT n + 1 FROM c "
      "WHERE n < " +
      std::to_string(jobs) + ") SELECT n FROM c");
  store.multiply("jobs", {{"id", copy}, {"sequence", "n"}}, "jobs.id = '" + id + "'");
  store.multiply("results", {{"job", "n"}}, "job = 1");
  store.multiply("events", {{"job", "n"}}, "job = 1");
  const std::string prefix = "results/" + id + ".1/";
  store.multiply(
      "stored_files",
      {{"name", "'results/' || " + copy + " || substr(name, " + std::to_string(prefix.size() - 2) + ")"}},
      "name LIKE '" + prefix + "%'");
  store.run("COMMIT");
  for (const std::string& name : store.texts("SELECT id || '.1' FROM jobs WHERE sequence > 1"))
    std::filesystem::create_directory(daemon.data() / "results" / name);
}

void measure(const Daemon& daemon, const std::string& filter, bool walk) {
  HttpConnection connection(daemon.port());
  std::vector<double> times;
  std::string cursor;
  for (int request = 0; request < 1000; ++request) {
    const auto start = Clock::now();
    const auto answer =
        expect_status(connection.exchange(
                          "GET", "/v1/jobs?limit=50" + filter + (cursor.empty() ? "" : "&cursor=" + cursor)),
                      200);
    times.push_back(milliseconds_since(start));
    const json page = answer.document();
    cursor = !walk || page.at("next_cursor").is_null() ? "" : page.at("next_cursor").get<std::string>();
  }
  std::ranges::sort(times);
  std::printf("GET /v1/jobs?limit=50%s: p50 %.2f ms, p99 %.2f ms, longest %.2f ms\n", filter.c_str(),
              times[500], times[990], times.back());
}

}  // namespace

int main(int argc, char** argv) {
  const int jobs = argc > 1 ? std::stoi(argv[1]) : 100'000;
  Daemon daemon(VOLSMOOTHD);
  std::string id;
  {
    const ServiceClient service(daemon);
    id = service
             .run({{"volume", service.upload(ball_file(24)).at("id")},
                   {"parameters", {{"flow_time_mm2", 1}}},
                   {"isovalues", {500}}})
             .at("id");
  }
  daemon.terminate();
  multiply(daemon, id, jobs);
  std::printf("%d jobs, a database of %.0f MB\n", jobs,
              static_cast<double>(std::filesystem::file_size(daemon.data() / "volsmooth.db")) / 1e6);
  for (int start = 0; start < 3; ++start) {
    const auto before = Clock::now();
    daemon.start();
    std::printf("ready after %.0f ms\n", milliseconds_since(before));
    if (start < 2) daemon.terminate();
  }
  measure(daemon, "", true);
  measure(daemon, "&state=succeeded", true);
  for (const std::string filter : {"&state=queued", "&label=nobody", "&method=unsharp"})
    measure(daemon, filter, false);
  for (const std::string target : {"/v1/volumes", "/metrics", "/readyz"}) {
    const auto before = Clock::now();
    ServiceClient(daemon).call("GET", target);
    std::printf("GET %s: %.2f ms\n", target.c_str(), milliseconds_since(before));
  }
}
