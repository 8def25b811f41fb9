#include "service/storage/database.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

class DatabaseTest : public testing::Test {
 protected:
  std::string value_of(Database& database, const std::string& sql) {
    Statement row = database.query(sql);
    return row.step() ? row.text(0) : "no row";
  }

  ScratchFolder scratch_;
  const std::filesystem::path file_ = scratch_.path() / "test.db";
  Database writer_{file_, Database::Access::kWriter};
};

TEST_F(DatabaseTest, WritesDurablyAndLeavesNothingOfWhatWasDeleted) {
  const std::pair<std::string, std::string> expected[] = {
      {"journal_mode", "wal"}, {"synchronous", "2"},    {"foreign_keys", "1"},         {"secure_delete", "1"},
      {"mmap_size", "0"},      {"trusted_schema", "0"}, {"wal_autocheckpoint", "4000"}};
  for (const auto& [setting, value] : expected)
    EXPECT_EQ(value_of(writer_, "PRAGMA " + setting), value) << setting;
}

TEST_F(DatabaseTest, ValuesComeBackAsTheyWere) {
  writer_.execute("CREATE TABLE t (a INTEGER, b REAL, c TEXT, d TEXT) STRICT");
  const std::string text("with \0 and \xC3\xA9", 11);
  EXPECT_EQ(writer_.run("INSERT INTO t VALUES (?, ?, ?, ?)", std::int64_t{-1} << 62, 1.0 / 3, text,
                        std::optional<std::string>()),
            1);
  Statement row = writer_.query("SELECT * FROM t");
  ASSERT_TRUE(row.step());
  EXPECT_EQ(row.integer(0), std::int64_t{-1} << 62);
  EXPECT_EQ(row.real(1), 1.0 / 3);
  EXPECT_EQ(row.text(2), text);
  EXPECT_TRUE(row.is_null(3));
  EXPECT_FALSE(row.step());
}

/// A prepared statement is used again, and shows nothing of its earlier use.
TEST_F(DatabaseTest, TheSameQueryBeginsAnew) {
  writer_.execute("CREATE TABLE t (a INTEGER); INSERT INTO t VALUES (1), (2), (3)");
  constexpr std::string_view kFrom = "SELECT a, ?2 FROM t WHERE a >= ?1 ORDER BY a";
  {
    Statement left_early = writer_.query(kFrom, 1, "value"), beside_it = writer_.query(kFrom, 2, "other");
    ASSERT_TRUE(left_early.step() && beside_it.step());
    EXPECT_EQ(left_early.integer(0), 1);
    EXPECT_EQ(beside_it.integer(0), 2);
  }
  for (int use = 0; use < 2; ++use) {
    Statement anew = writer_.query(kFrom, 1);
    ASSERT_TRUE(anew.step());
    EXPECT_EQ(anew.integer(0), 1);
    EXPECT_TRUE(anew.is_null(1));
  }
  writer_.execute("DROP TABLE t");  // which a statement in the middle of its rows would forbid
}

TEST_F(DatabaseTest, AQueryThatFailedCanBeAskedAgain) {
  writer_.execute("CREATE TABLE t (a INTEGER UNIQUE)");
  for (const int value : {1, 1, 2, 2}) {
    try {
      writer_.run("INSERT INTO t VALUES (?)", value);
    } catch (const DatabaseError&) {
    }
  }
  EXPECT_EQ(value_of(writer_, "SELECT group_concat(a) FROM t"), "1,2");
}

TEST_F(DatabaseTest, WhatIsNotCommittedIsUndone) {
  writer_.execute("CREATE TABLE t (a)");
  {
    const Transaction dropped(writer_, Transaction::Kind::kWrite);
    writer_.run("INSERT INTO t VALUES (1)");
  }
  EXPECT_EQ(value_of(writer_, "SELECT count(*) FROM t"), "0");
}

TEST_F(DatabaseTest, APartOfATransactionCanBeUndoneAlone) {
  writer_.execute("CREATE TABLE t (a)");
  Transaction writing(writer_, Transaction::Kind::kWrite);
  for (int part = 0; part < 3; ++part) {
    Savepoint savepoint(writer_);
    writer_.run("INSERT INTO t VALUES (?)", part);
    if (part == 1) {
      savepoint.undo();
    } else {
      savepoint.keep();
    }
  }
  writing.commit();
  EXPECT_EQ(value_of(writer_, "SELECT group_concat(a) FROM t"), "0,2");
}

TEST_F(DatabaseTest, AReaderNeitherWaitsForAWriterNorSeesHalfOfItsWork) {
  writer_.execute("CREATE TABLE t (a)");
  Database reader(file_, Database::Access::kReader);
  Transaction writing(writer_, Transaction::Kind::kWrite);
  writer_.run("INSERT INTO t VALUES (1)");
  EXPECT_EQ(value_of(reader, "SELECT count(*) FROM t"), "0");
  writing.commit();
  EXPECT_EQ(value_of(reader, "SELECT count(*) FROM t"), "1");
}

TEST_F(DatabaseTest, AReaderNeverChangesTheFile) {
  writer_.execute("CREATE TABLE t (a)");
  Database reader(file_, Database::Access::kReader);
  EXPECT_THROW(reader.run("INSERT INTO t VALUES (1)"), DatabaseError);
  EXPECT_EQ(value_of(reader, "PRAGMA wal_autocheckpoint"), "0");
}

TEST_F(DatabaseTest, AnUndoneCommitDoesNotCondemnIt) {
  writer_.execute("CREATE TABLE a (id INTEGER PRIMARY KEY)");
  writer_.execute("CREATE TABLE b (a REFERENCES a DEFERRABLE INITIALLY DEFERRED)");
  {
    Transaction broken(writer_, Transaction::Kind::kWrite);
    writer_.run("INSERT INTO b VALUES (7)");
    EXPECT_THROW(broken.commit(), DatabaseError);
  }
  EXPECT_FALSE(writer_.condemned());
  EXPECT_EQ(value_of(writer_, "SELECT count(*) FROM b"), "0");
}

TEST_F(DatabaseTest, WrongSqlIsAnError) {
  EXPECT_THROW(writer_.query("SELEKT 1"), DatabaseError);
}

}  // namespace
}  // namespace volsmooth
