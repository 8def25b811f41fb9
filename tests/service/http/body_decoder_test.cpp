#include "service/http/body_decoder.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

Head chunked_head() {
  Head head;
  head.chunked = true;
  return head;
}

struct Decoded {
  std::string body;
  std::size_t taken = 0;
  bool done = false, malformed = false;
};

/// Decodes `in` through windows of `step` bytes.
Decoded decoded(const Head& head, std::string_view in, std::size_t step) {
  BodyDecoder decoder(head);
  Decoded result;
  std::string out(step, '\0');
  while (!decoder.done() && result.taken < in.size()) {
    const auto did = decoder.decode(in.substr(result.taken, step), out);
    if (!did) {
      result.malformed = true;
      break;
    }
    result.body.append(out, 0, did->given);
    result.taken += did->taken;
  }
  result.done = decoder.done();
  return result;
}

TEST(BodyDecoder, IsTheSameHoweverTheBytesArrive) {
  const std::string chunks =
      "5;name=\"value\"\r\nab\r\nc\r\n000A\r\n0123456789\r\n0\r\nContent-Length: 9\r\nX: y\r\n\r\n";
  for (std::size_t step = 1; step <= chunks.size(); ++step) {
    const auto result = decoded(chunked_head(), chunks + "GET /", step);
    EXPECT_EQ(result.body, "ab\r\nc0123456789");
    EXPECT_EQ(result.taken, chunks.size());
    EXPECT_TRUE(result.done);
  }
}

TEST(BodyDecoder, EndsWithItsContentLength) {
  Head head;
  head.content_length = 5;
  for (std::size_t step = 1; step <= 8; ++step) {
    const auto result = decoded(head, "abcdeGET", step);
    EXPECT_EQ(result.body, "abcde");
    EXPECT_EQ(result.taken, 5);
    EXPECT_TRUE(result.done);
  }
}

TEST(BodyDecoder, NothingFollowsAHeadWithoutABody) {
  EXPECT_TRUE(BodyDecoder(Head{}).done());
  Head empty;
  empty.content_length = 0;
  EXPECT_TRUE(BodyDecoder(empty).done());
}

class MalformedChunks : public testing::TestWithParam<std::string> {};

TEST_P(MalformedChunks, AreFoundWithoutWaitingForMore) {
  for (const std::size_t step : {std::size_t{1}, std::size_t{1000}})
    EXPECT_TRUE(decoded(chunked_head(), GetParam(), step).malformed);
}

// malicious-input rows H6 and H7.
INSTANTIATE_TEST_SUITE_P(Rows, MalformedChunks,
                         testing::Values("00000000000000001", "0x5", " 5", "5 ", "5\n", "5\r\r", "\r", ";",
                                         "-5", "g", "1\r\nab", "1\r\na\n", "1\r\na\rb",
                                         "1;" + std::string(257, 'a'), "1;a\n", "1;\x01", "0\r\nX: a\n",
                                         "0\r\n" + std::string(9000, 'a'), "0\r\n\n", "0\r\n\ra"));

}  // namespace
}  // namespace volsmooth
