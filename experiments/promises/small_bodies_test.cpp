// Bodies of one to four voxels: a closed component of an output never has negative volume, in any extractor
// that guarantees orientation, in Booleans and in fractures.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/fracture/fracture.h"
#include "algorithms/hermite/solids.h"
#include "algorithms/remesh/thin_parts.h"
#include "experiments/fracture/fracture_for_tests.h"
#include "experiments/promises/methods_for_tests.h"
#include "experiments/promises/solids_for_tests.h"

namespace hermesh {
namespace small_bodies_test {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using recipes::Random;
using test_solids::placed;
using test_solids::random_turn;
using test_solids::random_vector;

PolygonMesh octahedron() {
  MeshFile file;
  for (int a = 0; a < 3; ++a)
    for (const double side : {-1.0, 1.0}) file.points.push_back(side * Vector3d::Unit(a));
  for (std::uint32_t octant = 0; octant < 8; ++octant) {
    const std::uint32_t x = octant & 1, y = 2 + (octant >> 1 & 1), z = 4 + (octant >> 2);
    const bool odd = (octant ^ octant >> 1 ^ octant >> 2) & 1;
    file.triangles.push_back(odd ? Triangle{x, y, z} : Triangle{x, z, y});
  }
  return to_polygon_mesh(file);
}

PolygonMesh tetrahedron() {
  MeshFile file;
  file.points = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  file.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  return to_polygon_mesh(file);
}

/// Returns a convex body that is 2 wide, about the origin.
PolygonMesh body(Random& random) {
  RunContext context;
  switch (random.bits() % 5) {
    case 0:
      return test_solids::cuboid({-1, -random.uniform(0.4, 1.0), -random.uniform(0.4, 1.0)}, {2, 1.2, 1.4});
    case 1:
      return octahedron();
    case 2:
      return tetrahedron();
    case 3:
      return make_recipe("uv-sphere", {{"around", 12.0}, {"upward", 6.0}}, context);
    default:
      return make_recipe("cylinder", {{"around", 3.0 + double(random.bits() % 4)}, {"height", 1.6}}, context);
  }
}

/// Returns a body of one to four voxels of size 1. One in four has its axes along the lattice's, one in four
/// its middle at a sample or halfway between samples.
PolygonMesh small_body(Random& random, double spread) {
  const PolygonMesh shape = body(random);
  const bool turns = random.bits() % 4 != 0, anywhere = random.bits() % 4 != 0;
  const Matrix3d turn = turns ? random_turn(random) : Matrix3d(Matrix3d::Identity());
  const double half_width =
      turns || anywhere ? random.uniform(0.5, 2.0) : 0.25 * double(2 + random.bits() % 7);
  Vector3d at = random_vector(random, spread);
  if (!anywhere) at = (2.0 * at).array().round() / 2.0;
  return placed(shape, half_width * turn, at);
}

/// Expects that no component has a negative volume; convex bodies have no cavities.
void expect_outwards(const MeshFile& mesh, RunContext& context) {
  const validation::MeshReport report = validation::check_mesh(mesh, kCounts, context);
  EXPECT_EQ(report.boundary_edges + report.inconsistent_edges, 0);
  EXPECT_EQ(report.inside_out_components.value_or(0), 0);
  EXPECT_GE(report.volume, 0.0);
}

void check_extractors(std::uint64_t seed, int bodies) {
  int meshes = 0;
  for (int i = 0; i < bodies; ++i) {
    Random random(double(seed + std::uint64_t(i)));
    const PolygonMesh mesh = small_body(random, 8.0);
    RunContext context;
    const LevelSet volume = test_methods::voxelized(mesh, 1.0, context);
    for (const Extractor& extractor : our_extractors()) {
      if (!extractor.promises.oriented) continue;
      for (const char* tolerance : {"0", "0.1", "1"}) {
        const bool merges = test_methods::has_option(extractor, "tolerance");
        if (!merges && tolerance != std::string("0")) continue;
        SCOPED_TRACE("body " + std::to_string(i) + ", " + extractor.name + ", tolerance " + tolerance);
        const GivenOptions given = merges ? GivenOptions{{"tolerance", tolerance}} : GivenOptions{};
        const PolygonMesh made =
            extract(volume, &mesh, {.chosen = choose(our_extractors(), extractor.name, given)}, context).mesh;
        meshes += !made.empty();
        expect_outwards(to_mesh_file(made), context);
      }
    }
  }
  EXPECT_GT(meshes, 4 * bodies);
}

void check_booleans(std::uint64_t seed, int pairs) {
  int meshes = 0;
  for (int i = 0; i < pairs; ++i) {
    Random random(double(seed + std::uint64_t(i)));
    const PolygonMesh a = small_body(random, 1.0), b = small_body(random, 1.0);
    RunContext context;
    const SharedLattice lattice = shared_lattice(a, b, 1.0);
    const auto sampled = [&](const PolygonMesh& mesh) -> std::optional<SampledSolid> {
      try {
        return sample_solid(mesh, lattice, [&](const PolygonMesh& framed) {
          const LevelSet level_set = test_methods::voxelized(framed, 1.0, context);
          return solid_of(framed, level_set, ThinRule::drop, context).solid;
        });
      } catch (const Error&) {
        return std::nullopt;  // it has no sample inside
      }
    };
    const std::optional<SampledSolid> first = sampled(a), second = sampled(b);
    if (!first || !second) continue;
    for (const Boolean boolean : {Boolean::unite, Boolean::intersect, Boolean::subtract}) {
      const CombinedSolid result = combine(boolean, *first, *second, context);
      if (result.hermite.leaves.empty()) continue;
      SCOPED_TRACE("pair " + std::to_string(i) + ", operation " + std::to_string(int(boolean)));
      const PolygonMesh made = extract(result.level_set, nullptr,
                                       {.chosen = choose(our_extractors(), "manifold-dual-contouring"),
                                        .hermite = &result.hermite},
                                       context)
                                   .mesh;
      meshes += !made.empty();
      expect_outwards(to_mesh_file(made), context);
    }
  }
  EXPECT_GT(meshes, pairs);
}

void check_fractures(std::uint64_t seed, int bodies) {
  int pieces = 0;
  for (int i = 0; i < bodies; ++i) {
    Random random(double(seed + std::uint64_t(i)));
    const PolygonMesh mesh = small_body(random, 8.0);
    RunContext context;
    const LevelSet volume = test_methods::voxelized(mesh, 1.0, context);
    const FloatHermite object = sample_polygons(volume, 0.0, mesh, context);
    if (object.leaves.empty()) continue;
    const Bounds box = bounds(mesh);
    const Vector3d place = 0.5 * (box.lower + box.upper);
    const Vector3d normal = random_vector(random, 1.0).normalized();
    const auto cutters =
        plane_cutters({{normal, normal.dot(place) + random.uniform(-0.5, 0.5)}}, object.placement);
    for (const double tolerance : {0.0, 0.5}) {
      FractureOptions options;
      options.tolerance = tolerance;
      options.least_samples = 0;
      SCOPED_TRACE("body " + std::to_string(i) + ", tolerance " + std::to_string(tolerance));
      for (const PolygonMesh& piece : pieces_of(labelled_fracture(object, *cutters, options, context))) {
        ++pieces;
        expect_outwards(to_mesh_file(piece), context);
      }
    }
  }
  EXPECT_GT(pieces, bodies);
}

TEST(SmallBodies, NoExtractorTurnsThemInsideOut) { check_extractors(1, 300); }
TEST(SmallBodies, NoBooleanTurnsThemInsideOut) { check_booleans(2000, 150); }
TEST(SmallBodies, NoFractureTurnsThemInsideOut) { check_fractures(3000, 150); }

TEST(Slow, NoExtractorTurns10000SmallBodiesInsideOut) { check_extractors(100'000, 10'000); }
TEST(Slow, NoBooleanTurns10000PairsOfSmallBodiesInsideOut) { check_booleans(200'000, 10'000); }
TEST(Slow, NoFractureTurns10000SmallBodiesInsideOut) { check_fractures(300'000, 10'000); }

}  // namespace small_bodies_test
}  // namespace hermesh
