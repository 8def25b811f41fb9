#include "service/http/multipart.h"

#include <gtest/gtest.h>

#include <map>

namespace volsmooth {
namespace {

std::string part(const std::string& name, const std::string& data) {
  return "--b0\r\nContent-Disposition: form-data; name=\"" + name +
         "\"; filename=\"x\"\r\nContent-Type: a/b\r\n\r\n" + data + "\r\n";
}

struct Taken {
  std::map<std::string, std::string> parts;
  std::string slug;  ///< of the problem, or empty
};

/// Reads `body` in pieces of `step` bytes.
Taken taken_apart(std::string_view body, std::size_t step) {
  Taken taken;
  std::string current;
  MultipartReader reader("b0", {[&](std::string_view name) {
                                  current = name;
                                  taken.parts[current];
                                  return tl::expected<void, Problem>();
                                },
                                [&](std::string_view bytes) {
                                  taken.parts[current] += bytes;
                                  return tl::expected<void, Problem>();
                                }});
  tl::expected<void, Problem> read;
  for (; read && !body.empty(); body.remove_prefix(std::min(step, body.size())))
    read = reader.read(body.substr(0, step));
  if (read) read = reader.finish();
  if (!read) taken.slug = read.error().slug;
  return taken;
}

TEST(Multipart, PartsAreTheSameHoweverTheBytesArrive) {
  const std::string tricky = "\r\n--b\r\n--b1\r\n\r\n--\r";
  const std::string body =
      part("volume", tricky) + part("job", "{}") + part("empty", "") + "--b0--\r\nepilogue";
  for (std::size_t step = 1; step <= body.size(); ++step) {
    const auto taken = taken_apart(body, step);
    EXPECT_EQ(taken.slug, "");
    EXPECT_EQ(taken.parts,
              (std::map<std::string, std::string>{{"volume", tricky}, {"job", "{}"}, {"empty", ""}}));
  }
}

class BadMultipart : public testing::TestWithParam<std::string> {};

TEST_P(BadMultipart, IsRefused) {
  EXPECT_EQ(taken_apart(GetParam(), 7).slug, "bad-multipart");
  EXPECT_EQ(taken_apart(GetParam(), 100000).slug, "bad-multipart");
}

INSTANTIATE_TEST_SUITE_P(
    Table, BadMultipart,
    testing::Values("", "--b0", "preamble\r\n" + part("a", "") + "--b0--", part("a", "cut"),
                    part("a", "") + "--b0", "--b0 \r\n" + part("a", "").substr(6) + "--b0--",
                    "--b0\r\n\r\ndata\r\n--b0--", "--b0\r\nContent-Disposition: form-data\r\n\r\n\r\n--b0--",
                    "--b0\r\nContent-Disposition: attachment; name=\"a\"\r\n\r\n\r\n--b0--",
                    "--b0\r\nContent-Disposition : form-data; name=\"a\"\r\n\r\n\r\n--b0--",
                    "--b0\r\nContent-Disposition: form-data; name=\"a\"\r\nContent-Disposition: form-data; "
                    "name=\"b\"\r\n\r\n\r\n--b0--",
                    "--b0\r\nX: " + std::string(10000, 'a'), "--b1\r\n" + part("a", "").substr(6) + "--b1--",
                    "--b0\r\nContent-Disposition: form-data; name=\"a\"\n\n\n--b0--"));

TEST(MultipartBoundary, IsReadFromTheContentType) {
  EXPECT_EQ(multipart_boundary("multipart/form-data; boundary=abc"), "abc");
  EXPECT_EQ(multipart_boundary("Multipart/Form-Data; charset=utf-8; Boundary=\"a b\""), std::nullopt);
  EXPECT_EQ(multipart_boundary("multipart/form-data; boundary=\"a:b\""), "a:b");
  EXPECT_EQ(multipart_boundary("multipart/form-data"), std::nullopt);
  EXPECT_EQ(multipart_boundary("multipart/form-data; boundary="), std::nullopt);
  EXPECT_EQ(multipart_boundary("multipart/form-data; boundary=" + std::string(71, 'a')), std::nullopt);
  EXPECT_EQ(multipart_boundary("multipart/mixed; boundary=abc"), std::nullopt);
  EXPECT_EQ(multipart_boundary("application/json"), std::nullopt);
}

}  // namespace
}  // namespace volsmooth
