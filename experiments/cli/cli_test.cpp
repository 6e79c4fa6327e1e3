// The commands of the program: results, output and exit codes.
#include <signal.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_test {

using Json = nlohmann::json;
using CliTest = ProgramTest;

/// The names in a list of objects that have one.
Words names(const Json& list) {
  Words all;
  for (const Json& item : list) all.push_back(item.at("name"));
  return all;
}

bool contains(const Words& all, const std::string& name) {
  return std::find(all.begin(), all.end(), name) != all.end();
}

TEST_F(CliTest, EveryCommandHasHelp) {
  const Outcome overview = run_to(0, {"--help"});
  for (const char* command : {"list", "voxelize", "import", "extract", "remesh", "combine", "validate",
                              "info", "run", "report", "compare", "accept"}) {
    SCOPED_TRACE(command);
    EXPECT_PRED2(has, overview.out, command);
    const Outcome help = run_to(0, {command, "--help"});
    EXPECT_EQ(help.err, "");
    for (const char* option : {"--threads", "--quiet", "--help"}) EXPECT_PRED2(has, help.out, option);
  }
}

TEST_F(CliTest, ListIsJsonWithEveryVariant) {
  const Json list = json_of("list --json");
  for (const char* name :
       {"marching-cubes", "dual-contouring", "openvdb", "cgal-surface-mesher", "marching-cubes-decimated"})
    EXPECT_TRUE(contains(names(list["extractors"]), name)) << name;
  for (const char* name : {"openvdb", "exact"})
    EXPECT_TRUE(contains(names(list["voxelizers"]), name)) << name;
  EXPECT_FALSE(list["cases"].empty());
  EXPECT_FALSE(list["experiments"].empty());
  for (const Json& extractor : list["extractors"]) {
    EXPECT_FALSE(extractor["summary"].get<std::string>().empty());
    EXPECT_TRUE(extractor["promises"]["closed"].is_boolean());
    for (const Json& option : extractor["options"]) EXPECT_FALSE(option["help"].get<std::string>().empty());
  }
}

TEST_F(CliTest, ListForPeopleNamesTheSame) {
  const Outcome text = run_to(0, {"list"});
  const Json list = json_of("list --json");
  for (const char* kind : {"extractors", "voxelizers", "experiments", "cases"})
    for (const std::string& name : names(list[kind])) EXPECT_PRED2(has, text.out, name) << name;
}

TEST_F(CliTest, RemeshChoosesTheVoxelSizeUnlessItIsGiven) {
  write_cube();
  const double side = 2.0;
  const Json report = json_of("remesh cube.off out.ply --json");
  EXPECT_NEAR(report.at("result").at("voxel_size").get<double>(), side / 200, 1e-9);
  EXPECT_EQ(report.at("result").at("auto").at("thin_share"), 0.0);
  EXPECT_GT(report.at("result").at("auto").at("estimated_bytes"), 1e6);
  run_to(0, "remesh cube.off auto.ply --resolution auto");
  EXPECT_EQ(read("out.ply"), read("auto.ply"));
  run_to(2, "voxelize cube.off out.vdb");
  run_to(2, "voxelize cube.off out.vdb --resolution auto");
  // A rod that is thinner than the smallest voxels permitted.
  write("hair.off",
        "OFF\n8 6 0\n0 0 0\n1 0 0\n1 1e-5 0\n0 1e-5 0\n0 0 1e-5\n1 0 1e-5\n1 1e-5 1e-5\n0 1e-5 1e-5\n"
        "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
  const Json hair = json_of("remesh hair.off out.ply --json");
  EXPECT_NEAR(hair.at("result").at("voxel_size").get<double>(), 1.0 / 2000, 1e-9);
  EXPECT_GT(hair.at("result").at("auto").at("thin_share"), 0.9);
  EXPECT_LT(hair.at("result").at("auto").at("wanted_voxel_size"), 1.0 / 2000);
  EXPECT_FALSE(hair.at("notes").empty());
}

TEST_F(CliTest, CubeThroughAllStages) {
  write_cube();
  // A resolution of 10 would put samples onto the cube's faces.
  const Outcome outcome = run_to(0, "remesh cube.off out.ply --resolution 11 --extractor marching-cubes");
  EXPECT_EQ(outcome.err, "");
  EXPECT_PRED2(has, outcome.out, "marching-cubes");

  const Json report = json_of(
      "validate out.ply --reference cube.off --features cube.off --certify --require "
      "closed,manifold,oriented,watertight,no-self-intersection --json --samples 20000");
  for (const char* key :
       {"boundary_edges", "non_manifold_edges", "non_manifold_vertices", "inconsistent_edges",
        "degenerate_polygons", "duplicate_polygons", "isolated_points", "genus", "self_intersecting_pairs"})
    EXPECT_EQ(report.at(key), 0) << key;
  EXPECT_EQ(report.at("components"), 1);
  EXPECT_EQ(report.at("euler_characteristic"), 2);
  EXPECT_GT(report.at("points"), 500);
  EXPECT_GT(report.at("triangles"), 1000);
  EXPECT_EQ(report.at("quads"), 0);
  // Marching cubes cuts the corners of the cube, whose side is 2, off by less than a voxel of 0.18.
  EXPECT_NEAR(report.at("volume"), 8.0, 0.1);
  EXPECT_NEAR(report.at("area"), 24.0, 1.5);
  for (const char* direction : {"to_reference", "from_reference"}) {
    const Json& distances = report.at(direction);
    EXPECT_LE(distances.at("mean"), distances.at("rms"));
    EXPECT_LE(distances.at("rms"), distances.at("max"));
    EXPECT_LT(distances.at("max"), 0.18);
    // A sampled maximum is a lower bound of the certified interval's upper end.
    EXPECT_LE(distances.at("max"), report.at(std::string("certified_") + direction).at("upper"));
  }
}

TEST_F(CliTest, VoxelizeAndExtractGiveWhatRemeshGives) {
  write_sphere();
  run_to(0, "voxelize sphere.off sphere.vdb --voxel-size 0.1");
  run_to(0, "extract sphere.vdb two.ply --extractor marching-cubes");
  run_to(0, "extract sphere.vdb exact.ply --source sphere.off");
  run_to(0, "remesh sphere.off one.ply --resolution 20 --extractor marching-cubes");
  run_to(0, "remesh sphere.off remeshed.ply --resolution 20 --extractor dual-contouring");
  EXPECT_EQ(read("one.ply"), read("two.ply"));
  EXPECT_EQ(read("exact.ply"), read("remeshed.ply"));

  const Outcome info = run_to(0, "info sphere.vdb");
  EXPECT_PRED2(has, info.out, "sdf");
  EXPECT_PRED2(has, info.out, "level set");
}

TEST_F(CliTest, BandsAndIsovalueTakeEffect) {
  write_sphere();
  const Outcome narrow = run("voxelize sphere.off narrow.vdb --voxel-size 0.1");
  const Outcome wide =
      run("voxelize sphere.off wide.vdb --voxel-size 0.1 --interior-band 6 --exterior-band 6");
  ASSERT_EQ(narrow.exit_code, 0) << narrow.err;
  ASSERT_EQ(wide.exit_code, 0) << wide.err;
  EXPECT_NE(run("info narrow.vdb").out, run("info wide.vdb").out);
  // Moving the isovalue outwards by 0.2 makes the sphere's radius 1.2 and its volume 1.2³ times as large.
  const auto volume = [&](const std::string& isovalue) {
    run_to(0, {"extract", "wide.vdb", "out.ply", "--isovalue", isovalue});
    return json_of("validate out.ply --json").at("volume").get<double>();
  };
  EXPECT_NEAR(volume("0.2") / volume("0"), 1.728, 0.02);
  EXPECT_NEAR(volume("-0.2") / volume("0"), 0.512, 0.02);
}

/// Exact crossings cannot be used at other isovalues: the polygons that remesh has available are at 0.
TEST_F(CliTest, RemeshesAtOtherIsovalues) {
  write_sphere();
  const auto volume = [&](const std::string& isovalue) {
    run_to(0, {"remesh", "sphere.off", "out.ply", "--voxel-size", "0.1", "--isovalue", isovalue});
    return json_of("validate out.ply --json").at("volume").get<double>();
  };
  EXPECT_NEAR(volume("0.05") / volume("0"), 1.158, 0.005);
  for (const auto& [extractor, option] :
       {std::pair("dual-contouring", "hermite=exact"), std::pair("marching-cubes", "crossings=exact")}) {
    const Outcome refused = run_to(1, {"remesh", "sphere.off", "x.ply", "--voxel-size", "0.1", "--isovalue",
                                       "0.05", "--extractor", extractor, "-o", option});
    EXPECT_PRED2(has, refused.err, "isovalue");
  }
}

TEST_F(CliTest, EveryExtractorRuns) {
  write_sphere();
  const Json list = json_of("list --json");
  for (const std::string& name : names(list["extractors"])) {
    const Outcome outcome =
        run({"remesh", "sphere.off", name + ".obj", "--resolution", "16", "--extractor", name, "--quiet"});
    EXPECT_EQ(outcome.exit_code, 0) << name << ": " << outcome.err;
    EXPECT_EQ(outcome.out + outcome.err, "") << name;
    run_to(0, {"validate", name + ".obj", "--require", "closed"});
  }
}

TEST_F(CliTest, SameBytesForEveryNumberOfThreads) {
  write_sphere();
  const Json list = json_of("list --json");
  int compared = 0;
  for (const Json& extractor : list["extractors"]) {
    if (!extractor.at("ours")) continue;
    const std::string name = extractor.at("name");
    for (const char* threads : {"1", "2"})
      run_to(0, {"remesh", "sphere.off", name + threads + ".ply", "--resolution", "64", "--extractor", name,
                 "--threads", threads});
    EXPECT_TRUE(read(name + "1.ply") == read(name + "2.ply")) << name;
    ++compared;
  }
  EXPECT_GE(compared, 2);
}

TEST_F(CliTest, RequirementNotMetIsExitCodeThree) {
  write("triangle.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  const Json report = json_of("validate triangle.off --require manifold,closed --json", 3);
  EXPECT_EQ(report.at("boundary_edges"), 3);
  EXPECT_TRUE(report.at("genus").is_null());
  EXPECT_EQ(report.at("unmet_requirements"), Json::array({"closed"}));
  run_to(0, "validate triangle.off --require manifold,oriented,no-self-intersection");
  run_to(3, "validate triangle.off --require watertight");
  run_to(0, "validate triangle.off");
}

/// OBJ text of boxes of 10 × 10 between heights, each on points of its own.
std::string boxes_obj(const std::vector<std::pair<double, double>>& heights) {
  std::ostringstream file;
  int base = 1;
  for (const auto& [from, to] : heights) {
    for (const double z : {from, to})
      for (const int y : {0, 10})
        for (const int x : {0, 10}) file << "v " << x << ' ' << y << ' ' << z << '\n';
    for (const auto& face :
         {std::array{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}) {
      file << 'f';
      for (const int corner : face) file << ' ' << base + corner;
      file << '\n';
    }
    base += 8;
  }
  return file.str();
}

TEST_F(CliTest, QuadsOfAReferenceAreCutAsItIsSaid) {
  // Across b–d the quad bends less than across a–c, along which its file means it to be cut.
  const std::string points = "v 0 0 0\nv 1 0 0\nv 2 1 0.5\nv 0 1 0\n";
  write("quad.obj", points + "f 1 2 3 4\n");
  write("triangles.obj", points + "f 1 2 3\nf 1 3 4\n");
  const auto distance = [&](const Words& more) {
    return Json::parse(run(Words("validate triangles.obj --reference quad.obj --json") + more).out)
        .at("to_reference")
        .at("max")
        .get<double>();
  };
  EXPECT_LT(distance("--reference-quads as-given"), 1e-12);
  EXPECT_GT(distance({}), 0.05);
  EXPECT_GT(distance("--reference-quads better"), 0.05);
  run_to(2, "validate quad.obj --reference-quads as-given");
}

TEST_F(CliTest, AWatertightMeshOfAnotherSolidDoesNotMeetTheRequirement) {
  // Inner walls of the reference: distances to it are small wherever a mesh follows them.
  write("reference.obj", boxes_obj({{0, 30}, {20, 60}}));
  write("three.obj", boxes_obj({{0, 19.995}, {20.005, 29.995}, {30.005, 60}}));
  write("one.obj", boxes_obj({{0, 60}}));
  run_to(0, "validate three.obj --require watertight");
  for (const char* word : {"watertight", "solid"}) {
    const Outcome bad =
        run_to(3, {"validate", "three.obj", "--reference", "reference.obj", "--certify", "--require", word});
    EXPECT_PRED2(has, bad.out, "solid");
    EXPECT_PRED2(has, bad.out, "Required but not met: solid.");
    run_to(0, {"validate", "one.obj", "--reference", "reference.obj", "--require", word});
  }
  const Json report = json_of("validate three.obj --reference reference.obj --json");
  EXPECT_EQ(report.at("solid").at("verdict"), "differs");
  EXPECT_EQ(report.at("solid").at("mesh_components"), 3);
  EXPECT_EQ(report.at("solid").at("reference_components"), 1);
  run_to(2, "validate one.obj --require solid");
  run_to(2, "validate one.obj --voxel-size 1");
}

TEST_F(CliTest, WatertightIncludesOriented) {
  std::string cube = boxes_obj({{0, 10}});
  write("cube.obj", cube);
  run_to(0, "validate cube.obj --require watertight");
  const std::string face = "f 1 5 7 3", turned = "f 3 7 5 1";
  cube.replace(cube.find(face), face.size(), turned);
  write("turned.obj", cube);
  EXPECT_EQ(json_of("validate turned.obj --require watertight --json", 3).at("watertight"), false);
}

/// Twenty beads on a string that is thinner than a voxel and lies between samples: one component, of which
/// twenty are left.
TEST_F(CliTest, ManyNewComponentsAreANote) {
  std::string points, faces;
  int rings = 0;
  const auto ring = [&](double x, double half) {
    for (const auto& [y, z] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}})
      points += std::to_string(x) + " " + std::to_string(0.1 + half * y) + " " +
                std::to_string(0.1 + half * z) + "\n";
    const int a = 4 * rings++;
    for (int i = 0; i < 4 && a > 0; ++i)
      faces += "4 " + std::to_string(a + i) + " " + std::to_string(a - 4 + i) + " " +
               std::to_string(a - 4 + (i + 1) % 4) + " " + std::to_string(a + (i + 1) % 4) + "\n";
  };
  for (int bead = 0; bead < 20; ++bead) {
    ring(2 * bead, 0.01), ring(2 * bead + 0.1, 0.5);
    ring(2 * bead + 1.1, 0.5), ring(2 * bead + 1.2, 0.01);
  }
  faces += "4 3 2 1 0\n4 316 317 318 319\n";
  write("beads.off", "OFF\n320 " + std::to_string(4 * 79 + 2) + " 0\n" + points + faces);
  const Outcome outcome = run_to(0, "remesh beads.off out.ply --voxel-size 0.23 --thin drop --max-loss 100%");
  EXPECT_PRED2(has, outcome.err, "note: the mesh has 20 components and the polygons have 1:");
  EXPECT_PRED2(lacks, run("remesh sphere.off out.ply --voxel-size 0.2").err, "components");
}

TEST_F(CliTest, ThinPartsAreKeptDroppedOrRefused) {
  // A square without thickness, and a plate of a fifth of a voxel.
  write("sheet.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
  write("plate.off",
        "OFF\n8 6 0\n0 0 0.003\n1 0 0.003\n1 1 0.003\n0 1 0.003\n0 0 0.013\n1 0 0.013\n1 1 0.013\n0 1 0.013\n"
        "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
  for (const std::string in : {"sheet.off", "plate.off"}) {
    SCOPED_TRACE(in);
    const auto remesh = [&](const Words& more) {
      return run(Words{"remesh", in, "out.ply", "--voxel-size", "0.05"} + more);
    };
    const Outcome kept = remesh({"--json"});
    ASSERT_EQ(kept.exit_code, 0) << kept.err;
    const Json result = Json::parse(kept.out).at("result");
    EXPECT_GT(result.at("thickened_share").get<double>(), 0.9);
    EXPECT_NEAR(result.at("thickened_by").get<double>(), in == "sheet.off" ? 0.06 : 0.05, 1e-3);
    EXPECT_EQ(result.at("visible_loss").get<double>(), 0.0);
    run_to(0, "validate out.ply --require watertight");
    // Here nothing remains of dropped parts, and refused parts are named.
    EXPECT_EQ(remesh("--thin drop").exit_code, 1);
    EXPECT_EQ(remesh("--thin refuse").exit_code, 1);
    EXPECT_EQ(remesh("--thin keep --isovalue 0.1").exit_code, 2);
    EXPECT_EQ(remesh("--max-loss 1").exit_code, 2);
    run_to(0, {"voxelize", in, "out.vdb", "--voxel-size", "0.05"});
    run_to(0, "extract out.vdb of_volume.ply");
    run_to(0, "validate of_volume.ply --require watertight");
  }
}

TEST_F(CliTest, MuchThatIsLostIsNotMet) {
  // A cube with a fin next to it that contains no sample.
  write("fin.off",
        "OFF\n16 12 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
        "0 0 1.53\n1 0 1.53\n1 1 1.53\n0 1 1.53\n0 0 1.56\n1 0 1.56\n1 1 1.56\n0 1 1.56\n"
        "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n"
        "4 11 10 9 8\n4 12 13 14 15\n4 8 9 13 12\n4 9 10 14 13\n4 10 11 15 14\n4 11 8 12 15\n");
  // The fin has two of eight squares, and its four sides.
  EXPECT_NEAR(json_of("remesh fin.off out.ply --voxel-size 0.1 --thin drop --json", 3)
                  .at("result")
                  .at("visible_loss")
                  .get<double>(),
              2.12 / 8.12, 0.02);
  run_to(0, "remesh fin.off out.ply --voxel-size 0.1 --thin drop --max-loss 30%");
  run_to(0, "remesh fin.off out.ply --voxel-size 0.1 --max-loss 1%");
}

TEST_F(CliTest, InfoOfAMesh) {
  write_cube();
  const Outcome outcome = run_to(0, "info cube.off");
  for (const char* text :
       {"points     8\n", "triangles  12\n", "quads      0\n", "(-1, -1, -1)", "(1, 1, 1)", "(2, 2, 2)"})
    EXPECT_PRED2(has, outcome.out, text);
}

TEST_F(CliTest, ProgressIsShownOnATerminalAndErased) {
  write_sphere();
  const Words arguments = "remesh sphere.off out.ply --resolution 80";
  const std::string erase = "\r\033[K";
  const std::string sent = terminal_output(arguments);
  EXPECT_PRED2(has, sent, "%");
  EXPECT_PRED2(lacks, sent, "\n");
  ASSERT_GE(sent.size(), erase.size());
  EXPECT_EQ(sent.substr(sent.size() - erase.size()), erase);

  Words quiet = arguments;
  quiet.push_back("--quiet");
  EXPECT_EQ(terminal_output(quiet), "");
  EXPECT_EQ(run(arguments).err, "");
}

// The program must be in the middle of its work when the signal comes: these meshes take many seconds.
class InterruptTest : public ProgramTest {
 protected:
  void expect_cancelled(int signal, int exit_code, std::chrono::milliseconds after, const Words& arguments) {
    const std::set<std::string> before = files();
    const Outcome outcome = run_to(exit_code, arguments, Interruption{signal, after});
    EXPECT_LT(outcome.seconds, 1.0);
    EXPECT_EQ(outcome.err, "");
    EXPECT_EQ(files(), before);
  }
};

TEST_F(InterruptTest, LeavesNothingBehind) {
  write_sphere();
  for (const int milliseconds : {0, 100, 400})
    expect_cancelled(SIGINT, 130, std::chrono::milliseconds(milliseconds),
                     "remesh sphere.off out.ply --resolution 1000");
}

TEST_F(InterruptTest, EndsLibraryCodeThatDoesNotPoll) {
  write_sphere();
  expect_cancelled(SIGINT, 130, std::chrono::milliseconds(700),
                   "remesh sphere.off out.ply --resolution 300 --extractor cgal-surface-mesher");
}

TEST_F(InterruptTest, KeepsTheOlderOutput) {
  write_sphere();
  write("out.vdb", "older");
  expect_cancelled(SIGTERM, 143, std::chrono::milliseconds(300),
                   "voxelize sphere.off out.vdb --resolution 1000");
  EXPECT_EQ(read("out.vdb"), "older");
}

}  // namespace cli_test
}  // namespace hermesh::cli
