// Outside programs as variants: what they are given, what they may say of themselves, and what becomes of
// absent ones. The peers of experiments/questions/meshes/peers.toml are run where they are installed.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "experiments/harness/harness.h"
#include "experiments/harness/rows.h"
#include "experiments/harness/run_cells.h"
#include "experiments/harness/unit_box_for_tests.h"
#include "reference/variants.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

class OutsidePrograms : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("hermesh-outside-" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// The exit code of a run of these variants on a box of side 1 at resolution 8, so that a voxel is an
  /// eighth.
  int run(const std::string& variants, bool resume = false) {
    std::ofstream(folder_ / "toy.toml")
        << "question = \"why?\"\nvoxelizers = [\"openvdb\"]\ncolumns = [\"triangles\"]\nvariants = ["
        << variants
        << "]\n[quick]\nrepetitions = 1\nseconds_per_variant = 0\nsamples = 100\npixels = 0\n"
           "cases = [{ name = \"box\", resolutions = [8] }]\n";
    Tables tables = all_tables();
    tables.cases = {"box"};
    tables.load = [](const std::string& name, RunContext&) {
      return LoadedCase{name, unit_box(), "generated", "0123456789abcdef"};
    };
    RunSettings settings{folder_ / "toy.toml", "quick", folder_ / "out", ""};
    settings.resume = resume;
    return run_experiment(settings, tables, context_, said_);
  }
  /// The peers of that filter on a small torus.
  int run_peers(const std::string& filter) {
    RunSettings settings{experiment_file("peers"), "quick", folder_ / "out", filter};
    settings.overrides = {{}, {"torus"}, {24}, 1};
    return run_experiment(settings, all_tables(), context_, said_);
  }
  std::map<std::string, Json> rows() const {
    std::map<std::string, Json> found;
    for (const Json& row : read_rows(folder_ / "out")) found[text_at(row, "/variant/label")] = row;
    return found;
  }

  fs::path folder_;
  RunContext context_;
  std::ostringstream said_;
};

TEST_F(OutsidePrograms, AbsentOnesAreNotesAndTheOthersGoOn) {
  EXPECT_EQ(run("{ label = \"nowhere\", command = \"no-such-program-here {in} {out}\" }, "
                "{ label = \"lacks\", command = \"echo a library is missing; exit 77 # {out}\" }, "
                "{ label = \"copy\", command = \"cp {in} {out}\" }"),
            0);
  const auto found = rows();
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(text_at(found.at("nowhere"), "/failed"), "absent: the shell does not find its program");
  EXPECT_EQ(text_at(found.at("lacks"), "/failed"), "absent: a library is missing");
  EXPECT_EQ(found.at("lacks").at("absent"), true);
  EXPECT_FALSE(found.at("copy").contains("failed"));
  EXPECT_EQ(number_at(found.at("copy"), "/triangle_count"), 12.0);
  EXPECT_NE(said_.str().find("NOTE: lacks on box at resolution 8: absent: a library is missing"),
            std::string::npos)
      << said_.str();
  EXPECT_EQ(said_.str().find("FAILED: "), std::string::npos);
}

TEST_F(OutsidePrograms, OneThatFailsIsAFailureStill) {
  EXPECT_EQ(run("{ label = \"bad\", command = \"exit 76 # {out}\" }"), 1);
}

TEST_F(OutsidePrograms, SayTheirOwnSecondsAndBytes) {
  EXPECT_EQ(run("{ label = \"says\", command = \"cp {in} {out}; sleep 0.05; echo seconds 0.0005; echo bytes "
                "4096\" }, "
                "{ label = \"silent\", command = \"cp {in} {out}; sleep 0.05; echo seconds about 3\" }"),
            0);
  const Json says = rows().at("says"), silent = rows().at("silent");
  EXPECT_EQ(number_at(says, "/seconds/median"), 0.0005);
  EXPECT_EQ(number_at(says, "/peak_bytes"), 4096.0);
  EXPECT_GT(number_at(says, "/figures/process_seconds"), 0.05);
  EXPECT_GT(number_at(says, "/figures/process_peak_bytes"), 1e5);
  EXPECT_GT(number_at(silent, "/seconds/median"), 0.05);
  EXPECT_EQ(number_at(silent, "/peak_bytes"), number_at(silent, "/figures/process_peak_bytes"));
}

TEST_F(OutsidePrograms, CannotTakeLongerThanTheyRan) {
  EXPECT_EQ(run("{ label = \"lies\", command = \"cp {in} {out}; echo seconds 1000\" }"), 1);
  EXPECT_EQ(text_at(rows().at("lies"), "/failed"), "the command says that it took longer than it ran");
}

TEST_F(OutsidePrograms, GetOurUniformMeshMultiplesOfAVoxelAndTheSources) {
  EXPECT_EQ(
      run("{ name = \"marching-cubes\" }, { label = \"uniform\", command = \"cp {uniform.obj} {out.obj}\" }, "
          "{ label = \"voxels\", command = \"case {0.25 voxel}/{3 voxel} in "
          "0.0312499*/0.37499999*|0.03125/0.375) "
          "cp {in} {out};; *) exit 9;; esac\" }, "
          "{ label = \"sources\", command = \"test -f {source}/experiments/questions/meshes/peers.toml && test -d {build} && "
          "cp {in} {out}\" }"),
      0);
  const auto found = rows();
  EXPECT_GT(number_at(found.at("uniform"), "/triangle_count"), 100.0);
  for (const char* count : {"/triangle_count", "/report/points", "/report/boundary_edges"})
    EXPECT_EQ(number_at(found.at("uniform"), count), number_at(found.at("marching-cubes"), count)) << count;
}

TEST_F(OutsidePrograms, AWordInBracesThatIsNoneIsAnError) {
  EXPECT_THROW(run("{ label = \"x\", command = \"a {voxels} {out}\" }"), Error);
  EXPECT_THROW(run("{ label = \"x\", command = \"a {1.2.3 voxel} {out}\" }"), Error);
  EXPECT_THROW(run("{ label = \"x\", command = \"a {uniform.vdb} {out}\" }"), Error);
}

/// What CONTRIBUTING.md says: a program in any language, with one entry in a file.
TEST_F(OutsidePrograms, TheExampleInPythonIsJudgedTimedAndPlotted) {
  ASSERT_EQ(std::system("python3 -c ''"), 0) << "experiments/install_packages.sh installs python3";
  EXPECT_EQ(run_peers("/example outside"), 0) << said_.str();
  const Json row = rows().at("example outside");
  // Cells of three voxels on a torus of 24: some hundreds of triangles, none of them off by more than a
  // cell's diagonal.
  EXPECT_GT(number_at(row, "/triangle_count"), 100.0);
  EXPECT_LT(number_at(row, "/triangle_count"), 2000.0);
  EXPECT_GT(number_at(row, "/seconds/median"), 0.0);
  EXPECT_LT(number_at(row, "/report/to_reference/max"), 3 * 1.74 * number_at(row, "/voxel_size"));
  EXPECT_GT(number_at(row, "/report/from_reference/rms"), 0.0);
}

/// Each peer that is installed makes a mesh near the torus, and says its time; each other one says what it lacks.
TEST(Slow, PeersMakeMeshesOrSayWhatTheyLack) {
  const fs::path folder = fs::temp_directory_path() / ("hermesh-peers-" + std::to_string(getpid()));
  RunSettings settings{experiment_file("peers"), "quick", folder, ""};
  settings.overrides = {{}, {"torus"}, {24}, 1};
  RunContext context;
  std::ostringstream said;
  EXPECT_EQ(run_experiment(settings, all_tables(), context, said), 0) << said.str();
  std::set<std::string> labels;
  for (const Json& row : read_rows(folder)) {
    const std::string label = text_at(row, "/variant/label");
    SCOPED_TRACE(label);
    labels.insert(label);
    const bool outside = text_at(row, "/variant/name").starts_with("command ");
    if (row.contains("absent")) {
      EXPECT_TRUE(outside) << "what is linked with the program cannot be absent";
      EXPECT_GT(text_at(row, "/failed").size(), std::string("absent: ").size());
      std::cout << label << " is " << text_at(row, "/failed") << '\n';
      continue;
    }
    EXPECT_GT(number_at(row, "/triangle_count"), 50.0);
    EXPECT_LT(number_at(row, "/report/to_reference/rms"), 1.5 * number_at(row, "/voxel_size"));
    if (outside && label != "example outside") {
      EXPECT_LT(number_at(row, "/seconds/median"), number_at(row, "/figures/process_seconds"));
    }
  }
  fs::remove_all(folder);
  EXPECT_GE(labels.size(), 20U);
}

TEST_F(OutsidePrograms, AreRunAgainForNobodyKnowsWhetherTheyAreWhatTheyWere) {
  const std::string command = "{ label = \"mine\", command = \"cp " + (folder_ / "mesh.obj").string() + " {out.obj}\" }";
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n", faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  std::ofstream(folder_ / "mesh.obj") << points << faces;
  ASSERT_EQ(run(command), 0);
  EXPECT_EQ(rows().at("mine").at("triangle_count"), 4);
  std::ofstream(folder_ / "mesh.obj") << points << "v 0.2 0.2 0.2\n"
                                      << "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 5\nf 3 4 5\nf 4 2 5\n";
  ASSERT_EQ(run(command, true), 0);
  EXPECT_EQ(rows().at("mine").at("triangle_count"), 6);
}

}  // namespace
}  // namespace hermesh
