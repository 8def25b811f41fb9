#include <random>

#include "tests/service/http/running_server.h"

namespace volsmooth {
namespace {

/// A request that is not as it should be, and what it gets.
struct Row {
  std::string name, bytes;
  int status;
  std::string slug;
  bool closes = true;  ///< where the request ends is in doubt
};

std::string post(const std::string& fields, const std::string& body) {
  return "POST /v1/volumes HTTP/1.1\r\nHost: localhost\r\n" + fields + "\r\n" + body;
}
std::string get(const std::string& target, const std::string& fields = "") {
  return "GET " + target + " HTTP/1.1\r\nHost: localhost\r\n" + fields + "\r\n";
}
std::string coded(const std::string& coding) {
  return post("Transfer-Encoding: " + coding + "\r\n", "5\r\nhello\r\n0\r\n\r\n");
}
std::string chunked(const std::string& body) {
  return post("Transfer-Encoding: chunked\r\n", body);
}
std::string many_fields(int count) {
  std::string fields;
  for (int i = 0; i < count; ++i) fields += "X-" + std::to_string(i) + ": 1\r\n";
  return fields;
}

/// The rows H1 to H25 of what can be sent wrong.
std::vector<Row> rows() {
  const std::string chunk = "5\r\nhello\r\n0\r\n\r\n";
  std::vector<Row> all = {
      {"H1 length, coding", post("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n", chunk), 400,
       "ambiguous-framing"},
      {"H1 coding, length", post("Transfer-Encoding: chunked\r\nContent-Length: 5\r\n", chunk), 400,
       "ambiguous-framing"},
      {"H1 gzip, length", post("Transfer-Encoding: gzip\r\nContent-Length: 5\r\n", "hello"), 400,
       "ambiguous-framing"},
      {"H2 gzip", coded("gzip"), 501, "unsupported-transfer-coding"},
      {"H2 xchunked", coded("xchunked"), 501, "unsupported-transfer-coding"},
      {"H2 chunked, identity", coded("chunked, identity"), 501, "unsupported-transfer-coding"},
      {"H2 identity, chunked", coded("identity, chunked"), 501, "unsupported-transfer-coding"},
      {"H3 twice", post("Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n", chunk), 400,
       "ambiguous-framing"},
      {"H3 chunked, chunked", coded("chunked, chunked"), 400, "ambiguous-framing"},
      {"H3 folded", coded("\r\n chunked"), 400, "bad-header"},
      {"H3 1.0", "POST /v1/volumes HTTP/1.0\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n" + chunk,
       400, "ambiguous-framing"},
      {"H4 differing", post("Content-Length: 5\r\nContent-Length: 6\r\n", "hello"), 400,
       "bad-content-length"},
      {"H5 equal", post("Content-Length: 5\r\nContent-Length: 5\r\n", "hello"), 400, "bad-content-length"},
      {"H6 17 digits", chunked("fffffffffffffffff\r\nhello\r\n0\r\n\r\n"), 400, "bad-chunk"},
      {"H6 0x", chunked("0x5\r\nhello\r\n0\r\n\r\n"), 400, "bad-chunk"},
      {"H6 space", chunked(" 5\r\nhello\r\n0\r\n\r\n"), 400, "bad-chunk"},
      {"H6 line feed", chunked("5\nhello\r\n0\r\n\r\n"), 400, "bad-chunk"},
      {"H6 no end", chunked("5\r\nhelloX0\r\n\r\n"), 400, "bad-chunk"},
      {"H7 extension", chunked("5;" + std::string(9000, 'x') + "\r\nhello\r\n0\r\n\r\n"), 400, "bad-chunk"},
      {"H9 line feeds", "GET /healthz HTTP/1.1\nHost: localhost\n\n", 400, "bad-header"},
      {"H9 return", get("/healthz", "X: a\rb\r\n"), 400, "bad-header"},
      {"H9 nul", get("/healthz", std::string("X: a\0b\r\n", 8)), 400, "bad-header"},
      {"H9 folded", get("/healthz", "X: a\r\n b\r\n"), 400, "bad-header"},
      {"H9 space before colon", get("/healthz", "X : a\r\n"), 400, "bad-header"},
      {"H9 empty name", get("/healthz", ": a\r\n"), 400, "bad-header"},
      {"H10 none", "GET /healthz HTTP/1.1\r\n\r\n", 400, "bad-host", false},
      {"H10 two", get("/healthz", "Host: localhost\r\n"), 400, "bad-host", false},
      {"H10 foreign", "GET /healthz HTTP/1.1\r\nHost: example.org\r\n\r\n", 421, "misdirected-request",
       false},
      {"H11 long field", get("/healthz", "X: " + std::string(9 << 10, 'a') + "\r\n"), 431,
       "header-too-large"},
      {"H11 101 fields", get("/healthz", many_fields(101)), 431, "header-too-large"},
      {"H11 long target", get("/" + std::string(8 << 10, 'a')), 414, "uri-too-long"},
      {"H12 high bytes", get("/v1/jobs/\xc3\xa9"), 400, "bad-target", false},
      {"H12 space", get("/v1/jobs/a b"), 400, "bad-target"},
      {"H12 nul", get(std::string("/v1/jobs/a\0b", 12)), 400, "bad-header"},
      {"H12 star", get("*"), 400, "bad-target", false},
      {"H14 0.9", "GET /healthz\r\n", 400, "bad-header"},
      {"H14 1.2", "GET /healthz HTTP/1.2\r\nHost: localhost\r\n\r\n", 505, "unsupported-version"},
      {"H14 2.0", "GET /healthz HTTP/2.0\r\nHost: localhost\r\n\r\n", 505, "unsupported-version"},
      {"H14 preface", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 505, "unsupported-version"},
      {"H15 trace", "TRACE /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n", 501, "unknown-method"},
      {"H15 connect", "CONNECT a:1 HTTP/1.1\r\nHost: localhost\r\n\r\n", 501, "unknown-method"},
      {"H15 wrong", "PUT /healthz HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n", 405,
       "method-not-allowed", false},
      {"H16 bogus", post("Expect: bogus\r\nContent-Length: 5\r\n", "hello"), 417, "expectation-failed"},
      {"H16 too large", post("Expect: 100-continue\r\nContent-Length: 99999999999\r\n", ""), 413,
       "content-too-large"},
      {"H17 over the limit", post("Content-Length: 9000000000000000000\r\n", "hello"), 413,
       "content-too-large"},
      {"H18 no length", post("", ""), 411, "length-required", false},
      {"H19 no type", "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\n{}", 415,
       "unsupported-media-type", false},
      {"H19 coding", post("Content-Length: 5\r\nContent-Encoding: br\r\n", "hello"), 415,
       "unsupported-media-type", false},
      {"H21 digest",
       post("Content-Length: 5\r\nContent-Digest: sha-256=:47DEQpj8HBSa+/TImW+5JCeuQeRkm5NMpJWZG3hSuFU=:\r\n",
            "hello"),
       422, "digest-mismatch", false},
      {"H24 accept", get("/v1/methods", "Accept: image/png\r\n"), 406, "not-acceptable", false},
  };
  for (const char* length : {"5, 6", "+5", "-5", "0x5", "5abc", "", "18446744073709551616"})
    all.push_back({"H4 " + std::string(length),
                   post("Content-Length: " + std::string(length) + "\r\n", "hello"), 400,
                   "bad-content-length"});
  for (const char* target : {"/v1/jobs/../../admin", "/v1/jobs/%2e%2e%2fadmin", "/v1/jobs/a%2Fb", "//v1/jobs",
                             "/v1/jobs/a%00b", "/v1/jobs/%252e%252e", "/v1/jobs/%c0%ae"})
    all.push_back({"H13 " + std::string(target), get(target), 400, "bad-target", false});
  return all;
}

/// Where bytes are cut before they are sent.
using Cut = std::function<std::size_t(std::size_t left)>;

class Rows : public ServerTest {
 protected:
  /// Stops when the server has closed.
  static void send(HttpClient& client, std::string_view bytes, const Cut& cut) {
    while (!bytes.empty()) {
      const std::size_t count = cut(bytes.size());
      if (!client.send(bytes.substr(0, count))) return;
      bytes.remove_prefix(count);
    }
  }

  /// Every row on a connection of its own. What follows it is answered as the next request, or not at all.
  void expect_answers(const Cut& cut) {
    for (const auto& [name, bytes, status, expected, closes] : rows()) {
      SCOPED_TRACE(name);
      auto client = connect();
      send(client, bytes + get("/v1/methods"), cut);
      const HttpAnswer answer = client.receive();
      EXPECT_EQ(answer.status, status) << answer.body;
      EXPECT_EQ(slug(answer), expected);
      EXPECT_EQ(answer.field("x-content-type-options"), "nosniff");
      EXPECT_THAT(answer.field("content-security-policy"), testing::StartsWith("default-src 'none'"));
      EXPECT_EQ(answer.field("cache-control"), "no-store");
      EXPECT_EQ(answer.field("connection"), closes ? "close" : "");
      if (closes)
        EXPECT_TRUE(client.is_closed()) << "desynchronised";
      else
        EXPECT_THAT(client.receive().body, testing::HasSubstr("\"methods\""));
    }
    EXPECT_TRUE(jobs_.volumes(kAnyone)->volumes.empty());
  }
};

TEST_F(Rows, SentWhole) {
  expect_answers([](std::size_t left) { return left; });
}

TEST_F(Rows, SentByteByByte) {
  expect_answers([](std::size_t) { return std::size_t{1}; });
}

TEST_F(Rows, SplitAtRandom) {
  std::mt19937 random(20261126);
  for (int time = 0; time < 3; ++time)
    expect_answers([&](std::size_t left) {
      if (random() % 8 == 0) std::this_thread::sleep_for(std::chrono::microseconds(50));
      return std::min<std::size_t>(left, 1 + random() % 40);
    });
}

/// Whether a read is one piece of a request or many, all that come after one another are answered in order.
TEST_F(Rows, APipelineSplitAtRandomIsAnsweredInOrder) {
  std::mt19937 random(7);
  std::string requests;
  for (int i = 0; i < 1000; ++i)
    requests += get(i % 3 == 0 ? "/healthz" : i % 3 == 1 ? "/v1/nothing" : "/v1/formats");
  auto client = connect();
  std::jthread sender([&] {
    send(client, requests, [&](std::size_t left) { return std::min<std::size_t>(left, 1 + random() % 500); });
  });
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(client.receive().status, i % 3 == 1 ? 404 : 200) << i;
}

/// Who does not read does not hold the answers of others in memory: the next request waits until the last
/// answer was taken, and its sender is cut off in the end.
TEST_F(Rows, WhoDoesNotReadIsCutOff) {
  const std::string id = upload(std::string(3'000'000, 'v'));
  start({.listen = "127.0.0.1:0", .write_seconds = 0.2});
  auto client = connect();
  const std::string ask = get("/v1/volumes/" + id + "/content");
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  bool open = true;
  while (open && std::chrono::steady_clock::now() < end) {
    open = client.send(ask);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_FALSE(open);
  EXPECT_EQ(connect().exchange(get("/healthz")).status, 200);
}

}  // namespace
}  // namespace volsmooth
