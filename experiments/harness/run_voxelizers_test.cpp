// Jobs of voxelizers (job.h), and facts about level sets.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>

#include "algorithms/core/level_set_grid.h"
#include "experiments/cases/recipes.h"
#include "experiments/cases/test_volumes.h"
#include "experiments/harness/facts.h"
#include "experiments/harness/jobs_for_tests.h"
#include "reference/variants.h"

namespace hermesh {
namespace run_voxelizers_test {

LevelSet edited(const LevelSet& level_set, const std::function<void(openvdb::FloatGrid&)>& edit) {
  const openvdb::FloatGrid::Ptr copy = level_set.grid().grid->deepCopy();
  edit(*copy);
  return make_level_set(copy);
}

int calls = 0;  ///< of make_toy()

/// Makes exact level sets, with a defect that the option "does" names.
LevelSet make_toy(const VoxelizationInput& input) {
  const Stage stage(input.context, "one");
  ++calls;
  const std::string& does = input.options.text("does");
  if (does == "fail") throw Error("the toy fell apart");
  return edited(find_variant(reference_voxelizers(), "exact").voxelize(input), [&](openvdb::FloatGrid& grid) {
    if (does == "waver") grid.beginValueOn().setValue(0.01f * float(calls));
    if (does == "hollow")  // no sample is interior
      for (auto value = grid.beginValueAll(); value; ++value) value.setValue(std::abs(*value));
  });
}

VariantEntry toy(const std::string& does) {
  return {.name = "toy", .label = does, .options = {{"does", does}}};
}

class RunVoxelizers : public testing::Test {
 protected:
  void SetUp() override {
    const auto reference = reference_voxelizers();
    tables_.voxelizers = {reference.begin(), reference.end()};
    const OptionSpec does{"does", "copy", "", {"copy", "fail", "waver", "hollow"}};
    tables_.voxelizers.push_back({"toy", "", {does}, make_toy});
    tables_.load = [this](const std::string& name, RunContext& context) {
      return tables_.load_changed(name, {{"hole", 0.1}}, context);
    };
    tables_.load_changed = [this](const std::string& name, RecipeParameters changes, RunContext& context) {
      loaded_.emplace(name, changes.at("hole"));
      changes["open"] = name == "holed" ? 1 : 0;
      changes["around"] = 40;  // the exact voxelizer visits every triangle for every voxel
      return LoadedCase{name, make_recipe("holed-sphere", changes, context), "generated", "0123", 42};
    };
    calls = 0;
  }

  /// Returns the job of a ball at resolution 16 with distances and signs checked at all voxels.
  static GroupJob job(const std::vector<VariantEntry>& variants) {
    GroupJob result = group_job("ball", 16, variants);
    result.extraction = false;
    result.judged.distances = JudgedBy::kAll;
    result.judged.signs = JudgedBy::Signs::kParity;
    result.components = true;
    return result;
  }
  std::vector<Json> run(const GroupJob& job) { return run_job(job, tables_, {}, context_); }

  Tables tables_;
  RunContext context_;
  std::set<std::pair<std::string, double>> loaded_;  ///< cases, with the diameters of their holes
};

TEST_F(RunVoxelizers, ARowHoldsEverythingThatTheCellIs) {
  const std::vector<Json> rows =
      run(job({{.name = "openvdb", .label = "raw", .options = {{"renormalize", "no"}}},
               toy("copy"),
               variant("openvdb")}));
  ASSERT_EQ(rows.size(), 3U);
  const Json& row = rows[1];
  for (const char* key :
       {"experiment", "case", "resolution", "voxel_size", "judged_by", "variant", "voxelization", "seconds",
        "stage_seconds", "peak_bytes", "cpu_seconds", "nanoseconds_per_triangle", "accuracy", "signs",
        "report", "surface_components", "load"})
    EXPECT_TRUE(row.contains(key)) << key;
  EXPECT_EQ(row["case"]["seed"], 42);
  EXPECT_EQ(row["judged_by"], (Json{{"signs", "parity"}, {"solid", "ball"}}));
  EXPECT_EQ(row["seconds"]["repetitions"], 3);
  EXPECT_TRUE(row["stage_seconds"].contains("one"));
  EXPECT_EQ(row["surface_components"], 1);
  EXPECT_EQ(row["accuracy"]["off_fine"], 0);
  EXPECT_EQ(row["accuracy"]["compared"], row["voxelization"]["active_voxels"]);
  EXPECT_GT(row["signs"]["inside"], 100);
  EXPECT_EQ(row["signs"]["wrong"], 0);
  EXPECT_FALSE(row.contains("repetitions_differ"));
  EXPECT_EQ(calls, 4);  // validated once and timed three times
  EXPECT_GT(rows[0]["accuracy"]["off_fine"], 0) << "OpenVDB is not exact";
  // Ratios are to OpenVDB with its default options, which this key distinguishes.
  EXPECT_EQ(rows[0]["variant"]["default_options"], false);
  EXPECT_EQ(rows[2]["variant"]["default_options"], true);
}

TEST_F(RunVoxelizers, FailuresAndRepetitionsThatDifferAreInTheirRows) {
  const std::vector<Json> rows = run(job({toy("fail"), toy("waver")}));
  EXPECT_EQ(rows.at(0).at("failed"), "the toy fell apart");
  EXPECT_FALSE(rows[0].contains("seconds"));
  EXPECT_FALSE(rows.at(1).contains("failed"));
  EXPECT_EQ(rows[1].at("repetitions_differ"), true);
}

TEST_F(RunVoxelizers, WrongSignsAreCountedBySide) {
  const Json row = run(job({toy("hollow")}))[0];
  EXPECT_EQ(row["signs"]["wrong_inside_share"], 1.0);
  EXPECT_EQ(row["signs"]["wrong_outside_share"], 0.0);
  EXPECT_EQ(row["accuracy"]["off_fine"], 0);
  EXPECT_EQ(row["surface_components"], 0);
}

TEST_F(RunVoxelizers, TheBandIsThatOfTheJob) {
  GroupJob wanted = job({variant("exact")});
  wanted.exterior_band = 2.0;
  wanted.interior_band = 4.0;
  const Json row = run(wanted)[0];
  EXPECT_EQ(row["accuracy"]["stray"], 0);
  EXPECT_EQ(row["accuracy"]["missing"], 0);
}

TEST_F(RunVoxelizers, TheSolidIsSweptWithTheInput) {
  GroupJob wanted = job({variant("exact")});
  wanted.input = "holed";
  wanted.sweep = {"hole", 0.4};
  wanted.judged.solid = "ball";
  const Json row = run(wanted)[0];
  EXPECT_EQ(row["sweep"], (Json{{"parameter", "hole"}, {"value", 0.4}}));
  EXPECT_EQ(row["judged_by"]["solid"], "ball");
  EXPECT_EQ(loaded_, (std::set<std::pair<std::string, double>>{{"ball", 0.4}, {"holed", 0.4}}));
}

TEST_F(RunVoxelizers, VoxelSizesMayBeInUnitsOfTheirOwn) {
  GroupJob wanted = job({variant("exact")});
  wanted.resolution.reset();
  wanted.voxel_size = 4.0;
  wanted.length = 80.0;  // of the ball, whose diameter is 2 in world units
  wanted.published_seconds = 2.5;
  wanted.judged = {};
  const Json row = run(wanted)[0];
  EXPECT_NEAR(row["voxel_size"].get<double>(), 2.0 / 20, 1e-3);
  EXPECT_EQ(row["nominal_voxel_size"], 4.0);
  EXPECT_EQ(row["published_seconds"], 2.5);
  for (const char* key : {"resolution", "judged_by", "accuracy", "signs"})
    EXPECT_FALSE(row.contains(key)) << key;
}

TEST(Fingerprint, SeesEveryPartOfATree) {
  const LevelSet sphere = make_sphere(10.0, 0.5);
  const std::uint64_t own = fingerprint(sphere);
  EXPECT_EQ(fingerprint(edited(sphere, [](auto&) {})), own);
  const auto changed = [&](const std::function<void(openvdb::FloatGrid&)>& edit) {
    return fingerprint(edited(sphere, edit)) != own;
  };
  const openvdb::Coord active = sphere.grid().grid->cbeginValueOn().getCoord();
  EXPECT_TRUE(changed([&](auto& grid) {
    const float value = grid.tree().getValue(active);
    grid.tree().setValueOn(active, std::nextafter(value, 9.0f));
  }));
  EXPECT_TRUE(changed([&](auto& grid) { grid.tree().setActiveState(active, false); }));
  EXPECT_TRUE(changed([&](auto& grid) { grid.tree().addTile(1, {800, 0, 0}, 0.5f, true); }));
  EXPECT_TRUE(changed([&](auto& grid) { grid.tree().setValueOff({-900, 0, 0}, -1.5f); }));
}

TEST(SurfaceComponents, AreCounted) {
  RunContext context;
  EXPECT_EQ(count_surface_components(make_sphere(10.0, 0.5), context), 1);
  const auto count = [&](std::set<int> inside) {  // samples on one line, apart from each other
    const auto value = [&](int x, int y, int z) {
      return y == 2 && z == 2 && inside.contains(x) ? -1.0f : 1.0f;
    };
    return count_surface_components(make_volume({9, 5, 5}, 1.0f, value), context);
  };
  EXPECT_EQ(count({}), 0);
  EXPECT_EQ(count({2, 6}), 2);
}

}  // namespace run_voxelizers_test
}  // namespace hermesh
