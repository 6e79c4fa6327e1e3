#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <limits>

#include "algorithms/io/test_mesh_files.h"

namespace hermesh {
namespace mesh_file_write_test {

namespace fs = std::filesystem;

class MeshFileWriteTest : public MeshFileTest {
 protected:
  std::string write_error_to(const fs::path& path, const PolygonMesh& mesh) {
    return error_in([&] { write_mesh(path, mesh, context); });
  }
};

TEST_F(MeshFileWriteTest, RoundTripsKeepEveryBit) {
  for (const Eigen::Vector3d& origin :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1e6, -1e6, 3), Eigen::Vector3d(0.5, 0, 0)}) {
    // The smallest coordinates of the mesh are above 2^-30, so that the sums with these origins are exact.
    PolygonMesh mesh = random_mesh(7, origin);
    for (Eigen::Vector3f& point : mesh.points)
      for (float& x : point) x = std::abs(x) < 1e-3f ? 0.25f : x;
    for (const char* name : {"a.ply", "a.obj", "a.off", "b.ply.gz", "b.obj.gz", "b.off.gz"}) {
      write_mesh(folder / name, mesh, context);
      const MeshFile file = read_mesh_file(folder / name, context);
      EXPECT_EQ(file.points, to_mesh_file(mesh).points) << name;
      EXPECT_EQ(file.triangles, mesh.triangles) << name;
      EXPECT_EQ(file.quads, mesh.quads) << name;
      EXPECT_TRUE(to_polygon_mesh(file) == mesh) << name;
    }
  }
  EXPECT_TRUE(context.notes.empty());
}

TEST_F(MeshFileWriteTest, AnOriginThatTheReaderWouldNotChooseIsKeptToo) {
  PolygonMesh mesh;  // far from the origin, yet relative to zero
  mesh.points = {{1000, 0, 0}, {1001, 0, 0}, {1000, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  write_mesh(folder / "a.ply", mesh, context);
  EXPECT_TRUE(read_mesh(folder / "a.ply", context) == mesh);
}

TEST_F(MeshFileWriteTest, PlyIsSinglePrecisionWhereThatLosesNothing) {
  const PolygonMesh near = random_mesh(1, {0, 0, 0}), far = random_mesh(1, {1e6, 1e6, 1e6});
  write_mesh(folder / "near.ply", near, context);
  write_mesh(folder / "far.ply", far, context);
  expect_words(bytes_of(folder / "near.ply"), "property float x");
  expect_words(bytes_of(folder / "far.ply"), "property double x");
}

TEST_F(MeshFileWriteTest, StlRoundTripKeepsSinglePrecisionPoints) {
  const PolygonMesh mesh = random_mesh(3, {0, 0, 0});
  for (const char* name : {"a.stl", "a.stl.gz"}) {
    write_mesh(folder / name, mesh, context);
    const MeshFile file = read_mesh_file(folder / name, context);
    const std::vector<Triangle> triangles = triangulated(mesh);
    ASSERT_EQ(file.triangles.size(), triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_EQ(file.points[file.triangles[i][k]], mesh.world(triangles[i][k]));
  }
}

TEST_F(MeshFileWriteTest, StlSaysWhatItLoses) {
  PolygonMesh mesh;
  mesh.origin = {1e6, 0, 0};
  mesh.points = {{0, 0, 0}, {0.001f, 0, 0}, {1, 1, 0}, {0, 1, 0}, {9, 9, 9}};
  mesh.quads = {{0, 1, 2, 3}};
  write_mesh(folder / "a.stl", mesh, context);
  ASSERT_EQ(context.notes.size(), 2u) << context.notes[0];
  expect_words(context.notes[0], "1 points moved, by at most 0.001, and 1 became equal");
  expect_words(context.notes[1], "1 points that no polygon uses");
}

TEST_F(MeshFileWriteTest, WritingFailsWithASentenceAndLeavesNothingBehind) {
  PolygonMesh mesh = random_mesh(1, {0, 0, 0}, 20);
  expect_words(write_error_to(folder / "a.xyz", mesh), "unknown type");
  expect_words(write_error_to(folder / "none" / "a.ply", mesh), "cannot write");
  expect_words(write_error_to("/dev/null/a.ply", mesh), "cannot write");
  mesh.points[3].y() = std::numeric_limits<float>::infinity();
  expect_words(write_error_to(folder / "a.ply", mesh), "point 3 is not finite");
  fs::create_directory(folder / "sub.ply");
  EXPECT_NE(write_error_to(folder / "sub.ply", mesh), "");
  EXPECT_EQ(files(), std::vector<std::string>{"sub.ply"});
}

/// A limit on the size of files stands in for a full disk.
TEST_F(MeshFileWriteTest, AFullDiskIsAnErrorAndKeepsTheOldFile) {
  const PolygonMesh mesh = random_mesh(1, {0, 0, 0}, 20000);
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit unlimited;
  getrlimit(RLIMIT_FSIZE, &unlimited);
  const rlimit small = {.rlim_cur = 10000, .rlim_max = unlimited.rlim_max};
  write("a.ply", "old");
  write("a.off.gz", "old");
  setrlimit(RLIMIT_FSIZE, &small);
  const std::string plain = write_error_to(folder / "a.ply", mesh);
  const std::string packed = write_error_to(folder / "a.off.gz", mesh);
  setrlimit(RLIMIT_FSIZE, &unlimited);
  expect_words(plain, "cannot write");
  expect_words(packed, "cannot write");
  EXPECT_EQ(bytes_of(folder / "a.ply"), "old");
  EXPECT_EQ(files().size(), 2u);
}

}  // namespace mesh_file_write_test
}  // namespace hermesh
