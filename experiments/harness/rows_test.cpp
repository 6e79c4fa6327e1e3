#include "experiments/harness/rows.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "algorithms/core/error.h"

namespace hermesh {
namespace {

using validation::MeshReport;

class Rows : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hermesh-rows-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_ / "deeper");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

Json row_of(const std::string& variant, double seconds) {
  return {{"case", {{"name", "ball"}}}, {"variant", {{"name", variant}}}, {"seconds", {{"median", seconds}}}};
}

TEST_F(Rows, RoundTripThroughTheFile) {
  Json first = row_of("toy", 0.1);
  first["text"] = "quotes \" and\nbreaks, ü";
  first["exact"] = 0.1 + 0.2;
  const Json second = row_of("other", 2.0);
  append_row(folder_ / "b.jsonl", first);
  append_row(folder_ / "b.jsonl", second);
  append_row(folder_ / "deeper" / "a.jsonl", second);
  EXPECT_EQ(read_rows(folder_), (std::vector<Json>{first, second, second}));
  EXPECT_EQ(read_rows(folder_ / "deeper" / "a.jsonl"), (std::vector<Json>{second}));
}

TEST_F(Rows, TextThatIsNoUtf8DoesNotLoseTheRow) {
  Json row = row_of("toy", 1.0);
  row["machine"] = "bad \xff byte";
  append_row(folder_ / "rows.jsonl", row);
  EXPECT_EQ(read_rows(folder_).size(), 1u);
}

TEST_F(Rows, BadFilesAreErrorsThatNameTheLine) {
  EXPECT_THROW(read_rows(folder_), Error);
  EXPECT_THROW(read_rows(folder_ / "missing"), Error);
  EXPECT_THROW(append_row(folder_ / "missing" / "rows.jsonl", row_of("toy", 1.0)), Error);
  append_row(folder_ / "rows.jsonl", row_of("toy", 1.0));
  std::ofstream(folder_ / "rows.jsonl", std::ios::app) << "{\"case\": 1, torn\n";
  try {
    read_rows(folder_);
    FAIL() << "a torn line was taken for a row";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("rows.jsonl:2"), std::string::npos) << error.what();
  }
}

TEST(TimeRatios, AreToTheFirstOpenvdbRow) {
  std::vector<Json> rows = {row_of("toy", 1.0), row_of("openvdb", 4.0), row_of("openvdb", 8.0)};
  rows.push_back({{"variant", {{"name", "broken"}}}, {"failed", "it did"}});
  add_time_ratios(rows);
  EXPECT_EQ(rows[0]["time_over_openvdb"], 0.25);
  EXPECT_EQ(rows[1]["time_over_openvdb"], 1.0);
  EXPECT_EQ(rows[2]["time_over_openvdb"], 2.0);
  EXPECT_FALSE(rows[3].contains("time_over_openvdb"));
}

TEST(TimeRatios, AreAbsentWithoutOpenvdb) {
  std::vector<Json> rows = {row_of("toy", 1.0)};
  add_time_ratios(rows);
  EXPECT_FALSE(rows[0].contains("time_over_openvdb"));
}

TEST(PromiseCheck, AMeshThatIsInsideOutIsNotOriented) {
  MeshReport report;
  report.volume = -1.0;
  EXPECT_EQ(check_promises({.oriented = true}, report).broken,
            (std::vector<std::string>{"oriented (inside out, the volume is negative)"}));
  EXPECT_TRUE(check_promises({.closed = true}, report).broken.empty());
  report.volume = 1.0;
  EXPECT_TRUE(check_promises({.oriented = true}, report).broken.empty());
}

TEST(PromiseCheck, NamesWhatIsBrokenAndWhatNobodyLookedAt) {
  const Promises all{true, true, true, true};
  MeshReport good;
  EXPECT_TRUE(check_promises(all, good).broken.empty());
  EXPECT_EQ(check_promises(all, good).unchecked, (std::vector<std::string>{"no self-intersection"}));

  MeshReport bad;
  bad.boundary_edges = 5;
  bad.non_manifold_vertices = 2;
  bad.inconsistent_edges = 1;
  bad.self_intersections.emplace().pairs = 7;
  const PromiseCheck check = check_promises(all, bad);
  EXPECT_EQ(check.broken, (std::vector<std::string>{
                              "closed (5 boundary edges)", "manifold (0 edges and 2 vertices are not)",
                              "oriented (1 inconsistent edges)", "no self-intersection (7 pairs)"}));
  EXPECT_TRUE(check.unchecked.empty());
  EXPECT_EQ(promise_letters(all, check), "cmoi BROKEN");
  EXPECT_EQ(promise_letters(all, check_promises(all, good)), "cmoi unchecked");
  EXPECT_EQ(promise_letters({.manifold = true}, {}), "m kept");
  EXPECT_EQ(promise_letters({}, {}), "none");
  EXPECT_EQ(promise_verdict({.closed = true, .oriented = true}, {}), "promises closed, oriented: kept");
  EXPECT_EQ(promise_verdict({.closed = true}, check_promises({.closed = true}, bad)),
            "BROKEN: closed (5 boundary edges)");
  EXPECT_TRUE(check_promises({}, bad).broken.empty());
  EXPECT_EQ(check_promises({.manifold = true}, bad).broken.size(), 1u);
}

}  // namespace
}  // namespace hermesh
