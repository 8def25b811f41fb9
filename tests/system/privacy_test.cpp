#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {
namespace {

namespace fs = std::filesystem;

TEST(Privacy, NobodyElseMayReadAnythingThatIsStored) {
  const mode_t before = ::umask(022);
  const Daemon daemon(VOLSMOOTHD);
  ::umask(before);
  (void)ServiceClient(daemon).upload(ball_file(16));

  // Each entry by itself: the folder around them may be one that was there before, and open to all.
  int entries = 0;
  for (const auto& entry : fs::recursive_directory_iterator(daemon.data())) {
    ++entries;
    EXPECT_EQ(entry.status().permissions() & (fs::perms::group_all | fs::perms::others_all), fs::perms::none)
        << entry.path();
  }
  EXPECT_GT(entries, 0);
}

}  // namespace
}  // namespace volsmooth::test
