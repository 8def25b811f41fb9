#include "service/pipeline/parts.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace volsmooth {
namespace {

const MethodInput kInput{Grid{{64, 64, 64}, {1, 1, 1}}};

JobOrder order(const std::string& method) {
  JobOrder order;
  order.method = method;
  order.parameters = {{"flow_time_mm2", 4.0}};
  return order;
}

TEST(Parts, AMethodRunsWithWhatItWasResolvedTo) {
  const ParameterValues resolved = {{"steps", 7.0}};
  const auto parts = parts_of(order("laplacian"), resolved, kInput);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].method, find_method("laplacian"));
  EXPECT_EQ(parts[0].parameters, resolved);
}

TEST(Parts, EachPartOfCompareHasItsOwnSteps) {
  const auto parts = parts_of(order("compare"), {}, kInput);
  ASSERT_EQ(parts.size(), 2u);
  for (const Part& part : parts) {
    EXPECT_EQ(part.parameters, part.method->resolve({{"flow_time_mm2", 4.0}}, kInput));
    EXPECT_EQ(passes_of(part, kInput.grid), part.method->passes(part.parameters, kInput.grid));
  }
  EXPECT_NE(parts[0].method, parts[1].method);
}

TEST(Parts, AnOrderForAMethodThatIsNotThereIsABrokenPromise) {
  EXPECT_THROW(parts_of(order("magic"), {}, kInput), std::logic_error);
}

}  // namespace
}  // namespace volsmooth
