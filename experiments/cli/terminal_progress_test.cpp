#include "experiments/cli/terminal_progress.h"

#include <gtest/gtest.h>

namespace hermesh::cli {
namespace terminal_progress_test {

TEST(OverallProgress, StagesTakeTheirShares) {
  OverallProgress progress(
      {{"read", 1.0}, {"decimate", 2.0}, {"certify", 4.0}, {"decimate", 2.0}, {"write", 1.0}});
  EXPECT_EQ(progress.update("read", 0.0), 0.0);
  EXPECT_DOUBLE_EQ(progress.update("read", 1.0), 0.1);
  EXPECT_DOUBLE_EQ(progress.update("decimate", 0.5), 0.2);
  EXPECT_DOUBLE_EQ(progress.update("decimate", 1.0), 0.3);
  EXPECT_DOUBLE_EQ(progress.update("certify", 0.25), 0.4);
  EXPECT_DOUBLE_EQ(progress.update("certify", 1.0), 0.7);
  EXPECT_DOUBLE_EQ(progress.update("decimate", 0.0), 0.7);
  EXPECT_DOUBLE_EQ(progress.update("decimate", 1.0), 0.9);
  EXPECT_DOUBLE_EQ(progress.update("write", 1.0), 1.0);
}

TEST(OverallProgress, AStageThatIsLeftOutIsSteppedOver) {
  OverallProgress progress({{"a", 1.0}, {"b", 1.0}, {"c", 2.0}});
  progress.update("a", 1.0);
  EXPECT_DOUBLE_EQ(progress.update("c", 0.0), 0.5);
  EXPECT_DOUBLE_EQ(progress.update("c", 0.5), 0.75);
}

TEST(OverallProgress, AStageThatNobodyPlannedTakesAPartOfTheRest) {
  OverallProgress progress({{"a", 1.0}, {"b", 4.0}, {"write", 5.0}});
  EXPECT_DOUBLE_EQ(progress.update("a", 1.0), 0.1);
  EXPECT_DOUBLE_EQ(progress.update("x", 1.0), 0.14) << "a tenth of the way from 0.1 to 0.5";
  EXPECT_DOUBLE_EQ(progress.update("b", 1.0), 0.5);
  OverallProgress repeated({{"a", 2.0}, {"write", 2.0}});
  EXPECT_DOUBLE_EQ(repeated.update("a", 0.5), 0.25);
  EXPECT_DOUBLE_EQ(repeated.update("x", 1.0), 0.375) << "half of the way from 0.25 to 0.5";
}

TEST(OverallProgress, NeverFallsNorEndsBeforeTheLastStage) {
  OverallProgress progress(plan_of("remesh"));
  double before = 0.0;
  for (int round = 0; round < 50; ++round)
    for (const char* stage : {"read", "decimate", "certify", "a stage that nobody planned"})
      for (const double fraction : {0.0, 0.5, 1.0}) {
        const double now = progress.update(stage, fraction);
        EXPECT_GE(now, before);
        EXPECT_LT(now, 1.0);
        before = now;
      }
  EXPECT_GT(before, 0.9);
  EXPECT_NEAR(progress.update("write", 1.0), 1.0, 1e-12);
}

TEST(OverallProgress, ASecondPassIsPlanned) {
  OverallProgress progress(plan_of("remesh --error"));
  for (const char* stage :
       {"read", "try larger voxels", "triangles to blocks", "distances", "signs", "move points", "compare"})
    progress.update(stage, 1.0);
  const double first = progress.update("triangles to blocks", 0.0);
  EXPECT_GT(first, 0.1);
  EXPECT_LT(first, 0.5);
  EXPECT_LT(progress.update("compare", 1.0), 0.6);
}

TEST(OverallProgress, APlanOfOneNamelessStageTakesAnyFraction) {
  OverallProgress progress({{"", 1.0}});
  EXPECT_EQ(progress.update("3 of 30 files", 0.1), 0.1);
  EXPECT_EQ(progress.update("4 of 30 files", 0.2), 0.2);
}

TEST(OverallProgress, TellsWhatIsLeft) {
  EXPECT_FALSE(OverallProgress::left(0.5, 0.5)) << "too early to tell";
  EXPECT_FALSE(OverallProgress::left(0.01, 100.0));
  EXPECT_DOUBLE_EQ(*OverallProgress::left(0.25, 10.0), 30.0);
  EXPECT_DOUBLE_EQ(*OverallProgress::left(0.25, 10.0, 12.0), 18.0) << "counts down";
  EXPECT_FALSE(OverallProgress::left(0.25, 10.0, 31.0)) << "longer than the estimate";
  EXPECT_EQ(duration_text(1.2), "2 s");
  EXPECT_EQ(duration_text(150.0), "3 min");
  EXPECT_EQ(duration_text(7.5 * 3600), "7 h 30 min");
}

}  // namespace terminal_progress_test
}  // namespace hermesh::cli
