#include "service/jobs/store_database.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <barrier>
#include <fstream>
#include <thread>
#include <vector>

#include "tests/support/disk_calls.h"
#include "tests/support/few_descriptors.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using testing::HasSubstr;

class DamagedDatabaseTest : public testing::Test {
 protected:
  /// A store of so many rows, then a page in its middle that is none.
  void make_damaged(int rows) {
    StoreDatabase(file_).write([&](Database& database) {
      database.run(
          "INSERT INTO tombstones (id, deleted_ms) WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 "
          "FROM c WHERE n < ?) SELECT hex(zeroblob(100)) || n, n FROM c",
          rows);
      return true;
    });
    pristine_ = scratch_.path() / "pristine.db";
    fs::copy_file(file_, pristine_);
    std::fstream file(file_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(fs::file_size(file_) / 4096 * 2 / 3 * 4096));
    file << std::string(4096, '\x5a');
  }

  std::string refusal(StoreDatabase::CheckFirst check) {
    try {
      const StoreDatabase database(file_, check);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  ScratchFolder scratch_;
  const fs::path file_ = scratch_.path() / "volsmooth.db";
  fs::path pristine_;
};

TEST_F(DamagedDatabaseTest, IsNotOpened) {
  make_damaged(20'000);
  EXPECT_THAT(refusal(std::nullopt), HasSubstr("restore"));
  EXPECT_THAT(refusal(10s), HasSubstr("restore"));
}

TEST_F(DamagedDatabaseTest, StopsWritingWhenThatIsSeenOnlyLater) {
  make_damaged(100'000);  // too many to be checked at once
  std::atomic<int> condemned = 0;
  {
    StoreDatabase database(file_, 0ms);
    database.on_condemned([&] { ++condemned; });
    for (int tries = 0; tries < 2000 && condemned == 0; ++tries) std::this_thread::sleep_for(10ms);
    EXPECT_EQ(condemned, 1);
    EXPECT_THAT(database.trouble().value_or(""), HasSubstr("restore"));
    EXPECT_THROW(database.write([](Database&) { return true; }), DatabaseError);
  }
  // The next start looks first, and is content with one that is whole.
  EXPECT_THAT(refusal(0ms), HasSubstr("restore"));
  fs::copy_file(pristine_, file_, fs::copy_options::overwrite_existing);
  EXPECT_EQ(refusal(0ms), "");
  EXPECT_FALSE(fs::exists(scratch_.path() / "volsmooth.db.damaged"));
}

TEST(StoreDatabaseTest, StepsThatFailLeaveNothingAndTheOthersAllTheirs) {
  const ScratchFolder scratch;
  StoreDatabase store(scratch.path() / "volsmooth.db");
  std::atomic<int> failed = 0;
  {
    std::vector<std::jthread> threads;
    for (int thread = 0; thread < 8; ++thread)
      threads.emplace_back([&, thread] {
        for (int step = 0; step < 30; ++step) try {
            store.write([&](Database& database) {
              bury(database, std::to_string(100 * thread + step), "t", Burial::kDeleted, store.now());
              if (step % 3 == 0) throw std::logic_error("no");
              return true;
            });
          } catch (const std::logic_error&) {
            ++failed;
          }
      });
  }
  EXPECT_EQ(failed, 80);
  const std::int64_t kept = store.read([](Database& database) {
    Statement row = database.query("SELECT count(*) FROM tombstones WHERE id % 100 % 3 <> 0");
    row.step();
    return row.integer(0);
  });
  EXPECT_EQ(kept, 160);
  EXPECT_FALSE(store.read([](Database& database) {
    return database.query("SELECT 1 FROM tombstones WHERE id % 100 % 3 = 0").step();
  }));
}

/// More than SQLite keeps in memory before it commits.
void write_much(Database& database) {
  database.run(
      "INSERT INTO tombstones (id, deleted_ms) WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 "
      "FROM c WHERE n < 40000) SELECT hex(zeroblob(100)) || n, n FROM c");
}

/// A full disk in the middle of a step undoes the steps before it as well, and those after it have no
/// transaction left to be in.
class FullDiskOfStore : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Errors, FullDiskOfStore, testing::Values(ENOSPC, EDQUOT));

TEST_P(FullDiskOfStore, UndoesWhatIsEverybodys) {
  const ScratchFolder scratch;
  StoreDatabase store(scratch.path() / "volsmooth.db");
  std::atomic<int> failed = 0;
  std::vector<std::jthread> threads;
  const auto step = [&](const std::string& id, bool is_large) {
    threads.emplace_back([&store, &failed, id, is_large] {
      try {
        store.write([&](Database& database) {
          bury(database, id, "t", Burial::kDeleted, store.now());
          if (is_large) write_much(database);
          return true;
        });
      } catch (const DatabaseError& error) {
        failed += error.is_full_disk();
      }
    });
    std::this_thread::sleep_for(20ms);  // into the queue in this order
  };
  {
    const DiskCalls disk(scratch.path(), [](const std::string& call) {
      return call == "write volsmooth.db-wal" ? GetParam() : 0;
    });
    EXPECT_THROW(store.write([&](Database&) {
      step("before", false);
      step("large", true);
      step("after", false);
      throw std::logic_error("only to hold up the others");
      return true;
    }),
                 std::logic_error);
    threads.clear();
  }
  EXPECT_EQ(failed, 3);
  EXPECT_FALSE(store.condemned());
  EXPECT_FALSE(
      store.read([](Database& database) { return database.query("SELECT 1 FROM tombstones").step(); }));
}

/// At the same time, so that each has a reader of its own.
TEST(StoreDatabaseTest, ReadsWithoutADescriptorToSpare) {
  const ScratchFolder scratch;
  StoreDatabase database(scratch.path() / "volsmooth.db");
  constexpr int kReaders = 4;
  std::barrier all(kReaders);
  std::atomic<int> done = 0;
  const FewDescriptors none(0);
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < kReaders; ++i)
      threads.emplace_back([&] {
        try {
          done += database.read([&](Database& reader) {
            all.arrive_and_wait();
            return static_cast<int>(reader.query("SELECT count(*) FROM volumes").step());
          });
        } catch (const DatabaseError&) {
          all.arrive_and_drop();
        }
      });
  }
  EXPECT_EQ(done, kReaders);
}

}  // namespace
}  // namespace volsmooth
