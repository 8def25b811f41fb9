#include "service/http/head_check.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

struct CheckedHead {
  std::string name;
  std::string head;
  std::string slug;  ///< empty: accepted
};
std::ostream& operator<<(std::ostream& out, const CheckedHead& one) {
  return out << one.name;
}

std::string head_with(const std::string& fields) {
  return "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\n" + fields + "\r\n";
}
std::string line(const std::string& request_line) {
  return request_line + "\r\nHost: localhost\r\n\r\n";
}
std::string repeated(const std::string& text, int times) {
  std::string result;
  for (int i = 0; i < times; ++i) result += text;
  return result;
}

class HeadCheck : public testing::TestWithParam<CheckedHead> {};

TEST_P(HeadCheck, GivesItsAnswer) {
  const auto head = check_head(GetParam().head);
  EXPECT_EQ(head ? "" : head.error().slug, GetParam().slug);
}

// malicious-input rows H1 to H5, H9, H11, H12, H14 to H16.
INSTANTIATE_TEST_SUITE_P(
    Rows, HeadCheck,
    testing::Values(
        CheckedHead{"plain", head_with(""), ""},
        CheckedHead{"length", head_with("Content-Length: 5\r\n"), ""},
        CheckedHead{"chunked", head_with("Transfer-Encoding: chunked\r\n"), ""},
        CheckedHead{"chunked_in_capitals", head_with("TRANSFER-ENCODING: Chunked\r\n"), ""},
        CheckedHead{"version_1_0", line("GET / HTTP/1.0"), ""},
        CheckedHead{"empty_value", head_with("X-Empty:\r\n"), ""},
        CheckedHead{"tab_in_value", head_with("X: a\tb\r\n"), ""},

        CheckedHead{"H1_length_then_chunked",
                    head_with("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n"), "ambiguous-framing"},
        CheckedHead{"H1_chunked_then_length",
                    head_with("Transfer-Encoding: chunked\r\nContent-Length: 5\r\n"), "ambiguous-framing"},
        CheckedHead{"H1_gzip_then_length", head_with("Transfer-Encoding: gzip\r\nContent-Length: 5\r\n"),
                    "ambiguous-framing"},
        CheckedHead{"H2_gzip", head_with("Transfer-Encoding: gzip\r\n"), "unsupported-transfer-coding"},
        CheckedHead{"H2_xchunked", head_with("Transfer-Encoding: xchunked\r\n"),
                    "unsupported-transfer-coding"},
        CheckedHead{"H2_chunked_identity", head_with("Transfer-Encoding: chunked, identity\r\n"),
                    "unsupported-transfer-coding"},
        CheckedHead{"H2_identity_chunked", head_with("Transfer-Encoding: identity, chunked\r\n"),
                    "unsupported-transfer-coding"},
        CheckedHead{"H2_empty", head_with("Transfer-Encoding:\r\n"), "unsupported-transfer-coding"},
        CheckedHead{"H3_twice", head_with("Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n"),
                    "ambiguous-framing"},
        CheckedHead{"H3_chunked_chunked", head_with("Transfer-Encoding: chunked, chunked\r\n"),
                    "ambiguous-framing"},
        CheckedHead{"H3_in_1_0", "POST / HTTP/1.0\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n",
                    "ambiguous-framing"},
        CheckedHead{"H3_folded", head_with("Transfer-Encoding:\r\n chunked\r\n"), "bad-header"},
        CheckedHead{"H4_differing", head_with("Content-Length: 5\r\nContent-Length: 6\r\n"),
                    "bad-content-length"},
        CheckedHead{"H4_list", head_with("Content-Length: 5, 6\r\n"), "bad-content-length"},
        CheckedHead{"H4_plus", head_with("Content-Length: +5\r\n"), "bad-content-length"},
        CheckedHead{"H4_minus", head_with("Content-Length: -5\r\n"), "bad-content-length"},
        CheckedHead{"H4_hex", head_with("Content-Length: 0x5\r\n"), "bad-content-length"},
        CheckedHead{"H4_letters", head_with("Content-Length: 5abc\r\n"), "bad-content-length"},
        CheckedHead{"H4_empty", head_with("Content-Length:\r\n"), "bad-content-length"},
        CheckedHead{"H4_2_to_63", head_with("Content-Length: 9223372036854775808\r\n"), "bad-content-length"},
        CheckedHead{"H4_2_to_64", head_with("Content-Length: 18446744073709551616\r\n"),
                    "bad-content-length"},
        CheckedHead{"H5_equal", head_with("Content-Length: 5\r\nContent-Length: 5\r\n"),
                    "bad-content-length"},

        CheckedHead{"H9_bare_lf", "GET / HTTP/1.1\nHost: localhost\n\n", "bad-header"},
        CheckedHead{"H9_bare_lf_in_field", head_with("X: a\nY: b\r\n"), "bad-header"},
        CheckedHead{"H9_bare_cr", head_with("X: a\rY: b\r\n"), "bad-header"},
        CheckedHead{"H9_nul", head_with(std::string("X: a\0b\r\n", 8)), "bad-header"},
        CheckedHead{"H9_folded", head_with("X: a\r\n b\r\n"), "bad-header"},
        CheckedHead{"H9_space_before_colon", head_with("X : a\r\n"), "bad-header"},
        CheckedHead{"H9_empty_name", head_with(": a\r\n"), "bad-header"},
        CheckedHead{"H9_no_colon", head_with("X\r\n"), "bad-header"},
        CheckedHead{"H9_delete", head_with("X: \x7f\r\n"), "bad-header"},
        CheckedHead{"H11_101_fields", head_with(repeated("X: a\r\n", 100)), "header-too-large"},
        CheckedHead{"H11_100_fields", head_with(repeated("X: a\r\n", 99)), ""},
        CheckedHead{"H11_9_KB", head_with("X: " + std::string(9000, 'a') + "\r\n"), "header-too-large"},
        CheckedHead{"H11_target_in_an_endless_line", "GET /" + std::string(8192, 'a'), "uri-too-long"},
        CheckedHead{"H11_target", line("GET /" + std::string(5000, 'a') + " HTTP/1.1"), "uri-too-long"},
        CheckedHead{"H12_space_in_target", line("GET /a b HTTP/1.1"), "bad-target"},
        CheckedHead{"H14_0_9", "GET /\r\n", "bad-header"},
        CheckedHead{"H14_1_2", line("GET / HTTP/1.2"), "unsupported-version"},
        CheckedHead{"H14_2_0", line("GET / HTTP/2.0"), "unsupported-version"},
        CheckedHead{"H14_preface", "PRI * HTTP/2.0\r\n\r\n", "unsupported-version"},
        CheckedHead{"H14_garbage_version", line("GET / HTTP/one"), "bad-header"},
        CheckedHead{"H14_no_target", line("GET HTTP/1.1"), "bad-header"},
        CheckedHead{"H15_trace", line("TRACE / HTTP/1.1"), "unknown-method"},
        CheckedHead{"H15_connect", line("CONNECT localhost:80 HTTP/1.1"), "unknown-method"},
        CheckedHead{"H15_garbage", line("get / HTTP/1.1"), "unknown-method"},
        CheckedHead{"H15_not_a_token", line("G(T / HTTP/1.1"), "bad-header"},
        CheckedHead{"H16_bogus", head_with("Expect: bogus\r\n"), "expectation-failed"},
        CheckedHead{"H16_continue", head_with("Expect: 100-Continue\r\n"), ""},
        CheckedHead{"nothing", "\r\n\r\n", "bad-header"},
        CheckedHead{"cut", "GET / HTTP/1.1\r\nHost: a\r\n", "bad-header"}),
    [](const auto& one) { return one.param.name; });

TEST(HeadCheckResult, HoldsWhatTheHeadSaid) {
  const auto head = check_head(
      "POST /v1/volumes?a=b HTTP/1.1\r\nHost: localhost:1\r\nX-Thing:  with spaces \t\r\nContent-Length: "
      "42\r\n"
      "Expect: 100-continue\r\nConnection: x, Close\r\n\r\n");
  ASSERT_TRUE(head);
  EXPECT_EQ(head->method, "POST");
  EXPECT_EQ(head->target, "/v1/volumes?a=b");
  EXPECT_EQ(head->header("x-thing"), "with spaces");
  EXPECT_EQ(head->header("missing"), "");
  EXPECT_EQ(head->content_length, 42);
  EXPECT_TRUE(head->expects_continue);
  EXPECT_FALSE(head->keep_alive);
}

TEST(HeadCheckResult, Version1_0NeitherKeepsTheConnectionNorKnows100Continue) {
  const auto head = check_head("POST / HTTP/1.0\r\nExpect: 100-continue\r\nConnection: keep-alive\r\n\r\n");
  ASSERT_TRUE(head);
  EXPECT_FALSE(head->keep_alive);
  EXPECT_FALSE(head->expects_continue);
}

TEST(HeadEnd, IsFoundAtTheEmptyLineWhicheverBytesFollow) {
  const std::string head = "GET / HTTP/1.1\r\nHost: a\r\n\r\n";
  EXPECT_EQ(head_end(head + "body\r\n\r\n"), head.size());
  for (std::size_t length = 0; length < head.size(); ++length)
    EXPECT_EQ(head_end(head.substr(0, length)), std::nullopt) << length;
}

TEST(HeadEnd, DoesNotWaitForMoreOfWhatCannotBecomeAHead) {
  for (const std::string bytes :
       {"GET / HTTP/1.1\n", "\x16\x03\x01", "GET /\r\n", "GET / HTTP/1.1\rX", "\r\n", "GET \x7f"}) {
    const auto end = head_end(bytes);
    ASSERT_TRUE(end) << testing::PrintToString(bytes);
    EXPECT_FALSE(check_head(std::string_view(bytes).substr(0, *end)));
  }
}

}  // namespace
}  // namespace volsmooth
