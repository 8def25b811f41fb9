#include "service/pipeline/stage_clock.h"

#include <gtest/gtest.h>

#include <thread>

namespace volsmooth {
namespace {

TEST(StageClock, TheFractionOfTheWholeGrowsFromZeroToOne) {
  std::vector<std::pair<std::string, double>> heard;
  const StageProgress report = [&](std::string_view stage, double fraction) {
    heard.emplace_back(stage, fraction);
  };
  StageClock clock(4, report);
  clock.run("read", 1, [](const Progress& progress) { progress(1); });
  clock.run("flow", 3, [](const Progress& progress) {
    progress(0.5);
    progress(1);
  });
  const std::vector<std::pair<std::string, double>> expected = {
      {"read", 0}, {"read", 0.25}, {"flow", 0.25}, {"flow", 0.625}, {"flow", 1}};
  EXPECT_EQ(heard, expected);
}

TEST(StageClock, GivesWhatTheWorkGivesAndLetsCancelThrough) {
  const StageProgress report = [](std::string_view, double fraction) {
    if (fraction > 0.4) throw Cancelled();
  };
  StageClock clock(1, report);
  EXPECT_EQ(clock.run("read", 0.1, [](const Progress&) { return 42; }), 42);
  EXPECT_THROW(clock.run("flow", 0.9, [](const Progress& progress) { progress(0.5); }), Cancelled);
}

TEST(StageClock, AddsUpTheTimeOfAStage) {
  const StageProgress report = [](std::string_view, double) {};
  StageClock clock(2, report);
  EXPECT_EQ(clock.seconds("flow"), 0);
  const auto work = [](const Progress&) { std::this_thread::sleep_for(std::chrono::milliseconds(2)); };
  clock.run("flow", 1, work);
  EXPECT_GE(clock.seconds("flow"), 0.002);
  clock.run("flow", 1, work);
  EXPECT_GE(clock.seconds("flow"), 0.004);
  EXPECT_EQ(clock.seconds("read"), 0);
}

}  // namespace
}  // namespace volsmooth
