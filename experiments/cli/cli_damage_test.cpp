// Damaged or unusual input files, resource limits and signals.
#include <openvdb/io/File.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <cstring>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/vdb_file.h"
#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_damage_test {

namespace fs = std::filesystem;

class DamageTest : public ProgramTest {
 protected:
  /// A file in the directory of this one.
  std::string input(const std::string& name) {
    const fs::path target = path(name);
    fs::copy_file(fs::path(HERMESH_TEST_INPUTS) / name, target);
    return name;
  }
  /// The message is short, and notes may precede it.
  void expect_refusal(int exit_code, const Words& arguments, const Words& words) {
    ProgramTest::expect_refusal(exit_code, arguments, words, true, 300);
  }
  nlohmann::json judged(const std::string& mesh) { return json_of({"validate", mesh, "--json"}); }
};

TEST_F(DamageTest, ABlockOfValuesThatIsLongerThanItsPlace) {
  const std::string file = input("damaged-chunk.vdb");
  for (const Words& arguments : {Words{"info", file},
                                 {"extract", file, "out.ply"},
                                 {"fracture", file, "out", "--cutters", "planes:1"}})
    expect_refusal(1, arguments, {file, "damaged"});
}

TEST_F(DamageTest, ATileOf4096CubedIsWeighedBeforeItIsMade) {
  const std::string file = input("one-tile-4096.vdb");
  EXPECT_PRED2(has, run({"info", file}).out, std::to_string(4096LL * 4096 * 4096) + " voxels");
  // However much memory the machine has: the surface has 100 million faces.
  for (const char* extractor : {"dual-contouring", "marching-cubes", "manifold-dual-contouring"})
    expect_refusal(1, {"extract", file, "out.ply", "--extractor", extractor},
                   {file, "100663296 faces of voxels"});
  expect_refusal(1, {"fracture", file, "out", "--cutters", "planes:1"}, {file, "100663296 faces of voxels"});
}

TEST_F(DamageTest, NiftiThatOthersRead) {
  for (const auto& [file, values] :
       {std::pair("nan-slope.nii.gz", "values 76.6"), {"bitpix.nii.gz", "values 76.6"}}) {
    const Outcome outcome = run_to(0, {"import", input(file), "out.vdb"});
    EXPECT_PRED2(has, outcome.out, values);
    EXPECT_PRED2(has, outcome.out, "to 99.1");
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_EQ(outcome.err.rfind("note: ", 0), 0u) << outcome.err;
  }
}

TEST_F(DamageTest, SingleBytesHaveNoOrder) {
  write("a.raw", std::string(8, '\x05') + std::string(19, '\x02'));
  for (const char* type : {"uint8", "uint8le", "int8be"})
    run_to(0, {"import", "a.raw", "a.vdb", "--dims", "3,3,3", "--type", type});
}

TEST_F(DamageTest, DamagedExperimentsLeaveNoFolder) {
  const std::string good =
      "question = \"Q?\"\nvoxelizers = [\"hermesh\"]\ncolumns = [\"triangles\"]\n[[variants]]\nname = "
      "\"marching-cubes\"\n"
      "[quick]\ncases = [{ name = \"uv-sphere\", resolutions = [8] }]\n";
  const std::pair<const char*, const char*> damages[] = {{"marching-cubes", "marching-cuves"},
                                                         {"[quick]", "[quick"},
                                                         {"\"triangles\"", "\"triangles"},
                                                         {"question", "quextion"},
                                                         {"uv-sphere", "\x1b[2J"},
                                                         {"resolutions", "resolutionsresolutions"}};
  for (const auto& [from, to] : damages) {
    std::string damaged = good;
    damaged.replace(damaged.find(from), std::strlen(from), to);
    write("damaged.toml", damaged);
    expect_refusal(1, "run damaged.toml --out a/b/rows", {"damaged.toml"});
  }
  write("good.toml", good);
  expect_refusal(1, {"run", "good.toml", "--out", "a/b/rows", "--filter", "no such cell"}, {"no cell"});
  expect_refusal(1, "run good.toml --out a/b/rows --tier full", {"full"});
}

TEST_F(DamageTest, AMaskIsInsideWhereItIsActive) {
  initialize_openvdb();
  auto mask = openvdb::MaskGrid::create(false);
  mask->fill(openvdb::CoordBBox(openvdb::Coord(1), openvdb::Coord(10, 20, 30)), true);
  mask->setName("mask");
  openvdb::io::File(path("mask.vdb")).write({mask});
  run_to(0, "extract mask.vdb a.obj --isovalue 0.5 --extractor marching-cubes");
  const nlohmann::json report = judged("a.obj");
  EXPECT_EQ(report.at("components"), 1);
  EXPECT_EQ(report.at("euler_characteristic"), 2);
  // A box of 10 x 20 x 30 voxels whose edges and corners marching cubes cuts: off an edge a prism of 1/8
  // voxel a voxel of its length, off a corner a pyramid of 1/48, where the prisms of three edges would meet
  // in 3 · 1/16 of a voxel.
  EXPECT_LT(report.at("volume").get<double>(), 6000.0);
  EXPECT_GT(report.at("volume").get<double>(), 6000.0 - 4 * 60 / 8.0 - 1e-3);
}

/// The inside of a level set with the background of outside, as programs leave it that do not flood it.
TEST_F(DamageTest, AnUnfloodedLevelSetIsFlooded) {
  initialize_openvdb();
  const auto grid =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(10.0f, openvdb::Vec3f(0.3f), 0.5f);
  grid->setName("sdf");
  openvdb::io::File(path("flooded.vdb")).write({grid});
  const auto unflooded = openvdb::FloatGrid::create(grid->background());
  unflooded->setGridClass(openvdb::GRID_LEVEL_SET);
  unflooded->setTransform(grid->transformPtr());
  unflooded->setName("sdf");
  for (auto it = grid->cbeginValueOn(); it; ++it) unflooded->tree().setValue(it.getCoord(), *it);
  openvdb::io::File(path("unflooded.vdb")).write({unflooded});
  for (const std::string name : {"flooded", "unflooded"}) {
    const Outcome outcome = run_to(0, {"extract", name + ".vdb", name + ".ply"});
    EXPECT_EQ(outcome.err.find("flood") != std::string::npos, name == "unflooded") << outcome.err;
  }
  EXPECT_TRUE(read("flooded.ply") == read("unflooded.ply"));
  EXPECT_EQ(judged("unflooded.ply").at("components"), 1);
}

TEST_F(DamageTest, NamesThatControlATerminalDoNot) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setName("\x1b[2J" + std::string(2'000'000, 'n'));
  grid->tree().setValue(openvdb::Coord(0), -1.0f);
  openvdb::io::File(path("name.vdb")).write({grid, openvdb::BoolGrid::create()});
  const Outcome outcome = run_to(0, "info name.vdb");
  EXPECT_LT(outcome.out.size(), 2000u);
  EXPECT_PRED2(lacks, outcome.out, "\x1b");
  expect_refusal(1, "extract name.vdb out.ply", "name.vdb --grid");
  expect_refusal(1, {"extract", "name.vdb", "out.ply", "--grid", "\x1b[2Jother"}, "name.vdb ?[2Jother");
  expect_refusal(1, {"info", "\x1b[2J.vdb"}, {"?[2J.vdb"});
}

TEST_F(DamageTest, ThreadsHaveAnEnd) {
  for (const char* threads : {"2147483647", "1025", "0", "99999999999"})
    expect_refusal(2, {"--threads", threads, "info", "none.vdb"}, "--threads 1024");
  write_cube();
  run_to(0, "remesh cube.off a.ply --resolution 20 --threads 1024");
  run_to(0, "remesh cube.off b.ply --resolution 20 --threads 1");
  EXPECT_TRUE(read("a.ply") == read("b.ply"));
}

TEST_F(DamageTest, NotesAreThereBeforeAnError) {
  // Two sheets on each other, turned against each other: they cancel.
  write("sheets.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n");
  const Outcome outcome = run_to(1, "remesh sheets.obj out.ply --resolution 10 --thin drop");
  EXPECT_PRED2(has, outcome.err, "--signs unsigned");
}

TEST_F(DamageTest, AHangUpLeavesNothingHalfWritten) {
  write_sphere();
  for (const int signal : {SIGHUP, SIGXCPU, SIGPIPE}) {
    const Outcome outcome = run("remesh sphere.off out.ply --resolution 1500", Interruption{signal, {}});
    EXPECT_EQ(outcome.exit_code, 128 + signal) << outcome.err;
    EXPECT_EQ(files(), std::set<std::string>{"sphere.off"});
  }
}

TEST_F(DamageTest, AFileThatMayNotGrowIsRemoved) {
  write_sphere();
  limit(RLIMIT_FSIZE, 10000);
  for (const char* out : {"out.ply", "out.stl", "out.obj"})
    run_to(1, {"remesh", "sphere.off", out, "--resolution", "60"});
  run_to(1, "voxelize sphere.off out.vdb --resolution 60");
  EXPECT_EQ(files(), std::set<std::string>{"sphere.off"});
}

}  // namespace cli_damage_test
}  // namespace hermesh::cli
