
#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_combine_test {

class CombineTest : public ProgramTest {
 protected:
  /// Writes a box from x0 to x1 along x, and from −1 to 1 along y and z, as an OFF file.
  void write_box(const std::string& name, double x0, double x1) {
    const auto corner = [&](int i) {
      return std::to_string(i & 1 ? x1 : x0) + (i & 2 ? " 1" : " -1") + (i & 4 ? " 1\n" : " -1\n");
    };
    std::string text = "OFF\n8 6 0\n";
    for (int i = 0; i < 8; ++i) text += corner(i);
    write(name, text + "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n");
  }
  Outcome combine(int exit_code, const std::string& operation) {
    return run_to(exit_code, {"combine", operation, "a.off", "b.off", "out.ply", "--voxel-size", "0.05"});
  }
  /// Volume of the mesh that was written, as measured by the validator.
  double volume() {
    return json_of("validate out.ply --json --require closed,oriented").at("volume").get<double>();
  }
};

TEST_F(CombineTest, VolumesOfTwoBoxesAreThoseOfTheirParts) {
  write_box("a.off", -1.0, 1.0);
  write_box("b.off", 0.21, 2.0);  // the lattice of a, not of b: the origins differ
  const struct {
    const char* operation;
    double volume;
  } expected[] = {{"union", 12.0}, {"intersection", 4 * 0.79}, {"difference", 4 * 1.21}};
  for (const auto& [operation, exact] : expected) {
    combine(0, operation);
    EXPECT_NEAR(volume(), exact, 0.002 * exact) << operation;
  }
}

TEST_F(CombineTest, AnEmptyResultIsSaidAndNotWritten) {
  write_box("a.off", -1.0, 1.0);
  write_box("b.off", 3.0, 4.0);
  const Outcome outcome = combine(1, "intersection");
  EXPECT_PRED2(has, outcome.err, "is empty, nothing was written");
  EXPECT_FALSE(files().contains("out.ply"));
}

TEST_F(CombineTest, AResultThinnerThanAVoxelIsNotCalledEmpty) {
  write_box("a.off", -1.0, 0.02);
  write_box("b.off", 0.01, 1.0);  // between the samples at 0 and 0.05
  const Outcome outcome = combine(1, "intersection");
  EXPECT_PRED2(has, outcome.err, "is thinner than a voxel everywhere, nothing was written");
  EXPECT_FALSE(files().contains("out.ply"));
}

TEST_F(CombineTest, WhatIsLostBetweenSamplesIsSaid) {
  write_box("a.off", -1.0, 0.52);
  write_box("b.off", -1.5, 0.51);  // a without b is a plate of 0.01
  write_box("c.off", -1.5, 0.21);
  const Outcome lost = run_to(1, "combine difference a.off b.off out.ply --voxel-size 0.05");
  EXPECT_PRED2(has, lost.err, "volume");
  const Outcome kept = run_to(0, "combine difference a.off c.off out.ply --voxel-size 0.05");
  EXPECT_EQ(kept.err, "");
  write_box("d.off", 0.53, 1.0);
  const Outcome filled = run_to(0, "combine union a.off d.off out.ply --voxel-size 0.05");
  EXPECT_PRED2(has, filled.err, "gaps");
}

TEST_F(CombineTest, AnOperandWithoutInsideIsRefused) {
  write_box("a.off", -1.0, 1.0);
  write("sheet.off", "OFF\n4 1 0\n-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n4 0 1 2 3\n");
  const Words keep = "combine union a.off sheet.off kept.ply --voxel-size 0.1";
  run_to(0, keep);  // an open sheet becomes a shell
  const Outcome outcome = run_to(1, "combine union a.off sheet.off out.ply --voxel-size 0.1 --thin drop");
  EXPECT_PRED2(has, outcome.err, "'sheet.off'");
  run_to(2, "combine union a.off a.off out.ply --voxel-size 0.1 --signs unsigned");
  EXPECT_FALSE(files().contains("out.ply"));
}

TEST_F(CombineTest, EitherOrderGivesTheSameBytes) {
  write_box("a.off", -1.03, 1.01);
  write_sphere();
  for (const char* operation : {"union", "intersection"}) {
    run_to(0, {"combine", operation, "a.off", "sphere.off", "1.ply", "--resolution", "20"});
    run_to(0, {"combine", operation, "sphere.off", "a.off", "2.ply", "--resolution", "20"});
    EXPECT_EQ(read("1.ply"), read("2.ply")) << operation;
  }
}

TEST_F(CombineTest, OptionsOfTheExtractorHaveAnEffect) {
  write_box("a.off", -1.03, 0.31);
  write_sphere();
  const auto bytes = [&](const Words& more) {
    run_to(0, Words("combine union a.off sphere.off out.ply --voxel-size 0.11") + more);
    return read("out.ply");
  };
  std::set<std::string> different = {bytes({})};
  for (const Words& more : std::vector<Words>{{"-o", "hermite=level-set"},
                                              {"-o", "representation=sparse"},
                                              {"-o", "representation=sparse", "-o", "normals=nearest"},
                                              {"-o", "tolerance=0"},
                                              {"--extractor", "dual-contouring"},
                                              {"--extractor", "marching-cubes"},
                                              {"--extractor", "marching-cubes", "-o", "crossings=exact"}})
    EXPECT_TRUE(different.insert(bytes(more)).second) << more.back();
  const Outcome idle =
      run_to(2, "combine union a.off sphere.off out.ply --voxel-size 0.11 -o normals=nearest");
  EXPECT_PRED2(has, idle.err, "representation=sparse");
}

TEST_F(CombineTest, TheJudgeReadsTheFile) {
  write_box("a.off", -1.03, 0.31);
  write_sphere();
  const Outcome outcome = run_to(0, "combine difference a.off sphere.off out.ply --voxel-size 0.11 --judge");
  EXPECT_PRED2(has, outcome.out, "self-intersection");
}

TEST_F(CombineTest, SolidsTooFarApartForOneMeshAreRefusedAndOthersKeepTheirShape) {
  write_box("a.off", -1.0, 1.0);
  write_box("far.off", 1e6, 1e6 + 2.0);
  const Outcome apart = run_to(1, "combine union a.off far.off out.ply --voxel-size 0.05");
  EXPECT_PRED2(has, apart.err, "voxel");
  EXPECT_FALSE(files().contains("out.ply"));
  // 10,000 voxels apart; only the far one has a part left.
  write_box("far.off", 500.0, 502.0);
  run_to(0, "combine union a.off far.off out.ply --voxel-size 0.05");
  EXPECT_NEAR(volume(), 16.0, 0.01);
  run_to(0, "combine difference far.off a.off out.ply --voxel-size 0.05");
  EXPECT_NEAR(volume(), 8.0, 0.005);
}

TEST_F(CombineTest, AWrongOperationOrOptionIsAUsageError) {
  write_box("a.off", -1.0, 1.0);
  write_box("b.off", 0.0, 2.0);
  combine(2, "xor");
  run_to(2, "combine union a.off b.off out.ply --voxel-size 0.1 -o placement=best");
  run_to(1, "combine union a.off missing.off out.ply --voxel-size 0.1");
  EXPECT_FALSE(files().contains("out.ply"));
}

}  // namespace cli_combine_test
}  // namespace hermesh::cli
