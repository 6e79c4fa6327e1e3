#include <nlohmann/json.hpp>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace {

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
  Outcome combine(const std::string& operation) {
    return run({"combine", operation, "a.off", "b.off", "out.ply", "--voxel-size", "0.05"});
  }
  /// Volume of the mesh that was written, as the judges have it.
  double volume() {
    const Outcome judged = run({"validate", "out.ply", "--json", "--require", "closed,oriented"});
    EXPECT_EQ(judged.exit_code, 0);
    return nlohmann::json::parse(judged.out).at("volume").get<double>();
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
    const Outcome outcome = combine(operation);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_NEAR(volume(), exact, 0.002 * exact) << operation;
  }
}

TEST_F(CombineTest, AnEmptyResultIsSaidAndNotWritten) {
  write_box("a.off", -1.0, 1.0);
  write_box("b.off", 3.0, 4.0);
  const Outcome outcome = combine("intersection");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("is empty, nothing was written"), std::string::npos) << outcome.err;
  EXPECT_FALSE(files().contains("out.ply"));
}

TEST_F(CombineTest, AResultThinnerThanAVoxelIsNotCalledEmpty) {
  write_box("a.off", -1.0, 0.02);
  write_box("b.off", 0.01, 1.0);  // between the samples at 0 and 0.05
  const Outcome outcome = combine("intersection");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("is thinner than a voxel everywhere, nothing was written"), std::string::npos)
      << outcome.err;
  EXPECT_FALSE(files().contains("out.ply"));
}

TEST_F(CombineTest, WhatIsLostBetweenSamplesIsSaid) {
  write_box("a.off", -1.0, 0.52);
  write_box("b.off", -1.5, 0.51);  // a without b is a plate of 0.01
  write_box("c.off", -1.5, 0.21);
  const Outcome lost = run({"combine", "difference", "a.off", "b.off", "out.ply", "--voxel-size", "0.05"});
  EXPECT_EQ(lost.exit_code, 1);
  EXPECT_NE(lost.err.find("they were lost, a volume of about 0.0"), std::string::npos) << lost.err;
  const Outcome kept = run({"combine", "difference", "a.off", "c.off", "out.ply", "--voxel-size", "0.05"});
  EXPECT_EQ(kept.exit_code, 0) << kept.err;
  EXPECT_EQ(kept.err, "");
  write_box("d.off", 0.53, 1.0);
  const Outcome filled = run({"combine", "union", "a.off", "d.off", "out.ply", "--voxel-size", "0.05"});
  EXPECT_EQ(filled.exit_code, 0) << filled.err;
  EXPECT_NE(filled.err.find("gaps that hold no sample: they were closed"), std::string::npos) << filled.err;
}

TEST_F(CombineTest, AnOperandWithoutInsideIsRefused) {
  write_box("a.off", -1.0, 1.0);
  write("sheet.off", "OFF\n4 1 0\n-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n4 0 1 2 3\n");
  const std::vector<std::string> keep = {"combine",  "union",        "a.off", "sheet.off",
                                         "kept.ply", "--voxel-size", "0.1"};
  EXPECT_EQ(run(keep).exit_code, 0) << "an open sheet becomes a shell";
  const Outcome outcome =
      run({"combine", "union", "a.off", "sheet.off", "out.ply", "--voxel-size", "0.1", "--thin", "drop"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("'sheet.off': it has no inside"), std::string::npos) << outcome.err;
  EXPECT_EQ(
      run({"combine", "union", "a.off", "a.off", "out.ply", "--voxel-size", "0.1", "--signs", "unsigned"})
          .exit_code,
      2);
  EXPECT_FALSE(files().contains("out.ply"));
}

TEST_F(CombineTest, EitherOrderGivesTheSameBytes) {
  write_box("a.off", -1.03, 1.01);
  write_sphere();
  for (const char* operation : {"union", "intersection"}) {
    ASSERT_EQ(run({"combine", operation, "a.off", "sphere.off", "1.ply", "--resolution", "20"}).exit_code, 0);
    ASSERT_EQ(run({"combine", operation, "sphere.off", "a.off", "2.ply", "--resolution", "20"}).exit_code, 0);
    EXPECT_EQ(read("1.ply"), read("2.ply")) << operation;
  }
}

TEST_F(CombineTest, OptionsOfTheExtractorHaveAnEffect) {
  write_box("a.off", -1.03, 0.31);
  write_sphere();
  const auto bytes = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"combine", "union",        "a.off", "sphere.off",
                                      "out.ply", "--voxel-size", "0.11"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return read("out.ply");
  };
  std::set<std::string> different = {bytes({})};
  for (const std::vector<std::string>& more :
       std::vector<std::vector<std::string>>{{"-o", "hermite=level-set"},
                                             {"-o", "representation=sparse"},
                                             {"-o", "representation=sparse", "-o", "normals=nearest"},
                                             {"-o", "tolerance=0"},
                                             {"--extractor", "dual-contouring"},
                                             {"--extractor", "marching-cubes"},
                                             {"--extractor", "marching-cubes", "-o", "crossings=exact"}})
    EXPECT_TRUE(different.insert(bytes(more)).second) << more.back();
  const Outcome idle = run({"combine", "union", "a.off", "sphere.off", "out.ply", "--voxel-size", "0.11",
                            "-o", "normals=nearest"});
  EXPECT_EQ(idle.exit_code, 2);
  EXPECT_NE(idle.err.find("has no effect without representation=sparse or fixed"), std::string::npos)
      << idle.err;
}

TEST_F(CombineTest, TheJudgeReadsTheFile) {
  write_box("a.off", -1.03, 0.31);
  write_sphere();
  const Outcome outcome =
      run({"combine", "difference", "a.off", "sphere.off", "out.ply", "--voxel-size", "0.11", "--judge"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("no self-intersection: kept"), std::string::npos) << outcome.out;
}

TEST_F(CombineTest, SolidsTooFarApartForOneMeshAreRefusedAndOthersKeepTheirShape) {
  write_box("a.off", -1.0, 1.0);
  write_box("far.off", 1e6, 1e6 + 2.0);
  const Outcome apart = run({"combine", "union", "a.off", "far.off", "out.ply", "--voxel-size", "0.05"});
  EXPECT_EQ(apart.exit_code, 1);
  EXPECT_NE(apart.err.find("more than a hundredth of a voxel"), std::string::npos) << apart.err;
  EXPECT_FALSE(files().contains("out.ply"));
  // 10,000 voxels apart; of the far one alone something is left.
  write_box("far.off", 500.0, 502.0);
  ASSERT_EQ(run({"combine", "union", "a.off", "far.off", "out.ply", "--voxel-size", "0.05"}).exit_code, 0);
  EXPECT_NEAR(volume(), 16.0, 0.01);
  ASSERT_EQ(run({"combine", "difference", "far.off", "a.off", "out.ply", "--voxel-size", "0.05"}).exit_code,
            0);
  EXPECT_NEAR(volume(), 8.0, 0.005);
}

TEST_F(CombineTest, AWrongOperationOrOptionIsAUsageError) {
  write_box("a.off", -1.0, 1.0);
  write_box("b.off", 0.0, 2.0);
  EXPECT_EQ(combine("xor").exit_code, 2);
  EXPECT_EQ(
      run({"combine", "union", "a.off", "b.off", "out.ply", "--voxel-size", "0.1", "-o", "placement=best"})
          .exit_code,
      2);
  EXPECT_EQ(run({"combine", "union", "a.off", "missing.off", "out.ply", "--voxel-size", "0.1"}).exit_code, 1);
  EXPECT_FALSE(files().contains("out.ply"));
}

}  // namespace
}  // namespace hermesh::cli
