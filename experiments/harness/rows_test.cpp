#include "experiments/harness/rows.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "algorithms/core/error.h"

namespace hermesh {
namespace {

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

}  // namespace
}  // namespace hermesh
