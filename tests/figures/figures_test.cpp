// Every figure on coarse grids, and what the thesis says it shows, in its numbers. The bounds are 1.3
// times what was measured where no law gives them.
#include "tests/figures/figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ranges>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "tests/support/scratch_folder.h"

namespace volsmooth {
namespace {

using Row = std::vector<std::string>;

std::vector<Row> rows_of(const std::string& csv) {
  std::vector<Row> rows;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    for (rows.emplace_back(); std::getline(cells, line, ',');) rows.back().push_back(line);
  }
  return rows;
}

/// A figure, drawn with phantoms alone.
class Drawn {
 public:
  Drawn(const std::string& name, void (*draw)(const FigureOrder&)) {
    draw({.directory = folder_.path(), .coarse = true});
    rows_ = rows_of(folder_.content(name + ".csv"));
    EXPECT_THAT(folder_.names(), testing::Contains(testing::EndsWith(".png")));
  }

  /// The rows below the heading.
  std::size_t rows() const { return rows_.size() - 1; }

  double number(std::size_t row, const std::string& column) const {
    const auto found = std::ranges::find(rows_.front(), column);
    if (found == rows_.front().end()) throw std::out_of_range(column);
    return std::stod(rows_.at(row + 1).at(static_cast<std::size_t>(found - rows_.front().begin())));
  }

  /// In the row that begins with these cells.
  double number(const Row& begin, const std::string& column) const {
    for (std::size_t row = 0; row < rows(); ++row)
      if (std::ranges::equal(begin, rows_[row + 1] | std::views::take(begin.size())))
        return number(row, column);
    throw std::out_of_range(begin.front());
  }

 private:
  ScratchFolder folder_;
  std::vector<Row> rows_;
};

TEST(Figure41, ComesBackFromTheVortexBetterWithWeno) {
  const Drawn figure("4.1", draw_figure_4_1);
  const auto of = [&](const char* scheme, const char* what) { return figure.number({scheme}, what); };
  const double constant = of("piecewise-constant", "mean error after return");
  EXPECT_LT(of("weno-7", "mean error after return"), constant / 2);
  EXPECT_LT(of("weno-5", "mean error after return"), constant / 2);
  for (const char* scheme : {"piecewise-constant", "weno-7", "weno-5"})
    EXPECT_NEAR(of(scheme, "relative change of mass"), 0, 1e-6) << scheme;
}

TEST(Figure42, KeepsTheMassWhereTheLevelSetIsLost) {
  const Drawn figure("4.2", draw_figure_4_2);
  const std::size_t last = figure.rows() - 1;
  EXPECT_EQ(figure.number(last, "area level set"), 0);
  EXPECT_EQ(figure.number(last, "area level set redistanced"), 0);
  for (const char* mass : {"mass density weno-5", "mass density weno-7"})
    EXPECT_NEAR(figure.number(last, mass), figure.number(0, mass), 1e-6) << mass;
}

TEST(Figure61, MovesTheSurfaceByItsDistance) {
  const Drawn figure("6.1", draw_figure_6_1);
  for (std::size_t row = 0; row < figure.rows(); ++row)
    EXPECT_NEAR(figure.number(row, "mean displacement (mm)"), figure.number(row, "distance (mm)"), 0.2)
        << row;
}

TEST(Figure62, GrowsWhereTheWeightIsPositiveAndShrinksWhereItIsNegative) {
  const Drawn figure("6.2", draw_figure_6_2);
  for (std::size_t row = 0; row < figure.rows(); ++row)
    for (const std::string weight : {"polynomial", "sinusoid"}) {
      const double before = figure.number(row, "cross-section at first (mm^2)");
      const double after = figure.number(row, "by the " + weight);
      const double moved = figure.number(row, weight + " (mm)");
      if (before == 0 || std::abs(moved) < 0.6) continue;
      EXPECT_EQ(after > before, moved > 0) << weight << " at " << figure.number(row, "height (mm)");
    }
}

TEST(Figure63, ShrinksTheCircleAsFastAsItShould) {
  const Drawn figure("6.3", draw_figure_6_3);
  const std::size_t last = figure.rows() - 1;
  const auto error = [&](const char* method) {
    return std::abs(figure.number(last, method) / figure.number(last, "exact") - 1);
  };
  EXPECT_LT(error("thesis weno-7"), error("thesis piecewise-constant") / 5);
  EXPECT_LT(error("face-centred"), error("thesis piecewise-constant") / 5);
  EXPECT_LT(error("face-centred on a wide profile"), 0.0008);
  EXPECT_LT(error("level set"), 0.0002);
  EXPECT_LT(error("level set redistanced"), 0.0002);
}

TEST(Figure64, KeepsTheVolumeOnlyWhereItKeepsTheMass) {
  const Drawn figure("6.4", draw_figure_6_4);
  EXPECT_NEAR(figure.number({"conservative", "24"}, "mass of that at first"), 1, 1e-5);
  EXPECT_GT(figure.number({"conservative", "24"}, "volume of that at first"), 0.95);
  EXPECT_LT(figure.number({"plain", "24"}, "volume of that at first"), 0.8);
  for (const char* flow : {"conservative", "plain"})
    EXPECT_LT(figure.number({flow, "24"}, "area of that at first"), 0.85) << flow;
}

TEST(Figure74, SmoothsAllSurfacesAsIfEachWereAlone) {
  const Drawn figure("7.4", draw_figure_7_4);
  for (const char* isovalue : {"-500", "400"}) {
    const auto at = [&](const char* time, const char* what) {
      return figure.number({"phantom", isovalue, time}, what);
    };
    EXPECT_LT(at("4", "rms curvature (1/mm)"), at("0", "rms curvature (1/mm)") / 3) << isovalue;
    EXPECT_NEAR(at("4", "mean displacement from the surface smoothed alone (mm)"), 0, 0.2) << isovalue;
  }
}

TEST(Figure75, MovesTheBoneOutwardsByTheHeatEquationOnly) {
  const Drawn figure("7.5", draw_figure_7_5);
  const auto of = [&](const char* method) {
    return figure.number({"phantom", "400", method}, "mean displacement (mm)");
  };
  EXPECT_GT(of("laplacian"), 2 * std::abs(of("mean curvature flow")));
}

}  // namespace
}  // namespace volsmooth
