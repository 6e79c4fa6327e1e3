#include "experiments/harness/compare.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace hermesh {
namespace {

Json row_of(const std::string& label, const std::string& digest, int resolution = 50) {
  return {{"experiment", "digests"},
          {"case", {{"name", "digests"}}},
          {"variant", {{"label", label}}},
          {"values", {{"resolution", resolution}, {"digest", digest}}}};
}

TEST(CompareRuns, EqualHoweverRowsAreOrdered) {
  const std::vector<Json> before = {row_of("a", "1"), row_of("b", "2"), row_of("a", "3", 200)},
                          after = {row_of("a", "3", 200), row_of("b", "2"), row_of("a", "1")};
  const RunComparison c = compare_runs(before, after);
  EXPECT_TRUE(c.same()) << text(c);
  EXPECT_EQ(c.equal, 3u);
}

TEST(CompareRuns, TheLastRowOfACellCounts) {
  EXPECT_TRUE(compare_runs({row_of("a", "1")}, {row_of("a", "0"), row_of("a", "1")}).same());
  EXPECT_FALSE(compare_runs({row_of("a", "1")}, {row_of("a", "1"), row_of("a", "0")}).same());
}

TEST(CompareRuns, TellsWhatDiffersIsMissingIsNewOrFailed) {
  Json failed = row_of("c", "");
  failed["failed"] = "out of luck";
  const RunComparison c = compare_runs({row_of("a", "1"), row_of("b", "2"), row_of("c", "3")},
                                       {row_of("a", "9"), failed, row_of("d", "4")});
  EXPECT_FALSE(c.same());
  EXPECT_EQ(c.equal, 0u);
  ASSERT_EQ(c.different.size(), 2u);
  EXPECT_EQ(c.different[0].before, "1");
  EXPECT_EQ(c.different[0].after, "9");
  EXPECT_EQ(c.different[1].after, "failed: out of luck");
  ASSERT_EQ(c.missing.size(), 1u);
  EXPECT_NE(c.missing[0].find("/ b"), std::string::npos);
  ASSERT_EQ(c.added.size(), 1u);
  const std::string said = text(c);
  for (const char* word :
       {"0 cells are equal", "2 differ", "1 are missing", "1 are new", "now 9", "missing: digests"})
    EXPECT_NE(said.find(word), std::string::npos) << said;
}

TEST(CompareRuns, RowsWithoutDigestsProveNothing) {
  Json row = row_of("a", "");
  row["values"].erase("digest");
  const RunComparison c = compare_runs({row}, {row});
  EXPECT_EQ(c.without_digest, 1u);
  EXPECT_FALSE(c.same());
}

}  // namespace
}  // namespace hermesh
