#include "service/http/audit_entry.h"

#include <set>

#include "service/storage/database.h"
#include "tests/service/http/running_server.h"

namespace volsmooth {
namespace {

class AuditedServerTest : public ServerTest {
 protected:
  /// As it is on the disk now.
  std::vector<AuditRow> rows() {
    std::vector<AuditRow> all;
    Database database(directory_ / "volsmooth.db", Database::Access::kReader);
    for_each_audit_row(database, [&](const AuditRow& row) { all.push_back(row); });
    EXPECT_EQ(fault_in_audit(database, {}), std::nullopt);
    return all;
  }
  /// The one row that an answer has added: action, object, outcome.
  std::string row_of(const HttpAnswer& answer) {
    std::string found;
    for (const AuditRow& row : rows())
      if (row.actor.request == answer.field("x-request-id"))
        found += (found.empty() ? "" : "; ") + row.entry.action + ", " + row.entry.object + ", " +
                 row.entry.outcome;
    return found;
  }
};

TEST_F(AuditedServerTest, EveryAnswerHasAnIdOfItsOwn) {
  std::set<std::string> ids;
  for (const char* line :
       {"GET /healthz", "GET /nothing", "GET /v1/jobs?x=1", "BREW /", "GET /v1/jobs/..", "HEAD /healthz"})
    ids.insert(ask(line).field("x-request-id"));
  EXPECT_EQ(ids.size(), 6U);
  EXPECT_FALSE(ids.contains(""));
}

TEST_F(AuditedServerTest, WhatIsStoredAndDeletedIsAuditedWithTheRequest) {
  const auto stored = ask("POST /v1/volumes", "voxels");
  const std::string volume = id_of(stored);
  EXPECT_EQ(row_of(stored), "volume stored, " + volume + ", done");
  const auto job = submit(volume);
  EXPECT_EQ(row_of(job), "job queued, " + id_of(job) + ", done");
  ask("GET /v1/jobs/" + id_of(job) + "?wait=60");
  EXPECT_EQ(row_of(ask("DELETE /v1/jobs/" + id_of(job))), "job deleted, " + id_of(job) + ", done");
  EXPECT_EQ(row_of(ask("DELETE /v1/volumes/" + volume)), "volume deleted, " + volume + ", done");
}

TEST_F(AuditedServerTest, BytesThatGoOutAreAudited) {
  const std::string volume = upload(), job = finished_job(volume);
  const std::string content = "/v1/volumes/" + volume + "/content",
                    result = "/v1/jobs/" + job + "/results/out.nii.gz";
  const auto whole = ask("GET " + content);
  EXPECT_EQ(row_of(whole), "volume downloaded, " + volume + ", done");
  EXPECT_EQ(row_of(ask("GET " + result)), "result downloaded, " + job + ", done");
  EXPECT_EQ(row_of(ask("GET " + result, "", "Range: bytes=1-2\r\n")), "result downloaded, " + job + ", done");
  EXPECT_EQ(row_of(ask("HEAD " + content)), "");
  EXPECT_EQ(row_of(ask("GET " + content, "", "If-None-Match: " + whole.field("etag") + "\r\n")), "");
  EXPECT_EQ(row_of(ask("GET /v1/volumes/" + volume)), "");
  EXPECT_EQ(row_of(ask("GET " + content, "", "Range: bytes=99-\r\n")),
            "GET /v1/volumes/{id}/content, " + volume + ", range-not-satisfiable");
}

TEST_F(AuditedServerTest, WhatWasRefusedIsAuditedWithoutWhatTheClientWrote) {
  EXPECT_EQ(row_of(ask("POST /v1/volumes", "bad voxels")), "POST /v1/volumes, , nifti-bad-header");
  EXPECT_EQ(row_of(submit("v-none")), "POST /v1/jobs, , not-found");
  EXPECT_EQ(row_of(ask("DELETE /v1/jobs/j-aaaaaaaaaaaaaaaa")),
            "DELETE /v1/jobs/{id}, j-aaaaaaaaaaaaaaaa, not-found");
  EXPECT_EQ(row_of(ask("DELETE /v1/jobs/Jane.Doe")), "DELETE /v1/jobs/{id}, , bad-id");
  for (const char* name : {"JaneDoe", "j-none", "Mary-Ann_Doe"})
    EXPECT_EQ(row_of(ask(std::string("DELETE /v1/jobs/") + name)), "DELETE /v1/jobs/{id}, , not-found");
  EXPECT_EQ(row_of(ask("GET /v1/jobs/j-none")), "");
  EXPECT_EQ(row_of(ask("GET /v1/volumes", "", "Origin: http://elsewhere\r\n")), ", , cross-origin");
}

}  // namespace
}  // namespace volsmooth
