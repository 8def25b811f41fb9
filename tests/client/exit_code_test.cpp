#include "client/exit_code.h"

#include <gtest/gtest.h>

namespace volsmooth {
namespace {

struct AnswerCase {
  long status;
  const char* slug;
  int code;  ///< as in the contract
};

class ExitCodeOfAnswer : public testing::TestWithParam<AnswerCase> {};

TEST_P(ExitCodeOfAnswer, FollowsTheContract) {
  EXPECT_EQ(static_cast<int>(exit_code_for(GetParam().status, GetParam().slug)), GetParam().code);
}

INSTANTIATE_TEST_SUITE_P(
    Answers, ExitCodeOfAnswer,
    testing::Values(AnswerCase{400, "bad-query", 65}, AnswerCase{400, "bad-id", 66}, AnswerCase{401, "", 77},
                    AnswerCase{403, "insufficient-scope", 77}, AnswerCase{404, "not-found", 66},
                    AnswerCase{408, "request-timeout", 75}, AnswerCase{409, "volume-in-use", 75},
                    AnswerCase{410, "gone", 66}, AnswerCase{413, "content-too-large", 65},
                    AnswerCase{415, "unsupported-format", 65}, AnswerCase{421, "misdirected", 77},
                    AnswerCase{422, "nifti-bad-header", 65}, AnswerCase{429, "queue-full", 75},
                    AnswerCase{500, "internal", 70}, AnswerCase{501, "", 70}, AnswerCase{502, "", 70},
                    AnswerCase{503, "not-ready", 75}, AnswerCase{507, "insufficient-storage", 75},
                    AnswerCase{302, "", 70}));

struct FailedJobCase {
  const char* problem;
  int code;
};

class ExitCodeOfFailedJob : public testing::TestWithParam<FailedJobCase> {};

TEST_P(ExitCodeOfFailedJob, BlamesTheInputOrTheService) {
  const auto problem = nlohmann::json::parse(GetParam().problem);
  EXPECT_EQ(static_cast<int>(exit_code_for_failed_job(problem)), GetParam().code) << problem;
}

INSTANTIATE_TEST_SUITE_P(
    Problems, ExitCodeOfFailedJob,
    testing::Values(FailedJobCase{R"({"type": "/problems/bad-parameter", "status": 422})", 65},
                    FailedJobCase{R"({"type": "/problems/bad-parameter"})", 65},
                    FailedJobCase{R"({"type": "/problems/internal"})", 70},
                    FailedJobCase{R"({"type": "/problems/attempts-exhausted", "status": 422})", 70},
                    FailedJobCase{R"({"type": "/problems/integrity-failure"})", 70},
                    FailedJobCase{R"({"type": "/problems/insufficient-storage", "status": 507})", 70},
                    FailedJobCase{"null", 70}));

TEST(Slug, IsTheEndOfTheType) {
  EXPECT_EQ(slug_of({{"type", "/problems/bad-id"}}), "bad-id");
  EXPECT_EQ(slug_of({{"type", "about:blank"}}), "about:blank");
  EXPECT_EQ(slug_of({{"type", 5}}), "");
  EXPECT_EQ(slug_of(nullptr), "");
}

}  // namespace
}  // namespace volsmooth
