#include "service/http/target.h"

#include <gtest/gtest.h>

#include "service/http/routes.h"

namespace volsmooth {
namespace {

struct TargetCase {
  std::string name;
  std::string target;
  std::string slug;  ///< empty: accepted
};
std::ostream& operator<<(std::ostream& out, const TargetCase& one) {
  return out << one.name;
}

class TargetTest : public testing::TestWithParam<TargetCase> {};

TEST_P(TargetTest, GivesItsAnswer) {
  const auto target = parse_target(GetParam().target);
  EXPECT_EQ(target ? "" : target.error().slug, GetParam().slug);
}

// malicious-input rows H12 and H13.
INSTANTIATE_TEST_SUITE_P(Rows, TargetTest,
                         testing::Values(TargetCase{"plain", "/v1/jobs", ""}, TargetCase{"root", "/", ""},
                                         TargetCase{"trailing_slash", "/v1/jobs/", ""},
                                         TargetCase{"name_with_dots_and_signs",
                                                    "/v1/jobs/j-1/results/laplacian_iso-1e+06.stl", ""},
                                         TargetCase{"encoded_plus", "/v1/jobs/j-1/results/a%2Bb", ""},
                                         TargetCase{"query", "/v1/jobs?label=a%20b+c", ""},
                                         TargetCase{"high_byte", "/v1/\x80", "bad-target"},
                                         TargetCase{"nul", std::string("/v1\0", 4), "bad-target"},
                                         TargetCase{"space", "/v1/a b", "bad-target"},
                                         TargetCase{"star", "*", "bad-target"},
                                         TargetCase{"empty", "", "bad-target"},
                                         TargetCase{"absolute", "http://localhost/v1/jobs", "bad-target"},
                                         TargetCase{"fragment", "/v1#a", "bad-target"},
                                         TargetCase{"dot_dot", "/v1/jobs/../../admin", "bad-target"},
                                         TargetCase{"dot", "/v1/./jobs", "bad-target"},
                                         TargetCase{"encoded_dot_dot", "/v1/%2e%2e%2fadmin", "bad-target"},
                                         TargetCase{"encoded_dots", "/v1/%2E%2E/admin", "bad-target"},
                                         TargetCase{"encoded_slash", "/v1%2Fjobs", "bad-target"},
                                         TargetCase{"two_slashes", "//v1/jobs", "bad-target"},
                                         TargetCase{"inner_slashes", "/v1//jobs", "bad-target"},
                                         TargetCase{"encoded_nul", "/v1/%00", "bad-target"},
                                         TargetCase{"double_encoding", "/v1/%252e", "bad-target"},
                                         TargetCase{"overlong", "/v1/%c0%ae", "bad-target"},
                                         TargetCase{"backslash", "/v1\\jobs", "bad-target"},
                                         TargetCase{"cut_encoding", "/v1/%2", "bad-target"},
                                         TargetCase{"bad_encoding", "/v1/%zz", "bad-target"},
                                         TargetCase{"query_bad_encoding", "/?a=%zz", "bad-query"},
                                         TargetCase{"query_twice", "/?a=1&a=2", "bad-query"},
                                         TargetCase{"query_nameless", "/?=1", "bad-query"},
                                         TargetCase{"query_empty_pair", "/?a=1&&b=2", "bad-query"},
                                         TargetCase{"query_nul", "/?a=%00", "bad-query"}),
                         [](const auto& one) { return one.param.name; });

TEST(Target, IsDecodedOnce) {
  const auto target = parse_target("/v1/a%2Bb?label=a%20b+c%2520&empty=&bare");
  ASSERT_TRUE(target);
  EXPECT_EQ(target->segments, (std::vector<std::string>{"v1", "a+b"}));
  EXPECT_EQ(target->query, (QueryValues{{"label", "a b c%20"}, {"empty", ""}, {"bare", ""}}));
}

TEST(RouteMatching, FillsInTheNamesOfThePattern) {
  const auto match = match_route("GET", {"v1", "jobs", "j-1", "results", "a.stl"});
  ASSERT_TRUE(match);
  EXPECT_EQ(match->route->pattern, "/v1/jobs/{id}/results/{name}");
  EXPECT_EQ(match->path.at("id"), "j-1");
  EXPECT_EQ(match->path.at("name"), "a.stl");
}

TEST(RouteMatching, HeadIsAnsweredByGet) {
  const auto match = match_route("HEAD", {"healthz"});
  ASSERT_TRUE(match);
  EXPECT_EQ(match->route->method, "GET");
}

TEST(RouteMatching, WrongMethodIsToldTheRightOnes) {
  const auto match = match_route("PUT", {"v1", "volumes", "v-1"});
  ASSERT_FALSE(match);
  EXPECT_EQ(match.error().slug, "method-not-allowed");
  EXPECT_EQ(match.error().members.at("allow"), "GET, HEAD, DELETE");
}

TEST(RouteMatching, OtherPathsAreNotFound) {
  for (const std::vector<std::string>& segments : std::vector<std::vector<std::string>>{
           {""}, {"v1"}, {"v2", "jobs"}, {"v1", "jobs", ""}, {"v1", "jobs", "a", "b"}}) {
    const auto match = match_route("GET", segments);
    ASSERT_FALSE(match);
    EXPECT_EQ(match.error().slug, "not-found");
  }
}

struct QueryCase {
  std::string path, name, value;
  bool good;
};
std::ostream& operator<<(std::ostream& out, const QueryCase& one) {
  return out << one.name << '=' << one.value;
}

class QueryTest : public testing::TestWithParam<QueryCase> {};

TEST_P(QueryTest, IsHeldToItsDeclaration) {
  const auto& [path, name, value, good] = GetParam();
  const auto match = match_route(
      path == "volumes" ? "POST" : "GET",
      path == "job" ? std::vector<std::string>{"v1", "jobs", "j"} : std::vector{std::string("v1"), path});
  ASSERT_TRUE(match);
  const auto checked = check_query(*match->route, {{name, value}});
  EXPECT_EQ(checked.has_value(), good);
  EXPECT_EQ(checked ? "bad-query" : checked.error().slug, "bad-query");
}

INSTANTIATE_TEST_SUITE_P(
    Table, QueryTest,
    testing::Values(
        QueryCase{"jobs", "state", "running", true}, QueryCase{"jobs", "state", "done", false},
        QueryCase{"jobs", "state", "", false}, QueryCase{"jobs", "limit", "1", true},
        QueryCase{"jobs", "limit", "0", false}, QueryCase{"jobs", "limit", "501", false},
        QueryCase{"jobs", "limit", "5.5", false}, QueryCase{"jobs", "limit", " 5", false},
        QueryCase{"jobs", "limit", "+5", false}, QueryCase{"jobs", "limit", "", false},
        QueryCase{"jobs", "limit", "99999999999999999999", false},
        QueryCase{"jobs", "label", std::string(1024, 'a'), true},
        QueryCase{"jobs", "label", std::string(1025, 'a'), false}, QueryCase{"jobs", "wait", "1", false},
        QueryCase{"jobs", "tenant", "1", false}, QueryCase{"job", "wait", "0.5", true},
        QueryCase{"job", "wait", "300", true}, QueryCase{"job", "wait", "300.5", false},
        QueryCase{"job", "wait", "-1", false}, QueryCase{"job", "wait", "nan", false},
        QueryCase{"job", "wait", "inf", false}, QueryCase{"job", "wait", "0x10", false},
        QueryCase{"volumes", "volume_index", "0", true}, QueryCase{"volumes", "volume_index", "-1", false},
        QueryCase{"volumes", "non_finite", "-1000.5", true}, QueryCase{"volumes", "non_finite", "nan", false},
        QueryCase{"volumes", "resample", "uniform", true}, QueryCase{"volumes", "resample", "cubic", false}));

}  // namespace
}  // namespace volsmooth
