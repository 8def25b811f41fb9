#include "service/storage/disk_space.h"

#include <cerrno>
#include <system_error>

#include "service/storage/database.h"

namespace volsmooth {

bool is_of_full_disk(const std::exception& failure) {
  if (const auto* error = dynamic_cast<const DatabaseError*>(&failure)) return error->is_full_disk();
  const auto* error = dynamic_cast<const std::system_error*>(&failure);
  return error && (error->code() == std::errc::no_space_on_device ||
                   error->code() == std::error_code(EDQUOT, std::generic_category()));
}

std::int64_t DiskSpace::available_bytes() const {
  const std::lock_guard lock(mutex_);
  return free_bytes_() - reserved_bytes_ - promised_bytes_;
}

bool DiskSpace::promise(std::int64_t bytes) {
  const std::int64_t held_back = held_back_();
  const std::lock_guard lock(mutex_);
  if (bytes > free_bytes_() - reserved_bytes_ - promised_bytes_ - held_back) return false;
  promised_bytes_ += bytes;
  return true;
}

void DiskSpace::end_promise(std::int64_t bytes) {
  const std::lock_guard lock(mutex_);
  promised_bytes_ -= bytes;
}

}  // namespace volsmooth
