// Mesh files as other programs write them (foreign_meshes/): one ball of 162 points and 320 triangles in
// every format, each with another fault, and files that cannot be read.
#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "algorithms/io/mesh_file.h"
#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_foreign_mesh_test {

/// The file's bytes, unpacked where it is packed, so that the program sees the file as its writer left it.
std::string foreign(const std::string& name) {
  const std::string file = std::string(HERMESH_FOREIGN_MESHES) + "/" + name;
  const bool packed = !std::filesystem::exists(file);
  const gzFile in = gzopen((file + (packed ? ".gz" : "")).c_str(), "rb");  // also reads plain files
  if (!in) throw std::runtime_error("no file " + file);
  std::string bytes;
  char buffer[1 << 14];
  for (int size = 0; (size = gzread(in, buffer, sizeof buffer)) > 0;) bytes.append(buffer, std::size_t(size));
  gzclose(in);
  return bytes;
}

const Words kBallsWithBadAttributes =
    "obj_vt_nan.obj obj_vn_nan.obj obj_tinkercad_comma.obj obj_zero_attr.obj";
/// Files of a ball by other programs; true if the reader notes a fault.
const std::vector<std::pair<std::string, bool>> kBalls = {
    {"obj_nan_unref.obj", true},        {"obj_trailing_junk.obj", true}, {"off_glued.off", true},
    {"ply_long_lines.ply", true},       {"ply_long_lines2.ply", true},   {"ply_tristrips.ply", false},
    {"ply_header_line.ply", true},      {"ply_space.ply", false},        {"stl_count0.stl", true},
    {"stl_count_ffff.stl", true},       {"stl_count_less.stl", true},    {"stl_end_solid.stl", false},
    {"stl_no_endsolid.stl", true},      {"obj_vt_nan.obj", false},       {"obj_vn_nan.obj", false},
    {"obj_tinkercad_comma.obj", false}, {"obj_zero_attr.obj", false}};

class ForeignMeshTest : public ProgramTest {
 protected:
  void copy(const std::string& name) { write(name, foreign(name)); }
};

double volume_of(const MeshFile& mesh) {
  double volume = 0.0;
  for (const auto& [a, b, c] : mesh.triangles)
    volume += mesh.points[a].dot(mesh.points[b].cross(mesh.points[c])) / 6.0;
  return volume;
}

TEST_F(ForeignMeshTest, EveryBallIsTheSameBall) {
  const std::string glued = foreign("off_glued.off");
  write("ball.off", "OFF\n" + glued.substr(3));
  const auto remeshed = [&](const std::string& name, bool noted) {
    const Outcome outcome = run_to(0, {"remesh", name, "a.obj", "--resolution", "32", "--extractor",
                                       "marching-cubes", "--attributes", "none"});
    EXPECT_EQ(outcome.err.find("note: ") != std::string::npos, noted) << outcome.err;
    return read("a.obj");
  };
  const std::string ball = remeshed("ball.off", false);
  EXPECT_GT(ball.size(), 10000u);
  for (const auto& [name, noted] : kBalls) {
    SCOPED_TRACE(name);
    copy(name);
    EXPECT_TRUE(remeshed(name, noted) == ball);
    RunContext context;
    const MeshFile mesh = read_mesh_file(path(name), context);
    EXPECT_EQ(mesh.points.size(), 162u);
    EXPECT_EQ(mesh.triangles.size(), 320u);
    EXPECT_NEAR(volume_of(mesh), 4.045389, 1e-6);
  }
}

TEST_F(ForeignMeshTest, AttributesThatCannotBeReadAreLeftOut) {
  for (const std::string& name : kBallsWithBadAttributes) {
    SCOPED_TRACE(name);
    copy(name);
    const Outcome broken =
        run_to(0, {"fracture", name, "out", "--resolution", "12", "--cutters", "planes:1", "--no-picture"});
    EXPECT_PRED2(has, broken.err, "note: ");
    std::filesystem::remove_all(path("out"));
    for (const std::string grids : {"attributes", "sdf,attributes", "fog,attributes"}) {
      const Outcome made = run_to(0, {"voxelize", name, "out.vdb", "--resolution", "12", "--grids", grids});
      EXPECT_PRED2(has, made.err, "note: ");
      EXPECT_TRUE(std::filesystem::exists(path("out.vdb")));
      std::filesystem::remove(path("out.vdb"));
    }
    // The file is refused only if the attribute is requested by name.
    const std::string attribute = name == "obj_vt_nan.obj" ? "uv" : "normal";
    const Outcome asked = run_to(
        1, {"voxelize", name, "out.vdb", "--resolution", "12", "--grids", "sdf,attribute:" + attribute});
    EXPECT_PRED2(has, asked.err, "'" + attribute + "'");
    EXPECT_FALSE(std::filesystem::exists(path("out.vdb")));
  }
}

TEST_F(ForeignMeshTest, DamagedFilesAreRefusedInOneShortCleanSentence) {
  for (const std::string name : {"damaged-format.ply", "escape-in-ply-format.ply"}) {
    copy(name);
    for (const Words& arguments :
         {Words{"info", name}, {"validate", name}, {"remesh", name, "a.obj", "--resolution", "32"}})
      expect_refusal(1, arguments, {name, "line 2"}, false, 300);
    EXPECT_FALSE(std::filesystem::exists(path("a.obj")));
  }
}

/// A prism whose file mixes quads, which take two numbers each, and the two triangles.
TEST_F(ForeignMeshTest, TriangleIdIsTheNumberInTheFile) {
  write("prism.obj",
        "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 2\nv 4 0 2\nv 0 4 2\n"
        "f 1 2 5 4\nf 1 3 2\nf 2 3 6 5\nf 4 5 6\nf 3 1 4 6\n");
  run_to(0, "voxelize prism.obj p.vdb --voxel-size 0.13 --grids sdf,triangle-id");
  run_to(0, "extract p.vdb p.ply --attributes triangle-id --extractor marching-cubes");
  RunContext context;
  const MeshFile mesh = read_mesh_file(path("p.ply"), context, {.attributes = true});
  const auto found = std::ranges::find(mesh.attributes, "triangle-id", &MeshAttribute::name);
  ASSERT_NE(found, mesh.attributes.end());
  ASSERT_EQ(found->domain, AttributeDomain::point);
  const auto& ids = std::get<std::vector<std::int32_t>>(found->values);
  std::size_t caps = 0, sides = 0;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const Eigen::Vector3d& p = mesh.points[i];
    if (p.x() > 0.6 && p.y() > 0.6 && p.x() + p.y() < 3) {  // far from the sides
      EXPECT_EQ(ids[i], p.z() < 1 ? 2 : 5) << p.transpose();
      ++caps;
    } else if (p.z() > 0.6 && p.z() < 1.4) {  // far from the caps
      const bool front = p.y() < 0.2 && p.x() > 0.6 && p.x() < 3,
                 left = p.x() < 0.2 && p.y() > 0.6 && p.y() < 3;
      if (!front && !left) continue;
      EXPECT_TRUE(front ? ids[i] == 0 || ids[i] == 1 : ids[i] == 6 || ids[i] == 7)
          << p.transpose() << ": " << ids[i];
      ++sides;
    }
  }
  EXPECT_GT(caps, 50u);
  EXPECT_GT(sides, 50u);
}

}  // namespace cli_foreign_mesh_test
}  // namespace hermesh::cli
