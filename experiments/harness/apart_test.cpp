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
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "experiments/harness/harness.h"
#include "experiments/harness/run_cells.h"
#include "reference/variants.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

PolygonMesh box() {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.points.emplace_back(float(i & 1), float(i >> 1 & 1), float(i >> 2));
  mesh.quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  return mesh;
}

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
  tables.load = [](const std::string& name, RunContext&) { return LoadedCase{name, box(), "generated", "0123456789abcdef"}; };
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
TEST_F(ApartRun, TenKillsLeaveTheRowsOfAnUndisturbedRun) {
  write_extraction("{ name = \"good\" }, { name = \"crashing\" }, { name = \"good2\" }",
                   "{ name = \"box\", resolutions = [8, 9] }, { name = \"brick\", resolutions = [8] }");
  EXPECT_EQ(run(settings()), 1);
  const auto undisturbed = outcomes_in_order();
  fs::remove_all(folder_ / "out");
  std::mt19937 random(20110701);
  for (int i = 0; i < 10; ++i) {
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
