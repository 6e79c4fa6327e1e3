// Small inputs that once went wrong, with their right answers (files in inputs/; volumes are closed forms).

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "algorithms/io/mesh_file.h"
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

TEST_F(RightAnswersTest, TurnedProfilesWithAConcaveCreaseAreExact) {
  // In these positions four vertices of a quad lie on a crease that ends at a corner, or a vertex just beyond
  // the corner blocked its place: one corner was off by 0.002 voxel.
  struct Placed {
    double voxel;
    Eigen::Quaterniond turn;
    Eigen::Vector3d shift;
  };
  const Placed placed[] = {{0.08333333333333333,
                            {-0.0964915, 0.83942588, -0.07686, -0.52928832},
                            {-0.98790598, 0.31921019, -0.61611376}},
                           {0.021011933581689395,
                            {0.53535957, 0.75907285, 0.3622206, 0.07742591},
                            {0.20578803, 0.91555308, 0.06622219}},
                           {0.03479238838239562,
                            {-0.41237378, -0.32085148, -0.62698727, -0.57783142},
                            {-0.78001363, -0.75431496, 0.83458972}}};
  const double outline[6][2] = {{0, 0}, {1, 0}, {1, 0.4}, {0.4, 0.4}, {0.4, 1}, {0, 1}};
  for (const auto& [voxel, turn, shift] : placed) {
    std::ostringstream text;
    text.precision(17);
    text << "OFF\n12 8 0\n";
    for (const double height : {0.0, 0.5})
      for (const auto& [x, y] : outline) {
        const Eigen::Vector3d p = turn.normalized() * Eigen::Vector3d(x, y, height) + shift;
        text << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
      }
    text << "6 5 4 3 2 1 0\n6 6 7 8 9 10 11\n";
    for (int i = 0; i < 6; ++i) {
      const int next = (i + 1) % 6;
      text << "4 " << i << ' ' << next << ' ' << next + 6 << ' ' << i + 6 << '\n';
    }
    std::ofstream(path("profile.off")) << text.str();
    std::ostringstream size;
    size.precision(17);
    size << voxel;
    EXPECT_EQ(run("remesh profile.off out.ply --voxel-size " + size.str()).exit_code, 0);
    const Json report = Json::parse(run("validate out.ply --reference profile.off --json").out);
    EXPECT_EQ(report["triangles"], 20);
    EXPECT_LE(report["to_reference"]["max"], 1e-5 * voxel);
    EXPECT_LE(report["from_reference"]["max"], 1e-5 * voxel);
  }
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

TEST_F(RightAnswersTest, InchesStayInches) {
  // 1 × 0.5 × 0.25 inches.
  run_to(0, {"remesh", input("f01_inch.3mf"), "out.3mf", "--resolution", "40"});
  EXPECT_NEAR(json_of("validate out.3mf --json")["volume"].get<double>(), 0.125, 1e-4);
  EXPECT_NEAR(json_of("validate out.3mf --units mm --json")["volume"].get<double>(), 2048.0, 2.0);
  const Json part = remesh("f01_inch.3mf", "--error 0.1mm --units mm");
  EXPECT_NEAR(part["mesh"]["volume"].get<double>(), 2048.4, 0.1);
  // A format without units gets a note.
  EXPECT_PRED2(has, remesh("f01_inch.3mf", "--resolution 40")["notes"].dump(), "inch");
}

TEST_F(RightAnswersTest, CoordinatesThatWereRoundedFarAwayAreNoted) {
  // A box of 0.4 × 0.3 × 0.2 at UTM coordinates in single precision, in steps of 0.5.
  const Outcome outcome = run({"remesh", input("t49_utm.stl"), "out.ply", "--voxel-size", "0.05"});
  EXPECT_PRED2(has, outcome.err, "single precision") << outcome.err;
  EXPECT_PRED2(has, outcome.err, "0.5") << outcome.err;
}

TEST_F(RightAnswersTest, ColoursAreTransferredOrNoted) {
  // Red above, blue below.
  const Json made = remesh("t50_two_colours.ply", "--resolution 20");
  EXPECT_EQ(made["result"]["attributes"], Json({"colour"}));
  run_to(0, "remesh out.ply coloured.obj --resolution 20");
  std::istringstream lines(read("coloured.obj"));
  for (std::string word, line; std::getline(lines, line);) {
    std::istringstream words(line);
    double x, y, z, red, green, blue;
    if (!(words >> word) || word != "v") continue;
    ASSERT_TRUE(words >> x >> y >> z >> red >> green >> blue) << line;
    EXPECT_NEAR(red + blue, 1.0, 0.02) << line;
  }
  // Through all formats that store colours, within 2 of 255 away from the border.
  for (const char* file : {"c.ply", "c.obj", "c.glb", "c.gltf", "c.3mf"}) {
    run_to(0, {"remesh", input("t50_two_colours.ply"), file, "--resolution", "20"});
    run_to(0, {"remesh", file, "back.ply", "--resolution", "20"});
    RunContext context;
    const MeshFile mesh = read_mesh_file(path("back.ply"), context, {.attributes = true});
    ASSERT_EQ(mesh.attributes.size(), 1u) << file;
    const auto& values = std::get<0>(mesh.attributes[0].values);
    std::size_t above = 0, below = 0;
    for (std::size_t i = 0; i < mesh.points.size(); ++i) {
      const double z = mesh.points[i].z();
      if (std::abs(z) < 0.3) continue;
      ++(z > 0 ? above : below);
      EXPECT_NEAR(values[3 * i], z > 0 ? 1.0 : 0.0, 2.0 / 255.0) << file << ' ' << z;
      EXPECT_NEAR(values[3 * i + 2], z > 0 ? 0.0 : 1.0, 2.0 / 255.0) << file << ' ' << z;
    }
    EXPECT_GT(std::min(above, below), 20u) << file;
  }
  const Outcome lost = run({"remesh", input("t50_two_colours.ply"), "out.stl", "--resolution", "20"});
  EXPECT_PRED2(has, lost.err, "colour") << lost.err;
  const Outcome dropped =
      run({"remesh", input("t50_two_colours.ply"), "out.stl", "--resolution", "20", "--attributes", "none"});
  EXPECT_PRED2(lacks, dropped.err, "colour") << dropped.err;
}

TEST_F(RightAnswersTest, AMaskThatFillsItsImageIsClosedAtItsEnd) {
  run_to(0, {"import", input("v22_full.nii.gz"), "full.vdb"});
  run_to(0, "extract full.vdb full.ply --isovalue 0.5");
  EXPECT_NEAR(json_of("validate full.ply --require watertight --json")["volume"].get<double>(), 840.0, 1e-3);
}

TEST_F(RightAnswersTest, AHeightFieldIsASolidIfThatIsRequested) {
  // The same hill facing up and down: with a base it is the solid below it, and as a shell a wall.
  const double up = remesh("t41v_hill.obj", "--fill-below=-1 --resolution 80")["mesh"]["volume"];
  const double down = remesh("t41v_hill_down.obj", "--fill-below=-1 --resolution 80")["mesh"]["volume"];
  EXPECT_NEAR(up, down, 1e-9 * up);
  EXPECT_GT(up, 400.0) << "20 × 20 × 1 below the hill";
  for (const char* name : {"t41v_hill.obj", "t41v_hill_down.obj"}) {
    const Json shell = remesh(name, "--shell 1 --voxel-size 0.2");
    EXPECT_LT(shell["result"]["offset"]["largest_above"].get<double>(), 0.04);
    EXPECT_LT(shell["result"]["offset"]["largest_below"].get<double>(), 0.04);
    EXPECT_EQ(shell["mesh"]["components"], 1);
  }
  expect_refusal(1, Words{"remesh", input("t41v_hill.obj"), "out.ply", "--fill-below=3"}, {"base"}, true);
  expect_refusal(2, Words{"remesh", input("t41v_hill.obj"), "out.ply", "--shell=-1"}, {"--shell"}, true);
}

TEST_F(RightAnswersTest, ShellsOfNarrowTubesKeepTheirThickness) {
  // Tubes in several directions, whose shells nearly close them: gaps of less than a voxel.
  constexpr int kSides = 24;
  for (const double radius : {0.55, 0.6, 0.65})
    for (const double angle : {0.3, 1.1, 2.3, 3.9, 5.2}) {
      SCOPED_TRACE(std::to_string(radius) + ", " + std::to_string(angle));
      std::ostringstream off;
      off << "OFF\n" << 2 * kSides << " " << kSides << " 0\n";
      for (int i = 0; i < 2 * kSides; ++i) {
        const double a = i % kSides * 2.0 * std::numbers::pi / kSides, x = radius * std::cos(a),
                     y = radius * std::sin(a), z = i < kSides ? 0.0 : 5.0;
        // Turned about x, then about z, and moved.
        const double v = std::cos(angle) * y - std::sin(angle) * z,
                     w = std::sin(angle) * y + std::cos(angle) * z;
        off << std::cos(2 * angle) * x - std::sin(2 * angle) * v + 0.37 * angle << " "
            << std::sin(2 * angle) * x + std::cos(2 * angle) * v << " " << w << "\n";
      }
      for (int i = 0; i < kSides; ++i)
        off << "4 " << i << " " << (i + 1) % kSides << " " << (i + 1) % kSides + kSides << " " << i + kSides
            << "\n";
      write("tube.off", off.str());
      const Json result = json_of("remesh tube.off shell.ply --shell 1 --json")["result"];
      const Json& errors = result["offset"];
      const double voxel = result["voxel_size"];
      for (const char* error : {"largest_below", "largest_above", "largest_from_offset"})
        EXPECT_LT(errors[error].get<double>(), 0.85 * voxel) << error;
    }
}

}  // namespace cli_right_answers_test
}  // namespace hermesh::cli
