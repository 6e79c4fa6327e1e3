// hermesh remesh --error and --triangles from the outside.

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_bounded_test {

using Json = nlohmann::json;
using CliBoundedTest = ProgramTest;

TEST_F(CliBoundedTest, TheJudgeFindsTheErrorKept) {
  write_sphere();
  const Json figures = json_of("remesh sphere.off out.ply --error 0.5% --json").at("figures");
  const double asked = figures.at("error_asked");
  EXPECT_NEAR(asked, 0.005 * 2.0 * std::sqrt(3.0), 1e-4);
  EXPECT_LE(figures.at("certified_to_polygons").get<double>(), asked);
  EXPECT_LE(figures.at("certified_from_polygons").get<double>(), asked);
  const Json report = json_of(
      "validate out.ply --reference sphere.off --certify --require watertight --json --samples 20000");
  // The validator's brackets are 1e-4 of the diagonal wide.
  EXPECT_LE(report.at("certified_to_reference").at("lower").get<double>(),
            figures.at("certified_to_polygons").get<double>());
  EXPECT_LE(report.at("certified_from_reference").at("lower").get<double>(),
            figures.at("certified_from_polygons").get<double>());
  EXPECT_LE(report.at("certified_to_reference").at("upper").get<double>(), asked + 4e-4);
}

TEST_F(CliBoundedTest, UnitsSayWhatTheNumbersAre) {
  write_cube();
  EXPECT_NEAR(json_of("remesh cube.off out.ply --error 1mm --units inch --json")
                  .at("figures")
                  .at("error_asked")
                  .get<double>(),
              1.0 / 25.4, 1e-9);
  expect_refusal(2, "remesh cube.off out.ply --error 1mm", {"--units"}, true);
}

TEST_F(CliBoundedTest, ABudgetIsKept) {
  write_sphere();
  const double triangles =
      json_of("remesh sphere.off out.ply --triangles 200 --json").at("figures").at("triangles");
  EXPECT_LE(triangles, 200);
  EXPECT_GE(triangles, 100);
}

TEST_F(CliBoundedTest, AHoleIsRefusedAndNothingIsWritten) {
  // A tetrahedron without one of its faces.
  write("open.off", "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n");
  const Outcome outcome = run_to(1, "remesh open.off out.ply --error 1% --thin drop");
  EXPECT_PRED2(has, outcome.err, "open.off");
  EXPECT_PRED2(has, outcome.err, "hole");
  EXPECT_EQ(files().count("out.ply"), 0u);
  run_to(0, "remesh open.off shell.ply --error 1%");
  const Outcome closed = run_to(0, "remesh open.off out.ply --error 1% --over-holes");
  EXPECT_PRED2(has, closed.err, "holes");
}

TEST_F(CliBoundedTest, ThinPartsAreExceptedAndListed) {
  // A cube with a hair-thin plate on top, which the smallest voxels do not show.
  write("thin.off",
        "OFF\n16 12 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
        "0 0.3031 1.2\n1 0.3031 1.2\n1 0.30311 1.2\n0 0.30311 1.2\n0 0.3031 2\n1 0.3031 2\n1 0.30311 2\n0 "
        "0.30311 2\n"
        "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n"
        "4 8 11 10 9\n4 12 13 14 15\n4 8 9 13 12\n4 9 10 14 13\n4 10 11 15 14\n4 11 8 12 15\n");
  const Outcome refused = run_to(1, "remesh thin.off out.ply --error 2% --thin drop --through-volume");
  EXPECT_PRED2(has, refused.err, "--except-thin");
  EXPECT_EQ(files().count("out.ply"), 0u);
  const Json report =
      json_of("remesh thin.off out.ply --error 2% --thin drop --through-volume --except-thin --json");
  EXPECT_EQ(report.at("exit_code"), 0);
  const Json& exceptions = report.at("result").at("exceptions");
  ASSERT_FALSE(exceptions.empty());
  double area = 0.0;
  for (const Json& ball : exceptions) {
    EXPECT_NEAR(ball.at("position")[1].get<double>(), 0.3031, 0.01);
    EXPECT_GT(ball.at("position")[2], 1.1);
    EXPECT_GT(ball.at("radius"), 0.0);
    EXPECT_GT(ball.at("distance"), report.at("figures").at("error_asked"));
    EXPECT_EQ(ball.at("reason"), "thin");
    area += ball.at("area").get<double>();
  }
  EXPECT_NEAR(report.at("result").at("excepted_area").get<double>(), area, 1e-9);
  EXPECT_NEAR(area, 1.6, 0.1);  // both sides of the plate
  EXPECT_FALSE(report.at("notes").empty());
  run_to(0, "validate out.ply --require watertight");
  // Without exceptions, the list is empty.
  write_cube();
  EXPECT_TRUE(json_of("remesh cube.off cube.ply --error 1% --except-thin --json")
                  .at("result")
                  .at("exceptions")
                  .empty());
}

TEST_F(CliBoundedTest, AValidMeshBecomesAVolumeOnRequestOnly) {
  write_cube();
  const auto voxel_size_of = [&](const std::string& options) -> double {
    return json_of("remesh cube.off out.ply --error 1% --json" + options).at("figures").at("voxel_size");
  };
  EXPECT_EQ(voxel_size_of(""), 0.0);
  EXPECT_GT(voxel_size_of(" --through-volume"), 0.0);
}

TEST_F(CliBoundedTest, WrongUsageIsSaid) {
  write_cube();
  const std::vector<Words> wrong = {
      {"--error", "0"},
      {"--error", "much"},
      {"--error", "1mm"},
      {"--error", "1parsec", "--units", "mm"},
      {"--error", "1%", "--resolution", "10"},
      {"--error", "1%", "--extractor", "openvdb"},
      {"--error", "1%", "--signs", "unsigned"},
      {"--resolution", "10", "--over-holes"},
      {"--resolution", "10", "--except-thin"},
      {"--resolution", "10", "--through-volume"},
      {"--resolution", "10", "--certificate", "proof"},
      {"--error", "1%", "--certificate", "proof", "--scale", "2"},
      {"--resolution", "auto", "--error", "1%"},
      {"--resolution", "auto", "--voxel-size", "0.1"},
      {"--resolution", "automatic"},
  };
  for (const Words& options : wrong) {
    const Words words = Words("remesh cube.off out.ply") + options;
    SCOPED_TRACE(options[0] + " " + options[1]);
    run_to(2, words);
    EXPECT_EQ(files().count("out.ply"), 0u);
  }
  run_to(2, "remesh cube.off out.glb --error 1% --certificate proof");  // the checker does not read glTF
  run_to(2, "remesh cube.off --out-dir many --error 1% --certificate proof");
  EXPECT_EQ(files().count("proof"), 0u);
}

// experiments/lab/tests/test_certificates.py verifies certificates.
TEST_F(CliBoundedTest, ACertificateCoversBothMeshes) {
  write_cube();
  const Json report = json_of("remesh cube.off out.ply --error 1% --certificate proof --json");
  const Json& certificate = report.at("result").at("certificate");
  EXPECT_EQ(certificate.at("file"), "proof");
  EXPECT_GE(certificate.at("pieces"), 24);  // 12 triangles each
  EXPECT_EQ(certificate.at("uncovered_input"), 0.0);
  EXPECT_EQ(certificate.at("uncovered_output"), 0.0);
  EXPECT_EQ(files().count("proof"), 1u);
}

}  // namespace cli_bounded_test
}  // namespace hermesh::cli
