#include "algorithms/catalog.h"

#include <gtest/gtest.h>

#include "algorithms/flows/mean_curvature_flow.h"
#include "tests/support/phantoms.h"

namespace volsmooth {
namespace {

const Grid kGrid{{12, 11, 10}, {1, 1, 2.5}};

double number(const ParameterValues& values, const std::string& name) {
  return std::get<double>(values.at(name));
}

TEST(Catalog, OffersTheMethodsInOrder) {
  std::vector<std::string> names;
  for (const Method& method : catalog()) names.push_back(method.info.name);
  EXPECT_EQ(names, (std::vector<std::string>{"mean-curvature-flow", "laplacian", "compare"}));
  EXPECT_EQ(find_method("compare"), &catalog()[2]);
  EXPECT_EQ(find_method("Compare"), nullptr);
}

class CatalogRow : public testing::TestWithParam<std::size_t> {
 protected:
  const Method& method() const { return catalog()[GetParam()]; }
};

TEST_P(CatalogRow, EitherRunsOrNamesPartsThatRun) {
  EXPECT_NE(static_cast<bool>(method().run), !method().info.parts.empty());
  for (const std::string& part : method().info.parts) {
    ASSERT_NE(find_method(part), nullptr) << part;
    EXPECT_TRUE(find_method(part)->run) << part;
  }
}

TEST_P(CatalogRow, DeclaresParametersThatExcludeEachOtherBothWays) {
  for (const ParameterInfo& parameter : method().info.parameters) {
    EXPECT_LT(parameter.minimum, parameter.maximum);
    EXPECT_FALSE(parameter.description.empty());
    EXPECT_TRUE(parameter.default_value || !parameter.default_text.empty());
    if (parameter.excludes.empty()) continue;
    const auto other = std::ranges::find(method().info.parameters, parameter.excludes, &ParameterInfo::name);
    ASSERT_NE(other, method().info.parameters.end());
    EXPECT_EQ(other->excludes, parameter.name);
  }
}

TEST_P(CatalogRow, TurnsARadiusIntoAQuarterOfItsSquareAndBack) {
  const auto by_radius = method().resolve({{"feature_radius_mm", 3.0}}, kGrid);
  EXPECT_DOUBLE_EQ(number(by_radius, "flow_time_mm2"), 2.25);
  EXPECT_DOUBLE_EQ(number(by_radius, "feature_radius_mm"), 3);
  const auto by_time = method().resolve({{"flow_time_mm2", 4.0}}, kGrid);
  EXPECT_DOUBLE_EQ(number(by_time, "flow_time_mm2"), 4);
  EXPECT_DOUBLE_EQ(number(by_time, "feature_radius_mm"), 4);
}

TEST_P(CatalogRow, DefaultsToTwiceTheGeometricMeanSpacing) {
  EXPECT_DOUBLE_EQ(number(method().resolve({}, kGrid), "feature_radius_mm"), 2 * std::cbrt(2.5));
}

/// From 10 nm, voxels of an electron microscope, to those of a survey of the ground.
TEST_P(CatalogRow, AcceptsItsOwnDefaultsForVoxelsOfAnySize) {
  for (const double spacing : {1e-5, 5e-4, 1e-3, 1.0, 500.0}) {
    const auto defaults = method().resolve({}, Grid{{8, 8, 8}, {spacing, spacing, spacing}});
    for (const ParameterInfo& parameter : method().info.parameters) {
      EXPECT_GE(number(defaults, parameter.name), parameter.minimum) << spacing << " " << parameter.name;
      EXPECT_LE(number(defaults, parameter.name), parameter.maximum) << spacing << " " << parameter.name;
    }
  }
}

TEST_P(CatalogRow, HasLimitsThatExcludeAbsurdStrengths) {  // P1
  for (const ParameterInfo& parameter : method().info.parameters) {
    EXPECT_GT(parameter.minimum, 1e-300);
    EXPECT_LT(parameter.maximum, 1e9);
  }
}

TEST_P(CatalogRow, ResolvesWhatItResolvedToTheSame) {
  const auto once = method().resolve({}, kGrid);
  EXPECT_EQ(number(method().resolve(once, kGrid), "flow_time_mm2"), number(once, "flow_time_mm2"));
}

TEST_P(CatalogRow, SaysTheStepsItWillTake) {
  if (!method().run) return;
  const auto resolved = method().resolve({{"flow_time_mm2", 4.0}}, kGrid);
  EXPECT_DOUBLE_EQ(number(resolved, "steps") * number(resolved, "step_mm2"), 4);
}

TEST_P(CatalogRow, SmoothsNoise) {
  if (!method().run) return;
  const auto before = noise(kGrid.size, 1);
  auto volume = volume_of(kGrid, before);
  method().run(*volume, method().resolve({}, kGrid), no_progress);
  EXPECT_LT(std::ranges::max(values_of(*volume)) - std::ranges::min(values_of(*volume)), 0.8F);
}

INSTANTIATE_TEST_SUITE_P(All, CatalogRow, testing::Range<std::size_t>(0, catalog().size()));

TEST(Catalog, RunsMeanCurvatureFlowUnderItsName) {
  auto by_name = volume_of(kGrid, noise(kGrid.size, 1)), directly = copy_of(*by_name);
  const Method& method = *find_method("mean-curvature-flow");
  method.run(*by_name, method.resolve({{"flow_time_mm2", 2.0}}, kGrid), no_progress);
  smooth(*directly, MeanCurvatureFlow{2});
  EXPECT_EQ(values_of(*by_name), values_of(*directly));
}

}  // namespace
}  // namespace volsmooth
