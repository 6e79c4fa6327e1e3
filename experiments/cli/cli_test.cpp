// The program from the outside: what its commands do, print and return.
#include <signal.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <sstream>

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace {

using Json = nlohmann::json;
using CliTest = ProgramTest;

/// The names in a list of objects that have one.
std::vector<std::string> names(const Json& list) {
  std::vector<std::string> all;
  for (const Json& item : list) all.push_back(item.at("name"));
  return all;
}

bool contains(const std::vector<std::string>& all, const std::string& name) {
  return std::find(all.begin(), all.end(), name) != all.end();
}

TEST_F(CliTest, EveryCommandHasHelp) {
  const Outcome overview = run({"--help"});
  EXPECT_EQ(overview.exit_code, 0);
  for (const char* command : {"list", "voxelize", "import", "extract", "remesh", "combine", "validate",
                              "info", "run", "report", "compare", "accept"}) {
    SCOPED_TRACE(command);
    EXPECT_NE(overview.out.find(command), std::string::npos);
    const Outcome help = run({command, "--help"});
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_EQ(help.err, "");
    for (const char* option : {"--threads", "--quiet", "--help"})
      EXPECT_NE(help.out.find(option), std::string::npos) << help.out;
  }
}

TEST_F(CliTest, ListIsJsonWithEveryVariant) {
  const Outcome outcome = run({"list", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Json list = Json::parse(outcome.out);
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
  const Outcome text = run({"list"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  const Json list = Json::parse(run({"list", "--json"}).out);
  for (const char* kind : {"extractors", "voxelizers", "experiments", "cases"})
    for (const std::string& name : names(list[kind]))
      EXPECT_NE(text.out.find(name), std::string::npos) << name;
}

TEST_F(CliTest, CubeThroughAllStages) {
  write_cube();
  // A resolution of 10 would put samples onto the cube's faces.
  const Outcome outcome =
      run({"remesh", "cube.off", "out.ply", "--resolution", "11", "--extractor", "marching-cubes"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("marching-cubes"), std::string::npos);

  const Outcome judged = run(
      {"validate", "out.ply", "--reference", "cube.off", "--features", "cube.off", "--certify", "--require",
       "closed,manifold,oriented,watertight,no-self-intersection", "--json", "--samples", "20000"});
  ASSERT_EQ(judged.exit_code, 0) << judged.err << judged.out;
  const Json report = Json::parse(judged.out);
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
  ASSERT_EQ(run({"voxelize", "sphere.off", "sphere.vdb", "--voxel-size", "0.1"}).exit_code, 0);
  ASSERT_EQ(run({"extract", "sphere.vdb", "two.ply", "--extractor", "marching-cubes"}).exit_code, 0);
  ASSERT_EQ(run({"extract", "sphere.vdb", "exact.ply", "--source", "sphere.off"}).exit_code, 0);
  ASSERT_EQ(run({"remesh", "sphere.off", "one.ply", "--resolution", "20", "--extractor", "marching-cubes"})
                .exit_code,
            0);
  ASSERT_EQ(
      run({"remesh", "sphere.off", "remeshed.ply", "--resolution", "20", "--extractor", "dual-contouring"})
          .exit_code,
      0);
  EXPECT_EQ(read("one.ply"), read("two.ply"));
  EXPECT_EQ(read("exact.ply"), read("remeshed.ply"));

  const Outcome info = run({"info", "sphere.vdb"});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_NE(info.out.find("sdf"), std::string::npos) << info.out;
  EXPECT_NE(info.out.find("level set"), std::string::npos) << info.out;
}

TEST_F(CliTest, BandsAndIsovalueTakeEffect) {
  write_sphere();
  const Outcome narrow = run({"voxelize", "sphere.off", "narrow.vdb", "--voxel-size", "0.1"});
  const Outcome wide = run({"voxelize", "sphere.off", "wide.vdb", "--voxel-size", "0.1", "--interior-band",
                            "6", "--exterior-band", "6"});
  ASSERT_EQ(narrow.exit_code, 0) << narrow.err;
  ASSERT_EQ(wide.exit_code, 0) << wide.err;
  EXPECT_NE(run({"info", "narrow.vdb"}).out, run({"info", "wide.vdb"}).out);
  // Moving the isovalue outwards by 0.2 makes the sphere's radius 1.2 and its volume 1.2³ times as large.
  const auto volume = [&](const std::string& isovalue) {
    EXPECT_EQ(run({"extract", "wide.vdb", "out.ply", "--isovalue", isovalue}).exit_code, 0);
    return Json::parse(run({"validate", "out.ply", "--json"}).out).at("volume").get<double>();
  };
  EXPECT_NEAR(volume("0.2") / volume("0"), 1.728, 0.02);
  EXPECT_NEAR(volume("-0.2") / volume("0"), 0.512, 0.02);
}

/// Exact crossings are no use at other isovalues: the polygons, which remesh has at hand, lie at 0.
TEST_F(CliTest, RemeshesAtOtherIsovalues) {
  write_sphere();
  const auto volume = [&](const std::string& isovalue) {
    EXPECT_EQ(
        run({"remesh", "sphere.off", "out.ply", "--voxel-size", "0.1", "--isovalue", isovalue}).exit_code, 0);
    return Json::parse(run({"validate", "out.ply", "--json"}).out).at("volume").get<double>();
  };
  EXPECT_NEAR(volume("0.05") / volume("0"), 1.158, 0.005);
  for (const auto& [extractor, option] :
       {std::pair("dual-contouring", "hermite=exact"), std::pair("marching-cubes", "crossings=exact")}) {
    const Outcome refused = run({"remesh", "sphere.off", "x.ply", "--voxel-size", "0.1", "--isovalue", "0.05",
                                 "--extractor", extractor, "-o", option});
    EXPECT_EQ(refused.exit_code, 1) << extractor;
    EXPECT_NE(refused.err.find("isovalue 0"), std::string::npos) << refused.err;
  }
}

TEST_F(CliTest, EveryExtractorRuns) {
  write_sphere();
  const Json list = Json::parse(run({"list", "--json"}).out);
  for (const std::string& name : names(list["extractors"])) {
    const Outcome outcome =
        run({"remesh", "sphere.off", name + ".obj", "--resolution", "16", "--extractor", name, "--quiet"});
    EXPECT_EQ(outcome.exit_code, 0) << name << ": " << outcome.err;
    EXPECT_EQ(outcome.out + outcome.err, "") << name;
    EXPECT_EQ(run({"validate", name + ".obj", "--require", "closed"}).exit_code, 0) << name;
  }
}

TEST_F(CliTest, SameBytesForEveryNumberOfThreads) {
  write_sphere();
  const Json list = Json::parse(run({"list", "--json"}).out);
  int compared = 0;
  for (const Json& extractor : list["extractors"]) {
    if (!extractor.at("ours")) continue;
    const std::string name = extractor.at("name");
    for (const char* threads : {"1", "2"})
      ASSERT_EQ(run({"remesh", "sphere.off", name + threads + ".ply", "--resolution", "64", "--extractor",
                     name, "--threads", threads})
                    .exit_code,
                0);
    EXPECT_TRUE(read(name + "1.ply") == read(name + "2.ply")) << name;
    ++compared;
  }
  EXPECT_GE(compared, 2);
}

TEST_F(CliTest, RequirementNotMetIsExitCodeThree) {
  write("triangle.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  const Outcome outcome = run({"validate", "triangle.off", "--require", "manifold,closed", "--json"});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  const Json report = Json::parse(outcome.out);
  EXPECT_EQ(report.at("boundary_edges"), 3);
  EXPECT_TRUE(report.at("genus").is_null());
  EXPECT_EQ(report.at("unmet_requirements"), Json::array({"closed"}));
  EXPECT_EQ(
      run({"validate", "triangle.off", "--require", "manifold,oriented,no-self-intersection"}).exit_code, 0);
  EXPECT_EQ(run({"validate", "triangle.off", "--require", "watertight"}).exit_code, 3);
  EXPECT_EQ(run({"validate", "triangle.off"}).exit_code, 0);
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
  const auto distance = [&](const std::vector<std::string>& more) {
    std::vector<std::string> line = {"validate", "triangles.obj", "--reference", "quad.obj", "--json"};
    line.insert(line.end(), more.begin(), more.end());
    return Json::parse(run(line).out).at("to_reference").at("max").get<double>();
  };
  EXPECT_LT(distance({"--reference-quads", "as-given"}), 1e-12);
  EXPECT_GT(distance({}), 0.05);
  EXPECT_GT(distance({"--reference-quads", "better"}), 0.05);
  EXPECT_EQ(run({"validate", "quad.obj", "--reference-quads", "as-given"}).exit_code, 2);
}

TEST_F(CliTest, AWatertightMeshOfAnotherSolidDoesNotMeetTheRequirement) {
  // Inner walls of the reference: distances to it are small wherever a mesh follows them.
  write("reference.obj", boxes_obj({{0, 30}, {20, 60}}));
  write("three.obj", boxes_obj({{0, 19.995}, {20.005, 29.995}, {30.005, 60}}));
  write("one.obj", boxes_obj({{0, 60}}));
  EXPECT_EQ(run({"validate", "three.obj", "--require", "watertight"}).exit_code, 0);
  for (const char* word : {"watertight", "solid"}) {
    const Outcome bad =
        run({"validate", "three.obj", "--reference", "reference.obj", "--certify", "--require", word});
    EXPECT_EQ(bad.exit_code, 3) << word;
    EXPECT_NE(bad.out.find("does not bound the reference's solid"), std::string::npos) << bad.out;
    EXPECT_NE(bad.out.find("Required but not met: solid."), std::string::npos) << bad.out;
    EXPECT_EQ(run({"validate", "one.obj", "--reference", "reference.obj", "--require", word}).exit_code, 0)
        << word;
  }
  const Json report =
      Json::parse(run({"validate", "three.obj", "--reference", "reference.obj", "--json"}).out);
  EXPECT_EQ(report.at("solid").at("verdict"), "differs");
  EXPECT_EQ(report.at("solid").at("mesh_components"), 3);
  EXPECT_EQ(report.at("solid").at("reference_components"), 1);
  EXPECT_EQ(run({"validate", "one.obj", "--require", "solid"}).exit_code, 2);
  EXPECT_EQ(run({"validate", "one.obj", "--voxel-size", "1"}).exit_code, 2);
}

TEST_F(CliTest, WatertightIncludesOriented) {
  std::string cube = boxes_obj({{0, 10}});
  write("cube.obj", cube);
  EXPECT_EQ(run({"validate", "cube.obj", "--require", "watertight"}).exit_code, 0);
  const std::string face = "f 1 5 7 3", turned = "f 3 7 5 1";
  cube.replace(cube.find(face), face.size(), turned);
  write("turned.obj", cube);
  const Outcome outcome = run({"validate", "turned.obj", "--require", "watertight", "--json"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_EQ(Json::parse(outcome.out).at("watertight"), false);
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
  const Outcome outcome =
      run({"remesh", "beads.off", "out.ply", "--voxel-size", "0.23", "--thin", "drop", "--max-loss", "100%"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("note: the mesh has 20 components and the polygons have 1:"), std::string::npos)
      << outcome.err;
  EXPECT_EQ(run({"remesh", "sphere.off", "out.ply", "--voxel-size", "0.2"}).err.find("components"),
            std::string::npos);
}

TEST_F(CliTest, ThinPartsAreKeptDroppedOrRefused) {
  // A square without thickness, and a plate of a fifth of a voxel.
  write("sheet.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
  write("plate.off",
        "OFF\n8 6 0\n0 0 0.003\n1 0 0.003\n1 1 0.003\n0 1 0.003\n0 0 0.013\n1 0 0.013\n1 1 0.013\n0 1 0.013\n"
        "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
  for (const std::string in : {"sheet.off", "plate.off"}) {
    SCOPED_TRACE(in);
    const auto remesh = [&](const std::vector<std::string>& more) {
      std::vector<std::string> arguments = {"remesh", in, "out.ply", "--voxel-size", "0.05"};
      arguments.insert(arguments.end(), more.begin(), more.end());
      return run(arguments);
    };
    const Outcome kept = remesh({"--json"});
    ASSERT_EQ(kept.exit_code, 0) << kept.err;
    const Json result = Json::parse(kept.out).at("result");
    EXPECT_GT(result.at("thickened_share").get<double>(), 0.9);
    EXPECT_NEAR(result.at("thickened_by").get<double>(), in == "sheet.off" ? 0.06 : 0.05, 1e-3);
    EXPECT_EQ(result.at("visible_loss").get<double>(), 0.0);
    EXPECT_EQ(run({"validate", "out.ply", "--require", "watertight"}).exit_code, 0);
    // What is dropped leaves nothing here, and what is refused is named.
    EXPECT_EQ(remesh({"--thin", "drop"}).exit_code, 1);
    EXPECT_EQ(remesh({"--thin", "refuse"}).exit_code, 1);
    EXPECT_EQ(remesh({"--thin", "keep", "--isovalue", "0.1"}).exit_code, 2);
    EXPECT_EQ(remesh({"--max-loss", "1"}).exit_code, 2);
    EXPECT_EQ(run({"voxelize", in, "out.vdb", "--voxel-size", "0.05"}).exit_code, 0);
    EXPECT_EQ(run({"extract", "out.vdb", "of_volume.ply"}).exit_code, 0);
    EXPECT_EQ(run({"validate", "of_volume.ply", "--require", "watertight"}).exit_code, 0);
  }
}

TEST_F(CliTest, MuchThatIsLostIsNotMet) {
  // A cube with a fin beside it that holds no sample.
  write("fin.off",
        "OFF\n16 12 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
        "0 0 1.53\n1 0 1.53\n1 1 1.53\n0 1 1.53\n0 0 1.56\n1 0 1.56\n1 1 1.56\n0 1 1.56\n"
        "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n"
        "4 11 10 9 8\n4 12 13 14 15\n4 8 9 13 12\n4 9 10 14 13\n4 10 11 15 14\n4 11 8 12 15\n");
  const Outcome dropped =
      run({"remesh", "fin.off", "out.ply", "--voxel-size", "0.1", "--thin", "drop", "--json"});
  EXPECT_EQ(dropped.exit_code, 3) << dropped.err;
  // The fin has two of eight squares, and its four sides.
  EXPECT_NEAR(Json::parse(dropped.out).at("result").at("visible_loss").get<double>(), 2.12 / 8.12, 0.02);
  EXPECT_EQ(
      run({"remesh", "fin.off", "out.ply", "--voxel-size", "0.1", "--thin", "drop", "--max-loss", "30%"})
          .exit_code,
      0);
  EXPECT_EQ(run({"remesh", "fin.off", "out.ply", "--voxel-size", "0.1", "--max-loss", "1%"}).exit_code, 0);
}

TEST_F(CliTest, InfoOfAMesh) {
  write_cube();
  const Outcome outcome = run({"info", "cube.off"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* text :
       {"points     8\n", "triangles  12\n", "quads      0\n", "(-1, -1, -1)", "(1, 1, 1)", "(2, 2, 2)"})
    EXPECT_NE(outcome.out.find(text), std::string::npos) << outcome.out;
}

TEST_F(CliTest, ProgressIsShownOnATerminalAndErased) {
  write_sphere();
  const std::vector<std::string> arguments = {"remesh", "sphere.off", "out.ply", "--resolution", "80"};
  const std::string erase = "\r\033[K";
  const std::string sent = terminal_output(arguments);
  EXPECT_NE(sent.find("%"), std::string::npos) << sent;
  EXPECT_EQ(sent.find('\n'), std::string::npos) << sent;
  ASSERT_GE(sent.size(), erase.size());
  EXPECT_EQ(sent.substr(sent.size() - erase.size()), erase);

  std::vector<std::string> quiet = arguments;
  quiet.push_back("--quiet");
  EXPECT_EQ(terminal_output(quiet), "");
  EXPECT_EQ(run(arguments).err, "");
}

// The program must be in the middle of its work when the signal comes: these meshes take many seconds.
class InterruptTest : public ProgramTest {
 protected:
  void expect_cancelled(int signal, int exit_code, std::chrono::milliseconds after,
                        const std::vector<std::string>& arguments) {
    const std::set<std::string> before = files();
    const Outcome outcome = run(arguments, Interruption{signal, after});
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.out << outcome.err;
    EXPECT_LT(outcome.seconds, 1.0);
    EXPECT_EQ(outcome.err, "");
    EXPECT_EQ(files(), before);
  }
};

TEST_F(InterruptTest, LeavesNothingBehind) {
  write_sphere();
  for (const int milliseconds : {0, 100, 400})
    expect_cancelled(SIGINT, 130, std::chrono::milliseconds(milliseconds),
                     {"remesh", "sphere.off", "out.ply", "--resolution", "1000"});
}

TEST_F(InterruptTest, EndsLibraryCodeThatDoesNotPoll) {
  write_sphere();
  expect_cancelled(
      SIGINT, 130, std::chrono::milliseconds(700),
      {"remesh", "sphere.off", "out.ply", "--resolution", "300", "--extractor", "cgal-surface-mesher"});
}

TEST_F(InterruptTest, KeepsTheOlderOutput) {
  write_sphere();
  write("out.vdb", "older");
  expect_cancelled(SIGTERM, 143, std::chrono::milliseconds(300),
                   {"voxelize", "sphere.off", "out.vdb", "--resolution", "1000"});
  EXPECT_EQ(read("out.vdb"), "older");
}

}  // namespace
}  // namespace hermesh::cli
