#include "service/storage/integrity_check.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <string>

#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using namespace std::chrono_literals;

class IntegrityCheckTest : public testing::Test {
 protected:
  /// All in the file itself, nothing in the log.
  void fill(int rows) {
    writer_.execute("CREATE TABLE t (a TEXT) STRICT");
    writer_.run(
        "INSERT INTO t WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM c WHERE n < ?) "
        "SELECT hex(zeroblob(100)) || n FROM c",
        rows);
    writer_.query("PRAGMA wal_checkpoint(TRUNCATE)").step();
  }

  /// Overwrites the middle of the file, which holds rows.
  void damage() {
    std::fstream file(file_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(std::filesystem::file_size(file_) / 2 / 4096 * 4096));
    file << std::string(4096, '\x5a');
  }

  ScratchFolder scratch_;
  const std::filesystem::path file_ = scratch_.path() / "test.db";
  Database writer_{file_, Database::Access::kWriter};
  std::atomic<int> calls_ = 0;
};

TEST_F(IntegrityCheckTest, FindsNothingWrongWithAWholeDatabase) {
  fill(1000);
  EXPECT_TRUE(is_sound(writer_));
  IntegrityCheck check(file_, [this] { ++calls_; });
  EXPECT_EQ(check.sound_within(10s), true);
  EXPECT_EQ(calls_, 0);
}

TEST_F(IntegrityCheckTest, FindsAPageThatIsNoPage) {
  fill(1000);
  damage();
  Database reader(file_, Database::Access::kReader);
  EXPECT_FALSE(is_sound(reader));
  IntegrityCheck check(file_, [this] { ++calls_; });
  EXPECT_EQ(check.sound_within(10s), false);
  EXPECT_EQ(calls_, 1);
}

TEST_F(IntegrityCheckTest, LetsTheDatabaseBeWritten) {
  fill(100'000);
  IntegrityCheck check(file_, [this] { ++calls_; });
  for (int row = 0; row < 100; ++row) {
    Transaction writing(writer_, Transaction::Kind::kWrite);
    writer_.run("INSERT INTO t VALUES (?)", std::to_string(row));
    writing.commit();
  }
  EXPECT_EQ(check.sound_within(10s), true);
}

TEST_F(IntegrityCheckTest, CanBeBrokenOff) {
  fill(200'000);
  for (int moment = 0; moment < 20; ++moment) {
    const IntegrityCheck check(file_, [this] { ++calls_; });
    std::this_thread::sleep_for(moment * 200us);
  }
  EXPECT_EQ(calls_, 0);  // what is broken off is no damage
}

}  // namespace
}  // namespace volsmooth
