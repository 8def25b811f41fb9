#include "service/http/head_check.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

struct Case {
  std::string name;
  std::string head;
  std::string slug;  ///< empty: accepted
};
std::ostream& operator<<(std::ostream& out, const Case& one) {
  return out << one.name;
}

std::string with(const std::string& fields) {
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

class HeadCheck : public testing::TestWithParam<Case> {};

TEST_P(HeadCheck, GivesItsAnswer) {
  const auto head = check_head(GetParam().head);
  EXPECT_EQ(head ? "" : head.error().slug, GetParam().slug);
}

// malicious-input rows H1 to H5, H9, H11, H12, H14 to H16.
INSTANTIATE_TEST_SUITE_P(
    Rows, HeadCheck,
    testing::Values(
        Case{"plain", with(""), ""}, Case{"length", with("Content-Length: 5\r\n"), ""},
        Case{"chunked", with("Transfer-Encoding: chunked\r\n"), ""},
        Case{"chunked_in_capitals", with("TRANSFER-ENCODING: Chunked\r\n"), ""},
        Case{"version_1_0", line("GET / HTTP/1.0"), ""}, Case{"empty_value", with("X-Empty:\r\n"), ""},
        Case{"tab_in_value", with("X: a\tb\r\n"), ""},

        Case{"H1_length_then_chunked", with("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n"),
             "ambiguous-framing"},
        Case{"H1_chunked_then_length", with("Transfer-Encoding: chunked\r\nContent-Length: 5\r\n"),
             "ambiguous-framing"},
        Case{"H1_gzip_then_length", with("Transfer-Encoding: gzip\r\nContent-Length: 5\r\n"),
             "ambiguous-framing"},
        Case{"H2_gzip", with("Transfer-Encoding: gzip\r\n"), "unsupported-transfer-coding"},
        Case{"H2_xchunked", with("Transfer-Encoding: xchunked\r\n"), "unsupported-transfer-coding"},
        Case{"H2_chunked_identity", with("Transfer-Encoding: chunked, identity\r\n"),
             "unsupported-transfer-coding"},
        Case{"H2_identity_chunked", with("Transfer-Encoding: identity, chunked\r\n"),
             "unsupported-transfer-coding"},
        Case{"H2_empty", with("Transfer-Encoding:\r\n"), "unsupported-transfer-coding"},
        Case{"H3_twice", with("Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n"),
             "ambiguous-framing"},
        Case{"H3_chunked_chunked", with("Transfer-Encoding: chunked, chunked\r\n"), "ambiguous-framing"},
        Case{"H3_in_1_0", "POST / HTTP/1.0\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n",
             "ambiguous-framing"},
        Case{"H3_folded", with("Transfer-Encoding:\r\n chunked\r\n"), "bad-header"},
        Case{"H4_differing", with("Content-Length: 5\r\nContent-Length: 6\r\n"), "bad-content-length"},
        Case{"H4_list", with("Content-Length: 5, 6\r\n"), "bad-content-length"},
        Case{"H4_plus", with("Content-Length: +5\r\n"), "bad-content-length"},
        Case{"H4_minus", with("Content-Length: -5\r\n"), "bad-content-length"},
        Case{"H4_hex", with("Content-Length: 0x5\r\n"), "bad-content-length"},
        Case{"H4_letters", with("Content-Length: 5abc\r\n"), "bad-content-length"},
        Case{"H4_empty", with("Content-Length:\r\n"), "bad-content-length"},
        Case{"H4_2_to_63", with("Content-Length: 9223372036854775808\r\n"), "bad-content-length"},
        Case{"H4_2_to_64", with("Content-Length: 18446744073709551616\r\n"), "bad-content-length"},
        Case{"H5_equal", with("Content-Length: 5\r\nContent-Length: 5\r\n"), "bad-content-length"},

        Case{"H9_bare_lf", "GET / HTTP/1.1\nHost: localhost\n\n", "bad-header"},
        Case{"H9_bare_lf_in_field", with("X: a\nY: b\r\n"), "bad-header"},
        Case{"H9_bare_cr", with("X: a\rY: b\r\n"), "bad-header"},
        Case{"H9_nul", with(std::string("X: a\0b\r\n", 8)), "bad-header"},
        Case{"H9_folded", with("X: a\r\n b\r\n"), "bad-header"},
        Case{"H9_space_before_colon", with("X : a\r\n"), "bad-header"},
        Case{"H9_empty_name", with(": a\r\n"), "bad-header"},
        Case{"H9_no_colon", with("X\r\n"), "bad-header"},
        Case{"H9_delete", with("X: \x7f\r\n"), "bad-header"},
        Case{"H11_101_fields", with(repeated("X: a\r\n", 100)), "header-too-large"},
        Case{"H11_100_fields", with(repeated("X: a\r\n", 99)), ""},
        Case{"H11_9_KB", with("X: " + std::string(9000, 'a') + "\r\n"), "header-too-large"},
        Case{"H11_target_in_an_endless_line", "GET /" + std::string(8192, 'a'), "uri-too-long"},
        Case{"H11_target", line("GET /" + std::string(5000, 'a') + " HTTP/1.1"), "uri-too-long"},
        Case{"H12_space_in_target", line("GET /a b HTTP/1.1"), ""},  // found by parse_target
        Case{"H14_0_9", "GET /\r\n", "bad-header"},
        Case{"H14_1_2", line("GET / HTTP/1.2"), "unsupported-version"},
        Case{"H14_2_0", line("GET / HTTP/2.0"), "unsupported-version"},
        Case{"H14_preface", "PRI * HTTP/2.0\r\n\r\n", "unsupported-version"},
        Case{"H14_garbage_version", line("GET / HTTP/one"), "bad-header"},
        Case{"H14_no_target", line("GET HTTP/1.1"), "bad-header"},
        Case{"H15_trace", line("TRACE / HTTP/1.1"), "unknown-method"},
        Case{"H15_connect", line("CONNECT localhost:80 HTTP/1.1"), "unknown-method"},
        Case{"H15_garbage", line("get / HTTP/1.1"), "unknown-method"},
        Case{"H15_not_a_token", line("G(T / HTTP/1.1"), "bad-header"},
        Case{"H16_bogus", with("Expect: bogus\r\n"), "expectation-failed"},
        Case{"H16_continue", with("Expect: 100-Continue\r\n"), ""}, Case{"nothing", "\r\n\r\n", "bad-header"},
        Case{"cut", "GET / HTTP/1.1\r\nHost: a\r\n", "bad-header"}),
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
