#include "algorithms/fracture/cutters.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "algorithms/fracture/growing_tree.h"
#include "algorithms/fracture/labelled_solid.h"
#include "algorithms/fracture/mass_properties.h"
#include "algorithms/fracture/noise.h"
#include "algorithms/fracture/piece_attributes.h"
#include "algorithms/fracture/scatter.h"
#include "algorithms/hermite/test_lattice.h"
#include "algorithms/search/transfer_attributes.h"

namespace hermesh {
namespace cutters_test {

using Eigen::Vector3d;

PolygonMesh cuboid(const Vector3d& lower, const Vector3d& upper) {
  PolygonMesh mesh;
  for (int c = 0; c < 8; ++c)
    mesh.points.push_back(
        Vector3d(c & 1 ? upper.x() : lower.x(), c & 2 ? upper.y() : lower.y(), c & 4 ? upper.z() : lower.z())
            .cast<float>());
  mesh.quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  return mesh;
}

TEST(GrowingTree, GivesWhatALoopOverAllPlacesGives) {
  Random random(7);
  // Many positions are equal in some or all coordinates.
  const auto place = [&] {
    Vector3d p;
    for (double& x : p)
      x = std::floor(16.0 * random.uniform()) / 4.0 + (random.uniform() < 0.3 ? random.uniform() : 0.0);
    return p;
  };
  GrowingTree tree;
  std::vector<Vector3d> places;
  EXPECT_EQ(tree.nearest(Vector3d::Zero()), std::numeric_limits<double>::infinity());
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p = place();
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vector3d& other : places) nearest = std::min(nearest, (other - p).squaredNorm());
    ASSERT_EQ(tree.nearest(p), nearest);
    if (i % 10 == 0) {
      const double reach = 2.0 * random.uniform();
      std::vector<std::uint32_t> expected, found;
      for (std::uint32_t k = 0; k < places.size(); ++k)
        if ((places[k] - p).squaredNorm() <= reach) expected.push_back(k);
      tree.for_each_within(p, reach, [&](std::uint32_t k) { found.push_back(k); });
      std::sort(found.begin(), found.end());
      ASSERT_EQ(found, expected);
    }
    places.push_back(p);
    tree.add(p);
  }
}

TEST(PlaneCutters, CrossWhereThePlaneDoes) {
  IndexToWorld placement;
  placement.linear *= 0.5;
  const auto cutters =
      plane_cutters({{Vector3d(2, 0, 0), 1.3}, {Vector3d(0, 1, 0), 1.0}}, placement);  // x = 0.65, y = 1
  std::array<CutCode, 512> codes;
  cutters->codes({0, 0, 0}, codes);
  EXPECT_EQ(codes[sample_index(1, 0, 0)], 0u);
  EXPECT_EQ(codes[sample_index(2, 1, 5)], 1u);
  EXPECT_EQ(codes[sample_index(0, 2, 5)], 2u);  // exactly on the plane is beyond it
  EXPECT_EQ(codes[sample_index(7, 7, 7)], 3u);
  const auto crossing = cutters->crossing({1, 0, 0}, 0, 0, 1);
  ASSERT_TRUE(crossing);
  EXPECT_FLOAT_EQ(crossing->crossing.offset, 0.3f);
  EXPECT_EQ(crossing->crossing.normal, (std::array<float, 3>{1, 0, 0}));
  EXPECT_EQ(crossing->cutter, 0);
  EXPECT_FALSE(cutters->crossing({2, 0, 0}, 0, 0, 1));
  EXPECT_EQ(cutters->nearest({2, 0, 0}, 0, 0, 1)->crossing.offset, 0.0f);
  EXPECT_EQ(*cutters->plane_between(1, 0), Vector3d(1, 0, 0));
  EXPECT_FALSE(cutters->plane_between(0, 3));
}

TEST(PlaneCutters, RefuseWhatIsNone) {
  EXPECT_THROW(plane_cutters({{Vector3d::Zero(), 1.0}}, {}), Error);
  EXPECT_THROW(plane_cutters(std::vector<CuttingPlane>(65, {Vector3d::UnitX(), 0.0}), {}), Error);
}

TEST(VoronoiCutters, CodeIsTheNearestSeedAndWallsLieBetween) {
  Random random(1);
  std::vector<Vector3d> seeds;
  for (int i = 0; i < 40; ++i)
    seeds.push_back(40.0 * Vector3d(random.uniform(), random.uniform(), random.uniform()));
  const auto cutters = voronoi_cutters(seeds, {}, {});
  for (const int corner : {0, 8, 24}) {
    std::array<CutCode, 512> codes;
    cutters->codes({corner, corner, 8}, codes);
    for (int i = 0; i < 512; ++i) {
      const Vector3d x(corner + (i >> 6), corner + ((i >> 3) & 7), 8 + (i & 7));
      const auto nearest =
          std::min_element(seeds.begin(), seeds.end(), [&](const Vector3d& a, const Vector3d& b) {
            return (a - x).squaredNorm() < (b - x).squaredNorm();
          });
      ASSERT_EQ(codes[static_cast<std::size_t>(i)], static_cast<CutCode>(nearest - seeds.begin()));
      if ((i & 7) == 7 || codes[static_cast<std::size_t>(i)] == codes[static_cast<std::size_t>(i) + 1])
        continue;
      const CutCode a = codes[static_cast<std::size_t>(i)], b = codes[static_cast<std::size_t>(i) + 1];
      const auto crossing =
          cutters->crossing({corner + (i >> 6), corner + ((i >> 3) & 7), 8 + (i & 7)}, 2, a, b);
      ASSERT_TRUE(crossing);
      const Vector3d hit = x + double(crossing->crossing.offset) * Vector3d::UnitZ();
      EXPECT_NEAR((hit - seeds[a]).norm(), (hit - seeds[b]).norm(), 1e-5);
      const auto& n = crossing->crossing.normal;
      EXPECT_NEAR(Vector3d(n[0], n[1], n[2]).dot((seeds[b] - seeds[a]).normalized()), 1.0, 1e-6);
    }
  }
}

TEST(VoronoiCutters, ABlockMayHoldWhatItHoldsAndNotWhatIsFarAway) {
  Random random(2);
  std::vector<Vector3d> seeds;
  for (int i = 0; i < 60; ++i)
    seeds.push_back(80.0 * Vector3d(random.uniform(), random.uniform(), random.uniform()));
  for (const double amplitude : {0.0, 4.0}) {
    const auto cutters = voronoi_cutters(seeds, {amplitude, 10.0, 3}, {});
    std::size_t possible = 0, held = 0;
    for (int b = 0; b < 1000; ++b) {
      const Cutters::At lower{8 * (b / 100), 8 * (b / 10 % 10), 8 * (b % 10)};
      std::array<CutCode, 512> codes;
      cutters->codes(lower, codes);
      for (CutCode code = 0; code < seeds.size(); ++code) {
        const bool holds = std::ranges::count(codes, code) > 0, may = cutters->may_hold(lower, code);
        ASSERT_TRUE(may || !holds) << "block " << b << ", code " << code;
        possible += may;
        held += holds;
      }
    }
    EXPECT_LT(possible, 30 * held);
    EXPECT_LT(possible, 60'000U / 2) << "of 60 seeds, most are far from most blocks";
    EXPECT_FALSE(cutters->may_hold({0, 0, 0}, 60)) << "there is no such seed";
  }
}

TEST(VoronoiCutters, DisplacedWallsAreFoundToTheStatedError) {
  const std::vector<Vector3d> seeds = {{10, 10, 2}, {10, 10, 18}};
  const Displacement displacement{2.0, 6.0, 9};
  const auto cutters = voronoi_cutters(seeds, displacement, {});
  const VectorNoise noise(9);
  int found = 0;
  for (int x = 4; x < 16; ++x)
    for (int z = 4; z < 16; ++z)
      if (const auto crossing = cutters->crossing({x, 9, z}, 2, 0, 1)) {
        const auto height = [&](double t) { return z + t + 2.0 * noise(Vector3d(x, 9, z + t) / 6.0).z(); };
        // The wall is where the displaced position has height 10; it lies on both sides of that height within
        // the error.
        const double t = crossing->crossing.offset;
        EXPECT_LE(height(t - 2e-6), 10.0);
        EXPECT_GE(height(t + 2e-6), 10.0);
        ++found;
      }
  EXPECT_GE(found, 12);
}

TEST(MeshCutters, TheFirstTakesWhatItHolds) {
  RunContext context;
  const std::vector<CuttingMesh> meshes = {
      {"a", cuboid({1.3, -2, -2}, {5.3, 4, 4})}, {"none", {}}, {"b", cuboid({-9, -9, -9}, {9, 9, 9})}};
  const auto cutters = mesh_cutters(meshes, {}, context);
  std::array<CutCode, 512> codes;
  cutters->codes({0, 0, 0}, codes);
  EXPECT_EQ(codes[sample_index(2, 1, 1)], 0u);
  EXPECT_EQ(codes[sample_index(1, 1, 1)], 2u);
  cutters->codes({16, 0, 0}, codes);
  EXPECT_EQ(codes[0], 3u);
  const auto crossing = cutters->crossing({1, 1, 1}, 0, 2, 0);
  ASSERT_TRUE(crossing);
  EXPECT_NEAR(crossing->crossing.offset, 0.3, 1e-6);
  EXPECT_EQ(crossing->crossing.normal[0], -1.0f);
  EXPECT_TRUE(cutters->is_empty(1));
  EXPECT_FALSE(cutters->is_empty(0));
}

TEST(MeshCutters, LieOnAnyLattice) {
  RunContext context;
  IndexToWorld placement;
  placement.linear =
      0.5 * Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitZ()).toRotationMatrix();  // index x is world y
  placement.base = {3, 0, 0};
  placement.origin = {0, 1, 0};
  const auto cutters = mesh_cutters({{"a", cuboid({-2, 1.1, -2}, {2, 3.1, 2})}}, placement, context);
  // Sample (i, j, k) lies at world (−j/2, 1 + (i − 3)/2, k/2); y = 1.1 is at index 3.2.
  const auto crossing = cutters->crossing({3, 0, 0}, 0, 1, 0);
  ASSERT_TRUE(crossing);
  EXPECT_NEAR(crossing->crossing.offset, 0.2, 1e-5);
}

TEST(Scatter, PlacesAreInsideAndFarFromOneAnother) {
  RunContext context;
  const LabelledSolid solid =
      whole_solid(to_sparse(sample_solid(box(10, 10, 10, 10.5, 10.5, 10.5))), context);
  const auto places = scatter(solid, 50, {.seed = 2, .density = {}}, context);
  EXPECT_EQ(places, scatter(solid, 50, {.seed = 2, .density = {}}, context));
  EXPECT_NE(places, scatter(solid, 50, {.seed = 3, .density = {}}, context));
  const double spacing = std::cbrt(21.0 * 21.0 * 21.0 / 50.0);
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_LE((places[i] - Vector3d::Constant(10)).cwiseAbs().maxCoeff(), 11.0);
    for (std::size_t j = 0; j < i; ++j) EXPECT_GT((places[i] - places[j]).norm(), 0.4 * spacing);
  }
}

TEST(Scatter, ClustersAboutAnImpact) {
  RunContext context;
  const LabelledSolid solid =
      whole_solid(to_sparse(sample_solid(box(10, 10, 10, 10.5, 10.5, 10.5))), context);
  const auto density = density_about(Vector3d(0, 10, 10), 4.0);
  EXPECT_DOUBLE_EQ(density(Vector3d(0, 10, 10)), 1.0);
  EXPECT_DOUBLE_EQ(density(Vector3d(4, 10, 10)), 0.5);
  std::size_t near = 0;
  for (const Vector3d& place : scatter(solid, 60, {.seed = 2, .density = density}, context))
    near += place.x() < 7.0;
  EXPECT_GT(near, 30u);  // a third of the box
  EXPECT_THROW(scatter(solid, 2, {.seed = 2, .density = [](const Vector3d&) { return 0.0; }}, context),
               Error);
}

TEST(MassProperties, OfACuboid) {
  PolygonMesh mesh = cuboid({-1, -1.5, -2}, {1, 1.5, 2});
  mesh.origin = {100, 0, 0};
  const MassProperties mass = mass_properties(mesh);
  EXPECT_NEAR(mass.volume, 24.0, 1e-12);
  EXPECT_NEAR(mass.area, 2 * (6 + 8 + 12), 1e-12);
  EXPECT_NEAR((mass.centre - Vector3d(100, 0, 0)).norm(), 0.0, 1e-12);
  // m/12 · (b² + c²), the sides being 2, 3 and 4.
  EXPECT_TRUE(mass.inertia.isApprox(Eigen::Matrix3d(Vector3d(50, 40, 26).asDiagonal()), 1e-12))
      << mass.inertia;
}

TEST(PieceAttributes, CutUvIsTheSameFromBothSidesAndKeepsLengths) {
  PolygonMesh piece;
  piece.points = {{0, 0, 0}, {3, 0, 0}, {0, 4, 0}};
  piece.triangles = {{0, 1, 2}, {0, 2, 1}};
  for (const char* name : {"surface", "neighbour"})
    piece.attributes.push_back({name, AttributeDomain::polygon, 1, std::vector<std::int32_t>{1, 1}, {}});
  std::get<1>(piece.attributes[1].values)[1] = 2;
  add_cut_uv(piece, [](std::int32_t neighbour) { return Vector3d(0, 0, neighbour == 1 ? 1.0 : -1.0); });
  const auto& uv = std::get<0>(piece.attributes.back().values);
  const auto at = [&](int i) { return Eigen::Vector2f(uv[2 * i], uv[2 * i + 1]); };
  EXPECT_FLOAT_EQ((at(1) - at(0)).norm(), 3.0f);
  EXPECT_FLOAT_EQ((at(2) - at(1)).norm(), 5.0f);
  EXPECT_EQ(at(2), at(4));
  EXPECT_EQ(at(1), at(5));
}

TEST(PieceAttributes, OriginalPolygonsTakeThoseOfTheSource) {
  PolygonMesh source = cuboid({0, 0, 0}, {4, 4, 4});
  source.attributes = {
      {"material", AttributeDomain::polygon, 1, std::vector<std::int32_t>{0, 1, 2, 3, 4, 5}, {}},
      {"height", AttributeDomain::point, 1, std::vector<float>{0, 0, 0, 0, 4, 4, 4, 4}, {}}};
  PolygonMesh piece;
  piece.points = {{4, 1, 1}, {4, 3, 1}, {4, 1, 3}, {2, 2, 2}};
  piece.triangles = {{0, 1, 2}, {0, 2, 3}};
  piece.attributes.push_back({"surface", AttributeDomain::polygon, 1, std::vector<std::int32_t>{0, 1}, {}});
  RunContext context;
  SourceAttributes(source, 1.0).add_to(piece, context);
  EXPECT_EQ(std::get<1>(piece.attributes[1].values), (std::vector<std::int32_t>{1, -1}));
  const auto& height = std::get<0>(piece.attributes[2].values);
  EXPECT_NEAR(height[0], 1.0f, 1e-6);
  EXPECT_NEAR(height[2], 3.0f, 1e-6);
}

/// A PLY file has texture coordinates per vertex; the pieces have them per corner, because they differ at
/// seams.
TEST(PieceAttributes, TextureCoordinatesOfPointsGoIntoTheCorners) {
  PolygonMesh source = cuboid({0, 0, 0}, {4, 4, 4});
  std::vector<float> uv;
  for (const Eigen::Vector3f& p : source.points) uv.insert(uv.end(), {0.25f * p.y(), 0.25f * p.z()});
  source.attributes = {{"uv", AttributeDomain::point, 2, uv, {}}};
  PolygonMesh piece;
  piece.points = {{4, 1, 0.5f}, {4, 3, 1}, {4, 3, 2}, {2, 2, 2}};  // within one half of a face
  piece.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const char* name : {"surface", "neighbour"})
    piece.attributes.push_back({name, AttributeDomain::polygon, 1, std::vector<std::int32_t>{0, 1}, {}});
  add_cut_uv(piece, [](std::int32_t) { return Vector3d(1, 0, 0); });
  const std::vector<float> cut = std::get<0>(piece.attributes.back().values);
  RunContext context;
  SourceAttributes(source, 1.0).add_to(piece, context);
  ASSERT_EQ(piece.attributes.size(), 3u);
  const auto& found = std::get<0>(piece.attributes.back().values);
  ASSERT_EQ(found.size(), 12u);
  const float expected[] = {0.25f, 0.125f, 0.75f, 0.25f, 0.75f, 0.5f};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(found[i], expected[i], 1e-6) << i;
  for (std::size_t i = 6; i < 12; ++i) EXPECT_EQ(found[i], cut[i]) << i;
}

}  // namespace cutters_test
}  // namespace hermesh
