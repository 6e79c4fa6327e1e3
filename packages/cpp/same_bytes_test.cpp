// The public functions make the same bytes as the program does for the same options.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>

#include "experiments/cli/process_for_tests.h"
#include "hermesh/hermesh.h"
#include "hermesh/openvdb.h"
#include "hermesh/validate.h"
#include "packages/cpp/meshes_for_tests.h"

namespace same_bytes_test {

using hermesh::Boolean;
using hermesh::Context;
using hermesh::Error;
using hermesh::Mesh;
using hermesh::Volume;
using namespace hermesh_tests;

class AsTheProgram : public hermesh::cli::ProgramTest {
 protected:
  void program(const hermesh::cli::Words& arguments) { run_to(0, arguments); }
  void expect_same(const std::string& a, const std::string& b) {
    const std::string first = read(a);
    ASSERT_FALSE(first.empty());
    EXPECT_EQ(first == read(b), true) << a << " and " << b << " differ";
  }
  Context context_;
};

TEST_F(AsTheProgram, Remeshes) {
  // Quads of a file are cut along their better diagonal, by the library as by the program.
  for (const Mesh& mesh : {torus(), cube(1.0)}) {
    hermesh::write_mesh(path("in.ply"), mesh, context_);
    for (const std::string extractor :
         {"manifold-dual-contouring", "certified-octree", "marching-cubes", "dual-contouring"}) {
      program({"remesh", "in.ply", "program.ply", "--resolution", "40", "--extractor", extractor});
      const Mesh made = hermesh::remesh(mesh, at_resolution(40), {.extractor = extractor}, context_);
      hermesh::write_mesh(path("library.ply"), made, context_);
      expect_same("program.ply", "library.ply");
    }
  }
  program("remesh in.ply program.ply --voxel-size 0.03 -o tolerance=0.3 --signs winding-number");
  hermesh::ThreadLimit one(1);
  const Mesh made = hermesh::remesh(cube(1.0), {.voxel_size = 0.03, .options = {{"signs", "winding-number"}}},
                                    {.options = {{"tolerance", "0.3"}}}, context_);
  hermesh::write_mesh(path("library.ply"), made, context_);
  expect_same("program.ply", "library.ply");
}

// A square plate of a twentieth of a voxel passes between the samples.
TEST_F(AsTheProgram, KeepsThinParts) {
  const Mesh plate = box({1.0, 1.0, 0.001}, {0.0, 0.0, 0.013});
  hermesh::write_mesh(path("in.ply"), plate, context_);
  const hermesh::VoxelizeOptions size = {.voxel_size = 0.02};
  using hermesh::Thin;
  program("remesh in.ply program.ply --voxel-size 0.02");
  const Mesh made = hermesh::remesh(plate, size, {}, context_);
  hermesh::write_mesh(path("library.ply"), made, context_);
  expect_same("program.ply", "library.ply");
  EXPECT_FALSE(context_.notes.empty()) << "a thickened plate is a note";

  program("combine union in.ply in.ply program.ply --voxel-size 0.02");
  const Mesh both = hermesh::combine(Boolean::union_of, plate, plate, size, {}, context_);
  hermesh::write_mesh(path("library.ply"), both, context_);
  expect_same("program.ply", "library.ply");

  hermesh::VoxelizeOptions asked = size;
  for (const Thin thin : {Thin::drop, Thin::refuse}) {
    asked.thin = thin;
    EXPECT_THROW(hermesh::remesh(plate, asked, {}, context_), Error);
  }
  asked.thin = Thin::keep;
  EXPECT_THROW(hermesh::remesh(plate, asked, {.isovalue = 0.01}, context_), Error);
  EXPECT_THROW(hermesh::voxelize(plate, asked, context_), Error);
}

TEST_F(AsTheProgram, RemeshesWithinAnError) {
  hermesh::write_mesh(path("in.ply"), torus(), context_);
  program("remesh in.ply program.ply --error 0.03");
  const hermesh::BoundedRemesh made = hermesh::remesh_within(torus(), {.error = 0.03}, context_);
  hermesh::write_mesh(path("library.ply"), made.mesh, context_);
  expect_same("program.ply", "library.ply");
  EXPECT_LE(made.to_polygons, 0.03);
  EXPECT_LE(made.from_polygons, 0.03);
  const hermesh::BoundedRemesh few = hermesh::remesh_within(torus(), {.triangles = 300}, context_);
  EXPECT_LE(few.mesh.triangle_count(), 300u);
  EXPECT_TRUE(few.exceptions.empty());
  EXPECT_THROW(hermesh::remesh_within(torus(), {}, context_), Error);
  EXPECT_THROW(hermesh::remesh_within(torus(), {.error = 0.1, .triangles = 10}, context_), Error);
  EXPECT_THROW(hermesh::remesh_within(torus(), {.error = 0.1, .signs = "unsigned"}, context_), Error);
}

TEST_F(AsTheProgram, VoxelizesAndExtracts) {
  hermesh::write_mesh(path("in.ply"), torus(), context_);
  program("voxelize in.ply program.vdb --resolution 40");
  const Volume volume = hermesh::voxelize(torus(), at_resolution(40), context_);
  hermesh::write_vdb(path("library.vdb"), volume, context_);
  expect_same("program.vdb", "library.vdb");
  program("voxelize in.ply program.vdb --resolution 40 --grids sdf,fog,closest-point");
  const std::vector<Volume> volumes =
      hermesh::voxelize_grids(torus(), "sdf,fog,closest-point", at_resolution(40), context_);
  hermesh::write_vdb(path("library.vdb"), volumes, context_);
  expect_same("program.vdb", "library.vdb");
  EXPECT_EQ(hermesh::grid_names(path("library.vdb")),
            (std::vector<std::string>{"closest-point", "fog", "sdf"}));

  program("extract program.vdb program.ply --grid fog --isovalue 0.5 --extractor marching-cubes");
  const Volume fog = hermesh::read_vdb(path("library.vdb"), context_, "fog");
  const Mesh mesh = hermesh::extract(fog, {.extractor = "marching-cubes", .isovalue = 0.5}, context_);
  hermesh::write_mesh(path("library.ply"), mesh, context_);
  expect_same("program.ply", "library.ply");
}

TEST_F(AsTheProgram, Combines) {
  const Mesh a = torus(), b = cube(1.0, {0.2, -0.5, -0.5});
  hermesh::write_mesh(path("a.ply"), a, context_);
  hermesh::write_mesh(path("b.ply"), b, context_);
  program("combine difference a.ply b.ply program.ply --resolution 40");
  const Mesh mesh = hermesh::combine(Boolean::difference, a, b, at_resolution(40), {}, context_);
  hermesh::write_mesh(path("library.ply"), mesh, context_);
  expect_same("program.ply", "library.ply");
}

TEST_F(AsTheProgram, Breaks) {
  hermesh::write_mesh(path("in.ply"), torus(), context_);
  program("fracture in.ply pieces --resolution 40 --cutters chunks:5 --seed 3 --no-picture");
  hermesh::FractureOptions options;
  options.cutters = "chunks:5";
  options.seed = 3;
  const hermesh::Fracture fracture = hermesh::fracture(torus(), at_resolution(40), options, context_);
  std::set<std::string> written;
  for (const auto& entry : std::filesystem::directory_iterator(path("pieces")))
    if (entry.path().extension() == ".ply") written.insert(entry.path().filename().string());
  ASSERT_EQ(written.size(), fracture.pieces.size());
  std::size_t number = 0;
  for (const std::string& name : written) {
    hermesh::write_mesh(path("library.ply"), fracture.pieces[number++].mesh, context_);
    expect_same("pieces/" + name, "library.ply");
  }
}

TEST_F(AsTheProgram, Judges) {
  hermesh::write_mesh(path("in.ply"), torus(), context_);
  const std::string of_program = run_to(0, "validate in.ply --json").out;
  const std::string json = hermesh::validate(torus(), {}, context_).json;
  // The program adds the file and the requirements; every line of ours is in its text.
  std::istringstream lines(json);
  int counted = 0;
  for (std::string line; std::getline(lines, line); ++counted) {
    if (line.ends_with(",")) line.pop_back();
    EXPECT_TRUE(contains(of_program, line)) << line;
  }
  EXPECT_GT(counted, 30);
}

TEST_F(AsTheProgram, ImportsRawSamples) {
  std::string bytes;
  for (int i = 0; i < 4 * 5 * 6; ++i) bytes.push_back(char(i));
  write("in.raw", bytes);
  program("import in.raw program.vdb --dims 4,5,6 --type uint8 --spacing 1,1,2");
  const Volume volume = hermesh::import_volume(
      path("in.raw"), {.raw = hermesh::RawSamples{.dims = {4, 5, 6}, .type = "uint8", .spacing = {1, 1, 2}}},
      context_);
  hermesh::write_vdb(path("library.vdb"), volume, context_);
  expect_same("program.vdb", "library.vdb");
  // x is fastest in the file, z in an array.
  EXPECT_EQ(volume.to_dense().values[1], 20.0f);
  EXPECT_EQ(volume.dims(), (std::array<int, 3>{4, 5, 6}));
}

}  // namespace same_bytes_test
