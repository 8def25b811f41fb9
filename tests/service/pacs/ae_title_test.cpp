#include "service/pacs/ae_title.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

TEST(AeTitle, IsWhatDicomWrites) {
  for (const char* title : {"A", "PACS", "pacs-1", "CT ROOM 2", "SIXTEEN_LETTERS_"})
    EXPECT_TRUE(is_ae_title(title));
  for (const char* title : {"", " ", "PACS ", " PACS", "A\\B", "SEVENTEEN_LETTERS", "A\nB", "\xC3\x84RZTE"})
    EXPECT_FALSE(is_ae_title(title)) << title;
}

}  // namespace
}  // namespace volsmooth
