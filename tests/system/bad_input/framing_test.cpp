#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/system/bad_input/survivor.h"

namespace volsmooth::test {
namespace {

/// A request that is not what HTTP allows, and the statuses that refuse it.
struct BadRequest {
  std::string name;
  std::string bytes;
  std::vector<int> statuses;
};

std::string host() {
  return "Host: 127.0.0.1:" + std::to_string(survivor().daemon().port()) + "\r\n";
}

/// A request with header lines (each with its end) and a body.
std::string post(const std::string& header_lines, const std::string& body) {
  return "POST /v1/volumes HTTP/1.1\r\n" + host() + header_lines + "\r\n" + body;
}
std::string get(const std::string& target, const std::string& header_lines = {}) {
  return "GET " + target + " HTTP/1.1\r\n" + host() + header_lines + "\r\n";
}

std::string many_fields(int count) {
  std::string lines;
  for (int i = 0; i < count; ++i) lines += "X-" + std::to_string(i) + ": 1\r\n";
  return lines;
}

std::vector<BadRequest> bad_requests() {
  const std::string chunk = "5\r\nhello\r\n0\r\n\r\n";
  const std::string chunked = "Transfer-Encoding: chunked\r\n";
  std::vector<BadRequest> rows = {
      {"H1LengthThenCoding", post("Content-Length: 5\r\n" + chunked, chunk), {400}},
      {"H1CodingThenLength", post(chunked + "Content-Length: 5\r\n", chunk), {400}},
      {"H1GzipThenLength", post("Transfer-Encoding: gzip\r\nContent-Length: 5\r\n", "hello"), {400, 501}},
      {"H2Gzip", post("Transfer-Encoding: gzip\r\n", chunk), {501}},
      {"H2Xchunked", post("Transfer-Encoding: xchunked\r\n", chunk), {501}},
      {"H2ChunkedIdentity", post("Transfer-Encoding: chunked, identity\r\n", chunk), {501}},
      {"H2IdentityChunked", post("Transfer-Encoding: identity, chunked\r\n", chunk), {501}},
      {"H3Twice", post(chunked + chunked, chunk), {400}},
      {"H3ChunkedChunked", post("Transfer-Encoding: chunked, chunked\r\n", chunk), {400}},
      {"H3Http10", "POST /v1/volumes HTTP/1.0\r\n" + host() + chunked + "\r\n" + chunk, {400, 505}},
      {"H3Folded", post("Transfer-Encoding:\r\n chunked\r\n", chunk), {400}},
      {"H4Differing", post("Content-Length: 5\r\nContent-Length: 6\r\n", "hello"), {400}},
      {"H5Equal", post("Content-Length: 5\r\nContent-Length: 5\r\n", "hello"), {400}},
      {"H6HugeSize", post(chunked, "fffffffffffffffff\r\nhello\r\n0\r\n\r\n"), {400}},
      {"H6Hex", post(chunked, "0x5\r\nhello\r\n0\r\n\r\n"), {400}},
      {"H6Space", post(chunked, " 5\r\nhello\r\n0\r\n\r\n"), {400}},
      {"H6LineFeedOnly", post(chunked, "5\nhello\r\n0\r\n\r\n"), {400}},
      {"H6NoEnd", post(chunked, "5\r\nhelloX0\r\n\r\n"), {400}},
      {"H7LongExtension", post(chunked, "5;" + std::string(100'000, 'x') + "\r\nhello\r\n0\r\n\r\n"), {400}},
      {"H9BareLineFeed", "GET /healthz HTTP/1.1\n" + host() + "\n", {400}},
      {"H9BareReturn", get("/healthz", "X-A: a\rb\r\n"), {400}},
      {"H9Nul", get("/healthz", std::string("X-A: a\0b\r\n", 10)), {400}},
      {"H9Folded", get("/healthz", "X-A: a\r\n b\r\n"), {400}},
      {"H9SpaceBeforeColon", get("/healthz", "X-A : a\r\n"), {400}},
      {"H9EmptyName", get("/healthz", ": a\r\n"), {400}},
      {"H11LongHeader", get("/healthz", "X-A: " + std::string(9 << 10, 'a') + "\r\n"), {431}},
      {"H11ManyFields", get("/healthz", many_fields(101)), {431}},
      {"H11LongTarget", get("/" + std::string(8 << 10, 'a')), {414}},
      {"H12Nul", get(std::string("/v1/jobs/a\0b", 12)), {400}},
      {"H14Http09", "GET /healthz\r\n\r\n", {400, 505}},
      {"H14Http12", "GET /healthz HTTP/1.2\r\n" + host() + "\r\n", {400, 505}},
      {"H14Http20", "GET /healthz HTTP/2.0\r\n" + host() + "\r\n", {400, 505}},
      {"H14Preface", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", {400, 505}},
      {"H16BogusExpect", post("Expect: bogus\r\nContent-Length: 5\r\n", "hello"), {417}},
      {"H17OverLimit", post("Content-Length: 9000000000000000000\r\n", "hello"), {413}},
      {"TlsHandshake",
       std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11) + std::string(500, 'x'),
       {400}},
  };
  for (const char* length :
       {"5, 6", "+5", "-5", "0x5", "5abc", "", "18446744073709551616", "99999999999999999999999"})
    rows.push_back({"H4Length " + std::string(length),
                    post("Content-Length: " + std::string(length) + "\r\n", "hello"),
                    {400, 413}});
  return rows;
}

/// Wrong, but there is no doubt where the request ends.
std::vector<BadRequest> well_framed_mistakes() {
  std::vector<BadRequest> rows = {
      {"UnknownPath", get("/v1/nothing"), {404}},
      {"H15WrongMethod", "DELETE /v1/methods HTTP/1.1\r\n" + host() + "\r\n", {405}},
      {"H19NotJson",
       "POST /v1/jobs HTTP/1.1\r\n" + host() + "Content-Type: text/plain\r\nContent-Length: 2\r\n\r\n{}",
       {415}},
      {"H24Accept", get("/v1/methods", "Accept: image/png\r\n"), {406}},
      {"BadQuery", get("/v1/jobs?limit=many"), {400}},
      {"H8Trailer",
       post("Transfer-Encoding: chunked\r\n",
            "5\r\nhello\r\n0\r\nContent-Length: 7\r\nAuthorization: x\r\n\r\n"),
       {400, 415, 422}},
      {"H6LongSize",
       post("Transfer-Encoding: chunked\r\n", "00000000000000005\r\nhello\r\n0\r\n\r\n"),
       {400, 415}},
      {"H10NoHost", "GET /healthz HTTP/1.1\r\n\r\n", {400}},
      {"H10TwoHosts", get("/healthz", host()), {400}},
      {"H10Foreign", "GET /healthz HTTP/1.1\r\nHost: example.org\r\n\r\n", {421}},
      {"H12HighByte", get("/v1/jobs/\xc3\xa9"), {400}},
      {"H12Space", get("/v1/jobs/a b"), {400}},
      {"H12Star", get("*"), {400}},
      {"H15Trace", "TRACE /healthz HTTP/1.1\r\n" + host() + "\r\n", {405, 501}},
      {"H15Connect", "CONNECT example.org:443 HTTP/1.1\r\n" + host() + "\r\n", {400, 405, 501}},
      {"H15Garbage", "FROBNICATE /healthz HTTP/1.1\r\n" + host() + "\r\n", {400, 405, 501}},
      {"H18NoLength", post("", ""), {411}},
  };
  for (const char* target : {"/v1/jobs/../../admin", "/v1/jobs/%2e%2e%2fadmin", "/v1/jobs/a%2Fb", "//v1/jobs",
                             "/v1/jobs/a%00b", "/v1/jobs/%252e%252e", "/v1/jobs/%c0%ae"})
    rows.push_back({"H13 " + std::string(target), get(target), {400}});
  return rows;
}

void expect_alive() {
  EXPECT_EQ(survivor().service().call("GET", "/healthz").status, 200);
}

/// A refused request closes its connection: what follows it, which the two sides may cut differently, is
/// never taken for a request.
TEST(BadFraming, IsRefusedAndClosesTheConnection) {
  for (const auto& [name, bytes, statuses] : bad_requests()) {
    SCOPED_TRACE(name);
    HttpConnection connection(survivor().daemon().port());
    connection.send(bytes + get("/v1/methods"));
    const auto answer = connection.read();
    if (answer) {
      EXPECT_THAT(statuses, testing::Contains(answer->status)) << answer->body;
      EXPECT_EQ(answer->header("content-type"), "application/problem+json");
      EXPECT_EQ(answer->header("connection"), "close");
      EXPECT_FALSE(connection.read().has_value()) << "a second answer: desynchronised";
    }
    EXPECT_TRUE(connection.closed_within(5));
    expect_alive();
  }
}

/// Either the connection is closed, or the next answer belongs to the next request.
TEST(BadFraming, AWellFramedMistakeKeepsTheOrder) {
  for (const auto& [name, bytes, statuses] : well_framed_mistakes()) {
    SCOPED_TRACE(name);
    HttpConnection connection(survivor().daemon().port());
    connection.send(bytes + get("/healthz") + get("/v1/methods"));
    const auto answer = connection.read();
    ASSERT_TRUE(answer.has_value());
    EXPECT_THAT(statuses, testing::Contains(answer->status)) << answer->body;
    EXPECT_EQ(answer->header("content-type"), "application/problem+json");
    if (answer->header("connection") == "close") {
      EXPECT_TRUE(connection.closed_within(5));
      continue;
    }
    const auto second = connection.read(), third = connection.read();
    ASSERT_TRUE(second && third);
    EXPECT_EQ(second->status, 200);
    EXPECT_EQ(third->status, 200);
    EXPECT_TRUE(third->document().contains("methods"));
  }
}

TEST(BadFraming, PipelinedRequestsAreAnsweredInOrder) {
  HttpConnection connection(survivor().daemon().port());
  std::string requests;
  for (int i = 0; i < 1000; ++i) requests += get(i % 2 == 0 ? "/healthz" : "/v1/nothing");
  connection.send(requests);
  for (int i = 0; i < 1000; ++i) {
    const auto answer = connection.read();
    ASSERT_TRUE(answer.has_value()) << i;
    ASSERT_EQ(answer->status, i % 2 == 0 ? 200 : 404) << i;
  }
}

TEST(BadFraming, ManySmallChunksAreABody) {
  HttpConnection connection(survivor().daemon().port());
  const Bytes file = ball_file(8);
  std::string body;
  for (const char byte : file) body += "1\r\n" + std::string(1, byte) + "\r\n";
  connection.send(post("Transfer-Encoding: chunked\r\n", body + "0\r\n\r\n"));
  const auto answer = connection.read();
  ASSERT_TRUE(answer.has_value());
  EXPECT_EQ(answer->status, 201) << answer->body;
  EXPECT_EQ(answer->document().at("bytes"), file.size());
}

/// Nothing stays of an upload whose sender went away.
TEST(BadFraming, AnUploadCutShortIsDiscarded) {
  const auto files = [] {
    using Iterator = std::filesystem::recursive_directory_iterator;
    return std::count_if(Iterator(survivor().daemon().data()), Iterator(),
                         [](const auto& entry) { return entry.is_regular_file(); });
  };
  const auto before = files();
  for (const bool chunked : {false, true}) {
    HttpConnection connection(survivor().daemon().port());
    connection.send(chunked ? post("Transfer-Encoding: chunked\r\n", "ffff\r\nhello")
                            : post("Content-Length: 100000\r\n", "hello"));
  }
  EXPECT_TRUE(eventually([&] { return files() == before; })) << files() << " files instead of " << before;
  expect_alive();
}

/// The 100 comes before the body is sent, and never for a body that will be refused.
TEST(BadFraming, ExpectContinue) {
  HttpConnection good(survivor().daemon().port());
  const Bytes file = ball_file(8);
  good.send(post("Expect: 100-continue\r\nContent-Length: " + std::to_string(file.size()) + "\r\n", ""));
  const auto go_on = good.read_head();
  ASSERT_TRUE(go_on.has_value());
  EXPECT_EQ(go_on->status, 100);
  good.send(file);
  EXPECT_EQ(good.read().value_or(HttpResponse{}).status, 201);

  HttpConnection too_long(survivor().daemon().port());
  too_long.send(post("Expect: 100-continue\r\nContent-Length: 9000000000000000000\r\n", ""));
  EXPECT_EQ(too_long.read_head().value_or(HttpResponse{}).status, 413);
}

}  // namespace
}  // namespace volsmooth::test
