// hermesh import, and extract where the surface runs into the end of the data or the volume has attributes.
#include <algorithm>
#include <cmath>
#include <map>

#include "algorithms/io/import/files_for_tests.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_import_test {

using Json = nlohmann::json;

class ImportTest : public ProgramTest {
 protected:
  void expect_refusal(int exit_code, const Words& arguments, const Words& words) {
    ProgramTest::expect_refusal(exit_code, arguments, words, true);
  }
  Json judged(const std::string& mesh) { return json_of({"validate", mesh, "--json"}); }

  /// A ball of radius 6.3 that the box's upper end in z cuts, as integers; 20 x 19 x 12 samples of 1 x 1 x 2
  /// mm.
  static NiftiBytes ball(bool big_endian = false) {
    std::vector<std::int16_t> values;
    for (int z = 0; z < 12; ++z)
      for (int y = 0; y < 19; ++y)
        for (int x = 0; x < 20; ++x)
          values.push_back(
              static_cast<std::int16_t>(100 * (6.3 - std::hypot(x - 10.0, y - 9.0, 2.0 * z - 20.0))));
    return NiftiBytes(big_endian).dims({20, 19, 12}).type(4, 16).put<float>(88, 2.0f).samples(values);
  }
};

TEST_F(ImportTest, NiftiToMeshClosedAndOpen) {
  write_gzipped(path("ball.nii.gz"), ball(true).bytes());
  const Outcome imported = run_to(0, "import ball.nii.gz ball.vdb");
  EXPECT_EQ(imported.err, "");
  EXPECT_PRED2(has, imported.out, "20 x 19 x 12 samples");
  EXPECT_PRED2(has, run("info ball.vdb").out, "volume");

  const Outcome closed = run_to(0, "extract ball.vdb closed.ply --extractor marching-cubes");
  EXPECT_PRED2(has, closed.err, "+z");
  EXPECT_EQ(judged("closed.ply").at("boundary_edges"), 0);
  EXPECT_EQ(judged("closed.ply").at("euler_characteristic"), 2);
  RunContext context;
  const MeshFile mesh = read_mesh_file(path("closed.ply"), context);
  double highest = 0.0;
  for (const Eigen::Vector3d& point : mesh.points) highest = std::max(highest, point.z());
  EXPECT_NEAR(highest, 23.0, 1e-6);  // half a voxel of 2 mm beyond the sample at 22 mm

  run_to(0, "extract ball.vdb open.ply --extractor marching-cubes --ends open");
  EXPECT_GT(judged("open.ply").at("boundary_edges"), 0);
  EXPECT_EQ(judged("open.ply").at("euler_characteristic"), 1);
  expect_refusal(2, "extract ball.vdb out.ply --ends ajar", "--ends ajar");
}

TEST_F(ImportTest, RawIsTheSameVolume) {
  write_bytes(path("ball.nii"), ball().bytes());
  write_bytes(path("ball.raw"), ball().bytes());
  run_to(0, "import ball.nii a.vdb");
  run_to(0, "import ball.raw b.vdb --dims 20,19,12 --type int16le --spacing 1,1,2 --offset 352");
  for (const char* name : {"a", "b"})
    run_to(0, {"extract", name + std::string(".vdb"), name + std::string(".ply")});
  EXPECT_TRUE(read("a.ply") == read("b.ply"));
}

TEST_F(ImportTest, BadInputIsRefusedInASentence) {
  write_bytes(path("a.nii"), ball().bytes());
  write_bytes(path("short.nii"), ball().bytes().substr(0, 5000));
  write_bytes(path("nan.nii"),
              NiftiBytes().dims({2, 1, 1}).type(16, 32).samples<float>({1.0f, std::nanf("")}).bytes());
  write("text.nii", "this is no volume but words, and not enough of them");
  expect_refusal(1, "import none.nii out.vdb", {"none.nii"});
  expect_refusal(1, "import text.nii out.vdb", {"text.nii"});
  expect_refusal(1, "import short.nii out.vdb", {"short.nii", "20 x 19 x 12"});
  expect_refusal(1, "import nan.nii out.vdb", "nan.nii --replace-nan");
  expect_refusal(1, "import a.nii out.ply", "out.ply .vdb");
  expect_refusal(1, "import a.nii out.vdb --frame 1", {"a.nii", "frame 1"});
  expect_refusal(2, "import a.raw out.vdb", "a.raw --dims");
  expect_refusal(2, "import a.nii out.vdb --type int8", {"--dims"});
  expect_refusal(2, "import a.nii out.vdb --dims 1,2,3", {"--type"});
  expect_refusal(2, "import a.nii out.vdb --dims 1,2 --type int8", "--dims 1,2");
  expect_refusal(2, "import a.nii out.vdb --dims 1,2,3 --type int7", "int7 float64");
  expect_refusal(1, "import a.nii out.vdb --dims 100000,100000,100000 --type int8", {"a.nii"});
  expect_refusal(1, "import a.nii out.vdb --dims 2,2,2 --type int8", {"a.nii"});
  expect_refusal(2, "import nan.nii out.vdb --replace-nan 1e39", {"--replace-nan", "single precision"});
  const Outcome replaced = run_to(0, "import nan.nii nan.vdb --replace-nan -5");
  EXPECT_PRED2(has, replaced.err, "replaced");
}

TEST_F(ImportTest, AnIsovalueBeyondTheDataSaysSo) {
  write_bytes(path("a.nii"), ball().bytes());
  run_to(0, "import a.nii a.vdb");
  for (const char* isovalue : {"1000", "-5000"})
    expect_refusal(1, {"extract", "a.vdb", "out.ply", "--isovalue", isovalue}, {"a.vdb", isovalue});
}

TEST_F(ImportTest, AttributesOfTheVolumeReachTheMesh) {
  write("t.obj",
        "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nv 0 0 1 1 1 1\nvn -1 0 0\nvn 0 -1 0\nvn 0 0 -1\nvn 1 1 "
        "1\n"
        "usemtl clay\nf 1//3 3//3 2//3\nf 1//2 2//2 4//2\nusemtl tin\nf 1//1 4//1 3//1\nf 2//4 3//4 4//4\n");
  run_to(0, "voxelize t.obj t.vdb --resolution 30 --grids sdf,attributes,closest-point,triangle-id");
  const Outcome outcome = run_to(0, "extract t.vdb t.ply --attributes all");
  EXPECT_EQ(outcome.err, "");
  RunContext context;
  const MeshFile mesh = read_mesh_file(path("t.ply"), context, {.attributes = true});
  std::map<std::string, const MeshAttribute*> found;
  for (const MeshAttribute& attribute : mesh.attributes) found[attribute.name] = &attribute;
  for (const char* name : {"colour", "normal", "material", "triangle-id", "closest-point_x"})
    ASSERT_TRUE(found.contains(name)) << name;
  const auto& colours = std::get<std::vector<float>>(found["colour"]->values);
  const auto& materials = std::get<std::vector<std::int32_t>>(found["material"]->values);
  const auto& x = std::get<std::vector<float>>(found["closest-point_x"]->values);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const Eigen::Vector3d p = mesh.points[i];
    EXPECT_NEAR(x[i], p.x(), 0.05);
    EXPECT_TRUE(materials[i] == 0 || materials[i] == 1);
    // The colours are linear: green is x + z on the surface.
    EXPECT_NEAR(colours[3 * i + 1], p.x() + p.z(), 0.06);
  }
  run_to(0, "extract t.vdb one.ply --attributes colour");
  EXPECT_EQ(read_mesh_file(path("one.ply"), context, {.attributes = true}).attributes.size(), 1u);
  expect_refusal(1, "extract t.vdb out.ply --attributes warmth", "warmth colour");
  expect_refusal(2, "extract t.vdb out.obj --attributes all", {"out.obj", "only .ply"});
  expect_refusal(2, "extract t.vdb out.ply --attributes colour,colour", {"--attributes", "colour twice"});
}

}  // namespace cli_import_test
}  // namespace hermesh::cli
