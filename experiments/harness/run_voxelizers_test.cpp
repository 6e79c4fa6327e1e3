#include "experiments/harness/run_voxelizers.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "algorithms/core/level_set_grid.h"
#include "experiments/harness/level_set_facts.h"
#include "experiments/cases/recipes.h"
#include "experiments/cases/test_volumes.h"
#include "reference/variants.h"

namespace hermesh {
namespace {

LevelSet by(const std::string& name, const VoxelizationInput& input) {
  return find_variant(reference_voxelizers(), name).voxelize(input);
}

LevelSet edited(const LevelSet& level_set, const std::function<void(openvdb::FloatGrid&)>& edit) {
  const openvdb::FloatGrid::Ptr copy = level_set.grid().grid->deepCopy();
  edit(*copy);
  return make_level_set(copy);
}

int calls = 0;  ///< of the toys

LevelSet staged(const VoxelizationInput& input) {
  ++calls;
  const Stage stage(input.context, "one");
  const Stage other(input.context, "two");
  return by("exact", input);
}
LevelSet fickle(const VoxelizationInput& input) {
  return edited(by("exact", input), [](auto& grid) { grid.beginValueOn().setValue(0.01f * float(++calls)); });
}
/// Everything inside is called outside.
LevelSet without_inside(const VoxelizationInput& input) {
  return edited(by("exact", input), [](auto& grid) {
    for (auto value = grid.beginValueAll(); value; ++value) value.setValue(std::abs(*value));
  });
}
LevelSet failing(const VoxelizationInput&) { throw Error("the toy fell apart"); }
LevelSet banded(const VoxelizationInput& input) {
  EXPECT_EQ(input.exterior_band, 2.0);
  EXPECT_EQ(input.interior_band, 4.0);
  return by("exact", input);
}

class RunVoxelizers : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hermesh-voxelizers-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    const auto reference = reference_voxelizers();
    tables_.voxelizers = {reference.begin(), reference.end()};
    for (const Voxelizer& toy : {Voxelizer{"staged", "", {}, staged}, Voxelizer{"fickle", "", {}, fickle},
                                 Voxelizer{"without-inside", "", {}, without_inside},
                                 Voxelizer{"failing", "", {}, failing}, Voxelizer{"banded", "", {}, banded}})
      tables_.voxelizers.push_back(toy);
    tables_.cases = {"ball", "holed"};
    tables_.load = [this](const std::string& name, RunContext& context) {
      return tables_.load_changed(name, {{"hole", 0.1}}, context);
    };
    tables_.load_changed = [](const std::string& name, const RecipeParameters& changes, RunContext& context) {
      RecipeParameters parameters = changes;
      parameters["open"] = name == "holed" ? 1 : 0;
      parameters["around"] = 40;  // the exact voxelizer looks at every triangle for every voxel
      return LoadedCase{name, make_recipe("holed-sphere", parameters, context), "generated",
                        "0123456789abcdef", 42};
    };
    calls = 0;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  int run(const std::string& voxelizers, const std::string& cases, const std::string& more = "",
          const std::string& filter = "") {
    std::ofstream(folder_ / "toy.toml")
        << "kind = \"voxelization\"\nquestion = \"why?\"\n" + more + "\nvoxelizers = [" + voxelizers +
               "]\ncolumns = [\"seconds\", \"openvdb_over_time\", \"error_max\", \"wrong_signs\"]\n"
               "[quick]\nrepetitions = 3\ncomponents = true\ncases = [" +
               cases + "]\n";
    table_.str("");
    return run_experiment({folder_ / "toy.toml", "quick", folder_ / "out", filter}, tables_, context_,
                          table_);
  }
  std::vector<Json> rows() const { return read_rows(folder_ / "out"); }

  std::filesystem::path folder_;
  Tables tables_;
  RunContext context_;
  std::ostringstream table_;
};

const std::string kBall = R"({ name = "ball", resolutions = [16], distances = "all", signs = "parity" })";

TEST_F(RunVoxelizers, ARowHoldsEverythingThatTheCellIs) {
  EXPECT_EQ(run(R"({ name = "openvdb", label = "raw", options = { renormalize = "no" } },
                   { name = "staged" }, { name = "openvdb" })",
                kBall),
            0);
  const std::vector<Json> all = rows();
  ASSERT_EQ(all.size(), 3u);
  const Json& row = all[1];
  for (const char* key : {"experiment",  "run",           "commit",     "machine",
                          "libraries",   "threads",       "case",       "resolution",
                          "voxel_size",  "band",          "variant",    "voxelization",
                          "seconds",     "stage_seconds", "peak_bytes", "peak_over_allowed",
                          "cpu_seconds", "accuracy",      "signs",      "surface_components",
                          "load"})
    EXPECT_TRUE(row.contains(key)) << key;
  EXPECT_EQ(row["case"]["seed"], 42);
  EXPECT_EQ(row["seconds"]["repetitions"], 3);
  EXPECT_EQ(row["surface_components"], 1);
  EXPECT_EQ(row["accuracy"]["off_fine"], 0);
  EXPECT_EQ(row["accuracy"]["compared"], row["voxelization"]["active_voxels"]);
  EXPECT_GT(row["signs"]["inside"], 100);
  EXPECT_EQ(row["signs"]["wrong"], 0);
  EXPECT_GT(all[0]["accuracy"]["off_fine"], 0);  // OpenVDB is not exact
  EXPECT_FALSE(row.contains("repetitions_differ"));
  EXPECT_EQ(calls, 4);  // judged once and timed three times
  EXPECT_NE(table_.str().find("time of staged: voxelization"), std::string::npos) << table_.str();
}

TEST_F(RunVoxelizers, RatiosAreToOpenvdbWithItsDefaults) {
  run(R"({ name = "openvdb", label = "raw", options = { renormalize = "no" } }, { name = "exact" },
         { name = "openvdb" })",
      kBall);
  const std::vector<Json> all = rows();
  EXPECT_EQ(all[2]["openvdb_over_time"], 1.0);
  EXPECT_EQ(all[2]["peak_over_openvdb"].is_number(), number_at(all[2], "/peak_bytes") > 0.0);
  for (const Json& row : all)
    EXPECT_DOUBLE_EQ(row["openvdb_over_time"].get<double>(),
                     number_at(all[2], "/seconds/median") / number_at(row, "/seconds/median"));
}

TEST_F(RunVoxelizers, RepetitionsThatDifferAreLoud) {
  run(R"({ name = "fickle" })", kBall);
  EXPECT_EQ(rows()[0]["repetitions_differ"], true);
  EXPECT_NE(table_.str().find(
                "NOT DETERMINISTIC: fickle on ball at resolution 16: repetitions gave different level"),
            std::string::npos)
      << table_.str();
}

TEST_F(RunVoxelizers, AFailureKeepsItsRowAndTheOthersGoOn) {
  EXPECT_EQ(run(R"({ name = "failing" }, { name = "exact" })", kBall), 1);
  ASSERT_EQ(rows().size(), 2u);
  EXPECT_EQ(rows()[0]["failed"], "the toy fell apart");
  EXPECT_FALSE(rows()[1].contains("failed"));
}

TEST_F(RunVoxelizers, WrongSignsAreCountedBySide) {
  run(R"({ name = "without-inside" })", kBall);
  const Json row = rows()[0];
  EXPECT_EQ(row["signs"]["wrong_inside_share"], 1.0);
  EXPECT_EQ(row["signs"]["wrong_outside_share"], 0.0);
  EXPECT_EQ(row["accuracy"]["off_fine"], 0);
  EXPECT_EQ(row["surface_components"], 0);
}

TEST_F(RunVoxelizers, TheBandIsTheFiles) {
  EXPECT_EQ(run(R"({ name = "banded" })", kBall, "exterior_band = 2\ninterior_band = 4"), 0);
  EXPECT_EQ(rows()[0]["accuracy"]["stray"], 0);
  EXPECT_EQ(rows()[0]["accuracy"]["missing"], 0);
}

TEST_F(RunVoxelizers, ASweepIsOneTableAndTheSolidIsSweptWithIt) {
  run(R"({ name = "exact" })",
      R"({ name = "holed", voxel_sizes = [0.1], sweep = { hole = [0.2, 0.4] }, signs = "parity", solid = "ball" })",
      R"(plots = [{ name = "p", title = "t", x = "swept", y = ["wrong_share"], x_label = "x", y_label = "y" }])");
  const std::vector<Json> all = rows();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0]["sweep"]["value"], 0.2);
  EXPECT_EQ(all[1]["sweep"]["value"], 0.4);
  EXPECT_EQ(all[1]["judged_by"]["solid"], "ball");
  EXPECT_NE(table_.str().find("### holed by hole at voxel size 0.1"), std::string::npos) << table_.str();
  EXPECT_EQ(table_.str().find("###"), table_.str().rfind("###"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out" / "toy-p.gp"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out" / "toy-p.dat"));
}

TEST_F(RunVoxelizers, VoxelSizesMayBeInUnitsOfTheirOwn) {
  run(R"({ name = "exact" })",
      R"({ name = "ball", voxel_sizes = [4, 2], length = 80, published_seconds = [1.5, 2.5] })");
  const std::vector<Json> all = rows();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_NEAR(all[0]["voxel_size"].get<double>(), 2.0 / 20, 1e-3);
  EXPECT_EQ(all[1]["nominal_voxel_size"], 2.0);
  EXPECT_EQ(all[1]["published_seconds"], 2.5);
  EXPECT_FALSE(all[0].contains("resolution"));
}

TEST_F(RunVoxelizers, TheFilterChoosesCells) {
  run(R"({ name = "exact" }, { name = "openvdb" })", R"({ name = "ball", resolutions = [12, 16] })", "",
      "16/exact");
  ASSERT_EQ(rows().size(), 1u);
  EXPECT_EQ(rows()[0]["resolution"], 16);
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
  const auto far = [](int x, int y, int z) { return (x == 2 || x == 6) && y == 2 && z == 2 ? -1.0f : 1.0f; };
  EXPECT_EQ(count_surface_components(make_volume({9, 5, 5}, 1.0f, far), context), 2);
  EXPECT_EQ(
      count_surface_components(make_volume({5, 5, 5}, 1.0f, [](int, int, int) { return 1.0f; }), context), 0);
}

}  // namespace
}  // namespace hermesh
