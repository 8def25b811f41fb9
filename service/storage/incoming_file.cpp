#include "service/storage/incoming_file.h"

#include <fcntl.h>
#include <unistd.h>

#include "service/storage/digest.h"
#include "service/storage/posix.h"

namespace volsmooth {

struct IncomingFile::State {
  explicit State(std::filesystem::path where)
      : path(std::move(where)), file(open_file(path, O_WRONLY | O_CREAT | O_EXCL)) {}
  ~State() {
    if (!released) ::unlink(path.c_str());
  }

  std::filesystem::path path;
  FileDescriptor file;
  Sha256 running;
  std::string sha256;  // empty: not finished
  std::int64_t bytes = 0;
  bool released = false;
};

IncomingFile::IncomingFile(std::filesystem::path path) : state_(std::make_unique<State>(std::move(path))) {}
IncomingFile::IncomingFile(IncomingFile&&) noexcept = default;
IncomingFile& IncomingFile::operator=(IncomingFile&&) noexcept = default;
IncomingFile::~IncomingFile() = default;

void IncomingFile::write(std::span<const std::byte> bytes) {
  write_all(state_->file, bytes);
  state_->running.update(bytes);
  state_->bytes += static_cast<std::int64_t>(bytes.size());
}

std::int64_t IncomingFile::bytes() const {
  return state_->bytes;
}
const std::filesystem::path& IncomingFile::path() const {
  return state_->path;
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
