#include "experiments/ledger/compare.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>

#include "experiments/harness/rows.h"

namespace hermesh {
namespace {

using Rows = std::vector<Json>;
using State = CellVerdict::State;

/// Ten times about a second, scattered by a hundredth as on a quiet machine.
Json seconds_about(double median, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(1.0, 0.01);
  Json all = Json::array();
  for (int i = 0; i < 10; ++i) all.push_back(median * noise(random));
  return {{"median", median}, {"minimum", median}, {"repetitions", 10}, {"warm", true}, {"all", all}};
}

Json head(const std::string& experiment) {
  return {{"experiment", experiment},
          {"tier", "quick"},
          {"run", "2026-01-01-1"},
          {"commit", "1111111111111111111111111111111111111111"},
          {"dirty", false},
          {"date", "2026-01-01"},
          {"machine", {{"cpu", "Some CPU"}, {"cores", 2}}},
          {"threads", 2},
          {"load", {0.5, 0.5, 0.5}}};
}

Json mesh_row(const std::string& label, const std::string& options, unsigned seed) {
  Json row = head("headline");
  row["case"] = {{"name", "torus"}, {"origin", "generated"}, {"sha256", "aa00"}};
  row["resolution"] = 100;
  row["voxel_size"] = 0.01;
  row["samples"] = 1000;
  row["variant"] = {
      {"name", "contouring"}, {"label", label}, {"options", options}, {"promises", {"closed", "manifold"}}};
  row["voxelization"] = {{"name", "hermesh"},
                         {"label", "hermesh"},
                         {"options", "signs=auto"},
                         {"peak_bytes", 50 << 20},
                         {"seconds", seconds_about(0.5, seed + 50)},
                         {"digest", "beef"},
                         {"active_voxels", 30000},
                         {"memory_bytes", 2 << 20}};
  row["peak_bytes"] = 20 << 20;
  row["digest"] = "digest of " + label;
  row["triangle_count"] = 2000;
  row["report"] = {{"points", 1000},
                   {"quads", 900},
                   {"boundary_edges", 0},
                   {"closed", true},
                   {"genus", 1},
                   {"self_intersecting_pairs", 0},
                   {"smallest_angle", 20.0},
                   {"euler_characteristic", 0},
                   {"to_reference", {{"max", 0.004}, {"mean", 0.001}, {"rms", 0.002}, {"samples", 2000}}},
                   {"solid", {{"verdict", "same"}, {"difference_percent", 0.25}}}};
  row["broken"] = Json::array();
  row["unchecked"] = Json::array();
  row["promise_letters"] = "cm kept";
  row["seconds"] = seconds_about(1.0, seed);
  row["nanoseconds_per_active_voxel"] = 33.0;
  return row;
}

Json voxel_row() {
  Json row = head("headline");
  row["kind"] = "voxelization";
  row["band"] = {{"exterior", 3.0}, {"interior", 3.0}};
  row["case"] = {{"name", "plate"}, {"sha256", "bb00"}};
  row["nominal_voxel_size"] = 0.5;
  row["voxel_size"] = 0.5;
  row["sweep"] = {{"parameter", "gap"}, {"value", 1.5}};
  row["variant"] = {{"name", "hermesh"}, {"label", "hermesh"}, {"options", "signs=auto"}};
  row["voxelization"] = {{"active_voxels", 7000}, {"fingerprint", "f00d"}, {"memory_bytes", 1 << 20}};
  row["accuracy"] = {{"max", 0.02}, {"rms", 0.003}, {"stray", 0}};
  row["signs"] = {{"judged", 6000}, {"wrong", 4}, {"wrong_share", 4.0 / 6000.0}};
  row["seconds"] = seconds_about(0.2, 4);
  return row;
}

Json measured_row(const std::string& label, int threads) {
  Json row = head("codes");
  row["measurement"] = {{"name", "codes"}, {"parameters", "points=1000 step=2"}, {"seed", 1}};
  row["case"] = {{"name", "errors"}};
  row["inputs"] = {{{"name", "bunny"}, {"sha256", "cc00"}}};
  row["variant"] = {{"name", label}, {"label", label}};
  row["table"] = {{"columns",
                   {{{"name", "threads"}, {"header", "threads"}, {"meaning", ""}},
                    {{"name", "mean"}, {"header", "mean [°]"}, {"meaning", ""}},
                    {{"name", "held"}, {"header", "held [%]"}, {"meaning", ""}},
                    {{"name", "growth"}, {"header", "growth"}, {"meaning", ""}},
                    {{"name", "escaped"}, {"header", "escaped"}, {"meaning", ""}},
                    {{"name", "slope"}, {"header", "slope"}, {"meaning", ""}},
                    {{"name", "slope_low"}, {"header", "from"}, {"meaning", ""}},
                    {{"name", "slope_high"}, {"header", "to"}, {"meaning", ""}},
                    {{"name", "verdict"}, {"header", "verdict"}, {"meaning", ""}},
                    {{"name", "pack"}, {"header", "pack [ns]"}, {"meaning", ""}},
                    {{"name", "speedup"}, {"header", "speedup"}, {"meaning", ""}}}}};
  row["values"] = {{"threads", threads}, {"mean", 1.25}, {"held", 96.0},      {"growth", 1.7},
                   {"escaped", 1000.0},  {"slope", 2.0}, {"slope_low", 1.95}, {"slope_high", 2.05},
                   {"verdict", "met"},   {"pack", 1.5},  {"speedup", 1.9}};
  return row;
}

Json failed_row() {
  Json row = mesh_row("failing", "a=9", 9);
  for (const char* key : {"digest", "report", "seconds", "triangle_count"}) row.erase(key);
  row["failed"] = "there is no way";
  row["promise_letters"] = "FAILED";
  return row;
}

// Rows by their place in baseline().
constexpr std::size_t kMesh = 0, kSharp = 1, kFailed = 2, kVoxels = 3, kMeasured = 4, kMoreThreads = 5;

Rows baseline() {
  Json broken = mesh_row("broken", "a=5", 7);
  broken["case"]["name"] = "knot";
  broken["broken"] = {"manifold: 3 edges are not"};
  broken["promise_letters"] = "cm BROKEN";
  return {mesh_row("smooth", "a=1 b=2", 1), mesh_row("sharp", "a=3", 2), failed_row(), voxel_row(),
          measured_row("thesis", 1),        measured_row("thesis", 2),   broken};
}
constexpr std::size_t kBroken = 6;

struct Change {
  const char* name;
  std::function<void(Rows&)> make;
};

void scale(Json& row, const char* place, double factor) {
  Json& value = row.at(Json::json_pointer(place));
  value = value.get<double>() * factor;
}

/// Later repetitions than the baseline's own, so that noise is other noise.
void slow_down(Json& row, const char* place, double median) {
  row[Json::json_pointer(place)] = seconds_about(median, 99);
}

const std::vector<Change>& drifts() {
  static const std::vector<Change> all = {
      {"a point more", [](Rows& r) { r[kMesh]["report"]["points"] = 1001; }},
      {"a triangle less", [](Rows& r) { r[kMesh]["triangle_count"] = 1999; }},
      {"another mesh", [](Rows& r) { r[kMesh]["digest"] = "other"; }},
      {"another grid", [](Rows& r) { r[kMesh]["voxelization"]["digest"] = "other"; }},
      {"another tree of voxels", [](Rows& r) { r[kVoxels]["voxelization"]["fingerprint"] = "other"; }},
      {"an error larger by 3 %", [](Rows& r) { scale(r[kMesh], "/report/to_reference/rms", 1.03); }},
      {"an angle smaller by 3 %", [](Rows& r) { scale(r[kMesh], "/report/smallest_angle", 0.97); }},
      {"a measured error larger by 3 %", [](Rows& r) { scale(r[kMeasured], "/values/mean", 1.03); }},
      {"what should hold holds less", [](Rows& r) { r[kMeasured]["values"]["held"] = 94.5; }},
      {"a figure of unknown direction smaller by 3 %",
       [](Rows& r) { scale(r[kMeasured], "/values/growth", 0.97); }},
      {"a count kept as floating point", [](Rows& r) { r[kMeasured]["values"]["escaped"] = 1001.0; }},
      {"a slope beyond its interval",
       [](Rows& r) {
         r[kMeasured]["values"].update(Json{{"slope", 1.8}, {"slope_low", 1.75}, {"slope_high", 1.85}});
       }},
      {"a text of a measurement", [](Rows& r) { r[kMeasured]["values"]["verdict"] = "not met"; }},
      {"a missing row", [](Rows& r) { r.erase(r.begin() + kMesh); }},
      {"a missing row among those of one label", [](Rows& r) { r.erase(r.begin() + kMoreThreads); }},
      {"a missing experiment",
       [](Rows& r) { std::erase_if(r, [](const Json& row) { return row["experiment"] == "codes"; }); }},
      {"a renamed variant", [](Rows& r) { r[kSharp]["variant"]["label"] = "pointed"; }},
      {"times of 1.3", [](Rows& r) { slow_down(r[kMesh], "/seconds", 1.3); }},
      {"times of 1.3 of a voxelizer", [](Rows& r) { slow_down(r[kVoxels], "/seconds", 0.26); }},
      {"times of 1.15, the median alone",
       [](Rows& r) { slow_down(r[kMesh], "/voxelization/seconds", 0.575); }},
      {"a peak of 1.5", [](Rows& r) { scale(r[kMesh], "/peak_bytes", 1.5); }},
      {"larger trees", [](Rows& r) { scale(r[kVoxels], "/voxelization/memory_bytes", 1.03); }},
      {"a broken promise",
       [](Rows& r) {
         r[kMesh]["broken"] = {"closed: 4 edges are open"};
         r[kMesh]["promise_letters"] = "cm BROKEN";
       }},
      {"another promise broken where one was",
       [](Rows& r) { r[kBroken]["broken"].push_back("closed: 1 edge is open"); }},
      {"a promise that is no longer made",
       [](Rows& r) {
         r[kMesh]["variant"]["promises"] = {"closed"};
         r[kMesh]["promise_letters"] = "c kept";
       }},
      {"a promise that is no longer checked", [](Rows& r) { r[kMesh]["unchecked"] = {"manifold"}; }},
      {"a failure", [](Rows& r) { r[kMesh]["failed"] = "out of luck"; }},
      {"another option", [](Rows& r) { r[kMesh]["variant"]["options"] = "a=1 b=3"; }},
      {"another parameter of a measurement",
       [](Rows& r) { r[kMeasured]["measurement"]["parameters"] = "points=900 step=2"; }},
      {"another seed", [](Rows& r) { r[kMeasured]["measurement"]["seed"] = 2; }},
      {"another input", [](Rows& r) { r[kMesh]["case"]["sha256"] = "ffff"; }},
      {"another input of a measurement", [](Rows& r) { r[kMeasured]["inputs"][0]["sha256"] = "ffff"; }},
      {"an error that is not finite", [](Rows& r) { r[kMesh]["report"]["to_reference"]["max"] = nullptr; }},
      {"a genus that is unknown now", [](Rows& r) { r[kMesh]["report"]["genus"] = nullptr; }},
      {"a truth value of the report", [](Rows& r) { r[kMesh]["report"]["closed"] = false; }},
      {"a count of the report that is no column",
       [](Rows& r) { r[kMesh]["report"]["euler_characteristic"] = 2; }},
      {"the solid", [](Rows& r) { r[kMesh]["report"]["solid"]["verdict"] = "differs"; }},
      {"wrong signs", [](Rows& r) { r[kVoxels]["signs"]["wrong"] = 5; }},
      {"an error where there was none", [](Rows& r) { r[kVoxels]["accuracy"]["stray"] = 1; }},
      {"repetitions that differ", [](Rows& r) { r[kMesh]["repetitions_differ"] = true; }},
      {"fewer samples for the distances", [](Rows& r) { r[kMesh]["samples"] = 500; }},
      {"a narrower band", [](Rows& r) { r[kVoxels]["band"]["exterior"] = 2.0; }},
      {"another size of voxels under one resolution", [](Rows& r) { r[kMesh]["voxel_size"] = 0.0101; }},
      {"a later run that is worse", [](Rows& r) {
         Rows again = r;
         for (Json& row : again) row["run"] = "2026-01-02-1";
         again[kMesh]["digest"] = "other";
         r.insert(r.end(), again.begin(), again.end());
       }}};
  return all;
}

const std::vector<Change>& harmless() {
  static const std::vector<Change> all = {
      {"nothing", [](Rows&) {}},
      {"order of rows", [](Rows& r) { std::ranges::reverse(r); }},
      {"order of rows of one label", [](Rows& r) { std::swap(r[kMeasured], r[kMoreThreads]); }},
      {"order of keys",
       [](Rows& r) {
         Json turned;
         std::vector<std::string> keys;
         for (const auto& [key, value] : r[kMesh].items()) keys.push_back(key);
         std::ranges::reverse(keys);
         for (const std::string& key : keys) turned[key] = r[kMesh][key];
         r[kMesh] = turned;
       }},
      {"noise of times", [](Rows& r) { slow_down(r[kMesh], "/seconds", 1.0); }},
      {"times of 1.05", [](Rows& r) { slow_down(r[kMesh], "/seconds", 1.05); }},
      {"faster", [](Rows& r) { slow_down(r[kMesh], "/seconds", 0.7); }},
      {"one slow repetition", [](Rows& r) { r[kMesh]["seconds"]["all"][3] = 5.0; }},
      {"four repetitions, however slow",
       [](Rows& r) {
         r[kMesh]["seconds"] = {{"median", 9.0}, {"repetitions", 4}, {"all", {9.0, 9.1, 9.2, 9.3}}};
       }},
      {"a slower machine",
       [](Rows& r) {
         for (Json& row : r) row["machine"]["cpu"] = "Some old CPU";
         slow_down(r[kMesh], "/seconds", 3.0);
         scale(r[kMesh], "/peak_bytes", 3.0);
       }},
      {"fewer threads", [](Rows& r) { r[kMesh]["threads"] = 1, slow_down(r[kMesh], "/seconds", 2.0); }},
      {"a machine of more cores",
       [](Rows& r) { r[kMesh]["machine"]["cores"] = 64, slow_down(r[kMesh], "/seconds", 2.0); }},
      {"another commit",
       [](Rows& r) {
         for (Json& row : r) row["commit"] = "2222", row["dirty"] = true;
       }},
      {"another date and run",
       [](Rows& r) {
         for (Json& row : r) row["date"] = "2027-01-01", row["run"] = "2027";
       }},
      {"load",
       [](Rows& r) {
         for (Json& row : r) row["load"] = {9.0, 9.0, 9.0};
       }},
      {"another compiler",
       [](Rows& r) {
         for (Json& row : r) row["build"] = {{"compiler", "other"}};
       }},
      {"a new row", [](Rows& r) { r.push_back(mesh_row("new", "a=7", 77)); }},
      {"a new experiment",
       [](Rows& r) { r.push_back(mesh_row("new", "a=7", 77)), r.back()["experiment"] = "more"; }},
      {"a new column of the report",
       [](Rows& r) {
         r[kMesh]["report"]["normals_to_reference"] = {{"mean", 3.0}};
       }},
      {"a new column of a measurement",
       [](Rows& r) {
         r[kMeasured]["table"]["columns"].push_back({{"name", "more"}, {"header", "more"}, {"meaning", ""}});
         r[kMeasured]["values"]["more"] = 5;
       }},
      {"a column less", [](Rows& r) { r[kMesh]["report"]["solid"].erase("difference_percent"); }},
      {"an option more, at its default", [](Rows& r) { r[kMesh]["variant"]["options"] = "a=1 b=2 c=off"; }},
      {"options in another order", [](Rows& r) { r[kMesh]["variant"]["options"] = "b=2 a=1"; }},
      {"a better error", [](Rows& r) { scale(r[kMesh], "/report/to_reference/rms", 0.8); }},
      {"an error larger by half a percent",
       [](Rows& r) { scale(r[kMesh], "/report/to_reference/rms", 1.005); }},
      {"an error of nothing", [](Rows& r) { r[kMesh]["report"]["to_reference"]["mean"] = 0.001 + 1e-9; }},
      {"a larger angle", [](Rows& r) { scale(r[kMesh], "/report/smallest_angle", 1.2); }},
      {"a slope within its interval",
       [](Rows& r) {
         r[kMeasured]["values"].update(Json{{"slope", 1.93}, {"slope_low", 1.88}, {"slope_high", 1.98}});
       }},
      {"a promise that is kept now",
       [](Rows& r) { r[kBroken]["broken"] = Json::array(), r[kBroken]["promise_letters"] = "cm kept"; }},
      {"what failed does no longer", [](Rows& r) { r[kFailed] = mesh_row("failing", "a=9", 9); }},
      {"another sentence of a failure", [](Rows& r) { r[kFailed]["failed"] = "there is still no way"; }},
      {"single times of a measurement", [](Rows& r) { scale(r[kMeasured], "/values/pack", 3.0); }},
      {"ratios of times",
       [](Rows& r) {
         scale(r[kMesh], "/nanoseconds_per_active_voxel", 3.0), scale(r[kMeasured], "/values/speedup", 0.3);
       }},
      {"a peak of 1.1", [](Rows& r) { scale(r[kMesh], "/peak_bytes", 1.1); }},
      {"a peak of half a MiB more than next to nothing",
       [](Rows& r) { r[kMesh]["voxelization"]["peak_bytes"] = (50 << 20) + (1 << 19); }},
      {"another sentence of the report",
       [](Rows& r) { r[kMesh]["report"]["sentences"] = {"The mesh is fine."}; }},
      {"notes", [](Rows& r) { r[kMesh]["notes"] = {"a note"}; }},
      {"an earlier run that was worse",
       [](Rows& r) {
         Rows before = r;
         for (Json& row : before) row["run"] = "2025-12-31-1";
         before[kMesh]["digest"] = "other";
         r.insert(r.begin(), before.begin(), before.end());
       }},
      {"the reason why rows were accepted", [](Rows& r) {
         r[kMesh]["accepted"] = {{"reason", "they are right"}};
       }}};
  return all;
}

Comparison compared_with(const Change& change, const CompareSettings& settings = {}) {
  Rows rows = baseline();
  change.make(rows);
  return compare_rows(baseline(), rows, settings);
}

TEST(CompareRows, PlantedDriftsAreCaught) {
  EXPECT_GE(drifts().size(), 30u);
  for (const Change& change : drifts()) {
    const Comparison c = compared_with(change);
    EXPECT_FALSE(c.fine()) << change.name << "\n" << text(c, "md");
    EXPECT_LE(c.regressions(), 2u) << change.name << " is told of other cells, too\n" << text(c, "md");
  }
}

TEST(CompareRows, HarmlessChangesPass) {
  EXPECT_GE(harmless().size(), 30u);
  for (const Change& change : harmless()) {
    const Comparison c = compared_with(change);
    EXPECT_TRUE(c.fine()) << change.name << "\n" << text(c, "md");
  }
}

TEST(CompareRows, ChangesForTheBetterAreTold) {
  for (const Change& change : harmless())
    for (const char* name : {"faster", "a better error", "a larger angle", "a promise that is kept now",
                             "what failed does no longer"})
      if (std::string(change.name) == name) {
        const Comparison c = compared_with(change);
        EXPECT_EQ(
            std::ranges::count_if(c.cells, [](const CellVerdict& cell) { return !cell.better.empty(); }), 1)
            << name;
        EXPECT_NE(text(c, "md").find("### Better"), std::string::npos);
      }
}

TEST(CompareRows, TellsWhatWasNotComparedOnce) {
  Rows rows = baseline();
  for (Json& row : rows) row["machine"]["cpu"] = "other";
  const Comparison c = compare_rows(baseline(), rows);
  EXPECT_EQ(std::ranges::count(c.notes, "seconds not compared: other machine (4 cells)"), 1) << text(c, "md");
  rows = baseline();
  for (Json& row : rows)
    if (row.contains("seconds")) row["seconds"]["all"] = {1.0};
  EXPECT_EQ(std::ranges::count(compare_rows(baseline(), rows).notes,
                               "seconds not compared: too few repetitions (4 cells)"),
            1);
  EXPECT_TRUE(std::ranges::none_of(
      compare_rows(baseline(), rows, {.costs = false}).notes,
      [](const std::string& note) { return note.find("seconds") != std::string::npos; }));
}

TEST(CompareRows, SettingsLetChangesPass) {
  const auto drift = [](const std::string& name) {
    return *std::ranges::find_if(drifts(), [&](const Change& change) { return change.name == name; });
  };
  EXPECT_TRUE(compared_with(drift("an error larger by 3 %"), {.tolerance = 0.05}).fine());
  EXPECT_TRUE(compared_with(drift("times of 1.3"), {.costs = false}).fine());
  EXPECT_TRUE(compared_with(drift("a peak of 1.5"), {.costs = false}).fine());
  EXPECT_TRUE(compared_with(drift("a missing row"), {.allow_missing = true}).fine());
  EXPECT_TRUE(compared_with(drift("a renamed variant"), {.allow_missing = true}).fine());
  EXPECT_FALSE(
      compared_with(drift("another mesh"), {.tolerance = 1.0, .costs = false, .allow_missing = true}).fine());
}

TEST(CompareRows, ARenamedCellIsOneAndItsValuesAreCompared) {
  Rows rows = baseline();
  rows[kSharp]["variant"]["label"] = "pointed";
  rows[kSharp]["report"]["points"] = 1;
  Comparison c = compare_rows(baseline(), rows, {.allow_missing = true});
  EXPECT_EQ(c.count(State::kRenamed), 1u);
  EXPECT_EQ(c.count(State::kMissing) + c.count(State::kNew), 0u);
  EXPECT_EQ(c.regressions(), 1u) << text(c, "md");
  // With other options the digest tells, and where that is another, too, nothing does.
  rows = baseline();
  rows[kSharp]["variant"]["label"] = "pointed";
  rows[kSharp]["variant"]["options"] = "a=4";
  EXPECT_EQ(compare_rows(baseline(), rows).count(State::kRenamed), 1u);
  rows[kSharp]["digest"] = "other";
  c = compare_rows(baseline(), rows);
  EXPECT_EQ(c.count(State::kRenamed), 0u);
  EXPECT_EQ(c.count(State::kMissing), 1u);
  EXPECT_EQ(c.count(State::kNew), 1u);
}

TEST(CompareRows, PoolsTheRepetitionsOfAllRuns) {
  const auto three_runs = [](double median) {
    Rows rows;
    for (int run = 0; run < 3; ++run) {
      rows.push_back(mesh_row("smooth", "a=1", 1));
      rows.back()["run"] = "run " + std::to_string(run);
      rows.back()["seconds"] = {{"all", {median + 0.001 * run, median + 0.002 * run + 0.0005}}};
    }
    return rows;
  };
  EXPECT_TRUE(compare_rows(three_runs(1.0), three_runs(1.3)).fine()) << "two repetitions are too few";
  const Comparison pooled = compare_rows(three_runs(1.0), three_runs(1.3), {.pool = true});
  EXPECT_FALSE(pooled.fine());
  EXPECT_NE(text(pooled, "md").find("over 6 and 6 repetitions"), std::string::npos) << text(pooled, "md");
  EXPECT_TRUE(compare_rows(three_runs(1.0), three_runs(1.0), {.pool = true}).fine());
}

TEST(CompareRows, ADisturbedRunAmongPooledOnesIsNoRegression) {
  const auto runs = [](std::initializer_list<double> medians) {
    Rows rows;
    for (const double median : medians) {
      rows.push_back(mesh_row("smooth", "a=1", 1));
      rows.back()["run"] = "run " + std::to_string(rows.size());
      rows.back()["seconds"] = seconds_about(median, unsigned(rows.size()));
    }
    return rows;
  };
  // Two of three runs were disturbed: the test alone is sure that something changed.
  const Comparison disturbed = compare_rows(runs({1.0, 1.0, 1.0}), runs({1.0, 1.5, 1.5}), {.pool = true});
  EXPECT_TRUE(disturbed.fine()) << text(disturbed, "md");
  EXPECT_NE(text(disturbed, "md").find("seconds not told"), std::string::npos) << text(disturbed, "md");
  EXPECT_FALSE(compare_rows(runs({1.0, 1.1, 1.0}), runs({1.3, 1.25, 1.5}), {.pool = true}).fine());
}

TEST(CompareRows, NothingComparedProvesNothing) {
  Rows other = baseline();
  for (Json& row : other) row["experiment"] = "another";
  const Comparison c = compare_rows(baseline(), other, {.allow_missing = true});
  EXPECT_FALSE(c.fine());
  EXPECT_EQ(c.regressions(), 0u);
  EXPECT_NE(text(c, "md").find("Nothing was compared"), std::string::npos);
  EXPECT_NE(text(c, "junit").find("failures=\"1\""), std::string::npos);
}

TEST(CompareRows, FormatsSayTheSame) {
  Rows rows = baseline();
  rows[kMesh]["report"]["points"] = 1001;
  rows[kSharp]["failed"] = "a < b & \"c\"\x01";
  rows.push_back(mesh_row("new", "a=7", 77));
  rows.erase(rows.begin() + kVoxels);
  const Comparison c = compare_rows(baseline(), rows);
  const Json json = Json::parse(text(c, "json"));
  EXPECT_EQ(json["fine"], false);
  EXPECT_EQ(json["regressions"], 3);
  EXPECT_EQ(json["missing"], 1);
  EXPECT_EQ(json["new"], 1);
  EXPECT_EQ(json["cells"].size(), baseline().size() + 1);
  EXPECT_EQ(json["cells"][0]["regressions"][0], "points was 1000, now 1001");
  const std::string junit = text(c, "junit");
  EXPECT_NE(junit.find("tests=\"8\" failures=\"3\""), std::string::npos) << junit;
  EXPECT_NE(junit.find("classname=\"headline, quick\" name=\"torus / 100 / hermesh / smooth\""),
            std::string::npos)
      << junit;
  EXPECT_NE(junit.find("fails: a &lt; b &amp; &quot;c&quot;?"), std::string::npos) << junit;
  EXPECT_NE(text(c, "md").find("6 cells were compared"), std::string::npos) << text(c, "md");
}

TEST(OptionsIn, ValuesMayHaveSpaces) {
  const auto options = options_in("threads=1 2 7 cases=few");
  EXPECT_EQ(options.at("threads"), "1 2 7");
  EXPECT_EQ(options.at("cases"), "few");
  EXPECT_EQ(options.size(), 2u);
  EXPECT_TRUE(options_in("").empty());
}

}  // namespace
}  // namespace hermesh
