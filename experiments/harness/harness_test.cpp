#include "experiments/harness/harness.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "experiments/harness/run_cells.h"
#include "reference/variants.h"

namespace hermesh {
namespace {

/// A ball of radius 1 from 12 × 24 patches.
PolygonMesh ball() {
  constexpr std::uint32_t kRings = 12, kSectors = 24;
  PolygonMesh mesh;
  mesh.points.emplace_back(0.0f, 1.0f, 0.0f);
  for (std::uint32_t ring = 1; ring < kRings; ++ring)
    for (std::uint32_t sector = 0; sector < kSectors; ++sector) {
      const double a = std::numbers::pi * ring / kRings, b = 2 * std::numbers::pi * sector / kSectors;
      mesh.points.push_back(
          Eigen::Vector3d(std::sin(a) * std::sin(b), std::cos(a), std::sin(a) * std::cos(b)).cast<float>());
    }
  mesh.points.emplace_back(0.0f, -1.0f, 0.0f);
  const auto at = [](std::uint32_t ring, std::uint32_t sector) {
    return 1 + (ring - 1) * kSectors + sector % kSectors;
  };
  const auto last = static_cast<std::uint32_t>(mesh.points.size() - 1);
  for (std::uint32_t s = 0; s < kSectors; ++s) {
    mesh.triangles.push_back({0, at(1, s), at(1, s + 1)});
    mesh.triangles.push_back({last, at(kRings - 1, s + 1), at(kRings - 1, s)});
    for (std::uint32_t r = 1; r + 1 < kRings; ++r)
      mesh.quads.push_back({at(r, s), at(r + 1, s), at(r + 1, s + 1), at(r, s + 1)});
  }
  return mesh;
}

int calls = 0;  ///< of the copier

PolygonMesh copier(const ExtractionInput& input) {
  const Stage stage(input.context, "copy");
  ++calls;
  return *input.source;
}
PolygonMesh leaky(const ExtractionInput& input) {
  PolygonMesh mesh = *input.source;
  mesh.triangles.pop_back();
  return mesh;
}
PolygonMesh swollen(const ExtractionInput& input) {
  PolygonMesh mesh = *input.source;
  for (Eigen::Vector3f& p : mesh.points) p *= 1.25f;
  return mesh;
}
PolygonMesh failing(const ExtractionInput&) { throw Error("the toy fell apart"); }
PolygonMesh empty(const ExtractionInput&) { return {}; }
PolygonMesh fickle(const ExtractionInput& input) {
  PolygonMesh mesh = *input.source;
  mesh.points[0].x() += 1e-3f * static_cast<float>(++calls);
  return mesh;
}
PolygonMesh cancelling(const ExtractionInput&) { throw Cancelled(); }

class Harness : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("hermesh-harness-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    const Promises all{.closed = true, .manifold = true, .oriented = true, .no_self_intersection = true};
    tables_.extractors = {{"copier", "", all, {{"size", "1", "", {}, 0, 9}}, copier},
                          {"leaky", "", all, {}, leaky},
                          {"modest", "", {}, {}, leaky},
                          {"swollen", "", all, {}, swollen},
                          {"failing", "", all, {}, failing},
                          {"empty", "", all, {}, empty},
                          {"fickle", "", all, {}, fickle},
                          {"openvdb", "", all, {}, copier},
                          {"cancelling", "", all, {}, cancelling}};
    const auto voxelizers = reference_voxelizers();
    tables_.voxelizers = {voxelizers.begin(), voxelizers.end()};
    tables_.cases = {"ball"};
    tables_.load = [](const std::string& name, RunContext&) {
      return LoadedCase{name, ball(), "generated", "0123456789abcdef", 42};
    };
    calls = 0;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  int run(const std::string& variants, const std::string& filter = "") {
    std::ofstream(folder_ / "toy.toml")
        << "question = \"why?\"\nvoxelizers = [\"openvdb\"]\nfeatures = 30\n"
           "columns = [\"points\", \"seconds\", \"time_over_openvdb\", \"promises\"]\n"
           "variants = [" +
               variants +
               "]\n[quick]\nrepetitions = 3\nsamples = 500\npixels = 40\n"
               "cases = [{ name = \"ball\", resolutions = [12, 16] }]\n";
    table_.str("");
    const RunSettings settings{folder_ / "toy.toml", "quick", folder_ / "out", filter};
    return run_experiment(settings, tables_, context_, table_);
  }
  std::vector<Json> rows() const { return read_rows(folder_ / "out"); }

  std::filesystem::path folder_;
  Tables tables_;
  RunContext context_;
  std::ostringstream table_;
};

TEST_F(Harness, AnExperimentOnExtractionMayHavePlots) {
  std::ofstream(folder_ / "toy.toml") << "question = \"why?\"\nvoxelizers = [\"openvdb\"]\ncolumns = [\"points\"]\n"
                                         "variants = [{ name = \"copier\" }]\n"
                                         "[[plots]]\nname = \"p\"\ntitle = \"t\"\nx = \"points\"\ny = [\"triangles\"]\n"
                                         "x_label = \"x\"\ny_label = \"y\"\n"
                                         "[quick]\nrepetitions = 1\nsamples = 500\npixels = 0\n"
                                         "cases = [{ name = \"ball\", resolutions = [12, 16] }]\n";
  EXPECT_EQ(run_experiment({folder_ / "toy.toml", "quick", folder_ / "out", ""}, tables_, context_, table_), 0);
  ASSERT_EQ(rows().back().at("plots").size(), 1u);
  std::ifstream data(folder_ / "out" / "toy-p.dat");
  std::string curve, point;
  std::getline(data, curve);
  EXPECT_EQ(curve, "# copier");
  EXPECT_TRUE(std::getline(data, point) && !point.empty());
}

TEST_F(Harness, ARowHoldsEverythingThatTheCellIs) {
  EXPECT_EQ(run(R"({ name = "copier", label = "good", options = { size = 2 } }, { name = "openvdb" })"), 0);
  const std::vector<Json> all = rows();
  ASSERT_EQ(all.size(), 4u);  // two variants at two resolutions
  const Json& row = all[0];
  for (const char* key : {"experiment", "tier",    "run",           "commit",  "dirty",         "date",
                          "machine",    "build",   "libraries",     "threads", "case",          "resolution",
                          "voxel_size", "variant", "voxelization",  "seconds", "stage_seconds", "peak_bytes",
                          "report",     "broken",  "judge_seconds", "load"})
    EXPECT_TRUE(row.contains(key)) << key;
  EXPECT_EQ(row["case"]["origin"], "generated");
  EXPECT_EQ(row["case"]["sha256"], "0123456789abcdef");
  EXPECT_EQ(row["case"]["seed"], 42);
  EXPECT_EQ(row["variant"]["options"], "size=2");
  EXPECT_EQ(row["resolution"], 12);
  EXPECT_DOUBLE_EQ(row["voxel_size"], 2.0 / 12);
  EXPECT_EQ(row["seconds"]["repetitions"], 3);
  EXPECT_EQ(row["seconds"]["all"].size(), 3u);
  EXPECT_TRUE(row["stage_seconds"].contains("copy"));
  EXPECT_GT(row["voxelization"]["active_voxels"], 100);
  EXPECT_EQ(row["report"]["points"], 266);
  EXPECT_EQ(row["triangle_count"], 528);
  EXPECT_EQ(row["report"]["boundary_edges"], 0);
  EXPECT_EQ(row["report"]["self_intersecting_pairs"], 0);
  // The mesh is the source itself, read back from the file.
  EXPECT_LT(row["report"]["to_reference"]["max"], 1e-6);
  EXPECT_LT(row["report"]["from_reference"]["max"], 1e-6);
  EXPECT_TRUE(row["report"].contains("features"));
  EXPECT_EQ(all[1]["time_over_openvdb"], 1.0);
  EXPECT_GT(all[0]["time_over_openvdb"], 0.0);
  // Judged once and timed three times, two variants, two resolutions.
  EXPECT_EQ(calls, 4 * 2 * 2);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out" / "ball-12.png"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out" / "meshes" / "toy-ball-12" / "1-good.ply"));
  EXPECT_NE(table_.str().find("| good "), std::string::npos);
}

TEST_F(Harness, DistancesToTheUniformMeshOfTheMethod) {
  run("{ name = \"copier\" }, { name = \"swollen\", uniform = \"copier\" }", "ball/12");
  ASSERT_EQ(rows().size(), 2u);
  EXPECT_FALSE(rows()[0].contains("to_uniform"));
  // Its points lie straight above those of the ball, by a quarter of the radius; the ball's own are nearer to its faces.
  EXPECT_NEAR(rows()[1]["to_uniform"]["max"].get<double>(), 0.25, 1e-6);
  EXPECT_LT(rows()[1]["to_uniform"]["rms"].get<double>(), 0.25);
  EXPECT_LT(rows()[1]["from_uniform"]["max"].get<double>(), 0.25);
  EXPECT_GT(rows()[1]["from_uniform"]["max"].get<double>(), 0.2);
  // Without the other one there is nothing to compare with.
  run("{ name = \"copier\" }, { name = \"swollen\", uniform = \"copier\" }", "12/swollen");
  EXPECT_FALSE(rows().back().contains("to_uniform"));
}

TEST_F(Harness, ABrokenPromiseIsLoudAndEndsWithThree) {
  EXPECT_EQ(run(R"({ name = "leaky" })"), 3);
  EXPECT_EQ(rows()[0]["broken"][0], "closed (3 boundary edges)");
  EXPECT_NE(table_.str().find("BROKEN: leaky on ball at resolution 12: closed (3 boundary edges)"),
            std::string::npos)
      << table_.str();
}

TEST_F(Harness, AnUnpromisedDefectIsAFigure) {
  EXPECT_EQ(run(R"({ name = "modest" })"), 0);
  EXPECT_EQ(rows()[0]["report"]["boundary_edges"], 3);
  EXPECT_EQ(table_.str().find("BROKEN"), std::string::npos);
}

TEST_F(Harness, AFailureKeepsItsRowAndTheOthersGoOn) {
  EXPECT_EQ(run(R"({ name = "failing" }, { name = "empty" }, { name = "copier" })"), 1);
  const std::vector<Json> all = rows();
  ASSERT_EQ(all.size(), 6u);
  EXPECT_EQ(all[0]["failed"], "the toy fell apart");
  EXPECT_EQ(all[1]["failed"], "the mesh is empty");
  EXPECT_FALSE(all[2].contains("failed"));
  EXPECT_NE(table_.str().find("FAILED: failing on ball at resolution 12: the toy fell apart"),
            std::string::npos);
}

TEST_F(Harness, ABrokenPromiseOutweighsAFailure) {
  EXPECT_EQ(run(R"({ name = "failing" }, { name = "leaky" })"), 3);
}

TEST_F(Harness, RepetitionsThatDifferAreLoud) {
  run(R"({ name = "fickle" })");
  EXPECT_EQ(rows()[0]["repetitions_differ"], true);
  EXPECT_NE(table_.str().find("NOT DETERMINISTIC: fickle"), std::string::npos);
}

TEST_F(Harness, CancellingIsNoFailureAndLeavesNoRow) {
  EXPECT_THROW(run(R"({ name = "copier" }, { name = "cancelling" })"), Cancelled);
  EXPECT_THROW(rows(), Error);
}

TEST_F(Harness, TheFilterChoosesCells) {
  EXPECT_EQ(run(R"({ name = "copier" }, { name = "leaky" })", "16/copier"), 0);
  ASSERT_EQ(rows().size(), 1u);
  EXPECT_EQ(rows()[0]["resolution"], 16);
  EXPECT_THROW(run(R"({ name = "copier" })", "nothing like it"), Error);
}

TEST_F(Harness, RunsAddUp) {
  run(R"({ name = "copier" })");
  run(R"({ name = "copier" })");
  EXPECT_EQ(rows().size(), 4u);
}

TEST_F(Harness, ATierThatIsNotThereIsAnError) {
  run(R"({ name = "copier" })");
  std::ostringstream out;
  EXPECT_THROW(run_experiment({folder_ / "toy.toml", "full", folder_ / "out", ""}, tables_, context_, out),
               Error);
}

/// What comes with the project names variants, options, cases and columns that there are.
TEST(ListExperiments, AllCanBeRead) {
  const Tables tables = all_tables();
  for (const ExperimentInfo& info : list_experiments())
    EXPECT_NO_THROW(read_experiment(
        info.file, {tables.extractors, tables.voxelizers, tables.cases, column_names(), tables.measurements}))
        << info.name;
}

/// Tables 9.1 to 9.4 and figures 9.1 to 9.16 of the thesis are names of experiments, each of one.
TEST(ListExperiments, MakeEachTableAndFigureOfChapter9) {
  std::map<std::string, int> made;
  for (const ExperimentInfo& info : list_experiments())
    for (const std::string& number : info.shows) ++made[number];
  for (int i = 1; i <= 4; ++i) EXPECT_EQ(made["table_9_" + std::to_string(i)], 1) << i;
  for (int i = 1; i <= 16; ++i) EXPECT_EQ(made["figure_9_" + std::to_string(i)], 1) << i;
}

TEST(ListExperiments, AreFoundByPathNameAndNumber) {
  EXPECT_EQ(experiment_file("anywhere/mine.toml"), "anywhere/mine.toml");
  EXPECT_EQ(experiment_file("mine.toml"), "mine.toml");
  EXPECT_EQ(experiment_file("headline").filename(), "headline.toml");
  EXPECT_EQ(experiment_file(experiment_file("headline").string()), experiment_file("headline"));
  try {
    experiment_file("elsewhere/headline.toml");
    ADD_FAILURE() << "a path to no file was taken";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()),
              "there is no file elsewhere/headline.toml; the project's experiment of that name is run by it: hermesh run headline");
  }
  EXPECT_EQ(experiment_file("figure_9_9").filename(), "table_9_2.toml");
  try {
    experiment_file("figure_9_99");
    ADD_FAILURE() << "a figure that is not there was found";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find("there is no experiment \"figure_9_99\"; there are figure_9_9, "), 0U);
  }
}

TEST(ListExperiments, KnowsTheHeadlineAndItsQuestion) {
  bool found = false;
  for (const ExperimentInfo& info : list_experiments()) {
    EXPECT_FALSE(info.question.empty());
    EXPECT_NE(info.name, "cases");
    found = found || info.name == "headline";
  }
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace hermesh
