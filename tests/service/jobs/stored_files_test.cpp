#include "service/jobs/stored_files.h"

#include "tests/service/jobs/service_fixture.h"
#include "tests/support/bit_flip.h"

namespace volsmooth {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// A store with files, without a service.
class StoredFilesTest : public testing::Test {
 protected:
  StoredFilesTest() {
    files_.sweep("volumes", [](std::string_view) { return true; });
    add("volumes/one", "first");
    add("volumes/two", "second");
  }

  void add(const std::string& name, const std::string& bytes) {
    IncomingFile file = files_.receive().value();
    file.write(std::as_bytes(std::span(bytes)));
    const FileRecord record{name, file.bytes(), file.finish(), file.block_sums()};
    files_.adopt(std::move(file), name);
    database_.write([&](Database& database) {
      insert_file(database, record, database_.now());
      return true;
    });
  }
  void run(const std::string& sql) {
    database_.write([&](Database& database) { return database.run(sql); });
  }
  std::string text_of(const std::string& name) {
    const auto file = stored_.open(name).value();
    std::string text(static_cast<std::size_t>(file->bytes()), '\0');
    file->read(0, std::as_writable_bytes(std::span(text)));
    return text;
  }

  ScratchFolder scratch_;
  FileStore files_{scratch_ / "data"};
  StoreDatabase database_{scratch_ / "test.db"};
  StoredFiles stored_{database_, files_};
};

TEST_F(StoredFilesTest, OfADamagedFileNothingIsGivenUntilItIsFoundWholeAgain) {
  flip_bit(files_.path_of("volumes/one"), 11);
  const auto opened = stored_.open("volumes/one");
  ASSERT_TRUE(opened);  // nobody knows yet
  EXPECT_THROW((*opened)->check(0), DamagedFile);
  flip_bit(files_.path_of("volumes/one"), 11);
  EXPECT_EQ(slug_of(stored_.open("volumes/one")), "integrity-failure");
  EXPECT_EQ(text_of("volumes/two"), "second");
  EXPECT_TRUE(stored_.check("volumes/one"));
  EXPECT_EQ(text_of("volumes/one"), "first");
}

TEST_F(StoredFilesTest, ACheckFindsAFlippedBitAnotherSizeAndAMissingFile) {
  EXPECT_TRUE(stored_.check("volumes/one"));
  for (int bit = 0; bit < 8 * 5; ++bit) {
    flip_bit(files_.path_of("volumes/one"), bit);
    EXPECT_FALSE(stored_.check("volumes/one")) << bit;
    EXPECT_EQ(slug_of(stored_.open("volumes/one")), "integrity-failure") << bit;
    flip_bit(files_.path_of("volumes/one"), bit);
  }
  std::ofstream(files_.path_of("volumes/one"), std::ios::app) << "x";
  EXPECT_FALSE(stored_.check("volumes/one"));
  fs::remove(files_.path_of("volumes/two"));
  EXPECT_FALSE(stored_.check("volumes/two"));
  EXPECT_EQ(slug_of(stored_.open("volumes/two")), "integrity-failure");
}

TEST_F(StoredFilesTest, AMissingFileIsDamagedUnlessItWasDeleted) {
  fs::remove(files_.path_of("volumes/one"));
  EXPECT_EQ(slug_of(stored_.open("volumes/one")), "integrity-failure");
  fs::remove(files_.path_of("volumes/two"));
  run("DELETE FROM stored_files WHERE name = 'volumes/two'");
  EXPECT_EQ(slug_of(stored_.open("volumes/two")), "gone");
  EXPECT_TRUE(stored_.check("volumes/two"));
}

TEST_F(StoredFilesTest, FilesOfBeforeGetTheirSumsWhenTheyAreFirstRead) {
  run("UPDATE stored_files SET block_sums = '', checked_ms = 0");
  run("UPDATE stored_files SET bytes = -1, sha256 = '' WHERE name = 'volumes/two'");
  EXPECT_EQ(stored_.due(Time(1ms), Time(0ms), {}), "volumes/one");
  EXPECT_EQ(text_of("volumes/one"), "first");
  EXPECT_EQ(stored_.due(Time(1ms), Time(0ms), {}), "volumes/two");
  EXPECT_TRUE(stored_.check("volumes/two"));
  EXPECT_EQ(text_of("volumes/two"), "second");
  EXPECT_FALSE(stored_.due(Time(1ms), Time(0ms), {}));

  run("UPDATE stored_files SET block_sums = '' WHERE name = 'volumes/one'");
  flip_bit(files_.path_of("volumes/one"), 3);
  EXPECT_EQ(slug_of(stored_.open("volumes/one")), "integrity-failure");
}

TEST_F(StoredFilesTest, SumsThatAreThemselvesDamagedAreMadeAnew) {
  run("UPDATE stored_files SET block_sums = '0000000000000000'");
  EXPECT_THROW((*stored_.open("volumes/one"))->check(0), DamagedFile);
  EXPECT_TRUE(stored_.check("volumes/one"));
  EXPECT_EQ(text_of("volumes/one"), "first");
}

TEST_F(StoredFilesTest, WhatWasCheckedLongestAgoIsDueFirstAndDamagedOnesBefore) {
  run("UPDATE stored_files SET checked_ms = 1000 WHERE name = 'volumes/one'");
  run("UPDATE stored_files SET checked_ms = 2000 WHERE name = 'volumes/two'");
  EXPECT_FALSE(stored_.due(Time(999ms), Time(999ms), {}));
  EXPECT_EQ(stored_.due(Time(5s), Time(0s), {}), "volumes/one");
  EXPECT_EQ(stored_.due(Time(5s), Time(0s), {{"volumes/one", Time()}}), "volumes/two");
  run("UPDATE stored_files SET damaged = 1 WHERE name = 'volumes/two'");
  EXPECT_EQ(stored_.due(Time(5s), Time(5s), {}), "volumes/two");
}

TEST_F(StoredFilesTest, FilesAreForgottenWithTheirDirectory) {
  for (const char* name : {"results/j-1.1/a", "results/j-1.1/b", "results/j-1.10/a", "results/j-1.1"})
    database_.write([&](Database& database) {
      insert_file(database, {name, 1, "", ""}, database_.now());
      return true;
    });
  database_.write([](Database& database) {
    forget_files_in(database, "results/j-1.1");
    return true;
  });
  EXPECT_EQ(slug_of(stored_.open("results/j-1.1/a")), "gone");
  EXPECT_EQ(slug_of(stored_.open("results/j-1.1/b")), "gone");
  EXPECT_EQ(slug_of(stored_.open("results/j-1.10/a")), "integrity-failure");
  EXPECT_EQ(slug_of(stored_.open("results/j-1.1")), "integrity-failure");
}

class ScrubTest : public JobServiceTest {
 protected:
  /// A service whose clock a test turns.
  void open_scrubbing() {
    auto wanted = settings();
    wanted.keep = std::chrono::days(0);
    wanted.clock = [this] { return now_in_milliseconds() + ahead_.load(); };
    service_ = std::make_unique<JobService>(wanted, fake_.engine());
    service_->start();
  }
  std::int64_t damaged() { return service_->statistics().damaged_files; }

  std::atomic<std::chrono::hours> ahead_ = 0h;
};

/// A directory in place of a file cannot be read, like a sector that has gone bad.
TEST_F(ScrubTest, AFileThatCannotBeReadHoldsUpNoOther) {
  open_scrubbing();
  const auto unreadable = upload(*service_, "voxels").value(), flipped = upload(*service_, "others").value();
  const auto folder = settings().data_dir / "volumes";
  std::filesystem::remove(folder / unreadable.id);
  std::filesystem::create_directory(folder / unreadable.id);
  flip_bit(folder / flipped.id, 13);
  ahead_ = 24h * 7 + 1h;
  for (int tries = 0; tries < 1000 && damaged() == 0; ++tries) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(damaged(), 1);
}

/// By the same clock as all else: not again and again, when that has been turned.
TEST_F(ScrubTest, ReadsEveryFileOnce) {
  open_scrubbing();
  const auto volume = upload(*service_, "voxels").value();
  ahead_ = 24h * 7 + 1h;
  const auto last_check = [&] {
    Database database(settings().data_dir / "volsmooth.db", Database::Access::kReader);
    Statement row = database.query("SELECT checked_ms FROM stored_files");
    row.step();
    return row.integer(0);
  };
  const std::int64_t stored = last_check();
  std::int64_t first = stored;
  for (int tries = 0; tries < 1000 && first == stored; ++tries) {
    std::this_thread::sleep_for(10ms);
    first = last_check();
  }
  EXPECT_NE(first, stored);
  std::this_thread::sleep_for(1500ms);  // a claim a second, at the least
  EXPECT_EQ(last_check(), first);
}

TEST_F(ScrubTest, FindsDamageThatNobodyAskedForAndItsEnd) {
  open_scrubbing();
  const auto volume = upload(*service_, "voxels").value();
  const Job job = wait_for(*service_, service_->submit(kAnyone, order_for(volume.id)).value().id);
  const auto path = service_->result(kAnyone, job.id, "out.nii.gz").value().path;
  flip_bit(path, 13);
  EXPECT_EQ(damaged(), 0);
  ahead_ = 24h * 7 + 1h;
  for (int tries = 0; tries < 1000 && damaged() == 0; ++tries) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(damaged(), 1);
  EXPECT_EQ(slug_of(service_->result(kAnyone, job.id, "out.nii.gz")), "integrity-failure");
  EXPECT_EQ(slug_of(service_->result(kAnyone, job.id, "report.json")), "none");

  flip_bit(path, 13);
  ahead_ = 24h * 7 + 3h;
  for (int tries = 0; tries < 1000 && damaged() == 1; ++tries) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(damaged(), 0);
  EXPECT_EQ(slug_of(service_->result(kAnyone, job.id, "out.nii.gz")), "none");
}

}  // namespace
}  // namespace volsmooth
