// The public functions: values computed by hand, cancelling, errors.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

#include "hermesh/hermesh.h"
#include "hermesh/openvdb.h"
#include "hermesh/validate.h"
#include "packages/cpp/meshes_for_tests.h"

namespace facade_test {

using hermesh::Attribute;
using hermesh::AttributeDomain;
using hermesh::Boolean;
using hermesh::Context;
using hermesh::Error;
using hermesh::Mesh;
using hermesh::Placement;
using hermesh::Volume;
using hermesh::VoxelizeOptions;
using namespace hermesh_tests;

// ---- Arrays.

TEST(PublicMesh, GivesItsArraysBack) {
  const std::vector<float> points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0};
  const std::vector<std::uint32_t> triangles = {0, 2, 1, 0, 1, 3}, quads = {0, 1, 4, 2};
  const std::vector<float> normals(15, 0.5f);
  const std::vector<std::int32_t> parts = {7, 8, -1};
  const std::vector<Attribute> attributes = {
      {.name = "normal", .components = 3, .floats = normals},
      {.name = "part", .domain = AttributeDomain::polygon, .integers = parts, .labels = {"a", "b"}}};
  const Mesh mesh(std::span<const float>(points), triangles, quads, attributes);
  EXPECT_EQ(std::vector<float>(mesh.points().begin(), mesh.points().end()), points);
  EXPECT_EQ(std::vector<std::uint32_t>(mesh.triangles().begin(), mesh.triangles().end()), triangles);
  EXPECT_EQ(std::vector<std::uint32_t>(mesh.quads().begin(), mesh.quads().end()), quads);
  EXPECT_EQ(mesh.origin(), (std::array<double, 3>{0, 0, 0}));
  EXPECT_EQ(mesh.point_count(), 5u);
  EXPECT_EQ(mesh.triangle_count(), 2u);
  EXPECT_EQ(mesh.quad_count(), 1u);
  const std::vector<Attribute> given_back = mesh.attributes();
  ASSERT_EQ(given_back.size(), 2u);
  EXPECT_EQ(given_back[0].floats.size(), 15u);
  EXPECT_EQ(given_back[0].floats[14], 0.5f);
  EXPECT_EQ(given_back[1].integers[2], -1);
  EXPECT_EQ(given_back[1].labels, (std::vector<std::string>{"a", "b"}));
  const Mesh plain = mesh.with_attributes({});
  EXPECT_TRUE(plain.attributes().empty());
  EXPECT_TRUE(std::ranges::equal(plain.quads(), mesh.quads()));
  EXPECT_EQ(plain.with_attributes(given_back).attributes()[0].floats[14], 0.5f);
  EXPECT_EQ(complaint([&] {
              mesh.with_attributes(std::vector<Attribute>{attributes[0], attributes[0]});
            }),
            "there are two attributes of the name 'normal'");
  // Copies share the arrays.
  const Mesh copy = mesh;
  EXPECT_EQ(copy.points().data(), mesh.points().data());
}

TEST(PublicMesh, KeepsPrecisionFarFromZero) {
  const Mesh mesh = cube(1.0, {1e7, 0, -1e7});
  const std::vector<double> world = mesh.world_points();
  EXPECT_EQ(world[0], 1e7);
  EXPECT_EQ(world[3], 1e7 + 1.0);  // single precision about 0 would have steps of 1
  EXPECT_NE(mesh.origin()[0], 0.0);
  EXPECT_EQ(mesh.origin()[1], 0.0);
}

TEST(PublicMesh, RefusesWhatIsNone) {
  const std::vector<float> points = {0, 0, 0, 1, 0, 0, 0, 1, 0}, short_of_one = {0, 0, 0, 1};
  const std::vector<std::uint32_t> good = {0, 1, 2}, beyond = {0, 1, 3}, odd = {0, 1};
  const auto of = [](const std::vector<float>& p, const std::vector<std::uint32_t>& t) {
    return complaint([&] { Mesh(std::span<const float>(p), t); });
  };
  EXPECT_EQ(of(points, good), "");
  EXPECT_EQ(of(short_of_one, {}), "the array of points holds 4 numbers, which is no multiple of 3");
  EXPECT_EQ(of(points, beyond),
            "triangle number 0 refers to point 3, but there are 3 points (both count from 0)");
  EXPECT_EQ(of(points, odd), "the array of triangles holds 2 numbers, which is no multiple of 3");
  std::vector<float> broken = points;
  broken[4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(of(broken, good), "point 1 (counting from 0) has a coordinate that is not a finite number");
  const std::vector<float> two = {1, 2};
  const std::vector<Attribute> wrong = {{.name = "a", .floats = two}};
  EXPECT_EQ(complaint([&] { Mesh(std::span<const float>(points), good, {}, wrong); }),
            "the attribute 'a' has 2 values, but the mesh needs 3");
}

TEST(PublicVolume, GoesToAnArrayAndBack) {
  // Trilinear interpolation is exact for a linear function.
  const std::array<int, 3> dims = {3, 4, 5};
  std::vector<float> values;
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 4; ++y)
      for (int z = 0; z < 5; ++z) values.push_back(float(100 * x + 10 * y + z));
  hermesh::DenseOptions options;
  options.lower = {-1, 2, 10};
  options.placement = Placement::uniform(0.5, {1, 2, 3});
  const Volume volume = Volume::from_dense(values, dims, options);
  EXPECT_EQ(volume.name(), "volume");
  EXPECT_FALSE(volume.is_level_set());
  EXPECT_EQ(volume.active_voxels(), 60u);  // also the sample with the least value
  EXPECT_EQ(volume.lower(), options.lower);
  EXPECT_EQ(volume.dims(), dims);
  EXPECT_DOUBLE_EQ(volume.voxel_size(), 0.5);
  EXPECT_EQ(volume.value_range(), (std::pair<float, float>(0.0f, 234.0f)));
  EXPECT_LT(volume.background(), 0.0);
  EXPECT_EQ(volume.placement().rows, options.placement.rows);
  const hermesh::DenseVolume dense = volume.to_dense();
  EXPECT_EQ(dense.lower, options.lower);
  EXPECT_EQ(dense.values, values);
  // Index (0.5, 3.25, 11), 1.5, 1.25 and 1 beyond the first sample, lies at 0.5 · index + (1, 2, 3).
  const std::vector<double> place = {1.25, 3.625, 8.5};
  EXPECT_FLOAT_EQ(volume.sample(place)[0], 150.0f + 12.5f + 1.0f);
  // A background of one's own leaves the samples that have its value known.
  options.background = 234.0f;
  const Volume other = Volume::from_dense(values, dims, options);
  EXPECT_EQ(other.active_voxels(), 60u);
  EXPECT_EQ(other.background(), 234.0);
  EXPECT_EQ(other.to_dense().values, values);
  const std::vector<double> beyond = {100, 100, 100};
  EXPECT_EQ(other.sample(beyond)[0], 234.0f);
}

TEST(PublicVolume, PlacementMayTurnAndMirror) {
  hermesh::DenseOptions options;
  options.placement.rows = {{{0, -2, 0, 5}, {3, 0, 0, 6}, {0, 0, -1, 7}}};
  const Volume volume = Volume::from_dense(std::vector<float>(8, 1.0f), {2, 2, 2}, options);
  const auto rows = volume.placement().rows;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      EXPECT_NEAR(rows[row][column], options.placement.rows[row][column], 1e-12);
  EXPECT_NEAR(volume.voxel_size(), std::cbrt(6.0), 1e-12);
  options.placement.rows[2] = {0, 0, 0, 1};
  EXPECT_TRUE(contains(complaint([&] {
                         Volume::from_dense(std::vector<float>(8), {2, 2, 2}, options);
                       }),
                       "cannot be inverted"));
  EXPECT_TRUE(contains(complaint([&] {
                         Volume::from_dense(std::vector<float>(7), {2, 2, 2});
                       }),
                       "holds 7 samples"));
  EXPECT_EQ(complaint([] { Volume().voxel_size(); }), "the volume holds nothing");
}

TEST(PublicVolume, ALevelSetThroughAnArrayHasTheSameMesh) {
  Context context;
  const Volume level_set = hermesh::voxelize(torus(), at_resolution(40), context);
  EXPECT_TRUE(level_set.is_level_set());
  EXPECT_EQ(level_set.name(), "sdf");
  EXPECT_NEAR(level_set.voxel_size(), 2.8 / 40, 1e-6);
  const hermesh::DenseVolume dense = level_set.to_dense();
  const Volume again = Volume::from_dense(dense.values, dense.dims,
                                          {.lower = dense.lower,
                                           .placement = level_set.placement(),
                                           .level_set = true,
                                           .background = float(level_set.background())});
  EXPECT_EQ(again.active_voxels(), level_set.active_voxels());
  const Mesh a = hermesh::extract(level_set, {}, context), b = hermesh::extract(again, {}, context);
  ASSERT_GT(a.quad_count(), 1000u);
  EXPECT_TRUE(std::ranges::equal(a.points(), b.points()));
  EXPECT_TRUE(std::ranges::equal(a.quads(), b.quads()));
  // The distance in the middle of the tube is its radius, if the band reaches that far.
  VoxelizeOptions wide = at_resolution(40);
  wide.interior_band = 12;
  const std::vector<double> middle = {1, 0, 0};
  EXPECT_NEAR(hermesh::voxelize(torus(), wide, context).sample(middle)[0], -0.4, 0.035);
}

TEST(PublicVolume, SharesALatticeWithAnother) {
  Context context;
  const Volume first = hermesh::voxelize(cube(1.0), {.voxel_size = 0.11}, context);
  const Volume second = hermesh::voxelize(cube(1.0, {0.3, 0.3, 0.3}), {.like = first}, context);
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      EXPECT_NEAR(second.placement().rows[row][column], first.placement().rows[row][column], 1e-15);
  const std::vector<double> inside = {1.2, 1.2, 1.2};  // 0.1 from three faces of only the second cube
  EXPECT_NEAR(second.sample(inside)[0], -0.1, 0.02);
  EXPECT_GT(first.sample(inside)[0], 0.1);
}

TEST(PublicVolume, GridsOfOneVoxelization) {
  Context context;
  const std::vector<Volume> volumes =
      hermesh::voxelize_grids(torus(), "sdf,fog,closest-point,triangle-id", at_resolution(30), context);
  ASSERT_EQ(volumes.size(), 4u);
  std::set<std::string> names;
  for (const Volume& volume : volumes) names.insert(volume.name() + " " + volume.value_type());
  EXPECT_EQ(names,
            (std::set<std::string>{"sdf float", "fog float", "closest-point vec3s", "triangle-id int32"}));
  for (const Volume& volume : volumes)
    if (volume.name() == "closest-point") {
      EXPECT_EQ(complaint([&] { volume.to_dense(); }),
                "the volume 'closest-point' holds vec3s values; one of floats is needed");
    }
}

TEST(PublicVolume, IsAnOpenvdbGrid) {
  Context context;
  const Volume level_set = hermesh::voxelize(torus(), at_resolution(20), context);
  const auto grid = openvdb::gridConstPtrCast<openvdb::FloatGrid>(hermesh::to_openvdb(level_set));
  ASSERT_TRUE(grid);
  EXPECT_EQ(grid->activeVoxelCount(), level_set.active_voxels());
  const Volume shared = hermesh::from_openvdb(grid);
  EXPECT_EQ(hermesh::to_openvdb(shared), hermesh::to_openvdb(level_set));
  const auto ints = openvdb::Int32Grid::create(-5);
  ints->tree().setValue(openvdb::Coord(1, 2, 3), 7);
  const Volume converted = hermesh::from_openvdb(ints);
  EXPECT_EQ(converted.value_type(), "float");
  EXPECT_EQ(converted.background(), -5.0);
  EXPECT_EQ(converted.to_dense().values, std::vector<float>{7.0f});
}

// ---- Hermite data, Booleans, fracture, validation.

TEST(PublicHermite, CrossingsLieOnTheCube) {
  Context context;
  const Mesh mesh = cube(1.0);
  const Volume level_set = hermesh::voxelize(mesh, {.voxel_size = 0.13}, context);
  const hermesh::Solid solid = hermesh::Solid::of(level_set, mesh, context);
  // Lattice lines through the unit square at steps of 0.13 from 0: 7 a side for samples within, at 0.13 to
  // 0.91 (that at 0 is on a face, and counts as in or out for all lines alike), two crossings a line, three
  // axes.
  const std::size_t lines = solid.crossings() / 6;
  EXPECT_TRUE(lines == 49 || lines == 64) << solid.crossings();
  const std::vector<float> points = solid.crossing_points(), normals = solid.crossing_normals();
  ASSERT_EQ(points.size(), 3 * solid.crossings());
  for (std::size_t i = 0; i < points.size(); i += 3) {
    int on_faces = 0;
    for (int axis = 0; axis < 3; ++axis)
      if (std::abs(std::abs(normals[i + axis]) - 1.0f) < 1e-6f) {
        const float face = normals[i + axis] > 0 ? 1.0f : 0.0f;
        on_faces += std::abs(points[i + axis] - face) < 1e-5f;
      }
    EXPECT_EQ(on_faces, 1) << "crossing " << i / 3;
  }
}

TEST(PublicHermite, BooleansOfCubesHaveTheirVolumes) {
  Context context;
  const Mesh a = cube(1.0), b = cube(1.0, {0.5, 0.5, 0.5});
  const std::pair<Boolean, double> expected[] = {
      {Boolean::union_of, 1.875}, {Boolean::intersection, 0.125}, {Boolean::difference, 0.875}};
  for (const auto& [operation, volume] : expected) {
    const Mesh mesh = hermesh::combine(operation, a, b, {.resolution = 30}, {}, context);
    const hermesh::Report report = hermesh::validate(mesh, {.libraries = false}, context);
    EXPECT_TRUE(report.watertight());
    EXPECT_NEAR(report.volume, volume, 1e-3) << int(operation);
  }
  EXPECT_TRUE(contains(
      complaint([&] {
        hermesh::combine(Boolean::intersection, a, cube(1.0, {3, 3, 3}), {.resolution = 30}, {}, context);
      }),
      "the result is empty, nothing was written"));
  // By hand: both on one lattice, combined, and contoured.
  const Volume first = hermesh::voxelize(a, {.voxel_size = 0.07}, context);
  const Volume second = hermesh::voxelize(b, {.like = first}, context);
  const hermesh::Solid both = hermesh::combine(Boolean::difference, hermesh::Solid::of(first, a, context),
                                               hermesh::Solid::of(second, b, context), context);
  const Mesh mesh = hermesh::extract(both, {.extractor = "manifold-dual-contouring"}, context);
  EXPECT_NEAR(hermesh::validate(mesh, {.libraries = false}, context).volume, 0.875, 2e-3);
}

TEST(PublicFracture, PiecesAddUpAndFit) {
  Context context;
  hermesh::FractureOptions options;
  options.cutters = "planes:1,0,0,0.3;0,1,0,0.6";
  const hermesh::Fracture fracture = hermesh::fracture(cube(1.0), {.resolution = 24}, options, context);
  ASSERT_EQ(fracture.pieces.size(), 4u);
  double volume = 0.0;
  std::vector<Mesh> meshes;
  for (const hermesh::Piece& piece : fracture.pieces) {
    volume += piece.volume;
    EXPECT_FALSE(piece.neighbours.empty());
    meshes.push_back(piece.mesh);
  }
  EXPECT_NEAR(volume, 1.0, 1e-3);
  const hermesh::FractureReport report = hermesh::validate_fracture(meshes, context);
  EXPECT_TRUE(report.consistent) << report.sentences.at(0);
  EXPECT_GT(report.seam_triangles, 100);
  // A mesh in memory cuts in the same way as its file.
  hermesh::FractureOptions by_mesh;
  by_mesh.meshes = {{"corner", cube(1.0, {0.5, 0.5, 0.5})}};
  const hermesh::Fracture two = hermesh::fracture(cube(1.0), {.resolution = 24}, by_mesh, context);
  ASSERT_EQ(two.pieces.size(), 2u);
  EXPECT_NEAR(std::min(two.pieces[0].volume, two.pieces[1].volume), 0.125, 0.01);
  options.method = "openvdb";
  EXPECT_EQ(complaint([&] { hermesh::fracture(cube(1.0), {.resolution = 24}, options, context); }),
            "there is no method 'openvdb'; there are labelled and thesis");
}

TEST(PublicValidate, ReportsWhatIsThere) {
  Context context;
  const hermesh::Report whole = hermesh::validate(cube(2.0), {}, context);
  EXPECT_TRUE(whole.watertight());
  EXPECT_EQ(whole.volume, 8.0);
  EXPECT_EQ(whole.area, 24.0);
  EXPECT_EQ(whole.genus, 0.0);
  EXPECT_TRUE(whole.defects.empty());
  EXPECT_TRUE(contains(whole.json, "\"watertight\": true"));
  // A cube without one face has its four edges open.
  const Mesh all = cube(2.0);
  const std::vector<float> points(all.points().begin(), all.points().end());
  const Mesh open(std::span<const float>(points), {}, all.quads().first(20));
  const hermesh::Report report = hermesh::validate(open, {}, context);
  EXPECT_EQ(report.boundary_edges, 4);
  ASSERT_EQ(report.defects.size(), 1u);
  EXPECT_EQ(report.defects[0].name, "boundary_edges");
  EXPECT_EQ(report.defects[0].places.size(), 4u);
  // Compared with itself moved by 1 along x: the largest distance is 1.
  const Mesh moved = cube(2.0, {1, 0, 0});
  const hermesh::Report apart = hermesh::validate(moved, {.reference = &all, .certify = true}, context);
  ASSERT_TRUE(apart.to_reference && apart.certified_to_reference);
  EXPECT_NEAR(apart.to_reference->max, 1.0, 1e-9);
  EXPECT_LE(apart.certified_to_reference->lower, 1.0 + 1e-9);
  EXPECT_GE(apart.certified_to_reference->upper, 1.0 - 1e-9);
  EXPECT_EQ(apart.solid, "differs");
  EXPECT_EQ(complaint([&] { hermesh::validate(all, {.certify = true}, context); }),
            "certify bounds the distance to a reference: give one");
}

// ---- Cancelling, progress, errors.

TEST(PublicContext, CancelsFromTheCallback) {
  Context context;
  std::set<std::string> stages;
  context.on_progress = [&](std::string_view stage, double fraction) {
    EXPECT_GE(fraction, 0.0);
    EXPECT_LE(fraction, 1.0);
    stages.insert(std::string(stage));
  };
  const Mesh mesh = torus();
  hermesh::remesh(mesh, at_resolution(60), {}, context);
  EXPECT_GE(stages.size(), 3u);
  EXPECT_FALSE(context.stage_seconds.empty());

  int calls = 0;
  std::chrono::steady_clock::time_point asked;
  context.on_progress = [&](std::string_view, double) {
    if (++calls == 3) asked = std::chrono::steady_clock::now(), context.cancel();
  };
  EXPECT_THROW(hermesh::remesh(mesh, at_resolution(120), {}, context), hermesh::Cancelled);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - asked).count(), 0.5);
  // The request holds until it is taken back.
  context.on_progress = {};
  EXPECT_THROW(hermesh::remesh(mesh, at_resolution(20), {}, context), hermesh::Cancelled);
  context.reset();
  EXPECT_FALSE(hermesh::remesh(mesh, at_resolution(20), {}, context).empty());
}

TEST(PublicContext, AnExceptionOfTheCallbackComesOut) {
  Context context;
  struct Mine {
    int number;
  };
  for (const int at : {1, 2, 5}) {
    int calls = 0;
    context.on_progress = [&](std::string_view, double) {
      if (++calls == at) throw Mine{at};
    };
    try {
      hermesh::remesh(torus(), at_resolution(60), {}, context);
      FAIL() << "nothing was thrown";
    } catch (const Mine& mine) {
      EXPECT_EQ(mine.number, at);
    }
    EXPECT_FALSE(context.cancelled());
  }
}

TEST(PublicContext, NotesWhatIsThinnerThanAVoxel) {
  Context context;
  // A plate of a tenth of a voxel, next to a cube.
  const Mesh a = cube(1.0);
  std::vector<double> points = a.world_points();
  std::vector<std::uint32_t> quads(a.quads().begin(), a.quads().end());
  for (int i = 0; i < 8; ++i) {
    points.push_back(2.0 + (i & 1));
    points.push_back(i >> 1 & 1);
    points.push_back(0.513 + 0.005 * (i >> 2));
  }
  for (std::size_t i = 0; i < 24; ++i) quads.push_back(quads[i] + 8);
  hermesh::remesh(Mesh(std::span<const double>(points), {}, quads), {.voxel_size = 0.05}, {}, context);
  ASSERT_EQ(context.notes.size(), 1u);
  EXPECT_TRUE(contains(context.notes[0], "0.005")) << context.notes[0];
}

TEST(PublicErrors, AreTheProgramsSentences) {
  Context context;
  const Mesh mesh = torus();
  const auto remesh = [&](VoxelizeOptions voxelizing, hermesh::ExtractOptions extracting = {}) {
    return complaint([&] { hermesh::remesh(mesh, voxelizing, extracting, context); });
  };
  EXPECT_TRUE(contains(remesh({}), "exactly one of resolution, voxel_size and like"));
  EXPECT_TRUE(contains(remesh({.resolution = 20}, {.extractor = "marching"}), "marching-cubes"));
  EXPECT_TRUE(contains(remesh({.resolution = 20}, {.options = {{"tolerance", "-1"}}}), "tolerance"));
  EXPECT_TRUE(contains(remesh({.resolution = 20}, {.options = {{"tolerence", "1"}}}), "tolerence"));
  EXPECT_TRUE(contains(remesh({.resolution = 20, .voxelizer = "none"}), "thesis"));
  EXPECT_TRUE(contains(remesh({.voxel_size = 1e-9}), "1e-09"));
  EXPECT_TRUE(contains(remesh({.resolution = 20}, {.isovalue = 5}), "isovalue 5"));
  EXPECT_NE(complaint([&] { hermesh::remesh(Mesh(), {.voxel_size = 1.0}, {}, context); }), "");
  EXPECT_TRUE(contains(complaint([&] { hermesh::read_mesh("/nowhere.ply", context); }), "/nowhere.ply"));
  EXPECT_TRUE(contains(complaint([&] { hermesh::read_vdb("/nowhere.vdb", context); }), "/nowhere.vdb"));
  EXPECT_EQ(complaint([] { hermesh::ThreadLimit(0); }), "the number of threads must be at least 1, not 0");
}

TEST(PublicOptions, ListsMethods) {
  std::set<std::string> names;
  for (const hermesh::MethodInfo& method : hermesh::extractors()) {
    names.insert(method.name);
    EXPECT_FALSE(method.summary.empty());
    if (method.name == "manifold-dual-contouring") {
      EXPECT_TRUE(method.free_of_self_intersection);
    }
  }
  EXPECT_TRUE(names.contains("marching-cubes") && names.contains("dual-contouring"));
  EXPECT_EQ(hermesh::voxelizers().front().name, "hermesh");
  EXPECT_STREQ(hermesh::version(), HERMESH_VERSION_STRING);
}

}  // namespace facade_test
