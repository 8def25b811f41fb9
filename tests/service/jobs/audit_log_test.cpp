#include "service/jobs/audit_log.h"

#include <gmock/gmock.h>

#include <thread>

#include "service/jobs/audit_seal.h"
#include "tests/service/jobs/service_fixture.h"
#include "tests/support/disk_calls.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

class AuditTest : public testing::Test {
 protected:
  void open() { database_ = std::make_unique<StoreDatabase>(file_); }
  void SetUp() override { open(); }

  void add(const std::string& object, const std::string& action = "volume stored") {
    database_->write([&](Database& database) {
      audit(database, object, action);
      return true;
    });
  }
  /// What somebody does who gets at the file while no daemon runs.
  void tamper(const std::string& sql) {
    database_.reset();
    Database(file_, Database::Access::kWriter).execute(sql.c_str());
  }
  std::string fault(std::vector<AuditHead> known = {}) {
    if (const auto seal = AuditSeal::read(file_)) known.push_back(*seal);
    Database database(file_, Database::Access::kReader);
    return fault_in_audit(database, known).value_or("none");
  }
  std::vector<AuditRow> rows() {
    std::vector<AuditRow> all;
    database_->read([&](Database& database) {
      for_each_audit_row(database, [&](const AuditRow& row) { all.push_back(row); });
      return true;
    });
    return all;
  }

  ScratchFolder scratch_;
  const fs::path file_ = scratch_ / "test.db";
  std::unique_ptr<StoreDatabase> database_;
};

TEST_F(AuditTest, SaysWhoDidWhatToWhatAndWhen) {
  add("v-1");
  {
    const ActingFor someone({"radiology", "viewer", "3-17"});
    add("v-2", "volume deleted");
  }
  add("v-3");
  ASSERT_EQ(rows().size(), 3U);
  const AuditRow row = rows()[1];
  EXPECT_EQ(row.sequence, 2);
  EXPECT_EQ(row.actor.tenant, "radiology");
  EXPECT_EQ(row.actor.token, "viewer");
  EXPECT_EQ(row.actor.request, "3-17");
  EXPECT_EQ(row.entry.action, "volume deleted");
  EXPECT_EQ(row.entry.object, "v-2");
  EXPECT_EQ(row.entry.outcome, "done");
  EXPECT_LT(now_in_milliseconds() - row.at, std::chrono::minutes(1));
  EXPECT_EQ(rows()[2].actor.token, "");
}

TEST_F(AuditTest, AnotherThreadIsAnotherActor) {
  const ActingFor someone({"radiology", "viewer", "3-17"});
  std::thread([] { EXPECT_EQ(acting().token, ""); }).join();
  EXPECT_EQ(acting().token, "viewer");
}

TEST_F(AuditTest, WhatIsUndoneIsNotAudited) {
  add("v-1");
  EXPECT_THROW(database_->write([](Database& database) -> bool {
    audit(database, "v-2", "volume stored");
    throw std::runtime_error("no");
  }),
               std::runtime_error);
  add("v-3");
  EXPECT_EQ(rows().size(), 2U);
  EXPECT_EQ(fault(), "none");
}

struct Tampering {
  std::string name, sql;
};
const Tampering kTamperings[] = {
    {"changed_action", "UPDATE audit SET action = 'x' WHERE sequence = 3"},
    {"changed_object", "UPDATE audit SET subject = 'x' WHERE sequence = 3"},
    {"changed_outcome", "UPDATE audit SET outcome = 'x' WHERE sequence = 3"},
    {"changed_tenant", "UPDATE audit SET tenant = 'x' WHERE sequence = 3"},
    {"changed_token", "UPDATE audit SET token = 'x' WHERE sequence = 3"},
    {"changed_request", "UPDATE audit SET request = 'x' WHERE sequence = 3"},
    {"changed_time", "UPDATE audit SET at_ms = at_ms + 1 WHERE sequence = 3"},
    {"changed_hash", "UPDATE audit SET hash = 'x' WHERE sequence = 3"},
    {"changed_first", "UPDATE audit SET action = 'x' WHERE sequence = 1"},
    {"changed_last", "UPDATE audit SET action = 'x' WHERE sequence = 6"},
    {"moved_between_columns", "UPDATE audit SET action = action || subject, subject = '' WHERE sequence = 3"},
    {"removed", "DELETE FROM audit WHERE sequence = 3"},
    {"removed_first", "DELETE FROM audit WHERE sequence = 1"},
    {"removed_and_renumbered",
     "DELETE FROM audit WHERE sequence = 3; UPDATE audit SET sequence = sequence - 1 WHERE sequence > 3"},
    {"swapped",
     "UPDATE audit SET sequence = 99 WHERE sequence = 3; UPDATE audit SET sequence = 3 WHERE sequence = 4; "
     "UPDATE audit SET sequence = 4 WHERE sequence = 99"},
    {"inserted",
     "INSERT INTO audit SELECT 7, at_ms, subject, action, tenant, token, request, outcome, hash FROM audit "
     "WHERE sequence = 6"},
    {"cut_at_the_end", "DELETE FROM audit WHERE sequence = 6"},
    {"cut_to_the_first", "DELETE FROM audit WHERE sequence > 1"},
    {"emptied", "DELETE FROM audit"}};

class TamperedAudit : public AuditTest, public testing::WithParamInterface<Tampering> {};

TEST_P(TamperedAudit, IsFound) {
  for (int row = 1; row <= 6; ++row) add("v-" + std::to_string(row));
  ASSERT_EQ(fault(), "none");
  tamper(GetParam().sql);
  EXPECT_NE(fault(), "none");
  open();  // also by the daemon, which goes on
  add("v-7");
  EXPECT_NE(fault(), "none");
}

INSTANTIATE_TEST_SUITE_P(Table, TamperedAudit, testing::ValuesIn(kTamperings),
                         [](const auto& row) { return row.param.name; });

TEST_F(AuditTest, ASealFromBeforeTheLastCommitsIsNoFault) {
  add("v-1");
  const fs::path seal = scratch_ / "test.db.audit";
  fs::copy_file(seal, scratch_ / "before");
  add("v-2");
  database_.reset();
  fs::copy_file(scratch_ / "before", seal, fs::copy_options::overwrite_existing);
  EXPECT_EQ(fault(), "none");
  open();
  add("v-3");
  EXPECT_EQ(fault(), "none");
}

TEST_F(AuditTest, EachCommitIsSealedWithAllItsRows) {
  const auto sealed = [&] { return AuditSeal::read(file_).value(); };
  for (int rows = 1; rows <= 4; ++rows) {
    database_->write([&](Database& database) {
      for (int row = 0; row < rows; ++row) audit(database, "v-1", "volume stored");
      return true;
    });
    EXPECT_EQ(sealed(), database_->read(audit_head));
    EXPECT_EQ(fs::file_size(scratch_ / "test.db.audit"), 96U) << "it never grows, also not on a full disk";
  }
}

TEST_F(AuditTest, ARowThatIsNotCommittedIsNotSealed) {
  add("v-1");
  {
    const DiskCalls disk(scratch_.path(),
                         [](const std::string& call) { return call == "write test.db-wal" ? ENOSPC : 0; });
    EXPECT_THROW(add("v-2"), DatabaseError);
  }
  EXPECT_EQ(fault(), "none");
  database_.reset();
  open();
  EXPECT_EQ(rows().size(), 1U);
}

TEST_F(AuditTest, ASealThatCannotBeWrittenIsMadeUpForByTheNext) {
  add("v-1");
  {
    const DiskCalls disk(scratch_.path(),
                         [](const std::string& call) { return call == "write test.db.audit" ? EIO : 0; });
    add("v-2");
  }
  add("v-3");
  EXPECT_EQ(fault(), "none");
  EXPECT_EQ(AuditSeal::read(file_)->sequence, 3);
}

TEST_F(AuditTest, TheDaemonNotesThatAllWasRewrittenSinceItsSeal) {
  add("v-1");
  const fs::path seal = scratch_ / "test.db.audit";
  fs::copy_file(seal, scratch_ / "before");
  tamper("DELETE FROM audit");
  fs::remove(seal);
  open();
  add("v-2");  // a chain as good as the first
  database_.reset();
  fs::copy_file(scratch_ / "before", seal, fs::copy_options::overwrite_existing);
  open();
  add("v-3");  // which seals it
  EXPECT_THAT(fault(), testing::HasSubstr("shortened or changed"));
}

TEST_F(AuditTest, AHeadNotedDownElsewhereShowsWhatWasRewrittenAltogether) {
  add("v-1");
  const AuditHead noted = database_->read(audit_head);
  add("v-2");
  EXPECT_EQ(fault({noted}), "none");
  tamper("DELETE FROM audit");
  fs::remove(scratch_ / "test.db.audit");
  open();
  add("v-1");
  add("v-2");
  EXPECT_EQ(fault(), "none");
  EXPECT_THAT(fault({noted}), testing::HasSubstr("noted down"));
}

TEST_F(AuditTest, RowsOfManyThreadsShareCommitsAndAreAllThere) {
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 8; ++thread)
    threads.emplace_back([&, thread] {
      const ActingFor someone({"t", "token" + std::to_string(thread), ""});
      for (int row = 0; row < 25; ++row) add("v-" + std::to_string(row));
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(rows().size(), 200U);
  std::map<std::string, std::vector<std::string>> of_token;
  for (const AuditRow& row : rows()) of_token[row.actor.token].push_back(row.entry.object);
  EXPECT_EQ(of_token.size(), 8U);
  for (const auto& [token, objects] : of_token)
    for (std::size_t row = 0; row < objects.size(); ++row)
      EXPECT_EQ(objects[row], "v-" + std::to_string(row)) << token;
  EXPECT_EQ(fault(), "none");
}

}  // namespace
}  // namespace volsmooth
