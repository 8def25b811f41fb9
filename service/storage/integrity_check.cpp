#include "service/storage/integrity_check.h"

#include <sqlite3.h>

namespace volsmooth {
namespace {

constexpr auto kBeforeAnotherTry = std::chrono::seconds(1);
constexpr auto kInterruptAgain = std::chrono::milliseconds(5);  // one that comes before the statement is lost

}  // namespace

bool is_sound(Database& database) try {
  Statement check = database.query("PRAGMA quick_check(1)");
  return check.step() && check.text(0) == "ok";
} catch (const DatabaseError& error) {
  if (error.code() == SQLITE_CORRUPT || error.code() == SQLITE_NOTADB) return false;
  throw;
}

IntegrityCheck::IntegrityCheck(const std::filesystem::path& file, std::function<void()> on_damage)
    : database_(file, Database::Access::kReader),
      on_damage_(std::move(on_damage)),
      thread_([this] { run(); }) {}

IntegrityCheck::~IntegrityCheck() {
  {
    std::unique_lock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
    do database_.interrupt();
    while (!changed_.wait_for(lock, kInterruptAgain, [&] { return ended_; }));
  }
  thread_.join();
}

std::optional<bool> IntegrityCheck::sound_within(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, patience, [&] { return sound_.has_value(); });
  return sound_;
}

void IntegrityCheck::run() {
  std::unique_lock lock(mutex_);
  while (!stopping_ && !sound_) {
    lock.unlock();
    std::optional<bool> found;
    try {
      found = is_sound(database_);
      if (!*found) on_damage_();
    } catch (const DatabaseError&) {
    }
    lock.lock();
    sound_ = found;
    changed_.notify_all();
    if (!found) changed_.wait_for(lock, kBeforeAnotherTry, [&] { return stopping_; });
  }
  ended_ = true;
  changed_.notify_all();
}

}  // namespace volsmooth
