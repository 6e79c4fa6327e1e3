#include "experiments/measurements/measurements.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "experiments/harness/experiment_file.h"
#include "experiments/harness/harness.h"
#include "experiments/harness/run_cells.h"

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
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hermesh-measurements-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    tables_.measurements = {toy()};
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  int run(const std::string& tier, const std::string& more = "", const std::string& filter = "") {
    std::ofstream(folder_ / "x.toml")
        << "kind = \"measurement\"\nmeasurement = \"toy\"\nquestion = \"why?\"\n" + more + "\n[quick]\n" +
               tier;
    said_.str("");
    return run_experiment({folder_ / "x.toml", "quick", folder_ / "out", filter}, tables_, context_, said_);
  }
  std::string complaint(const std::string& tier, const std::string& more = "") {
    try {
      run(tier, more);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  }
  std::string report(const std::string& format) const {
    std::ostringstream out;
    write_report(folder_ / "out", format, out);
    return out.str();
  }
  std::vector<Json> rows() const { return read_rows(folder_ / "out"); }

  std::filesystem::path folder_;
  Tables tables_;
  RunContext context_;
  std::ostringstream said_;
};

TEST_F(Measurements, ARowSaysWhatWasMeasuredAndWhereItComesFrom) {
  EXPECT_EQ(run("base = 3", "seed = 7"), 0);
  ASSERT_EQ(rows().size(), 7u);
  const Json row = rows()[1];
  for (const char* key : {"experiment", "tier", "question", "run", "commit", "machine", "libraries", "load"})
    EXPECT_TRUE(row.contains(key)) << key;
  EXPECT_EQ(row["kind"], "measurement");
  EXPECT_EQ(row["measurement"]["parameters"], "base=3 mode=fine");
  EXPECT_EQ(row["measurement"]["seed"], 7);
  EXPECT_EQ(row["values"], (Json{{"exponent", 1}, {"power", 3.0}, {"word", "p1"}}));
}

TEST_F(Measurements, TablesHaveTheirOwnColumnsAndLegend) {
  run("");
  EXPECT_NE(said_.str().find("### powers: what they are\n"), std::string::npos) << said_.str();
  EXPECT_NE(said_.str().find("| which |   n | power [1] | word |"), std::string::npos) << said_.str();
  EXPECT_NE(said_.str().find("| odd   |   3 |         8 |    – |"), std::string::npos) << said_.str();
  EXPECT_NE(said_.str().find("Columns: *n* the exponent; *power [1]* the base to the n; *word* its name."),
            std::string::npos);
  EXPECT_EQ(said_.str().find("drawn only"), std::string::npos);
  EXPECT_NE(report("md").find("| odd   |   3 |         8 |    – |"), std::string::npos);
  EXPECT_NE(report("tex").find("which & n & power [1] & word"), std::string::npos) << report("tex");
  const std::string csv = report("csv");
  EXPECT_NE(csv.substr(0, csv.find('\n')).find(",failed,exponent,power,word"), std::string::npos) << csv;
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 8);
}

TEST_F(Measurements, PlotsTakeATableAndItsColumns) {
  const auto plot = [](const std::string& label) {
    return R"(plots = [{ name = "p", title = "t", case = "powers", x = "exponent", y = ["power"], x_label = "n", )"
           "y_label = \"" +
           label + "\" }]";
  };
  EXPECT_NE(complaint("", plot("")).find("\"y_label\" must be a text"), std::string::npos);
  run("", plot("2ⁿ"));
  std::ifstream stream(folder_ / "out" / "x-p.dat");
  const std::string data{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_EQ(data, "# all\n0 1\n1 2\n2 4\n3 8\n\n\n# odd\n1 2\n3 8\n\n\n");
  EXPECT_NE(report("plots").find("x-p"), std::string::npos);
}

TEST_F(Measurements, MistakesInTheFileNameTheirLine) {
  EXPECT_EQ(complaint("points = 3"), "x.toml:6: unknown key \"points\" in [quick]; it takes mode, base");
  EXPECT_EQ(complaint("base = 11").substr(0, 8), "x.toml:5");
  EXPECT_NE(complaint("", "columns = [\"seconds\"]").find("x.toml:4: \"columns\" has no place"),
            std::string::npos);
  EXPECT_NE(complaint("", R"(plots = [{ name = "p", title = "t", case = "roots" }])")
                .find("there is no case \"roots\""),
            std::string::npos);
}

TEST_F(Measurements, WhatWasNotDeclaredIsAnError) {
  EXPECT_EQ(complaint("mode = \"stray\""),
            "the measurement toy gave a row of powers with an unknown column \"logarithm\"");
}

TEST_F(Measurements, AFailureIsARow) {
  EXPECT_EQ(run("mode = \"fail\""), 1);
  ASSERT_EQ(rows().size(), 1u);
  EXPECT_EQ(rows()[0]["failed"], "the toy fell apart");
  EXPECT_NE(said_.str().find("FAILED: toy on toy: the toy fell apart"), std::string::npos) << said_.str();
}

TEST_F(Measurements, WhatDoesNotHoldMakesTheExitCode3) { EXPECT_EQ(run("mode = \"broken\""), 3); }

TEST_F(Measurements, TheFilterChoosesRows) {
  run("", "", "powers/odd");
  EXPECT_EQ(rows().size(), 2u);
}

TEST_F(Measurements, WhatIsSetComesBeforeTheFile) {
  run("base = 3");
  RunSettings settings{folder_ / "x.toml", "quick", folder_ / "out", ""};
  settings.overrides.parameters = {{"base", "5"}};
  EXPECT_EQ(run_experiment(settings, tables_, context_, said_), 0);
  EXPECT_EQ(rows().back()["measurement"]["parameters"], "base=5 mode=fine");
  settings.overrides.parameters = {{"base", "11"}};
  EXPECT_THROW(run_experiment(settings, tables_, context_, said_), Error);
  settings.overrides.parameters = {{"exponent", "2"}};
  EXPECT_THROW(run_experiment(settings, tables_, context_, said_), Error);
}

TEST(NormalCodesMeasurement, GivesWhatItDeclares) {
  Tables tables;
  tables.measurements = {normal_codes_measurement()};
  RunContext context;
  Experiment experiment;
  experiment.measurement = "normal-codes";
  Tier tier;
  tier.parameters = {
      {"points", "20000"}, {"normals", "1000"}, {"repetitions", "1"}, {"bins", "10"}, {"directions", "4"}};
  const std::vector<Json> rows = run_measurement(experiment, tier, tables, {}, "", Json::object(), context);
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
    Experiment experiment;
    experiment.measurement = each.name;
    RunContext context;
    const std::vector<Json> rows = run_measurement(experiment, {}, tables, {}, "no such row", Json::object(), context);
    EXPECT_TRUE(rows.empty()) << each.name << ": " << rows.front().dump();
  }
}

}  // namespace
}  // namespace hermesh
