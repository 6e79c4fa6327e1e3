#include "experiments/measurements/measurements.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "experiments/harness/job.h"
#include "experiments/variants.h"

namespace hermesh {
namespace {

/// Powers of a base: n, baseⁿ, and for the label "odd" those of odd n alone.
std::vector<MeasuredRow> powers(const MeasurementInput& input) {
  if (input.parameters.is("mode", "fail")) throw Error("the toy fell apart");
  std::vector<MeasuredRow> rows;
  for (int n = 0; n < 4; ++n) {
    const double power = std::pow(input.parameters.number("base"), n);
    rows.push_back({"powers", "all", {{"exponent", n}, {"power", power}, {"word", "p" + std::to_string(n)}}});
    if (n % 2 == 1) rows.push_back({"powers", "odd", {{"exponent", n}, {"power", power}}});
  }
  rows.push_back({"points", "all", {{"exponent", 1}}});
  if (input.parameters.is("mode", "stray")) rows.push_back({"powers", "all", {{"logarithm", 1}}});
  if (input.parameters.is("mode", "broken")) rows.back().broken = {"one is not two"};
  return rows;
}

Measurement toy() {
  return {.name = "toy",
          .summary = "powers",
          .parameters = {{"base", "2", "of the powers", {}, 1, 10},
                         {"mode", "fine", "", {"fine", "fail", "stray", "broken"}}},
          .tables = {{"powers",
                      "what they are",
                      "which",
                      {{"exponent", "n", "the exponent"},
                       {"power", "power [1]", "the base to the n"},
                       {"word", "word", "its name"}}},
                     {.name = "points",
                      .title = "drawn only",
                      .first_column = "which",
                      .columns = {{"exponent", "n", "again"}},
                      .printed = false}},
          .measure = powers};
}

class Measurements : public testing::Test {
 protected:
  void SetUp() override { tables_.measurements = {toy()}; }

  std::vector<Json> run(const std::map<std::string, std::string>& parameters, const std::string& filter = "",
                        const std::set<std::string>& done = {}) {
    return run_measurement(
        {.name = "toy", .parameters = parameters, .seed = 7, .filter = filter, .done = done}, tables_,
        context_, [this](const Json& row) { kept_.push_back(row); });
  }

  Tables tables_;
  RunContext context_;
  std::vector<Json> kept_;
};

TEST_F(Measurements, ARowHasItsValuesItsTableAndItsParameters) {
  const std::vector<Json> rows = run({{"base", "3"}});
  ASSERT_EQ(rows.size(), 7u);
  EXPECT_EQ(kept_, rows);
  EXPECT_EQ(rows[1]["measurement"]["parameters"], "base=3 mode=fine");
  EXPECT_EQ(rows[1]["measurement"]["seed"], 7);
  EXPECT_EQ(rows[1]["values"], (Json{{"exponent", 1}, {"power", 3.0}, {"word", "p1"}}));
  EXPECT_EQ(rows[1]["table"]["title"], "what they are");
  EXPECT_EQ(rows[6]["table"]["printed"], false);
}

TEST_F(Measurements, WhatWasNotDeclaredIsAnError) {
  EXPECT_THROW(run({{"mode", "stray"}}), Error);
  EXPECT_THROW(run({{"exponent", "2"}}), Error);
  EXPECT_THROW(run({{"base", "11"}}), Error);
}

TEST_F(Measurements, AFailureIsARow) {
  const std::vector<Json> rows = run({{"mode", "fail"}});
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0]["failed"], "the toy fell apart");
}

TEST_F(Measurements, ABrokenExpectationIsInTheRow) {
  EXPECT_EQ(run({{"mode", "broken"}}).back()["broken"].size(), 1u);
}

TEST_F(Measurements, TheFilterAndExistingRowsLeaveRowsOut) {
  EXPECT_EQ(run({}, "powers/odd").size(), 2u);
  EXPECT_EQ(run({}, "", {"powers/all"}).size(), 3u);
}

TEST(NormalCodesMeasurement, GivesWhatItDeclares) {
  Tables tables;
  tables.measurements = {normal_codes_measurement()};
  RunContext context;
  const std::vector<Json> rows = run_measurement({.name = "normal-codes",
                                                  .parameters = {{"points", "20000"},
                                                                 {"normals", "1000"},
                                                                 {"repetitions", "1"},
                                                                 {"bins", "10"},
                                                                 {"directions", "4"}}},
                                                 tables, context);
  ASSERT_EQ(rows.size(), 5u * (1 + 10 + 1));
  double shares = 0.0;
  for (const Json& row : rows) {
    EXPECT_FALSE(row.contains("failed")) << row.dump();
    EXPECT_FALSE(row.contains("broken")) << row.dump();
    shares += number_at(row, "/values/share");
    if (find(row, "/values/max")) {
      EXPECT_GE(number_at(row, "/values/cell_max") * 1.1, number_at(row, "/values/max"));
      EXPECT_GT(number_at(row, "/values/p99"), number_at(row, "/values/median"));
    }
    EXPECT_EQ(row["case"]["name"] == "speed", number_at(row, "/values/pack") > 0.0);
  }
  EXPECT_NEAR(shares, 5.0, 1e-9) << "all errors are below 3°";
}

/// Voxelizing and extracting a table's models take minutes to hours; a filter is there to spare them.
TEST(AllMeasurements, DoNoWorkForRowsThatTheFilterThrowsAway) {
  Tables tables;
  for (Extractor each : all_extractors()) {
    each.extract = [](const ExtractionInput&) -> PolygonMesh { throw Error("extracted in vain"); };
    tables.extractors.push_back(each);
  }
  for (Voxelizer each : all_voxelizers()) {
    each.voxelize = [](const VoxelizationInput&) -> LevelSet { throw Error("voxelized in vain"); };
    tables.voxelizers.push_back(each);
  }
  // A label may say where a model came from, so that to read it is not yet in vain.
  tables.load = [](const std::string& name, RunContext&) {
    PolygonMesh triangle;
    triangle.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.triangles = {{0, 1, 2}};
    return LoadedCase{name, triangle, "generated", ""};
  };
  for (const Measurement& each : all_measurements()) {
    tables.measurements = {each};
    RunContext context;
    const std::vector<Json> rows =
        run_measurement({.name = each.name, .filter = "no such row"}, tables, context);
    EXPECT_TRUE(rows.empty()) << each.name << ": " << rows.front().dump();
  }
}

}  // namespace
}  // namespace hermesh
