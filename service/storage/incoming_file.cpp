#include "service/storage/incoming_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "service/storage/block_sums.h"
#include "service/storage/digest.h"
#include "service/storage/posix.h"

namespace volsmooth {
namespace {

/// How much of the disk an upload of unknown length has promised at a time.
constexpr std::int64_t kPromiseBytes = std::int64_t{4} << 20;

}  // namespace

struct IncomingFile::State {
  State(std::filesystem::path where, std::shared_ptr<DiskSpace> whose_disk)
      : path(std::move(where)),
        file(open_file(path, O_WRONLY | O_CREAT | O_EXCL)),
        disk(std::move(whose_disk)) {}
  ~State() {
    if (!released) ::unlink(path.c_str());
    if (disk) disk->end_promise(promised_bytes);
  }

  bool promise(std::int64_t count) {
    if (!disk) return true;
    if (!disk->promise(count)) return false;
    promised_bytes += count;
    return true;
  }

  void redeem(std::int64_t count) {
    if (!disk) return;
    disk->end_promise(count);
    promised_bytes -= count;
  }

  std::filesystem::path path;
  FileDescriptor file;
  std::shared_ptr<DiskSpace> disk;
  std::int64_t promised_bytes = 0;
  Sha256 running;
  BlockSums sums;
  std::string sha256;  // empty: not finished
  std::int64_t bytes = 0;
  bool released = false;
};

IncomingFile::IncomingFile(std::filesystem::path path, std::shared_ptr<DiskSpace> disk)
    : state_(std::make_unique<State>(std::move(path), std::move(disk))) {}
IncomingFile::IncomingFile(IncomingFile&&) noexcept = default;
IncomingFile& IncomingFile::operator=(IncomingFile&&) noexcept = default;
IncomingFile::~IncomingFile() = default;

bool IncomingFile::expect(std::int64_t bytes) {
  return state_->promise(bytes);
}

void IncomingFile::write(std::span<const std::byte> bytes) {
  const auto count = static_cast<std::int64_t>(bytes.size());
  if (count > state_->promised_bytes && !state_->promise(std::max(count, kPromiseBytes)))
    throw std::system_error(ENOSPC, std::generic_category(), "the disk's reserve");
  write_all(state_->file, bytes);
  state_->redeem(count);
  state_->running.update(bytes);
  state_->sums.update(bytes);
  state_->bytes += count;
}

std::int64_t IncomingFile::bytes() const {
  return state_->bytes;
}
const std::filesystem::path& IncomingFile::path() const {
  return state_->path;
}

std::string IncomingFile::block_sums() const {
  return state_->sums.text();
}

std::string IncomingFile::finish() {
  if (state_->sha256.empty()) {
    sync_to_disk(state_->file);
    state_->file.close();
    state_->sha256 = state_->running.hex();
  }
  return state_->sha256;
}

void IncomingFile::release() {
  state_->released = true;
}

}  // namespace volsmooth
