// Remeshing tile by tile: the bytes of the undivided mesh for any tiles and any number of jobs, and a mesh
// that keeps the guarantees across seams.
#include <vector>

#include "algorithms/extraction/certified_collapse/tile_mesh.h"
#include "algorithms/remesh/tiled_remesh.h"
#include "experiments/promises/methods_for_tests.h"
#include "experiments/promises/solids_for_tests.h"

namespace hermesh {
namespace tiles_test {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using recipes::Random;

/// A conversion with voxels of size 1.
struct Conversion {
  VoxelizeRecipe voxelizing;
  ExtractRecipe extracting;

  explicit Conversion(int side, const GivenOptions& more = {}) {
    GivenOptions given = more;
    given["tile"] = std::to_string(side);
    voxelizing.chosen = choose(our_voxelizers(), "hermesh", {{"signs", "winding-number"}});
    voxelizing.voxel_size = 1.0;
    extracting.chosen = choose(our_extractors(), "manifold-dual-contouring", given);
  }
  PolygonMesh whole(const PolygonMesh& mesh) const {
    RunContext context;
    return remesh(mesh, voxelizing, extracting, context).mesh;
  }
  PolygonMesh by_jobs(const PolygonMesh& mesh, int jobs = 1) const {
    RunContext context;
    std::vector<TilePart> parts;
    for (int job = jobs; job >= 1; --job)
      parts.push_back(remesh_tiles(mesh, voxelizing, extracting, {job, jobs}, context));
    return join_parts(std::move(parts));
  }
};

void append(PolygonMesh& mesh, const PolygonMesh& other) {
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
  for (const Triangle& t : triangulated(other))
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

PolygonMesh recipe(const char* name) {
  RunContext context;
  return make_recipe(name, {}, context);
}

/// Expects equal bytes by tiles, and the guarantees of the extractor.
void expect_same(const PolygonMesh& mesh, const Conversion& conversion, int jobs = 1) {
  const PolygonMesh whole = conversion.whole(mesh);
  EXPECT_TRUE(whole == conversion.by_jobs(mesh, jobs)) << whole.triangles.size() << " triangles";
  RunContext context;
  test_methods::expect_guarantees(conversion.extracting.chosen.extractor.promises, to_mesh_file(whole),
                                  context);
}

TEST(Tiles, AreThoseOfTheWholeForASphere) {
  const PolygonMesh sphere =
      test_solids::placed(recipe("uv-sphere"), 25.0 * Matrix3d::Identity(), {3.3, -7.1, 0.4});
  for (const int side : {16, 32, 128}) {
    SCOPED_TRACE(side);
    expect_same(sphere, Conversion(side), side == 32 ? 3 : 1);
  }
  expect_same(sphere, Conversion(32, {{"tolerance", "0"}}));
  expect_same(sphere, Conversion(32, {{"relaxation", "3"}, {"tolerance", "0.3"}}), 2);
}

TEST(Tiles, AreThoseOfTheWholeForCubes) {
  Random random(7);
  // Faces in planes of the lattice and of tiles; turned; far from zero.
  const PolygonMesh cube = test_solids::cuboid({-1, -1, -1}, {2, 2, 2});
  for (const Vector3d& at : {Vector3d(0, 0, 0), Vector3d(0.5, 0.25, 0), Vector3d(9000, -300, 12)})
    expect_same(test_solids::placed(cube, 32.0 * Matrix3d::Identity(), at), Conversion(32));
  for (int i = 0; i < 3; ++i) {
    SCOPED_TRACE(i);
    const Vector3d at = test_solids::random_vector(random, 10);
    expect_same(test_solids::placed(cube, 30.0 * test_solids::random_turn(random), at),
                Conversion(i ? 32 : 64), 2);
  }
}

TEST(Tiles, AreThoseOfTheWholeForThinAndOverlappingParts) {
  Random random(8);
  const PolygonMesh cube = test_solids::cuboid({-1, -1, -1}, {2, 2, 2});
  PolygonMesh parts;
  for (int i = 0; i < 8; ++i) {
    // Plates of one to three voxels, which meet and overlap.
    const Vector3d half(random.uniform(15, 30), random.uniform(15, 30), random.uniform(0.5, 1.5));
    const Matrix3d map = test_solids::random_turn(random) * half.asDiagonal();
    append(parts, test_solids::placed(cube, map, test_solids::random_vector(random, 12)));
  }
  expect_same(parts, Conversion(32), 2);
}

TEST(Tiles, AreThoseOfTheWholeForScatteredBodies) {
  Random random(9);
  PolygonMesh bodies;
  for (int i = 0; i < 500; ++i)
    append(bodies, test_solids::placed(test_solids::cuboid({-1, -1, -1}, {2, 2, 2}),
                                       random.uniform(0.4, 1.6) * test_solids::random_turn(random),
                                       test_solids::random_vector(random, 16)));
  expect_same(bodies, Conversion(32), 4);
}

TEST(Tiles, OpenPolygonsAndOtherMethodsAreRefused) {
  RunContext context;
  PolygonMesh open = test_solids::placed(recipe("uv-sphere"), 20.0 * Matrix3d::Identity(), Vector3d::Zero());
  Conversion conversion(32);
  const auto make = [&] { remesh_tiles(open, conversion.voxelizing, conversion.extracting, {}, context); };
  EXPECT_NO_THROW(make());
  conversion.voxelizing.chosen = choose(our_voxelizers(), "hermesh", {});
  EXPECT_THROW(make(), Error);
  conversion = Conversion(0);
  EXPECT_THROW(make(), Error);
  conversion = Conversion(32);
  open.triangles.size() > open.quads.size() ? open.triangles.pop_back()
                                            : open.quads.resize(open.quads.size() - 1);
  EXPECT_THROW(make(), Error);
}

TEST(Tiles, PartsThatDoNotBelongTogetherAreRefused) {
  RunContext context;
  const PolygonMesh sphere =
      test_solids::placed(recipe("uv-sphere"), 20.0 * Matrix3d::Identity(), Vector3d::Zero());
  const auto part = [&](int side, int number, int count) {
    const Conversion conversion(side);
    return remesh_tiles(sphere, conversion.voxelizing, conversion.extracting, {number, count}, context);
  };
  const auto joined = [](std::vector<TilePart> parts) { return join_parts(std::move(parts)); };
  EXPECT_NO_THROW(joined({part(32, 1, 2), part(32, 2, 2)}));
  EXPECT_THROW(joined({part(32, 1, 2)}), Error);
  EXPECT_THROW(joined({part(32, 1, 2), part(32, 1, 2)}), Error);
  EXPECT_THROW(joined({part(32, 1, 2), part(64, 2, 2)}), Error);
  EXPECT_THROW(joined({part(32, 1, 2), part(32, 2, 3)}), Error);
  // A part that claims to be complete: a tile, a vertex or a triangle of a seam differs.
  TilePart all = part(32, 1, 1);
  EXPECT_NO_THROW(joined({all}));
  TilePart missing = all, moved = all, turned = all;
  missing.tiles.pop_back();
  EXPECT_THROW(joined({missing}), Error);
  TileMesh& tile = moved.tiles[moved.tiles.size() / 2];
  tile.points.back().x() += 1e-3f;
  EXPECT_THROW(joined({moved}), Error);
  turned.tiles[0].fixed.pop_back();
  turned.tiles[0].touched.pop_back();
  EXPECT_THROW(joined({turned}), Error);
}

}  // namespace tiles_test
}  // namespace hermesh
