// Small inputs that once went wrong, with their right answers (files in inputs/; volumes are closed forms).

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_right_answers_test {

using Json = nlohmann::json;

class RightAnswersTest : public ProgramTest {
 protected:
  static std::string input(const std::string& name) {
    return (std::filesystem::path(HERMESH_TEST_INPUTS) / name).string();
  }

  /// Remeshes an input to out.ply, expects success, and returns the document of --json with the validation
  /// report of the mesh, which has to be watertight, as "mesh".
  Json remesh(const std::string& name, const Words& options) {
    Words arguments{"remesh", input(name), "out.ply", "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << name << ": " << outcome.err;
    const Outcome validated = run("validate out.ply --require watertight --json");
    EXPECT_EQ(validated.exit_code, 0) << name << ": " << validated.err;
    Json result = Json::parse(outcome.out);
    result["mesh"] = Json::parse(validated.out);
    return result;
  }
};

TEST_F(RightAnswersTest, ABudgetEndsAtTheExactMesh) {
  for (const char* triangles : {"12", "30", "500"}) {
    const Json box = remesh("box-turned.off", {"--triangles", triangles});
    EXPECT_EQ(box["mesh"]["triangles"], 12) << triangles;
    EXPECT_NEAR(box["mesh"]["volume"].get<double>(), 0.28, 1e-4);
  }
  const Json gear = remesh("gear9.off", "--triangles 500");
  EXPECT_LE(gear["mesh"]["triangles"], 500);
  EXPECT_NEAR(gear["mesh"]["volume"].get<double>(), 0.9201, 1e-3);
}

TEST_F(RightAnswersTest, AThinPlateIsNotCertifiedAsSpecks) {
  // 1 × 0.8 × 0.0005, a valid mesh, which becomes no thicker.
  Json plate = remesh("plate-thin.off", "--error 1%");
  EXPECT_EQ(plate["mesh"]["components"], 1);
  EXPECT_GT(plate["mesh"]["volume"], 0.0);
  // Through a volume the shell is as thick as a voxel, and one component.
  plate = remesh("plate-thin.off", "--error 1% --through-volume");
  EXPECT_EQ(plate["mesh"]["components"], 1);
  EXPECT_GT(plate["result"]["thickened_share"], 0.9);
}

TEST_F(RightAnswersTest, TurnedWallsThinnerThanVoxelsAreKept) {
  // A U profile with walls of 1.5, whose volume is 14550, and a plate of 60 × 40 × 1.
  Json profile = remesh("t65_profile.obj", "--voxel-size 2.2");
  EXPECT_EQ(profile["mesh"]["components"], 1);
  EXPECT_GT(profile["result"]["thickened_share"], 0.5);
  EXPECT_NEAR(profile["result"]["thinnest_wall"].get<double>(), 1.5, 0.01);
  EXPECT_LT(profile["result"]["visible_loss"], 0.01);
  profile = remesh("t65_profile.obj", "--voxel-size 0.7");
  EXPECT_NEAR(profile["mesh"]["volume"].get<double>(), 14550, 75);
  EXPECT_EQ(profile["result"]["thickened_share"], 0.0);

  Json plate = remesh("t67_plate_turned.obj", "--voxel-size 1.2");
  EXPECT_EQ(plate["mesh"]["components"], 1);
  EXPECT_EQ(plate["mesh"]["genus"], 0);
  plate = remesh("t67_plate_turned.obj", "--voxel-size 0.45");
  EXPECT_NEAR(plate["mesh"]["volume"].get<double>(), 2400, 24);
}

TEST_F(RightAnswersTest, LossesOfThinPartsThatAreDroppedAreStated) {
  const Json loss = json_of(
      {"remesh", input("t67_plate_turned.obj"), "out.ply", "--voxel-size", "1.5", "--thin", "drop", "--json"},
      3)["result"]["visible_loss"];
  EXPECT_GT(loss, 0.05);
}

TEST_F(RightAnswersTest, SmallBodiesAreNotInsideOut) {
  const Json coarse = remesh("u33_octa_axis.obj", "--resolution 2");
  EXPECT_GT(coarse["mesh"]["volume"], 0.0);
  EXPECT_GT(coarse["result"]["visible_loss"], 0.1) << "the output is a tetrahedron";
  const Json fine = remesh("u33_octa_axis.obj", "--resolution 20");
  EXPECT_NEAR(fine["mesh"]["volume"].get<double>(), 4.0 / 3.0, 1e-3);
}

TEST_F(RightAnswersTest, PinsOfAboutAVoxelAreKept) {
  // A plate and 20 pins of 1.
  EXPECT_EQ(remesh("u32_plate_and_pins.obj", "--voxel-size 0.5")["mesh"]["components"], 21);
  const Json coarse = remesh("u32_plate_and_pins.obj", "--voxel-size 1.5");
  EXPECT_EQ(coarse["mesh"]["components"], 21);
  EXPECT_GT(coarse["result"]["thickened_share"], 0.0);
}

TEST_F(RightAnswersTest, AHeightFieldIsAShellWhicheverSideItFaces) {
  const Json up = remesh("t41v_hill.obj", "--resolution 40"),
             down = remesh("t41v_hill_down.obj", "--resolution 40");
  for (const Json* hill : {&up, &down}) {
    EXPECT_EQ((*hill)["mesh"]["components"], 1);
    EXPECT_EQ((*hill)["mesh"]["genus"], 0);
    EXPECT_GT((*hill)["result"]["thickened_share"], 0.99);
  }
  const double volume = up["mesh"]["volume"];
  EXPECT_NEAR(down["mesh"]["volume"].get<double>(), volume, 1e-3 * volume);
}

TEST_F(RightAnswersTest, ABladeIsOnePart) {
  EXPECT_EQ(remesh("t47_knife.obj", "--resolution 60")["mesh"]["components"], 1);
}

TEST_F(RightAnswersTest, CubesOfOneVoxelAreThereOrTheirLossIsStated) {
  // 50 cubes of a checkerboard, which touch along edges.
  const Json board = remesh("l040.off", "--voxel-size 1");
  const double volume = board["mesh"]["volume"];
  EXPECT_TRUE(volume > 49.5 || board["result"]["visible_loss"] > 0.01) << volume;
}

TEST_F(RightAnswersTest, PiecesThatTouchAlongEdgesAreAccepted) {
  for (const Words& arguments :
       {Words{input("lat007.off"), "lattice", "--cutters", "planes:3", "--resolution", "40"},
        {input("checker-007.off"), "board", "--cutters", "voronoi:4", "--resolution", "40"}}) {
    Words all{"fracture", "--judge"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    run_to(0, all);
  }
}

TEST_F(RightAnswersTest, FractureKeepsTheVolumeAtAnyTolerance) {
  const auto volume = [&](const std::string& tolerance) {
    run_to(0, {"fracture", input("selftube-004.off"), "pieces" + tolerance, "--cutters", "voronoi:12",
               "--tolerance", tolerance, "--judge", "--resolution", "60"});
    return Json::parse(read("pieces" + tolerance + "/pieces.json"))["pieces_volume"].get<double>();
  };
  const double finest = volume("0");
  EXPECT_NEAR(volume("1"), finest, 0.01 * finest);
}

}  // namespace cli_right_answers_test
}  // namespace hermesh::cli
