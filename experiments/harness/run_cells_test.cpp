// Jobs of extractors (job.h): rows, failures, outside programs, and the JSON that a job is read from.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "experiments/harness/jobs_for_tests.h"
#include "experiments/variants.h"

namespace hermesh {
namespace run_cells_test {

int calls = 0;  ///< of make_toy()

/// Copies the source, with a defect that the option "does" names.
PolygonMesh make_toy(const ExtractionInput& input) {
  const Stage stage(input.context, "copy");
  ++calls;
  const std::string& does = input.options.text("does");
  PolygonMesh mesh = *input.source;
  if (does == "fail") throw Error("the toy fell apart");
  if (does == "cancel") throw Cancelled();
  if (does == "vanish") mesh = {};
  if (does == "leak") mesh.quads.pop_back();
  if (does == "waver") mesh.points[0].x() -= 1e-3f * static_cast<float>(calls);
  if (does == "swell")
    for (Eigen::Vector3f& p : mesh.points) p *= 1.25f;
  return mesh;
}
LevelSet no_level_set(const VoxelizationInput&) { throw Error("the voxelizer fell apart"); }

VariantEntry toy(const std::string& does, const std::string& uniform = "") {
  return {.name = "toy", .label = does, .options = {{"does", does}}, .uniform = uniform};
}

LoadedCase load_toy(const std::string& name, RunContext&) {
  if (name == "lost") throw Error("there is no such file");
  if (name == "absent") throw DataMissing("only a stand-in is available");
  LoadedCase input{name, unit_box(), "generated", "0123456789abcdef", 42};
  if (name == "empty") input.mesh = {};
  if (name == "dot") input.mesh.points.assign(8, {1.0f, 1.0f, 1.0f});
  return input;
}

VariantEntry program(const std::string& label, const std::string& command) {
  return {.name = "command " + label, .label = label, .command = command};
}

/// Runs toys next to the program's variants on a box of side 1 at resolution 8, so that a voxel is an eighth.
class RunCells : public testing::Test {
 protected:
  void SetUp() override {
    const Promises all{.closed = true, .manifold = true, .oriented = true, .no_self_intersection = true};
    tables_.extractors = all_extractors();
    const OptionSpec does{"does", "copy", "", {"copy", "fail", "cancel", "vanish", "leak", "waver", "swell"}};
    tables_.extractors.push_back({"toy", "", all, {does}, make_toy});
    tables_.extractors.push_back({"modest", "", {}, {does}, make_toy});
    tables_.voxelizers = all_voxelizers();
    tables_.voxelizers.push_back({"none", "", {}, no_level_set});
    tables_.load = load_toy;
    calls = 0;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::vector<Json> run(GroupJob job, const CellWatch& watch = {}) {
    job.out = folder_;
    return run_job(job, tables_, watch, context_);
  }
  std::vector<Json> run(const std::vector<VariantEntry>& variants) {
    return run(group_job("box", 8, variants));
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("hermesh-cells-" + std::to_string(getpid()));
  Tables tables_;
  RunContext context_;
};

TEST_F(RunCells, ARowHoldsEverythingThatTheCellIs) {
  GroupJob job = group_job("box", 8, {toy("copy")});
  job.features = 30.0;
  job.pixels = 40;
  const Json row = run(job).at(0);
  for (const char* key : {"samples", "voxelization", "stage_seconds", "peak_bytes", "digest", "judge_seconds",
                          "load", "broken", "unchecked", "promise_letters", "promise_verdict"})
    EXPECT_TRUE(row.contains(key)) << key;
  EXPECT_EQ(row.begin().key(), "experiment") << "a row begins with the head of the job";
  EXPECT_EQ(row["case"].dump(), R"({"name":"box","origin":"generated","sha256":"0123456789abcdef",)"
                                R"("points":8,"triangles":12,"seed":42})");
  EXPECT_EQ(row["variant"]["options"], "does=copy");
  EXPECT_EQ(row["resolution"], 8);
  EXPECT_EQ(row["voxel_size"], 0.125);
  EXPECT_EQ(row["seconds"]["all"].size(), 3U);
  EXPECT_TRUE(row["stage_seconds"].contains("copy"));
  EXPECT_GT(row["voxelization"]["active_voxels"], 100);
  EXPECT_EQ(row["report"]["points"], 8);
  EXPECT_EQ(row["report"]["self_intersecting_pairs"], 0);
  EXPECT_TRUE(row["report"].contains("features"));
  // The mesh is the source itself, read back from its file.
  EXPECT_LT(row["report"]["to_reference"]["max"], 1e-6);
  EXPECT_LT(row["report"]["from_reference"]["max"], 1e-6);
  EXPECT_EQ(calls, 4);  // validated once and timed three times
  EXPECT_TRUE(std::filesystem::exists(folder_ / "box.png"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "meshes" / "toy-box" / "1-copy.ply"));
}

/// The driver completes planned rows and names the culprit if the process does not survive a cell.
TEST_F(RunCells, RowsArePlannedBeforeTheWorkAndEachStepIsAnnounced) {
  std::vector<Json> planned;
  std::map<std::string, int> steps;
  const auto plan = [&](const Json& row) {
    EXPECT_EQ(calls, 0);
    planned.push_back(row);
  };
  const std::vector<Json> rows = run(group_job("box", 8, {toy("copy"), toy("swell")}),
                                     {plan, [&](const std::string& label) { ++steps[label]; }});
  ASSERT_EQ(planned.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (const auto& [key, value] : planned[i].items()) EXPECT_EQ(rows[i].at(key), value) << key;
  EXPECT_EQ(steps, (std::map<std::string, int>{{"copy", 4}, {"swell", 4}}));
}

TEST_F(RunCells, DistancesToTheUniformMeshOfTheMethod) {
  const std::vector<Json> rows = run({toy("copy"), toy("swell", "copy")});
  EXPECT_FALSE(rows[0].contains("to_uniform"));
  // The corner (1, 1, 1) moves by a quarter along each axis, and the faces around it by as much.
  EXPECT_NEAR(number_at(rows[1], "/to_uniform/max"), std::sqrt(3.0) / 4, 1e-6);
  EXPECT_NEAR(number_at(rows[1], "/from_uniform/max"), 0.25, 1e-6);
  EXPECT_LT(number_at(rows[1], "/from_uniform/rms"), 0.25);
  EXPECT_FALSE(run({toy("swell", "copy")})[0].contains("to_uniform"))
      << "the job does not have the uniform variant";
}

TEST_F(RunCells, ABrokenGuaranteeIsInTheRowAndAnUnpromisedDefectIsAFigure) {
  const VariantEntry modest{.name = "modest", .label = "modest", .options = {{"does", "leak"}}};
  const std::vector<Json> rows = run({toy("leak"), modest});
  EXPECT_EQ(rows[0]["broken"], Json({"closed (4 boundary edges)"}));
  EXPECT_EQ(rows[1]["broken"], Json::array());
  for (const Json& row : rows) {
    EXPECT_EQ(row["report"]["boundary_edges"], 4);
    EXPECT_FALSE(row.contains("failed"));
  }
}

TEST_F(RunCells, AFailureKeepsItsRowAndTheOthersGoOn) {
  const std::vector<Json> rows = run({toy("fail"), toy("vanish"), toy("copy")});
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].at("failed"), "the toy fell apart");
  EXPECT_EQ(rows[1].at("failed"), "the mesh is empty");
  EXPECT_FALSE(rows[0].contains("seconds") || rows[1].contains("seconds"));
  EXPECT_FALSE(rows[2].contains("failed"));
  EXPECT_EQ(rows[2].at("seconds").at("repetitions"), 3);
}

TEST_F(RunCells, AFailedVoxelizationFailsAllCells) {
  GroupJob job = group_job("box", 8, {toy("copy"), toy("swell")});
  job.voxelizer = variant("none");
  const std::vector<Json> rows = run(job);
  for (const std::size_t i : {0, 1}) EXPECT_EQ(rows.at(i).at("failed"), "the voxelizer fell apart");
  EXPECT_EQ(calls, 0);
}

TEST_F(RunCells, RepetitionsThatDifferAreFlagged) {
  const std::vector<Json> rows = run({toy("waver"), toy("copy")});
  EXPECT_EQ(rows[0].at("repetitions_differ"), true);
  EXPECT_FALSE(rows[1].contains("repetitions_differ"));
}

TEST_F(RunCells, CancellingIsNotAFailure) { EXPECT_THROW(run({toy("copy"), toy("cancel")}), Cancelled); }

TEST_F(RunCells, AnUnreadableInputIsAnErrorOfItsOwn) {
  for (const char* input : {"lost", "empty", "dot"})
    EXPECT_THROW(run(group_job(input, 8, {toy("copy")})), CaseUnreadable) << input;
  EXPECT_THROW(run(group_job("absent", 8, {toy("copy")})), DataMissing);
}

TEST_F(RunCells, AbsentProgramsAreMarkedAndTheOthersGoOn) {
  const std::vector<Json> rows =
      run({program("nowhere", "no-such-program-here {in} {out}"),
           program("lacks", "echo a library is missing; exit 77 # {out}"),
           program("bad", "echo no; exit 76 # {out}"), program("copy", "cp {in} {out}")});
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[0]["failed"], "absent: the shell does not find its program");
  EXPECT_EQ(rows[1]["failed"], "absent: a library is missing");
  EXPECT_EQ(rows[1]["absent"], true);
  EXPECT_EQ(rows[2]["failed"], "the command ended with exit code 76: no");
  EXPECT_FALSE(rows[2].contains("absent")) << "a program that fails is a failure";
  EXPECT_FALSE(rows[3].contains("failed"));
  EXPECT_EQ(rows[3]["triangle_count"], 12);
}

TEST_F(RunCells, ProgramsReportTheirOwnSecondsAndBytes) {
  const std::string work = "cp {in} {out}; sleep 0.05; ";
  const std::vector<Json> rows =
      run({program("reports", work + "echo seconds 0.0005; echo bytes 4096"),
           program("silent", work + "echo seconds about 3"), program("slow", work + "echo seconds 1000"),
           program("large", work + "echo bytes 1e15")});
  EXPECT_EQ(number_at(rows[0], "/seconds/median"), 0.0005);
  EXPECT_EQ(number_at(rows[0], "/peak_bytes"), 4096.0);
  EXPECT_GT(number_at(rows[0], "/figures/process_seconds"), 0.05);
  EXPECT_GT(number_at(rows[0], "/figures/process_peak_bytes"), 1e5);
  EXPECT_GT(number_at(rows[1], "/seconds/median"), 0.05);
  EXPECT_EQ(number_at(rows[1], "/peak_bytes"), number_at(rows[1], "/figures/process_peak_bytes"));
  // They cannot take longer than their process ran, nor more memory than it had.
  EXPECT_EQ(rows[2]["failed"], "the command says that it took longer than it ran");
  EXPECT_EQ(rows[3]["failed"], "the command says that it took more memory than it had");
}

TEST_F(RunCells, ProgramsGetOurUniformMeshMultiplesOfAVoxelAndTheSources) {
  const std::vector<Json> rows = run(
      {variant("marching-cubes"), program("uniform", "cp {uniform.obj} {out.obj}"),
       program("voxels",
               "case {0.25 voxel}/{3 voxel} in 0.0312499*/0.37499999*|0.03125/0.375) "
               "cp {in} {out};; *) exit 9;; esac"),
       program("sources", "test -f {source}/experiments/cases.toml && test -d {build} && cp {in} {out}")});
  for (const Json& row : rows) EXPECT_FALSE(row.contains("failed")) << text_at(row, "/failed");
  EXPECT_GT(number_at(rows[1], "/triangle_count"), 100.0);
  for (const char* count : {"/triangle_count", "/report/points", "/report/boundary_edges"})
    EXPECT_EQ(number_at(rows[1], count), number_at(rows[0], count)) << count;
}

TEST_F(RunCells, UnknownWordsInBracesAreErrors) {
  for (const char* command : {"a {voxels} {out}", "a {1.2.3 voxel} {out}", "a {uniform.vdb} {out}", "a {in}"})
    EXPECT_THROW(run({program("x", command)}), Error) << command;
}

/// The example of CONTRIBUTING.md, which needs python3 (experiments/install_packages.sh).
TEST_F(RunCells, TheExampleInPythonIsValidatedAndTimed) {
  const std::string command =
      "python3 {source}/reference/peers/example_outside.py {uniform.obj} {out.obj} {3 voxel}";
  const Json row = run({program("example", command)}).at(0);
  ASSERT_FALSE(row.contains("failed")) << text_at(row, "/failed");
  EXPECT_GT(number_at(row, "/triangle_count"), 12);
  EXPECT_LT(number_at(row, "/triangle_count"), 12 * 8 * 8) << "fewer than those of the uniform mesh";
  EXPECT_GT(number_at(row, "/seconds/median"), 0.0);
  // It moves vertices within cubes of three voxels, by less than a diagonal.
  EXPECT_LT(number_at(row, "/report/to_reference/max"), 3 * 1.74 * number_at(row, "/voxel_size"));
}

/// Returns a job with a value for every key, as the driver sends it.
Json full_job() {
  return Json::parse(R"({
    "kind": "extraction", "head": {"experiment": "toy"}, "case": "ball", "files": "ball-32", "out": "there",
    "sweep": {"parameter": "hole", "value": 0.2}, "resolution": 32, "voxel_size": 0.5, "length": 80,
    "published_seconds": 1.5, "voxelizer": {"name": "exact", "label": "truth", "options": {}}, "variants": [
      {"name": "toy", "label": "good", "options": {"does": "copy"}, "uniform": "plain", "command": "cp"}],
    "exterior_band": 2, "interior_band": 4, "distances": 1000, "to_boundary": true, "sign_samples": 7,
    "signs": "unanimous-parity", "solid": "whole", "features": 30, "closeup": [0.1, 0.2, 0.3, 0.4],
    "view": [10, 20], "repetitions": 3, "seconds_per_variant": 2.5, "samples": 500, "pixels": 40,
    "self_intersections": false, "components": true})");
}

TEST(GroupJobs, AreReadFromCompleteJson) {
  using std::tuple;
  const GroupJob job = read_group_job(full_job());
  EXPECT_EQ(job.head, (Json{{"experiment", "toy"}}));
  EXPECT_EQ(tuple(job.extraction, job.input, job.out, job.files), tuple(true, "ball", "there", "ball-32"));
  EXPECT_EQ(tuple(job.sweep.value().parameter, job.sweep->value), tuple("hole", 0.2));
  EXPECT_EQ(tuple(job.resolution, job.voxel_size, job.length), tuple(32, 0.5, 80.0));
  EXPECT_EQ(tuple(job.published_seconds, job.features, job.samples), tuple(1.5, 30.0, 500));
  const VariantEntry& only = job.variants.at(0);
  EXPECT_EQ(tuple(only.name, only.label, only.uniform, only.command), tuple("toy", "good", "plain", "cp"));
  EXPECT_EQ(only.options, (std::map<std::string, std::string>{{"does", "copy"}}));
  EXPECT_EQ(tuple(job.voxelizer.name, job.voxelizer.label), tuple("exact", "truth"));
  EXPECT_EQ(tuple(job.exterior_band, job.interior_band), tuple(2.0, 4.0));
  const JudgedBy& judged = job.judged;
  EXPECT_EQ(tuple(judged.distances, judged.to_boundary, judged.sign_samples), tuple(1000, true, 7));
  EXPECT_EQ(tuple(judged.signs, judged.solid), tuple(JudgedBy::Signs::kUnanimousParity, "whole"));
  EXPECT_EQ(tuple(job.close_up.centre, job.close_up.size), tuple(std::array{0.1, 0.2, 0.3}, 0.4));
  EXPECT_EQ(tuple(job.viewpoint.azimuth, job.viewpoint.elevation), tuple(10.0, 20.0));
  EXPECT_EQ(tuple(job.repetitions, job.seconds_per_variant, job.pixels), tuple(3, 2.5, 40));
  EXPECT_EQ(tuple(job.self_intersections, job.components), tuple(false, true));
}

TEST(GroupJobs, KeysAreRequiredExceptThoseThatMayBeNull) {
  // Either a resolution or a voxel size is required.
  const std::set<std::string> nullable = {"resolution", "voxel_size", "length",  "published_seconds",
                                          "distances",  "features",   "closeup", "view"};
  const Json full = full_job();
  for (const auto& [key, value] : full.items()) {
    Json job = full;
    job.erase(key);
    if (nullable.contains(key))
      EXPECT_NO_THROW(read_group_job(job)) << key;
    else
      EXPECT_THROW(read_group_job(job), Error) << key;
  }
  Json job = full;
  job["signs"] = "majority";
  EXPECT_THROW(read_group_job(job), Error);
}

}  // namespace run_cells_test
}  // namespace hermesh
