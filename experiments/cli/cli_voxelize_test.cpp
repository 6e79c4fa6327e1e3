// hermesh voxelize from the outside: its grids, signs and options, and what it refuses.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <tuple>

#include "algorithms/io/vdb_file.h"
#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace {

using Json = nlohmann::json;
using Arguments = std::vector<std::string>;

class VoxelizeTest : public ProgramTest {
 protected:
  Outcome voxelize(const std::string& in, const Arguments& more) {
    Arguments arguments = {"voxelize", in, "out.vdb", "--resolution", "20"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }
  void expect_refusal(int exit_code, const Arguments& more, const std::vector<std::string>& words,
                      const std::string& in = "cube.off") {
    const std::set<std::string> before = files();
    const Outcome outcome = voxelize(in, more);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    for (const std::string& word : words) EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
    EXPECT_EQ(files(), before);
  }
  std::vector<std::string> grids(const std::string& file) {
    std::vector<std::string> names;
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
  const Outcome outcome = voxelize("t.obj", {"--grids", kAllGrids});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(files(), (std::set<std::string>{"t.obj", "out.vdb", "out.hermite.vdb"}));
  EXPECT_EQ(grids("out.vdb"), (std::vector<std::string>{"closest-point", "colour", "fog", "material",
                                                        "normal", "sdf", "triangle-id", "udf", "uv"}));
  EXPECT_NE(outcome.out.find("out.hermite.vdb"), std::string::npos) << outcome.out;
  EXPECT_EQ(run({"info", "out.hermite.vdb"}).exit_code, 0);
  EXPECT_EQ(run({"extract", "out.vdb", "out.ply"}).exit_code, 0);
}

/// All outputs that §5.1 of the thesis names come from its own voxelizer, too, with the triangles of its own
/// band.
TEST_F(VoxelizeTest, TheThesisMakesAllGrids) {
  write_tetrahedron();
  const Outcome outcome = voxelize("t.obj", {"--grids", kAllGrids, "--voxelizer", "thesis"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(grids("out.vdb"), (std::vector<std::string>{"closest-point", "colour", "fog", "material",
                                                        "normal", "sdf", "triangle-id", "udf", "uv"}));
  EXPECT_EQ(run({"info", "out.hermite.vdb"}).exit_code, 0);
  EXPECT_EQ(run({"extract", "out.vdb", "out.ply"}).exit_code, 0);
  for (const char* option : {"clean_up=false", "expansion=false", "signs=unsigned"})
    EXPECT_EQ(voxelize("t.obj", {"--grids", "udf,triangle-id,closest-point", "--voxelizer", "thesis",
                                 "--voxelizer-option", option})
                  .exit_code,
              0)
        << option;
  expect_refusal(1, {"--grids", "fog", "--voxelizer", "thesis", "--signs", "unsigned"}, {"fog", "sign"},
                 "t.obj");
  expect_refusal(2, {"--voxelizer", "thesis", "--signs", "unsigned", "--voxelizer-option", "clean_up=false"},
                 {"clean_up", "signs"}, "t.obj");
}

/// OpenVDB's tool reads the file. It returns 0 whatever happens, so its text is what counts.
TEST_F(VoxelizeTest, OpenVdbsToolReadsTheFile) {
  ASSERT_EQ(std::system("command -v vdb_print > /dev/null"), 0)
      << "vdb_print is not installed (package libopenvdb-tools)";
  write_tetrahedron();
  ASSERT_EQ(voxelize("t.obj", {"--grids", kAllGrids}).exit_code, 0);
  ASSERT_EQ(
      std::system(
          ("vdb_print -l '" + path("out.vdb").string() + "' > '" + path("text").string() + "' 2>&1").c_str()),
      0);
  const std::string text = read("text");
  EXPECT_EQ(text.find("ERROR"), std::string::npos) << text;
  for (const std::string& name : grids("out.vdb"))
    EXPECT_NE(text.find("Name: " + name + "\n"), std::string::npos) << name << " is missing in:\n" << text;
}

TEST_F(VoxelizeTest, SameBytesForEveryNumberOfThreads) {
  write_tetrahedron();
  std::vector<std::string> written;
  for (const char* threads : {"1", "2"}) {
    ASSERT_EQ(voxelize("t.obj", {"--grids", kAllGrids, "--threads", threads}).exit_code, 0);
    written.emplace_back();
    for (const char* file : {"out.vdb", "out.hermite.vdb"}) written.back() += read(file);
  }
  EXPECT_TRUE(written[0] == written[1]);
}

TEST_F(VoxelizeTest, DefaultIsTheLevelSet) {
  write_cube();
  ASSERT_EQ(voxelize("cube.off", {}).exit_code, 0);
  EXPECT_EQ(grids("out.vdb"), std::vector<std::string>{"sdf"});
  EXPECT_NE(run({"info", "out.vdb"}).out.find("level set"), std::string::npos);
}

TEST_F(VoxelizeTest, UnsignedMakesAUdf) {
  write_cube();
  for (const Arguments& unsigned_ :
       {Arguments{"--signs", "unsigned"}, {"--voxelizer-option", "signs=unsigned"}}) {
    ASSERT_EQ(voxelize("cube.off", unsigned_).exit_code, 0);
    EXPECT_EQ(grids("out.vdb"), std::vector<std::string>{"udf"});
  }
  for (const char* signs : {"auto", "flood-fill", "winding-number"}) {
    ASSERT_EQ(voxelize("cube.off", {"--signs", signs}).exit_code, 0);
    EXPECT_EQ(grids("out.vdb"), std::vector<std::string>{"sdf"});
  }
}

TEST_F(VoxelizeTest, OptionsOfOtherVoxelizers) {
  write_cube();
  EXPECT_EQ(voxelize("cube.off", {"--voxelizer", "thesis", "--voxelizer-option", "sign_angle=80"}).exit_code,
            0);
  EXPECT_EQ(voxelize("cube.off", {"--voxelizer", "openvdb", "--grids", "sdf"}).exit_code, 0);
  EXPECT_EQ(grids("out.vdb"), std::vector<std::string>{"sdf"});
}

TEST_F(VoxelizeTest, WrongUsage) {
  write_cube();
  expect_refusal(2, {"--grids", "sdf,smoke"}, {"smoke", "closest-point", "attribute:NAME"});
  expect_refusal(2, {"--grids", ""}, {"--grids", "empty"});
  expect_refusal(2, {"--grids", "sdf,"}, {"missing", "fog"});
  expect_refusal(2, {"--grids", "fog", "--voxelizer", "openvdb"}, {"hermesh", "openvdb", "--grids"});
  expect_refusal(2, {"--fog-exterior"}, {"--fog-exterior", "fog"});
  expect_refusal(2, {"--signs", "maybe"}, {"maybe", "winding-number"});
  expect_refusal(2, {"--signs", "auto", "--voxelizer", "exact"}, {"exact", "signs"});
  expect_refusal(2, {"--signs", "auto", "--voxelizer-option", "signs=auto"}, {"signs", "twice"});
  expect_refusal(2, {"--voxelizer-option", "nonsense=1"}, {"nonsense", "hermesh", "signs"});
  expect_refusal(2, {"--voxelizer-option", "nonsense"}, {"nonsense", "key=value"});
  expect_refusal(2, {"--voxelizer", "thesis", "--voxelizer-option", "sign_angle=400"},
                 {"sign_angle", "400", "180"});
}

TEST_F(VoxelizeTest, WhatTheMeshDoesNotHave) {
  write_cube();
  expect_refusal(1, {"--grids", "attributes"}, {"no attributes"});
  expect_refusal(1, {"--grids", "sdf,attribute:uv"}, {"uv"});
  for (const char* grid : {"fog", "hermite"})
    expect_refusal(1, {"--grids", grid, "--signs", "unsigned"}, {grid, "sign"});
}

TEST_F(VoxelizeTest, BadAttributesMatterOnlyWhereTheyAreAskedFor) {
  write("nan.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 nan\nf 1//1 3//1 2//1\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  expect_refusal(1, {"--grids", "sdf,attribute:normal"}, {"nan.obj", "normal", "finite"}, "nan.obj");
  for (const char* asked : {"udf,attributes", "attributes"}) {
    const Outcome outcome = voxelize("nan.obj", {"--grids", asked});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("'normal' was left out"), std::string::npos) << outcome.err;
    EXPECT_EQ(grids("out.vdb"), std::vector<std::string>{asked[0] == 'u' ? "udf" : "sdf"});
  }
  EXPECT_EQ(voxelize("nan.obj", {}).exit_code, 0);
}

TEST_F(VoxelizeTest, LikeTakesTheLatticeOfAnotherVolume) {
  write_cube();
  write_tetrahedron();
  ASSERT_EQ(voxelize("cube.off", {}).exit_code, 0);
  ASSERT_EQ(run({"voxelize", "t.obj", "same.vdb", "--like", "out.vdb"}).exit_code, 0);
  EXPECT_EQ(describe_vdb(path("same.vdb"))[0].voxel_size, describe_vdb(path("out.vdb"))[0].voxel_size);
  const std::set<std::string> before = files();
  for (const auto& [more, exit_code, word] :
       {std::tuple(Arguments{"--like", "out.vdb", "--resolution", "20"}, 2, "--like"),
        std::tuple(Arguments{"--like", "out.vdb", "--grids", "hermite"}, 2, "--like"),
        std::tuple(Arguments{"--like", "out.vdb", "--voxelizer", "openvdb"}, 2, "--like"),
        std::tuple(Arguments{"--like", "t.obj"}, 1, "t.obj")}) {
    Arguments arguments = {"voxelize", "t.obj", "refused.vdb"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
    EXPECT_EQ(files(), before);
  }
}

TEST_F(VoxelizeTest, NeitherFileIfOneCannotBeWritten) {
  write_cube();
  std::filesystem::create_directory(path("out.hermite.vdb"));
  expect_refusal(1, {"--grids", "hermite"}, {"out.hermite.vdb"});
}

TEST_F(VoxelizeTest, ListShowsTheOptionsOfVoxelizers) {
  const Json list = Json::parse(run({"list", "--json"}).out);
  const auto hermesh =
      std::ranges::find(list.at("voxelizers"), "hermesh", [](const Json& item) { return item.at("name"); });
  ASSERT_NE(hermesh, list.at("voxelizers").end());
  EXPECT_EQ(hermesh->at("ours"), true);
  EXPECT_EQ(hermesh->at("options").at(0).at("name"), "signs");
  EXPECT_EQ(hermesh->at("options").at(0).at("default"), "auto");
  EXPECT_NE(run({"list"}).out.find(
                "--voxelizer-option signs=auto (auto|auto-sheets|flood-fill|winding-number|unsigned)"),
            std::string::npos);
}

}  // namespace
}  // namespace hermesh::cli
