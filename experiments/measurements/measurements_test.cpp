// Measurements: the rows of a toy, and those of measurements with known results.
#include "experiments/measurements/measurements.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "experiments/cells/serve.h"
#include "experiments/variants.h"

namespace hermesh {
namespace measurements_test {

/// Returns powers of a base: n, baseⁿ, and for the label "odd" those of odd n only.
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

std::vector<Json> rows_of(const std::string& measurement,
                          const std::map<std::string, std::string>& parameters,
                          const std::string& filter = "") {
  RunContext context;
  return run_measurement({.name = measurement, .parameters = parameters, .filter = filter}, all_tables(),
                         context);
}

double value(const Json& row, const std::string& column) { return number_at(row, "/values/" + column); }

void expect_unbroken(const std::vector<Json>& rows) {
  for (const Json& row : rows) EXPECT_FALSE(row.contains("broken") || row.contains("failed")) << row.dump();
}

TEST(NormalCodesMeasurement, GivesWhatItDeclares) {
  const std::vector<Json> rows = rows_of(
      "normal-codes",
      {{"points", "20000"}, {"normals", "1000"}, {"repetitions", "1"}, {"bins", "10"}, {"directions", "4"}});
  ASSERT_EQ(rows.size(), 5u * (1 + 10 + 1));
  expect_unbroken(rows);
  double shares = 0.0;
  for (const Json& row : rows) {
    shares += number_at(row, "/values/share");
    if (find(row, "/values/max")) {
      EXPECT_GE(number_at(row, "/values/cell_max") * 1.1, number_at(row, "/values/max"));
      EXPECT_GT(number_at(row, "/values/p99"), number_at(row, "/values/median"));
    }
    EXPECT_EQ(row["case"]["name"] == "speed", number_at(row, "/values/pack") > 0.0);
  }
  EXPECT_NEAR(shares, 5.0, 1e-9) << "all errors are below 3°";
}

/// Voxelizing and extracting a table's models take minutes to hours, which a filter must save.
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
  // A label may contain the origin of a model, which requires reading it.
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

TEST(ArithmeticMeasurement, CountsTheOperationsOfTheCodeThatIsInUse) {
  const std::vector<Json> rows = rows_of("arithmetic", {}, "operations/");
  ASSERT_EQ(rows.size(), 4u);
  expect_unbroken(rows);
  // Additions, multiplications, divisions, roots, look-ups.
  constexpr double kCounts[4][5] = {{2, 2, 2, 0, 0}, {2, 2, 1, 0, 0}, {2, 3, 0, 0, 1}, {4, 6, 1, 1, 0}};
  for (std::size_t i = 0; i < 4; ++i) {
    const char* const columns[] = {"additions", "multiplications", "divisions", "roots", "lookups"};
    for (std::size_t j = 0; j < 5; ++j)
      EXPECT_EQ(value(rows[i], columns[j]), kCounts[i][j]) << i << columns[j];
  }
  EXPECT_EQ(value(rows[1], "differing"), 0.0);
  EXPECT_EQ(value(rows[2], "tried"), 65'536.0);
}

TEST(ArithmeticMeasurement, AllStoragesFindTheSameNeighbours) {
  const std::vector<Json> rows =
      rows_of("arithmetic", {{"case", "torus"}, {"resolution", "24"}, {"repetitions", "3"}}, "blocks/");
  ASSERT_EQ(rows.size(), 6u);
  expect_unbroken(rows);  // a sum that is not that of the first row breaks it
}

/// §2.4 indexes a grid of 200 × 400 samples by x + 200 y, and states that it has 160 000 elements.
TEST(UniformGrid, TwoHundredTimesFourHundredSamplesAreEightyThousand) {
  std::vector<int> used(160'000, 0);
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 200; ++x) ++used.at(std::size_t(x + y * 200));
  EXPECT_TRUE(std::all_of(used.begin(), used.begin() + 80'000, [](int times) { return times == 1; }));
  EXPECT_TRUE(std::all_of(used.begin() + 80'000, used.end(), [](int times) { return times == 0; }));
}

/// The heights have the spectrum that they were made with.
TEST(SurfaceNoiseMeasurement, ThePolygonsHaveTheNoiseThatWasAskedFor) {
  const std::vector<Json> rows = rows_of("surface-noise", {{"width", "64"}, {"pixels", "0"}}, ": polygons");
  ASSERT_EQ(rows.size(), 3u);
  expect_unbroken(rows);
  for (const Json& row : rows) {
    const double noise = value(row, "noise");
    EXPECT_NEAR(value(row, "rms"), noise, 1e-4 * noise);
    EXPECT_NEAR(std::hypot(value(row, "rms_from_4"), value(row, "rms_from_8")), noise, 1e-4 * noise);
    for (const char* band : {"rms_from_2", "rms_from_16", "rms_from_32"})
      EXPECT_LT(value(row, band), 1e-5) << band;
    EXPECT_DOUBLE_EQ(value(row, "noise_kept"), 1.0);
    EXPECT_EQ(value(row, "holes"), 0.0);
  }
}

TEST(SamplingMeasurement, ACubesFacesLoseVoxelsEverywhere) {
  const std::vector<Json> rows =
      rows_of("sampling", {{"resolution", "30"}, {"samples", "500"}}, "turned-cube");
  expect_unbroken(rows);
  ASSERT_FALSE(rows.empty());
  ASSERT_EQ(text_at(rows[0], "/case/name"), "missed");
  EXPECT_EQ(value(rows[0], "creases"), 12.0);
  EXPECT_EQ(value(rows[0], "invented"), 0.0);
  double boundary = 0.0, missed = 0.0;
  std::size_t angles = 0;
  for (const Json& row : rows) {
    if (text_at(row, "/case/name") == "sign-angle") ++angles;
    if (text_at(row, "/case/name") != "where") continue;
    boundary += value(row, "voxels");
    missed += value(row, "missed");
  }
  EXPECT_EQ(boundary, value(rows[0], "boundary")) << "each voxel is in one class of distances";
  EXPECT_EQ(missed, value(rows[0], "missed"));
  EXPECT_GT(missed, 0.0);
  EXPECT_EQ(angles, 12u);
}

TEST(FogMeasurement, DensitiesAreThoseOfTheRamp) {
  const std::vector<Json> rows =
      rows_of("figure-9-3", {{"resolution", "30"}, {"puffs", "2"}, {"spread", "1"}, {"pixels", "0"}}, "");
  ASSERT_EQ(rows.size(), 4u);
  expect_unbroken(rows);
  for (const Json& row : rows) EXPECT_EQ(value(row, "wrong"), 0.0);
  // A ramp inside takes mass away, the more the wider it is; one over both sides about keeps it.
  EXPECT_LT(value(rows[2], "mass"), value(rows[1], "mass"));
  EXPECT_LT(value(rows[1], "mass"), value(rows[0], "mass"));
  EXPECT_LT(value(rows[0], "mass"), value(rows[0], "solid"));
}

TEST(ThreadsMeasurement, ComparesWithOneThread) {
  const std::vector<Json> rows =
      rows_of("threads", {{"case", "torus"}, {"resolution", "30"}, {"repetitions", "1"}},
              "extractors/marching-cubes");
  expect_unbroken(rows);
  ASSERT_FALSE(rows.empty());
  EXPECT_EQ(value(rows.front(), "threads"), 1.0);
  EXPECT_DOUBLE_EQ(value(rows.front(), "speedup"), 1.0);
  EXPECT_EQ(value(rows.back(), "threads"),
            double(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)));
}

TEST(Slow, TheOracleOfFigure91AgreesWithItself) {
  const std::vector<Json> rows =
      rows_of("figure-9-1", {{"resolution", "20"}, {"pixels", "0"}}, "clean-up/openscad, exact");
  ASSERT_EQ(rows.size(), 1u);
  for (const char* column : {"buried", "missing", "wrong_signs"})
    EXPECT_EQ(value(rows[0], column), 0.0) << column;
  EXPECT_EQ(value(rows[0], "active"), value(rows[0], "active_inside") + value(rows[0], "active_outside"));
}

// ---- Guarantees.

const std::map<std::string, std::string> kSmall = {
    {"cases", "turned-cube"}, {"resolutions", "30"}, {"noise_sizes", "8"}};

std::vector<Json> guarantee_rows(const std::map<std::string, std::string>& parameters,
                                 const std::string& filter = "", const std::atomic<bool>* cancel = nullptr,
                                 const std::function<void(const Json&)>& keep = {}) {
  RunContext context;
  context.cancel = cancel;
  return run_measurement({.name = "guarantee", .parameters = parameters, .seed = 5, .filter = filter},
                         all_tables(), context, keep);
}

TEST(GuaranteeMeasurement, FindsNoViolation) {
  const std::vector<Json> rows = guarantee_rows(kSmall);
  // Two tolerances and the uniform mesh, and four others, and an overview, of a model, four fields of noise
  // and two of patterns; the sums of the three kinds; and the total.
  ASSERT_EQ(rows.size(), 8u * (1 + 4 + 2) + 7u * 3 + 1);
  std::size_t certified = 0;
  expect_unbroken(rows);
  for (const Json& row : rows)
    certified += row["values"].contains("from_upper") && row["values"].contains("to_upper");
  EXPECT_EQ(certified, 2u * (1 + 4 + 2)) << "every adaptive mesh has its bounds";
  EXPECT_EQ(number_at(rows.back(), "/values/meshes"), 3 * (1 + 4 + 2));
  EXPECT_EQ(rows.back()["values"]["violations"], 0);
}

/// Digests of meshes made without validation make the results of one commit valid for another.
TEST(GuaranteeMeasurement, DigestsAreThoseOfTheMeshesThatAreJudged) {
  const auto overviews = [](const std::map<std::string, std::string>& parameters) {
    std::map<std::string, Json> result;
    for (const Json& row : guarantee_rows(parameters, "noise")) {
      const std::string kind = text_at(row, "/case/name");
      if (kind == "noise" || kind == "summary") result[text_at(row, "/variant/name")] = row["values"];
    }
    return result;
  };
  std::map<std::string, std::string> parameters = kSmall;
  std::map<std::string, Json> judged = overviews(parameters);
  parameters["judge"] = "no";
  std::map<std::string, Json> made = overviews(parameters);
  parameters["tolerances"] = "0.1";
  std::map<std::string, Json> fewer = overviews(parameters);
  for (const char* field : {"uniform 000", "whole 001", "uniform 002", "whole 003"}) {
    EXPECT_EQ(text_at(judged[field], "/digest").size(), 16u) << field;
    EXPECT_EQ(judged[field]["digest"], made[field]["digest"]) << field;
    EXPECT_NE(judged[field]["digest"], fewer[field]["digest"]) << "the mesh with tolerance 1 is missing";
    EXPECT_EQ(number_at(judged[field], "/violations"), 0);
  }
  for (const auto& [name, values] : made)
    EXPECT_FALSE(values.contains("violations")) << "not validated: " << name;
}

TEST(GuaranteeMeasurement, ARowIsMadeWhenItsWholeLabelIsAskedFor) {
  std::map<std::string, std::string> parameters = kSmall;
  parameters["extractor"] = "certified-octree";
  parameters["judge"] = "no";
  const std::vector<Json> rows = guarantee_rows(parameters, "patterns/cells 000, octree");
  const bool made = std::ranges::any_of(rows, [](const Json& row) {
    return text_at(row, "/case/name") == "patterns" && text_at(row, "/variant/name") == "cells 000, octree";
  });
  EXPECT_TRUE(made);
}

/// An interrupted run of hours keeps its rows.
TEST(GuaranteeMeasurement, KeepsRowsThatWereReadyBeforeItWasCancelled) {
  const std::vector<Json> all = guarantee_rows(kSmall, "noise");
  std::atomic<bool> cancel = false;
  std::vector<Json> kept;
  EXPECT_THROW(guarantee_rows(kSmall, "noise", &cancel,
                              [&](const Json& row) {
                                kept.push_back(row);
                                cancel = true;
                              }),
               Cancelled);
  ASSERT_GE(kept.size(), 1u);
  ASSERT_LT(kept.size(), all.size());
  EXPECT_EQ(kept[0]["variant"], all[0]["variant"]);
}

TEST(GuaranteeMeasurement, SeesTheDefectsOfThoseThatPromiseLess) {
  std::int64_t defects = 0;
  for (const Json& row : guarantee_rows(kSmall, "uniform"))
    if (text_at(row, "/values/extractor") == "dual-contouring")
      defects += std::int64_t(number_at(row, "/values/non_manifold_edges")) +
                 std::int64_t(number_at(row, "/values/self_intersections"));
  EXPECT_GT(defects, 0);
}

}  // namespace measurements_test
}  // namespace hermesh
