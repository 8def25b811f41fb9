#include "service/http/digest_check.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

/// Takes anything.
class Anything : public BodyReceiver {
 public:
  tl::expected<void, Problem> receive(std::string_view) override { return {}; }
};

constexpr std::string_view kBody = "{\"hello\": \"world\"}\n";
// Of kBody, RFC 9530, appendix D.
constexpr std::string_view kDigest = "sha-256=:RK/0qy18MlBSVnWgjwz6lZEWjP/lF5HF9bvEF8FabDg=:";
constexpr std::string_view kOther = "sha-256=:X48E9qOokqqrvdts8nOJRJN3OWDUoyWxBf7kbu9DBPE=:";

/// What becomes of kBody, sent in two pieces under these fields: a slug, or nothing.
std::string outcome(std::vector<HeaderField> fields, std::string_view body = kBody) {
  Head head;
  head.fields = std::move(fields);
  const auto receiver = with_digest_check(head, std::make_unique<Anything>());
  if (!receiver) return receiver.error().slug;
  for (const auto piece : {body.substr(0, 5), body.substr(5)}) EXPECT_TRUE((*receiver)->receive(piece));
  const auto finished = (*receiver)->finish();
  return finished ? "" : finished.error().slug;
}

std::string with(std::string_view value, const std::string& name = "content-digest") {
  return outcome({{name, std::string(value)}});
}

TEST(DigestCheck, LetsTheBodyThroughThatWasPromised) {
  EXPECT_EQ(with(kDigest), "");
  EXPECT_EQ(with(kDigest, "repr-digest"), "");
  EXPECT_EQ(with(std::string(kDigest) + ";note=1"), "");
  EXPECT_EQ(with("sha-512=:AA==:, " + std::string(kDigest)), "");
  EXPECT_EQ(outcome({}), "");
}

TEST(DigestCheck, RefusesAnotherBody) {
  EXPECT_EQ(with(kOther), "digest-mismatch");
  EXPECT_EQ(with(kOther, "repr-digest"), "digest-mismatch");
  EXPECT_EQ(outcome({{"content-digest", std::string(kDigest)}}, "{\"hello\": \"World\"}\n"),
            "digest-mismatch");
}

TEST(DigestCheck, EveryPromiseCounts) {
  for (const auto& [first, second] : {std::pair(kDigest, kOther), std::pair(kOther, kDigest)}) {
    EXPECT_EQ(outcome({{"content-digest", std::string(first)}, {"repr-digest", std::string(second)}}),
              "digest-mismatch");
    EXPECT_EQ(with(std::string(first) + ", " + std::string(second)), "digest-mismatch");
  }
}

TEST(DigestCheck, RefusesWhatCannotBeADigest) {
  for (const char* value : {"sha-256", "sha-256=", "sha-256=:", "sha-256=::", "sha-256=:AAAA:",
                            "sha-256=RK/0qy18MlBSVnWgjwz6lZEWjP/lF5HF9bvEF8FabDg=",
                            "sha-256=:44aff4ab2d7c3250525675a08f0cfa9591168cffe51791c5f5bbc417c15a6c38:",
                            "sha-256=:RK/0qy18MlBSVnWgjwz6lZEWjP_lF5HF9bvEF8FabDg=:"})
    EXPECT_EQ(with(value), "bad-header") << value;
}

TEST(DigestCheck, LeavesOtherAlgorithmsAlone) {
  for (const char* value : {"sha-512=:AAAA:", "md5=:AAAA:", "adler=1", "nonsense"})
    EXPECT_EQ(with(value), "") << value;
}

}  // namespace
}  // namespace volsmooth
