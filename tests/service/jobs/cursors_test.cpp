#include "service/jobs/cursors.h"

#include <gtest/gtest.h>

#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

class CursorsTest : public testing::Test {
 protected:
  ScratchFolder scratch_;
  StoreDatabase database_{scratch_.path() / "test.db"};
  Cursors cursors_{database_};
};

TEST_F(CursorsTest, ComeBackAsWhatTheyWereAlsoAfterARestart) {
  const Cursors later(database_);
  for (const std::int64_t sequence :
       {std::int64_t{0}, std::int64_t{1}, std::int64_t{300}, std::int64_t{1} << 60})
    EXPECT_EQ(later.sequence_at("a", cursors_.at("a", sequence)), sequence);
}

TEST_F(CursorsTest, AreOneTenantsAndTellNothing) {
  const std::string one = cursors_.at("a", 1), two = cursors_.at("a", 2);
  EXPECT_FALSE(cursors_.sequence_at("b", one));
  EXPECT_NE(one, cursors_.at("b", 1));
  int differing = 0;
  for (std::size_t i = 0; i < one.size(); ++i) differing += one[i] != two[i] ? 1 : 0;
  EXPECT_GT(differing, 16) << "numbers that follow each other must not look alike";
}

TEST_F(CursorsTest, NothingElseIsOne) {
  std::string changed = cursors_.at("a", 7);
  changed[5] = changed[5] == '0' ? '1' : '0';
  for (const std::string& wrong :
       {std::string(), std::string("7"), std::string(32, 'x'), std::string(32, '0'), std::string(33, '0'),
        changed, "-" + std::string(31, '1')})
    EXPECT_FALSE(cursors_.sequence_at("a", wrong)) << wrong;
}

TEST_F(CursorsTest, EveryStoreHasASecretOfItsOwn) {
  StoreDatabase other(scratch_.path() / "other.db");
  EXPECT_FALSE(Cursors(other).sequence_at("a", cursors_.at("a", 7)));
}

}  // namespace
}  // namespace volsmooth
