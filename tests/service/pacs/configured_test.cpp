#include "service/pacs/configured.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

using nlohmann::json;

std::string said_of(const json& object) {
  std::string said;
  know_members(object, {"tenants", "dimse"}, [&](const std::string& sentence) { said += sentence; });
  return said;
}

TEST(Configured, ASlipOfThePenIsNamedWithWhatWasMeant) {
  EXPECT_EQ(said_of({{"tenants", 1}, {"dimse", 2}}), "");
  EXPECT_EQ(said_of({{"tenant", 1}}),
            "'tenant' is not known; known are tenants, dimse; did you mean 'tenants'?");
  EXPECT_EQ(said_of({{"xylophone", 1}}), "'xylophone' is not known; known are tenants, dimse");
}

/// A third of the characters and one more may be wrong.
TEST(Configured, TheNearestIsNoneWhenItIsFar) {
  EXPECT_EQ(nearest_match("abcdef", {"abcxyz", "uvwxyz"}), "abcxyz");
  EXPECT_EQ(nearest_match("abcdef", {"abwxyz"}), "");
  EXPECT_EQ(nearest_match("abc", {"abcdef", "bc", "ac"}), "bc");
  EXPECT_EQ(nearest_match("a", {}), "");
}

TEST(Configured, TextsAreAListOfOneOrMore) {
  EXPECT_EQ(texts_in({"a", "b"}), (std::vector<std::string>{"a", "b"}));
  for (const json& other : {json::array(), json("a"), json::array({"a", 1}), json(nullptr), json::object()})
    EXPECT_FALSE(texts_in(other)) << other;
}

}  // namespace
}  // namespace volsmooth
