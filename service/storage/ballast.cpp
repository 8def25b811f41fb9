#include "service/storage/ballast.h"

#include <fcntl.h>
#include <unistd.h>

#include <exception>

#include "service/storage/posix.h"

namespace volsmooth {

void Ballast::lay() {
  const std::lock_guard lock(mutex_);
  if (lies_) return;
  try {
    const FileDescriptor file = open_file(file_, O_WRONLY | O_CREAT);
    lies_ = ::posix_fallocate(file.get(), 0, bytes_) == 0;
    if (!lies_) ::unlink(file_.c_str());
  } catch (const std::exception&) {  // the disk is full, or worse
  }
}

bool Ballast::drop() {
  const std::lock_guard lock(mutex_);
  if (!lies_) return false;
  lies_ = false;
  try {
    const FileDescriptor file = open_file(file_, O_WRONLY | O_TRUNC);
    sync_to_disk(file);  // blocks may be given away only when it is sure that they are free
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace volsmooth
