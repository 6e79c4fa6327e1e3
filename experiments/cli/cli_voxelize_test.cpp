// hermesh voxelize: grids, signs, options and refusals.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>

#include "algorithms/io/vdb_file.h"
#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_voxelize_test {

using Json = nlohmann::json;

class VoxelizeTest : public ProgramTest {
 protected:
  Outcome voxelize(int exit_code, const std::string& in, const Words& more) {
    return run_to(exit_code, Words{"voxelize", in, "out.vdb", "--resolution", "20"} + more);
  }
  void expect_refusal(int exit_code, const Words& more, const Words& words,
                      const std::string& in = "cube.off") {
    ProgramTest::expect_refusal(exit_code, Words{"voxelize", in, "out.vdb", "--resolution", "20"} + more,
                                words);
  }
  Words grids(const std::string& file) {
    Words names;
    for (const GridSummary& grid : describe_vdb(path(file))) names.push_back(grid.name);
    std::sort(names.begin(), names.end());
    return names;
  }
  /// Writes a tetrahedron with an attribute of each kind.
  void write_tetrahedron() {
    write("t.obj",
          "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nv 0 0 1 1 1 1\nvt 0 0\nvt 1 0\nvt 0 1\n"
          "vn -1 0 0\nvn 0 -1 0\nvn 0 0 -1\nvn 1 1 1\nusemtl clay\nf 1/1/3 3/2/3 2/3/3\nf 1/1/2 2/2/2 4/3/2\n"
          "usemtl tin\nf 1/1/1 4/2/1 3/3/1\nf 2/1/4 3/2/4 4/3/4\n");
  }
};

constexpr const char* kAllGrids = "sdf,udf,closest-point,triangle-id,fog,hermite,attributes";

TEST_F(VoxelizeTest, AllGridsInOneFileAndHermiteBesideIt) {
  write_tetrahedron();
  const Outcome outcome = voxelize(0, "t.obj", {"--grids", kAllGrids});
  EXPECT_EQ(files(), (std::set<std::string>{"t.obj", "out.vdb", "out.hermite.vdb"}));
  EXPECT_EQ(grids("out.vdb"), (Words("closest-point colour fog material normal sdf triangle-id udf uv")));
  EXPECT_PRED2(has, outcome.out, "out.hermite.vdb");
  run_to(0, "info out.hermite.vdb");
  run_to(0, "extract out.vdb out.ply");
}

/// All outputs that §5.1 of the thesis names come from its own voxelizer, too, with the triangles of its own
/// band.
TEST_F(VoxelizeTest, TheThesisMakesAllGrids) {
  write_tetrahedron();
  voxelize(0, "t.obj", {"--grids", kAllGrids, "--voxelizer", "thesis"});
  EXPECT_EQ(grids("out.vdb"), (Words("closest-point colour fog material normal sdf triangle-id udf uv")));
  run_to(0, "info out.hermite.vdb");
  run_to(0, "extract out.vdb out.ply");
  for (const char* option : {"clean_up=false", "expansion=false", "signs=unsigned"})
    voxelize(
        0, "t.obj",
        {"--grids", "udf,triangle-id,closest-point", "--voxelizer", "thesis", "--voxelizer-option", option});
  expect_refusal(1, "--grids fog --voxelizer thesis --signs unsigned", "fog sign", "t.obj");
  expect_refusal(2, "--voxelizer thesis --signs unsigned --voxelizer-option clean_up=false", "clean_up signs",
                 "t.obj");
}

/// OpenVDB's tool reads the file. It always returns 0, so the test reads its output.
TEST_F(VoxelizeTest, OpenVdbsToolReadsTheFile) {
  ASSERT_EQ(std::system("command -v vdb_print > /dev/null"), 0)
      << "vdb_print is not installed (package libopenvdb-tools)";
  write_tetrahedron();
  voxelize(0, "t.obj", {"--grids", kAllGrids});
  ASSERT_EQ(
      std::system(
          ("vdb_print -l '" + path("out.vdb").string() + "' > '" + path("text").string() + "' 2>&1").c_str()),
      0);
  const std::string text = read("text");
  EXPECT_PRED2(lacks, text, "ERROR");
  for (const std::string& name : grids("out.vdb"))
    EXPECT_PRED2(has, text, "Name: " + name + "\n") << name << " is missing in:\n" << text;
}

TEST_F(VoxelizeTest, SameBytesForEveryNumberOfThreads) {
  write_tetrahedron();
  Words written;
  for (const char* threads : {"1", "2"}) {
    voxelize(0, "t.obj", {"--grids", kAllGrids, "--threads", threads});
    written.emplace_back();
    for (const char* file : {"out.vdb", "out.hermite.vdb"}) written.back() += read(file);
  }
  EXPECT_TRUE(written[0] == written[1]);
}

TEST_F(VoxelizeTest, DefaultIsTheLevelSet) {
  write_cube();
  voxelize(0, "cube.off", {});
  EXPECT_EQ(grids("out.vdb"), Words("sdf"));
  EXPECT_PRED2(has, run("info out.vdb").out, "level set");
}

TEST_F(VoxelizeTest, UnsignedMakesAUdf) {
  write_cube();
  for (const char* unsigned_ : {"--signs unsigned", "--voxelizer-option signs=unsigned"}) {
    voxelize(0, "cube.off", unsigned_);
    EXPECT_EQ(grids("out.vdb"), Words("udf"));
  }
  for (const char* signs : {"auto", "flood-fill", "winding-number"}) {
    voxelize(0, "cube.off", {"--signs", signs});
    EXPECT_EQ(grids("out.vdb"), Words("sdf"));
  }
}

TEST_F(VoxelizeTest, OptionsOfOtherVoxelizers) {
  write_cube();
  voxelize(0, "cube.off", "--voxelizer thesis --voxelizer-option sign_angle=80");
  voxelize(0, "cube.off", "--voxelizer openvdb --grids sdf");
  EXPECT_EQ(grids("out.vdb"), Words("sdf"));
}

TEST_F(VoxelizeTest, WrongUsage) {
  write_cube();
  expect_refusal(2, "--grids sdf,smoke", "smoke closest-point attribute:NAME");
  expect_refusal(2, {"--grids", ""}, "--grids empty");
  expect_refusal(2, "--grids sdf,", "missing fog");
  expect_refusal(2, "--grids fog --voxelizer openvdb", "hermesh openvdb --grids");
  expect_refusal(2, {"--fog-exterior"}, "--fog-exterior fog");
  expect_refusal(2, "--signs maybe", "maybe winding-number");
  expect_refusal(2, "--signs auto --voxelizer exact", "exact signs");
  expect_refusal(2, "--signs auto --voxelizer-option signs=auto", "signs twice");
  expect_refusal(2, "--voxelizer-option nonsense=1", "nonsense hermesh signs");
  expect_refusal(2, "--voxelizer-option nonsense", "nonsense key=value");
  expect_refusal(2, "--voxelizer thesis --voxelizer-option sign_angle=400", "sign_angle 400 180");
}

TEST_F(VoxelizeTest, WhatTheMeshDoesNotHave) {
  write_cube();
  expect_refusal(1, "--grids attributes", {"attributes"});
  expect_refusal(1, "--grids sdf,attribute:uv", {"uv"});
  for (const char* grid : {"fog", "hermite"})
    expect_refusal(1, {"--grids", grid, "--signs", "unsigned"}, {grid, "sign"});
}

TEST_F(VoxelizeTest, BadAttributesMatterOnlyWhereTheyAreAskedFor) {
  write("nan.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 nan\nf 1//1 3//1 2//1\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  expect_refusal(1, "--grids sdf,attribute:normal", "nan.obj normal finite", "nan.obj");
  for (const char* asked : {"udf,attributes", "attributes"}) {
    const Outcome outcome = voxelize(0, "nan.obj", {"--grids", asked});
    EXPECT_PRED2(has, outcome.err, "'normal'");
    EXPECT_EQ(grids("out.vdb"), Words{asked[0] == 'u' ? "udf" : "sdf"});
  }
  voxelize(0, "nan.obj", {});
}

TEST_F(VoxelizeTest, LikeTakesTheLatticeOfAnotherVolume) {
  write_cube();
  write_tetrahedron();
  voxelize(0, "cube.off", {});
  run_to(0, "voxelize t.obj same.vdb --like out.vdb");
  EXPECT_EQ(describe_vdb(path("same.vdb"))[0].voxel_size, describe_vdb(path("out.vdb"))[0].voxel_size);
  for (const char* more : {"--resolution 20", "--grids hermite", "--voxelizer openvdb"})
    ProgramTest::expect_refusal(2, Words("voxelize t.obj refused.vdb --like out.vdb") + more, {"--like"});
  ProgramTest::expect_refusal(1, "voxelize t.obj refused.vdb --like t.obj", {"t.obj"});
}

TEST_F(VoxelizeTest, NeitherFileIfOneCannotBeWritten) {
  write_cube();
  std::filesystem::create_directory(path("out.hermite.vdb"));
  expect_refusal(1, "--grids hermite", {"out.hermite.vdb"});
}

TEST_F(VoxelizeTest, ListShowsTheOptionsOfVoxelizers) {
  const Json list = json_of("list --json");
  const auto hermesh =
      std::ranges::find(list.at("voxelizers"), "hermesh", [](const Json& item) { return item.at("name"); });
  ASSERT_NE(hermesh, list.at("voxelizers").end());
  EXPECT_EQ(hermesh->at("ours"), true);
  EXPECT_EQ(hermesh->at("options").at(0).at("name"), "signs");
  EXPECT_EQ(hermesh->at("options").at(0).at("default"), "auto");
  EXPECT_PRED2(has, run({"list"}).out,
               "--voxelizer-option signs=auto (auto|auto-sheets|flood-fill|winding-number|unsigned)");
}

}  // namespace cli_voxelize_test
}  // namespace hermesh::cli
