#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "service/storage/database.h"

namespace volsmooth {

/// Whether all of a database is as SQLite wrote it: its pages, and what type its values have. Takes about two
/// seconds for each GB. Throws DatabaseError when it could not be read.
bool is_sound(Database& database);

/// That look beside the use of the database, by a connection and a thread of its own. What cannot be read is
/// tried again.
class IntegrityCheck {
 public:
  /// Begins at once; `on_damage` is called from its thread. The database outlives this.
  IntegrityCheck(const std::filesystem::path& file, std::function<void()> on_damage);
  ~IntegrityCheck();  ///< breaks it off
  IntegrityCheck(const IntegrityCheck&) = delete;
  IntegrityCheck& operator=(const IntegrityCheck&) = delete;

  /// What it found; none: it was not through after so long.
  std::optional<bool> sound_within(std::chrono::milliseconds patience);

 private:
  void run();

  Database database_;
  std::function<void()> on_damage_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<bool> sound_;
  bool stopping_ = false, ended_ = false;
  std::thread thread_;
};

}  // namespace volsmooth
