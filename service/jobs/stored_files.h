#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "service/jobs/store_database.h"
#include "service/storage/checked_file.h"
#include "service/storage/digest.h"
#include "service/storage/file_store.h"

namespace volsmooth {

/// What a stored file is to be; its name is that below the data directory.
struct FileRecord {
  std::string name;
  std::int64_t bytes = 0;
  std::string sha256;
  std::string block_sums;  ///< the text of its BlockSums
};

// Rows of stored files, each written and deleted in the transaction of the row that points to the file.

void insert_file(Database& database, const FileRecord& file, Time now);
void forget_file(Database& database, std::string_view name);
void forget_files_in(Database& database, std::string_view directory);

/// The stored files and whether they still are what was stored. Whoever finds damage records it; nothing of a
/// damaged file is given out until a later check finds it whole (say, restored from a backup). Thread-safe;
/// throws DatabaseError, and std::system_error when the disk fails, which says nothing of a file.
class StoredFiles {
 public:
  StoredFiles(StoreDatabase& database, FileStore& files) : database_(database), files_(files) {}

  /// To be read with every block checked. integrity-failure, or gone when it is on record no more.
  tl::expected<std::shared_ptr<const CheckedFile>, Problem> open(const std::string& name);

  /// Reads the whole file and records what it finds; files of earlier versions get their block sums by it.
  /// Calls `between_blocks` every few megabytes, which may throw to end it. True also when it is on record no
  /// more.
  bool check(
      const std::string& name, const std::function<void()>& between_blocks = [] {});

  /// The file that was checked longest ago, before `since`; of damaged ones, before `damaged_since`. None of
  /// `but_not`.
  std::optional<std::string> due(Time since, Time damaged_since, const std::map<std::string, Time>& but_not);

 private:
  struct Row {
    FileRecord file;
    bool damaged = false;
  };
  std::optional<Row> find(std::string_view name);
  bool record(const std::string& name, bool damaged, const FileDigest& found);

  StoreDatabase& database_;
  FileStore& files_;
};

}  // namespace volsmooth
