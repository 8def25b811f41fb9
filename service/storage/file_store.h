#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

#include "service/storage/ballast.h"
#include "service/storage/incoming_file.h"
#include "service/storage/posix.h"

namespace volsmooth {

/// The files of one data directory, which it holds for this process alone. What it adopts is there whole and
/// durable, or not at all, whenever the machine stops. Names are relative to the directory and must be made
/// by us, never by a client. Thread-safe. Every function throws std::system_error when the disk fails.
class FileStore {
 public:
  /// Creates and locks the directory. Throws std::runtime_error when another process holds it or when it lies
  /// on a network file system, where neither locks nor fsync can be relied on.
  /// What it receives leaves `reserved_bytes` of the disk free.
  explicit FileStore(std::filesystem::path root, std::int64_t reserved_bytes = 0);

  std::filesystem::path path_of(const std::filesystem::path& name) const { return root_ / name; }
  std::int64_t free_bytes() const;

  /// What can still be received.
  std::int64_t available_bytes() const { return disk_->available_bytes(); }

  /// Nothing is received into what others will need, which `bytes` measures. Set before others use it.
  void hold_back(std::function<std::int64_t()> bytes) { disk_->hold_back(std::move(bytes)); }

  /// Some MiB for what has to be written on a full disk (storage/ballast.h): laid when the disk has room.
  void lay_ballast();
  bool drop_ballast() { return ballast_.drop(); }

  /// A new file in the area for unfinished ones; nothing when the disk has no such room beside what others
  /// were promised.
  std::optional<IncomingFile> receive(std::int64_t expected_bytes = 0);
  /// Makes a received file a stored one: fsync, rename, fsync of the directory.
  void adopt(IncomingFile file, const std::filesystem::path& name);

  /// A new, empty directory `<name>.part` to fill.
  std::filesystem::path begin_directory(const std::filesystem::path& name);
  /// Makes it `name`; its files must be synced already.
  void adopt_directory(const std::filesystem::path& name);
  void abandon_directory(const std::filesystem::path& name);

  /// Removes a file or a directory with all in it; what is not there is not an error.
  void remove(const std::filesystem::path& name);

  /// Removes every entry of `folder` that `keep` does not want, such as what a crash left behind.
  void sweep(const std::filesystem::path& folder, const std::function<bool(std::string_view)>& keep);

 private:
  std::filesystem::path root_;
  std::shared_ptr<DiskSpace> disk_;
  FileDescriptor lock_;
  Ballast ballast_;
};

}  // namespace volsmooth
