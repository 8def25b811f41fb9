#include "service/pacs/arrivals.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <stdexcept>

#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

constexpr std::int64_t kMaxBytes = 10;

/// An inbox that remembers, and answers as it is told.
class ArrivalsAt : public testing::Test {
 protected:
  ArrivalsAt() {
    inbox_.begin = [this]() -> tl::expected<IncomingFile, Problem> {
      if (!refusal_.empty() && refuses_at_once_) return tl::unexpected(Problem{refusal_, ""});
      return IncomingFile(scratch_.path() / std::to_string(begun_++));
    };
    inbox_.keep = [this](const std::string& preset,
                         IncomingFile file) -> tl::expected<std::vector<ArrivedInstance>, Problem> {
      if (breaks_) throw std::runtime_error("the store");
      if (!refusal_.empty()) return tl::unexpected(Problem{refusal_, ""});
      file.finish();
      std::ifstream in(file.path());
      kept_.push_back(preset + ": " + std::string(std::istreambuf_iterator<char>(in), {}));
      return std::vector<ArrivedInstance>{{"class", "instance", "study", "series", 0, file.bytes()}};
    };
    inbox_.max_bytes = kMaxBytes;
  }

  std::uint16_t status_of_one(const std::string& bytes) {
    arrivals_.take(bytes);
    return arrivals_.keep("head", "class", "instance");
  }

  ScratchFolder scratch_;
  Inbox inbox_;
  std::string refusal_;
  bool refuses_at_once_ = false, breaks_ = false;
  int begun_ = 0;
  std::vector<std::string> kept_;
  Arrivals arrivals_{inbox_};
};

TEST_F(ArrivalsAt, EachIsKeptForItsPreset) {
  arrivals_.take("one, ");
  arrivals_.take("two");
  EXPECT_EQ(arrivals_.keep("head", "class", "instance"), 0x0000);
  EXPECT_EQ(status_of_one("three"), 0x0000);
  EXPECT_EQ(kept_, (std::vector<std::string>{"head: one, two", "head: three"}));
}

TEST_F(ArrivalsAt, OneThatIsTooLargeIsRefusedAndTheNextIsNot) {
  arrivals_.take("12345");
  EXPECT_EQ(status_of_one("678901"), 0xC000);
  EXPECT_EQ(status_of_one("1234567890"), 0x0000);
  EXPECT_EQ(kept_, std::vector<std::string>{"head: 1234567890"});
}

/// DICOM PS3.4, table B.2-1.
TEST_F(ArrivalsAt, AProblemHasItsStatus) {
  const std::vector<std::pair<std::string, std::uint16_t>> table = {
      {"insufficient-storage", 0xA700}, {"content-too-large", 0xC000},       {"not-ready", 0xA700},
      {"queue-full", 0xA700},           {"dicom-missing-attribute", 0xC000}, {"dicom-decode-failed", 0xC000}};
  for (const bool at_once : {false, true})
    for (const auto& [slug, status] : table) {
      refusal_ = slug;
      refuses_at_once_ = at_once;
      EXPECT_EQ(status_of_one("x"), status) << slug;
    }
}

TEST_F(ArrivalsAt, WhatMayPassIsWorthAnotherTry) {
  Problem killed{"dicom-decode-failed", "The reader was killed."};
  EXPECT_EQ(status_of(killed), 0xC000);
  killed.is_passing = true;
  EXPECT_EQ(status_of(killed), 0xA700);
}

TEST_F(ArrivalsAt, AStoreThatFailsIsWorthAnotherTry) {
  breaks_ = true;
  EXPECT_EQ(status_of_one("x"), 0xA700);
}

TEST_F(ArrivalsAt, NothingCannotBeUnderstood) {
  EXPECT_EQ(arrivals_.keep("head", "class", "instance"), 0xC000);
}

TEST_F(ArrivalsAt, OneThatIsNotWhatWasAnnouncedIsKeptWithAWarning) {
  arrivals_.take("x");
  EXPECT_EQ(arrivals_.keep("head", "class", "another"), 0xB007);
  arrivals_.take("x");
  EXPECT_EQ(arrivals_.keep("head", "another", "instance"), 0xB007);
}

}  // namespace
}  // namespace volsmooth
