#include "service/storage/posix.h"

#include <fcntl.h>
#include <gtest/gtest.h>

#include <system_error>

#include "tests/support/disk_calls.h"
#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

/// A disk that takes three bytes at a time, and is interrupted before every other call.
TEST(Posix, WritesWholeWhatTheDiskTakesInPieces) {
  const ScratchFolder scratch;
  {
    const FileDescriptor file = open_file(scratch / "a", O_WRONLY | O_CREAT);
    const DiskCalls disk(
        scratch.path(), [calls = 0](const std::string&) mutable { return ++calls % 2 == 1 ? EINTR : 0; }, 3);
    const std::string text = "0123456789";
    write_all(file, std::as_bytes(std::span(text)));
    write_at(file, 5, std::as_bytes(std::span(text)));
  }
  EXPECT_EQ(scratch.content("a"), "012340123456789");
}

TEST(Posix, SaysWhatTheDiskSays) {
  const ScratchFolder scratch;
  const FileDescriptor file = open_file(scratch / "a", O_WRONLY | O_CREAT);
  const DiskCalls disk(scratch.path(), [](const std::string&) { return ENOSPC; });
  const std::string text = "x";
  const std::function<void()> calls[] = {[&] { write_all(file, std::as_bytes(std::span(text))); },
                                         [&] { write_at(file, 0, std::as_bytes(std::span(text))); },
                                         [&] { sync_to_disk(file); }};
  for (const auto& call : calls) try {
      call();
      ADD_FAILURE() << "a failure was not noticed";
    } catch (const std::system_error& error) {
      EXPECT_EQ(error.code(), std::errc::no_space_on_device);
    }
  EXPECT_EQ(disk.seen().size(), 3U) << "and is not asked again";
}

}  // namespace
}  // namespace volsmooth
