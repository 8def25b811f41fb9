#include "service/storage/file_store.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/vfs.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

namespace volsmooth {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTemporary = "tmp";
constexpr std::int64_t kBallastBytes = std::int64_t{8} << 20;
constexpr std::array<std::uint32_t, 4> kNetworkFileSystems = {NFS_SUPER_MAGIC, SMB_SUPER_MAGIC,
                                                              CIFS_SUPER_MAGIC, SMB2_SUPER_MAGIC};

void refuse_network_file_system(const fs::path& root) {
  struct statfs found {};
  if (::statfs(root.c_str(), &found) != 0) throw std::system_error(errno, std::generic_category(), "statfs");
  if (std::ranges::count(kNetworkFileSystems, static_cast<std::uint32_t>(found.f_type)) > 0)
    throw std::runtime_error("the data directory lies on a network file system; it must be on a local disk");
}

std::int64_t free_bytes_at(const fs::path& root) {
  struct statvfs found {};
  if (::statvfs(root.c_str(), &found) != 0)
    throw std::system_error(errno, std::generic_category(), "statvfs");
  return static_cast<std::int64_t>(found.f_bavail) * static_cast<std::int64_t>(found.f_frsize);
}

FileDescriptor lock(const fs::path& root) {
  FileDescriptor file = open_file(root / "lock", O_RDWR | O_CREAT);
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0)
    throw std::runtime_error("the data directory is in use by another volsmoothd: " + root.string());
  return file;
}

/// With all that is missing above it, for good. False: it is there already.
bool create_durably(const fs::path& directory) {
  if (fs::exists(directory)) return false;
  const fs::path above = directory.parent_path();
  create_durably(above);
  fs::create_directory(directory);
  sync_path(above);
  return true;
}

/// `path` as one that has a parent.
fs::path whole(const fs::path& path) {
  const fs::path normal = fs::absolute(path).lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

/// Gives `from` its name for good. When it is open whether the name would last, neither stays.
void rename_durably(const fs::path& from, const fs::path& to) {
  fs::rename(from, to);
  try {
    sync_path(to.parent_path());
  } catch (...) {
    fs::remove_all(to);
    throw;
  }
}

fs::path part_of(fs::path name) {
  return name += ".part";
}

}  // namespace

FileStore::FileStore(fs::path root, std::int64_t reserved_bytes)
    : root_(std::move(root)),
      disk_(std::make_shared<DiskSpace>([where = root_] { return free_bytes_at(where); }, reserved_bytes)),
      ballast_(root_ / "ballast", kBallastBytes) {
  if (create_durably(whole(root_))) fs::permissions(root_, fs::perms::owner_all);
  refuse_network_file_system(root_);
  lock_ = lock(root_);
  sweep(kTemporary, [](std::string_view) { return false; });
}

std::int64_t FileStore::free_bytes() const {
  return free_bytes_at(root_);
}

void FileStore::lay_ballast() {
  if (free_bytes() >= 2 * kBallastBytes) ballast_.lay();
}

std::optional<IncomingFile> FileStore::receive(std::int64_t expected_bytes) {
  static std::atomic<std::uint64_t> count =
      0;  // the folder is swept at the start, so a number is unique enough
  IncomingFile file(root_ / kTemporary / std::to_string(++count), disk_);
  if (!file.expect(expected_bytes)) return std::nullopt;
  return file;
}

void FileStore::adopt(IncomingFile file, const fs::path& name) {
  file.finish();
  rename_durably(file.path(), root_ / name);
  file.release();
}

fs::path FileStore::begin_directory(const fs::path& name) {
  const fs::path part = root_ / part_of(name);
  fs::remove_all(part);
  fs::create_directory(part);
  return part;
}

void FileStore::adopt_directory(const fs::path& name) {
  const fs::path part = root_ / part_of(name);
  sync_path(part);
  rename_durably(part, root_ / name);
}

void FileStore::abandon_directory(const fs::path& name) {
  fs::remove_all(root_ / part_of(name));
}

void FileStore::remove(const fs::path& name) {
  fs::remove_all(root_ / name);
  sync_path((root_ / name).parent_path());
}

void FileStore::sweep(const fs::path& folder, const std::function<bool(std::string_view)>& keep) {
  fs::create_directories(root_ / folder);
  std::vector<fs::path> leftovers;
  for (const auto& entry : fs::directory_iterator(root_ / folder))
    if (!keep(entry.path().filename().string())) leftovers.push_back(entry.path());
  for (const fs::path& leftover : leftovers) fs::remove_all(leftover);
  sync_path(root_ / folder);
  sync_path(root_);
}

}  // namespace volsmooth
