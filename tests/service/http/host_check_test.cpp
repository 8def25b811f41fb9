#include "service/http/host_check.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

struct HostCase {
  std::vector<std::string> hosts;
  std::string slug;  ///< empty: accepted
};

std::ostream& operator<<(std::ostream& out, const HostCase& one) {
  for (const auto& host : one.hosts) out << host << ' ';
  return out << one.slug;
}

class HostCheck : public testing::TestWithParam<HostCase> {};

TEST_P(HostCheck, GivesItsAnswer) {
  Head head;
  for (const auto& host : GetParam().hosts) head.fields.push_back({"host", host});
  HostNames ours;
  ours.names.push_back("volsmooth.hospital.example");
  const auto checked = check_host(head, ours);
  EXPECT_EQ(checked ? "" : checked.error().slug, GetParam().slug);
}

// malicious-input row H10.
INSTANTIATE_TEST_SUITE_P(
    Rows, HostCheck,
    testing::Values(HostCase{{"localhost"}, ""}, HostCase{{"LocalHost:8742"}, ""},
                    HostCase{{"127.0.0.1:1"}, ""}, HostCase{{"[::1]"}, ""}, HostCase{{"[::1]:8742"}, ""},
                    HostCase{{"volsmooth.hospital.example"}, ""}, HostCase{{}, "bad-host"},
                    HostCase{{""}, "bad-host"}, HostCase{{"localhost", "localhost"}, "bad-host"},
                    HostCase{{"localhost:"}, "bad-host"}, HostCase{{"localhost:80x"}, "bad-host"},
                    HostCase{{"localhost:123456"}, "bad-host"}, HostCase{{"[::1"}, "bad-host"},
                    HostCase{{"evil.example"}, "misdirected-request"},
                    HostCase{{"localhost.evil.example"}, "misdirected-request"},
                    HostCase{{"evil.example:8742"}, "misdirected-request"},
                    HostCase{{"127.0.0.2"}, "misdirected-request"},
                    HostCase{{"localhost, evil.example"}, "misdirected-request"}));

struct OriginCase {
  HeaderField field;
  std::string slug;  ///< empty: accepted
};

std::ostream& operator<<(std::ostream& out, const OriginCase& one) {
  return out << one.field.name << ' ' << one.field.value;
}

class OriginCheck : public testing::TestWithParam<OriginCase> {};

TEST_P(OriginCheck, GivesItsAnswer) {
  Head head;
  head.fields = {{"host", "localhost"}, GetParam().field};
  const auto checked = check_origin(head, {});
  EXPECT_EQ(checked ? "" : checked.error().slug, GetParam().slug);
}

INSTANTIATE_TEST_SUITE_P(
    Rows, OriginCheck,
    testing::Values(
        OriginCase{{"accept", "*/*"}, ""}, OriginCase{{"origin", "http://localhost:8742"}, ""},
        OriginCase{{"origin", "https://LOCALHOST"}, ""}, OriginCase{{"origin", "http://127.0.0.1:3000"}, ""},
        OriginCase{{"origin", "http://[::1]:8742"}, ""},
        OriginCase{{"origin", "https://evil.example"}, "cross-origin"},
        OriginCase{{"origin", "http://localhost.evil.example:8742"}, "cross-origin"},
        OriginCase{{"origin", "http://evil.example://localhost"}, "cross-origin"},
        OriginCase{{"origin", "null"}, "cross-origin"}, OriginCase{{"origin", ""}, "cross-origin"},
        OriginCase{{"origin", "localhost"}, "cross-origin"},
        OriginCase{{"sec-fetch-site", "cross-site"}, "cross-origin"},
        OriginCase{{"sec-fetch-site", "same-origin"}, ""}, OriginCase{{"sec-fetch-site", "none"}, ""}));

}  // namespace
}  // namespace volsmooth
