// Invalid input: a message that names the fault, exit code 1 or 2, and no partial file.
#include <algorithm>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_bad_input_test {

class BadInputTest : public ProgramTest {
 protected:
  void expect_bad_mesh(const std::string& name, const std::string& content) {
    write(name, content);
    expect_refusal(1, {"remesh", name, "out.ply", "--resolution", "10"}, {name});
    expect_refusal(1, {"validate", name}, {name});
  }
};

TEST_F(BadInputTest, MissingFile) {
  expect_refusal(1, "remesh missing.ply out.ply --resolution 10", {"missing.ply"});
  expect_refusal(1, "extract missing.vdb out.ply", {"missing.vdb"});
  expect_refusal(1, "validate missing.off", {"missing.off"});
  expect_refusal(1, "info missing.vdb", {"missing.vdb"});
  expect_refusal(1, "run missing.toml --out rows", {"missing.toml"});
  expect_refusal(1, "report missing", {"missing"});
}

TEST_F(BadInputTest, FolderInPlaceOfInput) {
  std::filesystem::create_directory(path("folder.ply"));
  std::filesystem::create_directory(path("folder.vdb"));
  expect_refusal(1, "validate folder.ply", {"folder.ply"});
  expect_refusal(1, "extract folder.vdb out.ply", {"folder.vdb"});
}

TEST_F(BadInputTest, EmptyFile) {
  for (const char* name : {"empty.ply", "empty.obj", "empty.off", "empty.stl", "empty.ply.gz"})
    expect_bad_mesh(name, "");
  write("empty.vdb", "");
  expect_refusal(1, "extract empty.vdb out.ply", {"empty.vdb"});
  expect_refusal(1, "info empty.vdb", {"empty.vdb"});
}

TEST_F(BadInputTest, TruncatedFile) {
  write_cube();
  const std::string cube = read("cube.off");
  expect_bad_mesh("cut.off", cube.substr(0, cube.size() / 2));
  expect_bad_mesh("cut_header.ply", "ply\nformat ascii 1.0\nelement vertex 3\n");
  for (const std::string name : {"whole.ply", "whole.stl"}) {
    run_to(0, {"remesh", "cube.off", name, "--resolution", "8"});
    const std::string whole = read(name);
    expect_bad_mesh("cut_" + name, whole.substr(0, whole.size() - 7));
    expect_bad_mesh("half_" + name, whole.substr(0, whole.size() / 2));
  }
}

TEST_F(BadInputTest, TruncatedVolume) {
  write_cube();
  run_to(0, "voxelize cube.off cube.vdb --resolution 16");
  const std::string whole = read("cube.vdb");
  for (const std::size_t size : {whole.size() / 10, whole.size() / 2, whole.size() - 20}) {
    write("cut.vdb", whole.substr(0, size));
    expect_refusal(1, "extract cut.vdb out.ply", {"cut.vdb"});
  }
}

TEST_F(BadInputTest, WrongType) {
  write_cube();
  write("cube.txt", read("cube.off"));
  expect_refusal(1, "remesh cube.txt out.ply --resolution 10", "cube.txt .ply");
  expect_refusal(1, "info cube.txt", {"cube.txt"});
  expect_bad_mesh("cube_is_off.ply", read("cube.off"));
  write("cube_is_off.vdb", read("cube.off"));
  expect_refusal(1, "extract cube_is_off.vdb out.ply", {"cube_is_off.vdb"});
  expect_refusal(1, "info cube_is_off.vdb", {"cube_is_off.vdb"});
  expect_refusal(1, "extract cube.off out.ply", {"cube.off"});
}

TEST_F(BadInputTest, BadNumbersInAMesh) {
  expect_bad_mesh("nan.off", "OFF\n3 1 0\n0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n");
  expect_bad_mesh("inf.obj", "v 0 0 0\nv 1 0 inf\nv 0 1 0\nf 1 2 3\n");
  expect_bad_mesh("index.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n");
  expect_bad_mesh("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
  expect_bad_mesh("negative.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n");
  expect_bad_mesh("none.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n");
  expect_bad_mesh("none.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
}

TEST_F(BadInputTest, VoxelSize) {
  write_cube();
  const auto refuse = [&](const Words& size, const std::string& word) {
    expect_refusal(2, Words("remesh cube.off out.ply") + size, {word});
  };
  for (const char* bad : {"0", "-0.1", "nan", "-inf", "small", ""})
    refuse({"--voxel-size", bad}, "--voxel-size");
  for (const char* bad : {"0", "-5", "2.5", "many"}) refuse({"--resolution", bad}, "--resolution");
  refuse("--voxel-size 0.1 --resolution 10", "--resolution");
  for (const char* band : {"--exterior-band", "--interior-band"})
    for (const char* bad : {"0", "-3", "nan"}) refuse({"--resolution", "10", band, bad}, band);
  expect_refusal(2, "voxelize cube.off out.vdb --voxel-size 0", {"--voxel-size"});
  expect_refusal(2, "voxelize cube.off out.vdb", {"--voxel-size"});
}

TEST_F(BadInputTest, AbsurdlySmallVoxelsAreRefusedWithTheEstimate) {
  write_cube();
  const auto refuse = [&](const Words& size, const std::string& word) {
    expect_refusal(1, Words("remesh cube.off out.ply") + size, {word});
  };
  for (const char* size : {"1e-4", "2e-5"}) refuse({"--voxel-size", size}, "GiB");
  refuse("--voxel-size 1e-4 --voxelizer exact", "GiB");
  refuse("--resolution 50 --interior-band 1e9 --exterior-band 1e9", "GiB");
  expect_refusal(1, "voxelize cube.off out.vdb --voxel-size 1e-4", {"GiB"});
  // OpenVDB takes no smaller voxels, whatever memory there is.
  for (const char* size : {"1e-6", "1e-12", "1e-300"}) refuse({"--voxel-size", size}, "voxel size");
  refuse("--resolution 1000000000", "voxel size");
}

TEST_F(BadInputTest, MeshWithoutExtent) {
  write("point.off", "OFF\n3 1 0\n1 1 1\n1 1 1\n1 1 1\n3 0 1 2\n");
  expect_refusal(1, "remesh point.off out.ply --resolution 10", "point.off --voxel-size");
}

TEST_F(BadInputTest, UnwritableOutput) {
  write_cube();
  std::filesystem::create_directory(path("folder.ply"));
  std::filesystem::create_directory(path("folder.vdb"));
  for (const char* out :
       {"missing/out.ply", "folder.ply", "out.txt", "out.vdb.gz", "out", "out.vdb", "cube.off/out.ply"})
    expect_refusal(1, {"remesh", "cube.off", out, "--resolution", "10"}, {out});
  for (const char* out : {"missing/out.vdb", "folder.vdb", "out.ply"})
    expect_refusal(1, {"voxelize", "cube.off", out, "--resolution", "10"}, {out});
  expect_refusal(1, "remesh cube.off /dev/null --resolution 10", {"/dev/null"});
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST_F(BadInputTest, FailureLeavesAnOlderOutputAsItWas) {
  write_cube();
  write("out.ply", "older");
  expect_refusal(1, "remesh missing.ply out.ply --resolution 10", {"missing.ply"});
  expect_refusal(1, "remesh cube.off out.ply --resolution 10 --isovalue -1e6", {"isovalue"});
  EXPECT_EQ(read("out.ply"), "older");
}

TEST_F(BadInputTest, UnknownNamesAndOptionValues) {
  write_cube();
  const Words remesh = "remesh cube.off out.ply --resolution 10";
  const auto refuse = [&](const Words& more, const Words& words) { expect_refusal(2, remesh + more, words); };
  refuse("--extractor nonsense", "nonsense dual-contouring");
  refuse("--voxelizer nonsense", "nonsense openvdb");
  refuse({"--nonsense"}, {"--nonsense"});
  refuse("-o nonsense=1", "nonsense dual-contouring");
  refuse("-o nonsense", "nonsense key=value");
  expect_refusal(2, "remesh cube.off -o out.ply --resolution 10", {"out.ply", "key=value", "without -o"});
  refuse("-o placement=nonsense", "placement nonsense average");
  refuse("-o placement=average -o placement=optimal", "placement twice");
  refuse("--extractor openvdb -o adaptivity=2", "adaptivity 2");
  refuse("--isovalue nan", {"--isovalue"});
  refuse("--threads 0", {"--threads"});
  refuse("--threads -1", {"--threads"});
  refuse("--threads two", {"--threads"});
}

TEST_F(BadInputTest, Usage) {
  write_cube();
  expect_refusal(2, {}, {"--help"});
  expect_refusal(2, {"nonsense"}, {"nonsense"});
  expect_refusal(2, "remesh cube.off", {"OUT"});
  expect_refusal(2, {"validate"}, {"MESH"});
  expect_refusal(2, "validate cube.off --require closed,pretty", "pretty manifold");
  expect_refusal(2, "validate cube.off --certify", {"--reference"});
  expect_refusal(2, "validate cube.off --features cube.off --dihedral 200", {"--dihedral"});
  expect_refusal(2, "validate cube.off --samples 0", {"--samples"});
  expect_refusal(2, "run x.toml --tier huge", "--tier quick");
  expect_refusal(2, "run headline --shard 9/2", "--shard 9/2");
  expect_refusal(2, "run guarantee --set judge", {"judge"});
  expect_refusal(2, "run guarantee --set judge=no --set judge=yes", "--set twice");
  expect_refusal(1, "run guarantee --out rows --set jugde=no", "jugde judge");
  // An unset variable of a script leaves an empty word.
  expect_refusal(2, {"validate", "cube.off", "--reference", ""}, "--reference empty");
  expect_refusal(2, "import x.raw x.vdb --dims 2,2,2 --type uint8 --offset 99999999999999999999",
                 {"--offset"});
  expect_refusal(2, "report . --format pdf", "--format md");
  expect_refusal(2, "report . --meshes all", {"--meshes", "--format html"});
  expect_refusal(2, "report . --format html --meshes some", {"--meshes", "all, none"});
}

TEST_F(BadInputTest, GridThatIsNotThere) {
  write_cube();
  run_to(0, "voxelize cube.off cube.vdb --resolution 10");
  expect_refusal(1, "extract cube.vdb out.ply --grid density", "cube.vdb density sdf");
}

}  // namespace cli_bad_input_test
}  // namespace hermesh::cli
