#include "experiments/cli/streams.h"

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace streams_test {

class StreamsTest : public ProgramTest {
 protected:
  StreamsTest() {
    write_sphere();
    std::filesystem::create_directory(path("tmp"));
  }
  /// Runs a script whose temporary files are in the folder tmp, and expects that nothing stays there.
  Outcome piped(const std::string& script) {
    const Outcome outcome = run_shell("export TMPDIR=$PWD/tmp; set -o pipefail; " + script);
    EXPECT_TRUE(std::filesystem::is_empty(path("tmp"))) << script;
    EXPECT_PRED2(lacks, outcome.err, path("tmp").string()) << "a temporary file is named: " << outcome.err;
    return outcome;
  }
  void expect_refusal(int exit_code, const std::string& script, const std::string& words) {
    const Outcome outcome = piped(script);
    EXPECT_EQ(outcome.exit_code, exit_code) << script << ": " << outcome.err;
    EXPECT_PRED2(has, outcome.err, words) << script << ": " << outcome.err;
    EXPECT_EQ(outcome.out, "") << script;
  }
};

TEST_F(StreamsTest, APipeGivesTheBytesThatFilesGive) {
  run_to(0, "voxelize sphere.off sphere.vdb --voxel-size 0.1");
  run_to(0, "extract sphere.vdb files.obj");
  const Outcome outcome = piped(
      "$H voxelize - - --format off --voxel-size 0.1 < sphere.off | $H extract - - --format obj | tee "
      "piped.obj | "
      "$H validate - --require watertight --quiet");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_PRED2(has, outcome.out, "mesh                    the standard input");
  ASSERT_FALSE(read("files.obj").empty());
  EXPECT_EQ(read("piped.obj"), read("files.obj"));
}

TEST_F(StreamsTest, NothingButTheFileGoesToTheStandardOutput) {
  write_open_cube();
  run_to(0, "remesh open.off file.stl --voxel-size 0.13");
  const Outcome outcome = piped("$H remesh open.off - --voxel-size 0.13 --format stl");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_TRUE(outcome.out == read("file.stl"));
  EXPECT_PRED2(has, outcome.err, "extracted") << "summaries go to the standard error: " << outcome.err;
  EXPECT_PRED2(has, outcome.err, "note: ");
}

TEST_F(StreamsTest, EveryFormatIsToldByItsContent) {
  for (const char* format :
       {"ply", "obj", "off", "stl", "glb", "gltf", "3mf", "ply.gz", "stl.gz", "3mf.gz"}) {
    const Outcome outcome = piped(std::string("$H remesh sphere.off - --voxel-size 0.2 --quiet --format ") +
                                  format + " | $H validate - --require watertight --quiet");
    EXPECT_EQ(outcome.exit_code, 0) << format << outcome.err;
  }
  EXPECT_EQ(ending_of("ply\nformat ascii 1.0\n"), ".ply");
  EXPECT_EQ(ending_of("# a comment\nv 0 0 0\n"), ".obj");
  EXPECT_EQ(ending_of("\n OFF\n"), ".off");
  EXPECT_EQ(ending_of("solid x\n"), ".stl");
  EXPECT_EQ(ending_of(std::string(80, ' ') + std::string("\x01\0\0\0", 4)), ".stl");
}

TEST_F(StreamsTest, HalfOfAStreamIsRefused) {
  run_to(0, "remesh sphere.off s.ply --voxel-size 0.1");
  run_to(0, "voxelize sphere.off s.vdb --voxel-size 0.1");
  for (const auto& [file, command] :
       {std::pair("s.ply", "$H validate -"), std::pair("s.vdb", "$H extract - o.obj")}) {
    const std::uint64_t half = std::filesystem::file_size(path(file)) / 2;
    expect_refusal(1, "head -c " + std::to_string(half) + " " + file + " | " + command, "the standard input");
  }
  EXPECT_FALSE(files().contains("o.obj"));
  expect_refusal(1, "true | $H extract - o.obj", "the standard input is empty");
  expect_refusal(1, "$H voxelize none.off - --voxel-size 0.1 | $H extract - o.obj", "none.off");
}

TEST_F(StreamsTest, AReaderThatGoesAwayIsToldOfInASentence) {
  const Outcome outcome = piped(
      "set +o pipefail; ( $H remesh sphere.off - --voxel-size 0.01 --extractor marching-cubes --quiet; echo "
      "$? > code ) | head -c 10 > /dev/null");
  EXPECT_EQ(read("code"), "1\n");
  EXPECT_PRED2(has, outcome.err, "the program that reads it has ended");
}

TEST_F(StreamsTest, RefusesWhatCannotBeMeant) {
  const std::string in = " < sphere.off > out";
  const auto expect = [&](const std::string& script, const std::string& words) {
    expect_refusal(2, script + in, words);
    EXPECT_EQ(read("out"), "") << script;
  };
  expect("$H combine union - - o.ply --voxel-size 0.2", "only one input can be");
  expect("$H remesh - - --voxel-size 0.2 --json", "--json FILE");
  expect("$H remesh - - --voxel-size 0.2 --format vdb", "takes ply, obj, off, stl, glb, gltf or 3mf");
  expect("$H remesh sphere.off o.ply --voxel-size 0.2 --format ply", "--format has no effect");
  expect("$H remesh sphere.off - --voxel-size 0.2 --input-format ply", "--input-format has no effect");
  expect("$H voxelize - - --voxel-size 0.2 --grids sdf,hermite", "a second file");
  expect("$H fracture - - --voxel-size 0.2 --cutters voronoi:2", "a folder");
}

TEST_F(StreamsTest, OtherCommandsTakeStreamsToo) {
  for (const char* script :
       {"$H combine union - sphere.off - --voxel-size 0.2 < sphere.off | $H validate - --require watertight",
        "$H voxelize sphere.off - --voxel-size 0.2 | $H info - | grep 'level set'",
        "$H fracture - pieces --voxel-size 0.2 --cutters planes:1 --no-picture < sphere.off"})
    EXPECT_EQ(piped(script).exit_code, 0) << script;
}

}  // namespace streams_test
}  // namespace hermesh::cli
