#pragma once

#include <sys/types.h>

#include <filesystem>

#include "service/dimse/channel.h"
#include "service/storage/posix.h"

namespace volsmooth {

/// volsmooth-dimse beside the running program; throws std::runtime_error when it is not there.
std::filesystem::path dimse_program();

/// volsmooth-dimse at work, in a process of its own that has nothing open but a channel to us and maybe a
/// connection. It ends with this object.
class DimseChild {
 public:
  /// `connection`: a descriptor that it gets, or -1. Throws std::system_error when it cannot be started.
  explicit DimseChild(const char* command, int connection = -1);
  DimseChild(const DimseChild&) = delete;
  ~DimseChild();  ///< kills it unless it has ended

  Channel channel() const { return Channel(socket_.get()); }
  void finish();      ///< lets it end by itself, for a few seconds
  void kill() const;  ///< from any thread: who waits for it is told that it is gone

 private:
  FileDescriptor socket_;
  pid_t process_ = -1;
};

}  // namespace volsmooth
