// A harness that survives its variants: toys that crash, hang, eat memory and leave without a word, in processes of their
// own. This program is the child as well: see main() below.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "algorithms/io/mesh_file.h"
#include "experiments/harness/harness.h"
#include "experiments/harness/run_cells.h"
#include "experiments/harness/unit_box_for_tests.h"
#include "experiments/harness/sha256.h"
#include "experiments/sweep/shards.h"
#include "experiments/ledger/compare.h"
#include "experiments/ledger/merge.h"
#include "reference/variants.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

bool poisoned = false;
volatile int sink = 0;

PolygonMesh good(const ExtractionInput& input) { return *input.source; }
PolygonMesh crashing(const ExtractionInput&) {
  std::raise(SIGSEGV);
  return {};
}
PolygonMesh looping(const ExtractionInput&) {
  while (true) sink = sink + 1;
}
PolygonMesh hungry(const ExtractionInput&) {
  std::vector<std::vector<char>> all;
  while (true) {
    all.emplace_back(std::size_t(8) << 20, char(1));
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}
PolygonMesh leaving(const ExtractionInput&) { _exit(0); }
PolygonMesh poisonous(const ExtractionInput& input) {
  poisoned = true;
  return *input.source;
}
PolygonMesh fragile(const ExtractionInput& input) {
  if (poisoned) std::abort();
  return *input.source;
}

LevelSet crashing_voxelizer(const VoxelizationInput&) { std::abort(); }

/// Rows "a" to "e"; the third is the end of the process as long as the file HERMESH_TOY_TRAP is there.
std::vector<MeasuredRow> measure(const MeasurementInput& input) {
  for (const char* label : {"a", "b", "c", "d", "e"}) {
    if (!input.wants("letters", label)) continue;
    const char* const trap = std::getenv("HERMESH_TOY_TRAP");
    if (*label == 'c' && trap && fs::exists(trap)) std::abort();
    input.emit({{"letters", label, {{"value", int(*label)}}}});
  }
  return {};
}

Tables toys() {
  Tables tables;
  for (const auto& [name, extract] : std::initializer_list<std::pair<const char*, PolygonMesh (*)(const ExtractionInput&)>>{
           {"good", good}, {"good2", good}, {"crashing", crashing}, {"looping", looping}, {"hungry", hungry}, {"leaving", leaving},
           {"poisonous", poisonous}, {"fragile", fragile}})
    tables.extractors.push_back({name, "", {}, {}, extract});
  const auto voxelizers = reference_voxelizers();
  tables.voxelizers = {voxelizers.begin(), voxelizers.end()};
  tables.voxelizers.push_back({"crashing", "", {}, crashing_voxelizer});
  tables.cases = {"box", "block", "brick"};
  tables.load = [](const std::string& name, RunContext& context) {
    if (is_mesh_path(name)) return LoadedCase{name, read_mesh(name, context), "file", sha256_of_file(name)};
    if (name == "brick") check_stand_in_allowed(name, "it is a toy");
    return LoadedCase{name, unit_box(), "generated", "0123456789abcdef"};
  };
  tables.measurements = {{"letters", "", {}, {{"letters", "letters", "letter", {{"value", "value", ""}}}}, measure}};
  return tables;
}

class ApartRun : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("hermesh-apart-" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& text) const { std::ofstream(folder_ / "toy.toml") << text; }
  void write_extraction(const std::string& variants, const std::string& cases = "{ name = \"box\", resolutions = [8] }",
                        const std::string& voxelizers = "\"openvdb\"") const {
    write("question = \"why?\"\nvoxelizers = [" + voxelizers + "]\ncolumns = [\"triangles\"]\nvariants = [" + variants +
          "]\n[quick]\nrepetitions = 2\nseconds_per_variant = 0.1\nsamples = 100\npixels = 0\ncases = [" + cases + "]\n");
  }
  RunSettings settings(double seconds = 60, std::int64_t mib = 4000) const {
    RunSettings settings{folder_ / "toy.toml", "quick", folder_ / "out", ""};
    settings.resume = true;
    settings.apart = Apart{"/proc/self/exe", {"cell"}, {seconds, mib << 20}};
    return settings;
  }
  int run(const RunSettings& settings) {
    std::ostringstream table;
    return run_experiment(settings, toys(), context_, table);
  }
  std::vector<Json> rows() const { return read_rows(folder_ / "out"); }
  /// The sentence of a failure, or the digest, by "case/variant".
  std::map<std::string, std::string> outcomes() const {
    std::map<std::string, std::string> found;
    for (const Json& row : rows())
      EXPECT_TRUE(found.emplace(text_at(row, "/case/name") + "/" + text_at(row, "/variant/label"),
                                row.contains("failed") ? text_at(row, "/failed") : text_at(row, "/digest"))
                      .second)
          << "two rows of " << row.at("case") << row.at("variant");
    return found;
  }

  /// All that a row says of what was made, in the order of the rows.
  std::vector<std::string> outcomes_in_order() const {
    std::vector<std::string> list;
    for (const Json& row : rows())
      list.push_back(text_at(row, "/case/name") + "/" + text_at(row, "/resolution") + "/" + text_at(row, "/variant/label") + ": " +
                     (row.contains("failed") ? text_at(row, "/failed") : text_at(row, "/digest")));
    return list;
  }

  fs::path folder_;
  RunContext context_;
};

TEST_F(ApartRun, GivesTheRowsThatAreMadeInOneProcess) {
  write_extraction("{ name = \"good\" }, { name = \"fragile\" }");
  EXPECT_EQ(run(settings()), 0);
  const auto apart = outcomes();
  RunSettings together = settings();
  together.apart.reset();
  together.resume = false;
  fs::remove_all(folder_ / "out");
  EXPECT_EQ(run(together), 0);
  EXPECT_EQ(apart, outcomes());
  EXPECT_EQ(apart.size(), 2U);
}

TEST_F(ApartRun, SurvivesACrashALoopAHogAndAQuitter) {
  write_extraction("{ name = \"good\" }, { name = \"crashing\" }, { name = \"looping\" }, { name = \"hungry\" }, { name = \"leaving\" }, "
                   "{ name = \"good2\" }");
  EXPECT_EQ(run(settings(5, 1000)), 1);
  auto found = outcomes();
  EXPECT_EQ(found.size(), 6U);
  EXPECT_EQ(found["box/good"].size(), 16U);
  EXPECT_EQ(found["box/good"], found["box/good2"]);
  EXPECT_EQ(found["box/crashing"], "crashed (Segmentation fault)");
  EXPECT_EQ(found["box/looping"], "took longer than 5 s");
  EXPECT_EQ(found["box/hungry"], "took more than 1000 MiB of memory");
  EXPECT_EQ(found["box/leaving"], "ended before it was done");
}

/// A crash may come of what another variant did to the memory that they share.
TEST_F(ApartRun, ACrashThatAnotherCausedIsNoneAlone) {
  write_extraction("{ name = \"poisonous\" }, { name = \"fragile\" }");
  EXPECT_EQ(run(settings()), 0);
  for (const Json& row : rows()) {
    const bool noted = row.at("notes").dump().find("crashed beside others and not alone") != std::string::npos;
    EXPECT_EQ(noted, text_at(row, "/variant/label") == "fragile");
  }
  EXPECT_EQ(outcomes()["box/fragile"], outcomes()["box/poisonous"]);
}

TEST_F(ApartRun, AVoxelizerThatCrashesTakesItsCellsAlong) {
  write_extraction("{ name = \"good\" }", "{ name = \"box\", resolutions = [8] }", "\"crashing\", \"openvdb\"");
  EXPECT_EQ(run(settings()), 1);
  ASSERT_EQ(rows().size(), 2U);
  EXPECT_EQ(text_at(rows()[0], "/failed").substr(0, 8), "crashed ");
  EXPECT_EQ(text_at(rows()[0], "/voxelization/label"), "crashing");
  EXPECT_FALSE(rows()[1].contains("failed"));
}

TEST_F(ApartRun, VoxelizersCompeteApart) {
  write("kind = \"voxelization\"\nquestion = \"why?\"\nvoxelizers = [\"openvdb\", \"crashing\"]\ncolumns = [\"active_voxels\"]\n"
        "[quick]\nrepetitions = 1\nseconds_per_variant = 0\ncases = [{ name = \"box\", resolutions = [8, 12] }]\n");
  EXPECT_EQ(run(settings()), 1);
  ASSERT_EQ(rows().size(), 4U);
  EXPECT_EQ(text_at(rows()[0], "/digest").size(), 16U);
  EXPECT_EQ(text_at(rows()[1], "/failed"), "crashed (Aborted)");
}

TEST_F(ApartRun, TakesUpWhereItStopped) {
  write_extraction("{ name = \"good\" }", "{ name = \"box\", resolutions = [8, 10] }");
  RunSettings first = settings();
  first.filter = "/8/";
  EXPECT_EQ(run(first), 0);
  EXPECT_EQ(run(settings()), 0);
  ASSERT_EQ(rows().size(), 2U);
  EXPECT_EQ(rows()[0].at("run"), rows()[1].at("run"));
  EXPECT_EQ(run(settings()), 0);
  EXPECT_EQ(rows().size(), 2U);
  RunSettings again = settings();
  again.resume = false;
  EXPECT_EQ(run(again), 0);
  EXPECT_EQ(rows().size(), 4U);
}

TEST_F(ApartRun, ATornRowIsMadeAgain) {
  write_extraction("{ name = \"good\" }", "{ name = \"box\", resolutions = [8, 10] }");
  EXPECT_EQ(run(settings()), 0);
  const fs::path file = folder_ / "out" / "rows.jsonl";
  fs::resize_file(file, fs::file_size(file) - 7);
  EXPECT_EQ(run(settings()), 0);
  EXPECT_EQ(rows().size(), 2U);
  ASSERT_FALSE(context_.notes.empty());
  EXPECT_NE(context_.notes[0].find("half a row"), std::string::npos);
}

TEST_F(ApartRun, AMeasurementKeepsTheRowsBeforeItsCrashAndGoesOnFromThere) {
  write("kind = \"measurement\"\nmeasurement = \"letters\"\nquestion = \"why?\"\n[quick]\n");
  const fs::path trap = folder_ / "trap";
  std::ofstream(trap) << "x";
  setenv("HERMESH_TOY_TRAP", trap.c_str(), 1);
  EXPECT_EQ(run(settings()), 1);
  ASSERT_EQ(rows().size(), 3U);
  EXPECT_EQ(text_at(rows()[2], "/failed"), "crashed (Aborted)");
  fs::remove(trap);
  EXPECT_EQ(run(settings()), 0);
  std::vector<std::string> labels;
  for (const Json& row : rows())
    if (!row.contains("failed")) labels.push_back(text_at(row, "/variant/label"));
  EXPECT_EQ(labels, (std::vector<std::string>{"a", "b", "c", "d", "e"}));
}

TEST_F(ApartRun, OverridesTakeOtherVariantsCasesAndResolutions) {
  write_extraction("{ name = \"good\" }");
  RunSettings look = settings();
  look.overrides = {{"fragile"}, {"brick"}, {9, 11}, 1};
  EXPECT_EQ(run(look), 0);
  ASSERT_EQ(rows().size(), 2U);
  EXPECT_EQ(text_at(rows()[1], "/case/name") + text_at(rows()[1], "/variant/label") + text_at(rows()[1], "/resolution"), "brickfragile11");
  look.overrides.variants = {"goood"};
  EXPECT_THROW(run(look), Error);
  look.overrides = {{}, {"bricks"}, {}};
  EXPECT_THROW(run(look), Error);
  look.overrides = {};
  look.overrides.parameters = {{"seed", "2"}};  // those of measurements alone
  EXPECT_THROW(run(look), Error);
}

TEST_F(ApartRun, AnOutsideProgramIsJudgedAndTimedLikeOurs) {
  write_extraction("{ name = \"good\" }, { label = \"copy\", command = \"cp {in} {out}\" }, { label = \"none\", command = \"true {in} {out}\" }, "
                   "{ label = \"ends\", command = \"echo so what >&2; exit 3 # {out}\" }, { label = \"crash\", command = \"kill -SEGV $$ # {out}\" }, "
                   "{ label = \"grid\", command = \"test -s {volume} && cp {in.obj} {out.obj}\" }");
  EXPECT_EQ(run(settings()), 1);
  auto found = outcomes();
  EXPECT_EQ(found["box/copy"].size(), 16U);
  EXPECT_EQ(found["box/grid"].size(), 16U);
  EXPECT_EQ(found["box/none"], "the command ended well and wrote no mesh");
  EXPECT_EQ(found["box/ends"], "the command ended with exit code 3: so what");
  EXPECT_EQ(found["box/crash"].substr(0, 45), "the command crashed (Segmentation fault)");
  for (const Json& row : rows())
    if (text_at(row, "/variant/label") == "copy") {
      EXPECT_GT(number_at(row, "/seconds/median"), 0.0);
      EXPECT_GT(number_at(row, "/peak_bytes"), 1e5);
      EXPECT_EQ(number_at(row, "/triangle_count"), 12.0);
    }
}

/// Starts this program with "run", kills it at a moment that a fixed seed chooses, and takes up again, ten times.
TEST_F(ApartRun, ThreeKillsLeaveTheRowsOfAnUndisturbedRun) {
  write_extraction("{ name = \"good\" }, { name = \"crashing\" }, { name = \"good2\" }",
                   "{ name = \"box\", resolutions = [8, 9] }, { name = \"brick\", resolutions = [8] }");
  EXPECT_EQ(run(settings()), 1);
  const auto undisturbed = outcomes_in_order();
  fs::remove_all(folder_ / "out");
  std::mt19937 random(20110701);
  for (int i = 0; i < 3; ++i) {
    const pid_t pid = fork();
    if (pid == 0) {
      execl("/proc/self/exe", "apart_test", "run", (folder_ / "toy.toml").c_str(), (folder_ / "out").c_str(), nullptr);
      _exit(127);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50 + random() % 350));
    kill(pid, i % 2 == 0 ? SIGKILL : SIGTERM);
    int status = 0;
    waitpid(pid, &status, 0);
  }
  EXPECT_EQ(run(settings()), 1);
  EXPECT_EQ(undisturbed, outcomes_in_order());
}

/// A case whose mesh cannot be had makes rows with the reason, and the other cases go on.
TEST_F(ApartRun, ACaseThatCannotBeReadFailsAlone) {
  const std::string torn = (folder_ / "torn.off").string(), gone = (folder_ / "gone.off").string(),
                    none = (folder_ / "none.off").string();
  std::ofstream(torn) << "OFF\n3 1 0\n0 0 0\n1 0";
  std::ofstream(none) << "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n";
  write_extraction("{ name = \"good\" }, { name = \"good2\" }",
                   "{ name = \"" + torn + "\", resolutions = [8, 9] }, { name = \"" + gone + "\", resolutions = [8] }, { name = \"" +
                       none + "\", resolutions = [8] }, { name = \"box\", resolutions = [8] }");
  for (const bool apart : {true, false}) {
    fs::remove_all(folder_ / "out");
    RunSettings each = settings();
    if (!apart) each.apart.reset();
    std::ostringstream table;
    EXPECT_EQ(run_experiment(each, toys(), context_, table), 1);
    ASSERT_EQ(rows().size(), 10U);
    for (const Json& row : rows()) {
      const std::string name = text_at(row, "/case/name"), failed = text_at(row, "/failed");
      if (name == "box") {
        EXPECT_EQ(text_at(row, "/digest").size(), 16U);
      } else {
        EXPECT_EQ(failed.find("the case " + name + " cannot be read: "), 0U) << failed;
      }
      const std::string why = name == none ? "holds no polygon" : name == gone ? "there is no such file" : "";
      EXPECT_NE(failed.find(why), std::string::npos) << failed;
    }
    const std::string said = table.str(), last = said.substr(said.rfind('\n', said.size() - 2) + 1);
    EXPECT_EQ(last.find("FAILED: 8 of 10 cells; the first is " + torn + "/8/good: "), 0U) << last;
  }
  // As long as the reason stays the same there is nothing to make again, and afterwards there is.
  EXPECT_EQ(run(settings()), 1);
  EXPECT_EQ(rows().size(), 10U);
  std::ofstream(none) << "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  EXPECT_EQ(run(settings()), 1);
  ASSERT_EQ(rows().size(), 12U);
  EXPECT_FALSE(rows()[11].contains("failed")) << rows()[11].at("failed");
}

TEST_F(ApartRun, DataThatAreRequiredAndMissingFailTheirCellsAlone) {
  write_extraction("{ name = \"good\" }", "{ name = \"brick\", resolutions = [8] }, { name = \"box\", resolutions = [8] }");
  require_data(true);
  const int code = run(settings());
  require_data(false);
  EXPECT_EQ(code, 3);
  ASSERT_EQ(rows().size(), 2U);
  EXPECT_NE(text_at(rows()[0], "/failed").find("the case brick would be a stand-in"), std::string::npos);
  EXPECT_EQ(text_at(rows()[1], "/digest").size(), 16U);
}

TEST(Partition, DealsTheHeaviestFirstToTheLightest) {
  // 9 and 7 go to the first two; 6 to the third; 5 joins 6 (11), 4 joins 7 (11), 3 joins 9 (12), 1 joins the first of the two 11.
  EXPECT_EQ(partition({1, 3, 4, 5, 6, 7, 9}, 3), (std::vector<int>{2, 1, 2, 3, 3, 2, 1}));
  EXPECT_EQ(partition({2, 2, 2, 2}, 3), (std::vector<int>{1, 2, 3, 1})) << "those of one weight in their order";
  EXPECT_EQ(partition({5}, 4), std::vector<int>{1});
  EXPECT_TRUE(partition({}, 2).empty());
}

/// Graham's bound for longest processing time first, with the mean and the largest weight as bounds of the optimum from below.
TEST(Partition, IsBalanced) {
  std::mt19937 random(20110702);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> weights(1 + random() % 60);
    for (double& weight : weights) weight = double(1 + random() % 1000);
    const int shards = 1 + int(random() % 8);
    std::vector<double> sums(std::size_t(shards), 0.0);
    const std::vector<int> parts = partition(weights, shards);
    for (std::size_t i = 0; i < weights.size(); ++i) sums.at(std::size_t(parts[i]) - 1) += weights[i];
    const double all = std::accumulate(weights.begin(), weights.end(), 0.0), largest = std::ranges::max(weights);
    EXPECT_LE(std::ranges::max(sums), all / shards + (1.0 - 1.0 / shards) * largest + 1e-9);
  }
}

TEST(Shards, AreNamedByTheirNumberAndHowManyThereAre) {
  EXPECT_EQ(shard_of("2/3"), (Shard{2, 3}));
  for (const char* wrong : {"", "2", "0/3", "4/3", "2/", "/3", "2/3/4", "-1/3", "a/b", "1/10001", "2 /3", "1/0"})
    EXPECT_THROW(shard_of(wrong), Error) << wrong;
}

class ShardedRun : public ApartRun {
 protected:
  static constexpr int kShards = 3;
  void SetUp() override {
    ApartRun::SetUp();
    write_extraction("{ name = \"good\" }, { name = \"crashing\" }, { name = \"good2\" }",
                     "{ name = \"box\", resolutions = [8, 9] }, { name = \"brick\", resolutions = [8] }", "\"openvdb\"");
  }
  fs::path folder_of(int number) const { return folder_ / ("shard-" + std::to_string(number)); }
  RunSettings part(int number) const {
    RunSettings each = settings();
    each.out = folder_of(number);
    return each;
  }
  int run_part(int number, int of = kShards) { return run_part(Shard{number, of}, part(number)); }
  int run_part(const Shard& shard, const RunSettings& each) {
    std::ostringstream table;
    return run_shard(shard, each, toys(), context_, table);
  }
  void run_shards() {
    for (int number = 1; number <= kShards; ++number) EXPECT_EQ(run_part(number), 1);
  }
  std::vector<fs::path> folders() const { return {folder_of(2), folder_of(3), folder_of(1)}; }
  std::string refusal(const std::vector<fs::path>& shards) const {
    try {
      std::ostringstream text;
      merge_shards(folder_ / "merged", shards, text);
    } catch (const Error& error) {
      return error.what();
    }
    return "merged";
  }
  /// Applies a change to each row of a shard.
  template <class Change>
  void doctor(int number, const Change& change) const {
    std::vector<Json> rows = read_rows(folder_of(number));
    fs::remove(folder_of(number) / "rows.jsonl");
    for (Json& row : rows) change(row);
    append_rows(folder_of(number) / "rows.jsonl", rows);
  }
};

TEST_F(ShardedRun, MergedShardsAreTheRowsOfAnUndividedRun) {
  EXPECT_EQ(run(settings()), 1);
  run_shards();
  std::size_t least = 9, all = 0;
  for (int number = 1; number <= kShards; ++number) {
    const std::size_t own = read_rows(folder_of(number)).size();
    least = std::min(least, own);
    all += own;
  }
  EXPECT_EQ(all, 9U);
  EXPECT_GE(least, 3U);
  std::ostringstream text;
  merge_shards(folder_ / "merged", folders(), text);
  const std::vector<Json> whole = rows(), merged = read_rows(folder_ / "merged");
  ASSERT_EQ(merged.size(), whole.size());
  for (std::size_t i = 0; i < whole.size(); ++i) {
    EXPECT_EQ(merged[i].at("cell"), whole[i].at("cell")) << "another order";
    EXPECT_EQ(merged[i].at("run"), merged[0].at("run"));
  }
  const Comparison comparison = compare_rows(whole, merged, {.tolerance = 0.0, .costs = false});
  EXPECT_TRUE(comparison.fine());
  EXPECT_EQ(comparison.count(CellVerdict::State::kBoth), 9U);
  EXPECT_NE(text.str().find("9 cells of 3 shards\nFAILED: 3 of 9 cells; the first is box/8/crashing: crashed"), std::string::npos)
      << text.str();
  EXPECT_TRUE(fs::exists(folder_ / "merged" / "meshes" / "toy-box-8" / "1-good.ply"));
  EXPECT_NE(refusal(folders()), "merged") << "into a folder with rows";
}

TEST_F(ShardedRun, WhatIsMissingIsRefusedByName) {
  run_shards();
  EXPECT_EQ(refusal({folder_of(1), folder_of(3)}), "shard 2 of 3 is missing");
  EXPECT_EQ(refusal({folder_of(3)}), "shards 1, 2 of 3 are missing");
  EXPECT_EQ(refusal({folder_ / "none"}).find((folder_ / "none").string() + " is no shard"), 0U);
  std::vector<Json> rows = read_rows(folder_of(2));
  const std::string lost = text_at(rows.back(), "/case/name") + "/" + text_at(rows.back(), "/resolution") + "/openvdb/" +
                           text_at(rows.back(), "/variant/label");
  rows.pop_back();
  fs::remove(folder_of(2) / "rows.jsonl");
  append_rows(folder_of(2) / "rows.jsonl", rows);
  EXPECT_EQ(refusal(folders()), "1 of 9 cells are missing, the first is " + lost + " of shard 2: run that shard again, to its end");
  EXPECT_EQ(run_part(2), 1);
  EXPECT_EQ(refusal(folders()), "merged");
}

TEST_F(ShardedRun, ADoubledCellMustHaveTheSameValues) {
  run_shards();
  fs::copy(folder_of(1), folder_ / "twice");
  std::vector<fs::path> doubled = folders();
  doubled.push_back(folder_ / "twice");
  // Other times are no other values.
  doctor(1, [](Json& row) {
    if (row.contains("seconds")) row["seconds"]["median"] = 17.0;
  });
  EXPECT_EQ(refusal(doubled), "merged");
  fs::remove_all(folder_ / "merged");
  doctor(1, [](Json& row) {
    if (row.contains("digest")) row["digest"] = "0000000000000000";
  });
  EXPECT_NE(refusal(doubled).find(" has other values in "), std::string::npos) << refusal(doubled);
}

TEST_F(ShardedRun, PartsOfDifferentWholesAreRefused) {
  run_shards();
  const ShardManifest good = read_manifest(folder_of(3));
  EXPECT_TRUE(good.finished);
  const auto refused = [&](const auto& change) {
    ShardManifest other = good;
    change(other);
    write_manifest(other, folder_of(3));
    return refusal(folders());
  };
  EXPECT_NE(refused([](ShardManifest& m) { m.binary = "ffff"; }).find("different programs"), std::string::npos);
  EXPECT_NE(refused([](ShardManifest& m) { m.commit = "ffff"; }).find("different commits"), std::string::npos);
  EXPECT_NE(refused([](ShardManifest& m) { m.file_sha256 = "ffff"; }).find("different states of the experiment file"), std::string::npos);
  EXPECT_NE(refused([](ShardManifest& m) { m.threads = 999; }).find("different numbers of threads"), std::string::npos);
  EXPECT_NE(refused([](ShardManifest& m) { m.shard.of = 4; }).find("different numbers of shards"), std::string::npos);
  EXPECT_NE(refused([](ShardManifest& m) { m.cells.pop_back(); }).find("name different cells"), std::string::npos);
  write_manifest(good, folder_of(3));
  // The box is in the first two shards.
  doctor(2, [](Json& row) {
    if (row.at("case").contains("sha256")) row["case"]["sha256"] = "ffff";
  });
  EXPECT_NE(refusal(folders()).find(" is another input in "), std::string::npos) << refusal(folders());
  std::ofstream(manifest_path(folder_of(3))) << "{\"experiment\": ";
  EXPECT_NE(refusal(folders()).find("is torn"), std::string::npos);
}

TEST_F(ShardedRun, AFolderIsOfOneShard) {
  EXPECT_EQ(run_part(1), 1);
  RunSettings other = part(2);
  other.out = folder_of(1);
  EXPECT_THROW(run_part({2, kShards}, other), Error);
  RunSettings partial = part(2);
  partial.filter = "box";
  EXPECT_THROW(run_part({2, kShards}, partial), Error);
}

TEST_F(ShardedRun, MoreShardsThanGroupsLeaveSomeEmpty) {
  std::vector<fs::path> all;
  for (int number = 1; number <= 7; ++number) {
    EXPECT_EQ(run_part(number, 7), number <= 3 ? 1 : 0);
    all.push_back(folder_of(number));
  }
  EXPECT_EQ(refusal(all), "merged");
  EXPECT_EQ(read_rows(folder_ / "merged").size(), 9U);
}

TEST_F(ShardedRun, AMeasurementHasNoShards) {
  write("kind = \"measurement\"\nmeasurement = \"letters\"\nquestion = \"why?\"\n[quick]\n");
  EXPECT_THROW(run_part(1), Error);
  EXPECT_FALSE(fs::exists(folder_of(1)));
}

}  // namespace

/// The program as `hermesh cell` and `hermesh run` are, with toys.
int work_for_others(int argc, char** argv) {
  RunContext context;
  if (std::string(argv[1]) == "cell") return serve_cells(toys(), context);
  RunSettings settings{argv[2], "quick", argv[3], ""};
  settings.resume = true;
  settings.apart = Apart{"/proc/self/exe", {"cell"}, {60, std::int64_t(4000) << 20}};
  std::ostringstream table;
  return argc == 4 ? run_experiment(settings, toys(), context, table) : 2;
}

}  // namespace hermesh

int main(int argc, char** argv) {
  if (argc > 1 && (std::string(argv[1]) == "cell" || std::string(argv[1]) == "run")) return hermesh::work_for_others(argc, argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
