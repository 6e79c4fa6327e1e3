#include <map>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_fracture_test {

using std::chrono::milliseconds;

class FractureTest : public ProgramTest {
 protected:
  Outcome fracture(int exit_code, const Words& more) {
    return run_to(exit_code, Words("fracture cube.off out --voxel-size 0.05") + more);
  }
  nlohmann::json ledger() const { return nlohmann::json::parse(read("out/pieces.json")); }
  bool is_there() const { return std::filesystem::exists(path("out")); }
};

TEST_F(FractureTest, WritesPiecesLedgerAndPicture) {
  write_cube();
  fracture(0, "--cutters voronoi:5 --seed 3 --judge");
  const nlohmann::json json = ledger();
  ASSERT_EQ(json.at("pieces").size(), 5u);
  EXPECT_TRUE(std::filesystem::exists(path("out/exploded.png")));
  double volume = 0.0;
  std::uint64_t seams = 0;
  for (const auto& piece : json.at("pieces")) {
    EXPECT_TRUE(std::filesystem::exists(path("out") / piece.at("file").get<std::string>()));
    volume += piece.at("volume").get<double>();
    seams += piece.at("seam_triangles").get<std::uint64_t>();
    for (const auto& neighbour : piece.at("neighbours")) {  // both sides list the same triangles
      const auto& other = json.at("pieces")[neighbour.at("piece").get<std::size_t>() - 1];
      bool told = false;
      for (const auto& back : other.at("neighbours"))
        told = told ||
               (back.at("piece") == piece.at("piece") && back.at("triangles") == neighbour.at("triangles"));
      EXPECT_TRUE(told);
    }
  }
  EXPECT_NEAR(volume, 8.0, 4e-3);  // cells where several cuts meet a crease of the cube have one point
  EXPECT_GT(seams, 0u);
  EXPECT_EQ(seams % 2, 0u);
  for (const auto& cutter : json.at("cutters")) EXPECT_EQ(cutter.at("state"), "cuts");
}

TEST_F(FractureTest, TheSameSeedGivesTheSameBytes) {
  write_cube();
  const auto bytes = [&](const std::string& threads, const std::string& seed) {
    fracture(0, {"--cutters", "chunks:6", "--seed", seed, "--threads", threads, "--no-picture"});
    std::string all = read("out/pieces.json");
    for (int i = 1; i <= 6; ++i) all += read("out/piece_000" + std::to_string(i) + ".ply");
    std::filesystem::remove_all(path("out"));
    return all;
  };
  const std::string first = bytes("1", "4");
  EXPECT_EQ(first, bytes("2", "4"));
  EXPECT_EQ(first, bytes("7", "4"));
  EXPECT_NE(first, bytes("2", "5"));
}

TEST_F(FractureTest, MeshesCutInPlace) {
  write_cube();
  write_sphere();
  fracture(0, "--cutters mesh:sphere.off --no-picture --judge");
  const nlohmann::json json = ledger();
  ASSERT_EQ(json.at("pieces").size(), 2u);  // the ball, and the rest
  EXPECT_NEAR(
      json.at("pieces")[0].at("volume").get<double>() + json.at("pieces")[1].at("volume").get<double>(), 8.0,
      2e-2);
  EXPECT_EQ(json.at("pieces")[0].at("name"), "taken by sphere.off");
}

TEST_F(FractureTest, ThinPartsCannotBeKeptByOtherVoxelizers) {
  write_cube();
  fracture(2, "--cutters voronoi:3 --no-picture --voxelizer openvdb --thin keep");
  EXPECT_FALSE(is_there());
}

TEST_F(FractureTest, NumbersMustBeFinite) {
  write_cube();
  for (const char* option : {"--roughness", "--mesh-scale", "--impact-radius"})
    fracture(2, {"--cutters", "chunks:4", "--no-picture", option, "nan"});
  fracture(2, "--cutters chunks:4 --no-picture --impact nan 0 0");
}

TEST_F(FractureTest, ACutterThatTakesNothingIsNoted) {
  write_cube();
  const Outcome outcome = fracture(0, "--cutters planes:0,0,1,0.5;1,0,0,7 --no-picture");
  EXPECT_PRED2(has, outcome.err, "plane 1");
  EXPECT_EQ(ledger().at("cutters")[1].at("state"), "misses");
  EXPECT_NEAR(ledger().at("pieces")[1].at("volume").get<double>(), 2.0, 1e-3);
}

TEST_F(FractureTest, OtherMethods) {
  write_cube();
  for (const char* method : {"thesis", "openvdb"}) {
    fracture(0, {"--cutters", "voronoi:4", "--method", method, "--no-picture"});
    EXPECT_GE(ledger().at("pieces").size(), 4u) << method;
    // Eq. 7.1 leaves polygons that bound nothing, so the printed pieces' volume means less.
    EXPECT_NEAR(ledger().at("pieces_volume").get<double>(), 8.0,
                method == std::string("openvdb") ? 0.2 : 0.8);
    std::filesystem::remove_all(path("out"));
  }
}

TEST_F(FractureTest, TheThesisTakesARuleAndAThreshold) {
  write_cube();
  std::map<std::string, std::size_t> sizes;
  for (const std::string rule : {"printed", "repaired"})
    for (const std::string tolerance : {"0", "0.3"}) {
      const Outcome outcome = fracture(0, {"--cutters", "voronoi:4", "--method", "thesis", "--rule", rule,
                                           "--tolerance", tolerance, "--no-picture"});
      EXPECT_EQ(ledger().at("rule"), rule);
      EXPECT_EQ(outcome.err.find("bound nothing") != std::string::npos, rule == "printed") << outcome.err;
      EXPECT_NEAR(ledger().at("pieces_volume").get<double>(), 8.0, rule == "repaired" ? 0.2 : 0.8);
      std::size_t& size = sizes[rule + tolerance];
      const nlohmann::json made = ledger();
      for (const auto& piece : made.at("pieces")) size += piece.at("triangles").get<std::size_t>();
      std::filesystem::remove_all(path("out"));
    }
  EXPECT_LT(sizes.at("printed0.3"), sizes.at("printed0"));
  EXPECT_LT(sizes.at("repaired0.3"), sizes.at("repaired0"));
}

TEST_F(FractureTest, TheThesisMethodDoesNotPassTheJudge) {
  write_cube();
  fracture(3, "--cutters voronoi:4 --method thesis --no-picture --judge");
  EXPECT_TRUE(is_there());  // the pieces are written all the same
}

TEST_F(FractureTest, AnEmptyCutterOfOpenvdbIsNoted) {
  write_cube();
  write_sphere();
  const Outcome outcome = fracture(0, "--cutters mesh:sphere.off,sphere.off --method openvdb --no-picture");
  ASSERT_EQ(ledger().at("cutters").size(), 1u) << outcome.err;
  EXPECT_EQ(ledger().at("cutters")[0].at("state"), "nothing");
}

TEST_F(FractureTest, AnImpactNeedsNoRadiusOnASmallObject) {
  write_cube();
  run_to(0,
         "fracture cube.off out --voxel-size 0.5 --cutters voronoi:2 --impact 0 0 0 --min-volume 0 "
         "--no-picture");
  EXPECT_EQ(ledger().at("pieces").size(), 2u);
}

TEST_F(FractureTest, AMergedSliverIsNamed) {
  write_cube();
  const Outcome outcome = fracture(0, "--cutters planes:0,0,1,0.5;1,1,1,2.8 --no-picture --judge");
  const nlohmann::json json = ledger();
  EXPECT_EQ(json.at("cutters")[1].at("state"), "merged");
  EXPECT_PRED2(has, outcome.err, "plane 1");
  const nlohmann::json& merged = json.at("labels").at("merged_slivers");
  ASSERT_EQ(merged.size(), 1u);
  EXPECT_EQ(merged[0].at("code"), 3);
  EXPECT_EQ(merged[0].at("into_code"), 1);
  EXPECT_NE(merged[0].at("name"), merged[0].at("into"));
}

TEST_F(FractureTest, BadInputIsOneSentenceAndLeavesNothing) {
  write_cube();
  const struct {
    Words words;
    int exit_code;
    const char* says;
  } cases[] = {
      {{"--cutters", "voronoi"}, 2, "voronoi"},
      {{"--cutters", "voronoi:0"}, 2, "voronoi:0"},
      {{"--cutters", "planes:1,2,3"}, 2, "planes:1,2,3"},
      {{"--cutters", "planes:0,0,0,1"}, 2, "0,0,0,1"},
      {{"--cutters", "mesh:missing.off"}, 1, "missing.off"},
      {{"--cutters", "voronoi:3", "--method", "magic"}, 2, "magic"},
      {{"--cutters", "voronoi:3", "--tolerance", "-1"}, 2, "tolerance"},
      {{"--cutters", "voronoi:3", "--method", "openvdb", "--tolerance", "2"}, 2, "adaptivity"},
      {{}, 2, "--cutters"},
      {{"--cutters", "voronoi:3", "--roughness", "0.1"}, 2, "--roughness has no effect"},
      {{"--cutters", "planes:0,0,1,0", "--seed", "1"}, 2, "--seed has no effect"},
      {{"--cutters", "voronoi:3", "--mesh-scale", "2"}, 2, "--mesh-scale has no effect"},
      {{"--cutters", "voronoi:3", "--impact-radius", "2"}, 2, "--impact-radius has no effect"},
      {{"--cutters", "voronoi:3", "--method", "thesis", "--no-split"}, 2, "--no-split has no effect"},
      {{"--cutters", "voronoi:3", "--rule", "printed"}, 2, "--rule has no effect"},
      {{"--cutters", "voronoi:3", "--method", "thesis", "--rule", "other"}, 2, "--rule"},
  };
  for (const auto& [words, exit_code, says] : cases)
    expect_refusal(exit_code, Words("fracture cube.off out --voxel-size 0.05") + words, {says});
}

TEST_F(FractureTest, AFolderWithFilesIsNotTouched) {
  write_cube();
  std::filesystem::create_directory(path("out"));
  write("out/mine.txt", "keep");
  EXPECT_PRED2(has, fracture(1, "--cutters voronoi:3").err, "'out'");
  EXPECT_EQ(read("out/mine.txt"), "keep");
}

TEST_F(FractureTest, AnInterruptionLeavesNothingBehind) {
  write_sphere();
  run_to(130, "fracture sphere.off out --resolution 400 --cutters voronoi:300",
         Interruption{SIGINT, milliseconds(700)});
  EXPECT_FALSE(is_there());
  EXPECT_EQ(files(), std::set<std::string>{"sphere.off"});
}

}  // namespace cli_fracture_test
}  // namespace hermesh::cli
