#include "algorithms/extraction/certified_collapse/manifold_dual_contouring.h"

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/extraction/certified_octree/certified_octree.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace manifold_dual_contouring_test {

using Eigen::Vector3d;

constexpr double kRadius = 15.0;

FloatHermite sphere() {
  RunContext context;
  const AnalyticSurface surface = {
      .value = [](const Vector3d& p) { return p.norm() - kRadius; },
      .gradient = [](const Vector3d& p) { return p; },
  };
  return sample_function(surface, IndexToWorld(), {-20, -20, -20}, {20, 20, 20}, 1e-9, context);
}

/// A cube of side 20, turned about two axes.
struct TurnedCube {
  Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(0.4, Vector3d::UnitX()) * Eigen::AngleAxisd(0.3, Vector3d::UnitY())).matrix();
  static constexpr double kHalf = 10.0;

  FloatHermite hermite() const {
    RunContext context;
    const Eigen::Matrix3d back = turn.transpose();
    const AnalyticSurface surface = {
        .value = [back](const Vector3d& p) { return (back * p).cwiseAbs().maxCoeff() - kHalf; },
        .gradient =
            [this, back](const Vector3d& p) {
              const Vector3d q = back * p;
              int axis;
              q.cwiseAbs().maxCoeff(&axis);
              return Vector3d(turn.col(axis) * (q[axis] < 0 ? -1.0 : 1.0));
            },
        .lipschitz = 1.0,
    };
    return sample_function(surface, IndexToWorld(), {-20, -20, -20}, {20, 20, 20}, 1e-9, context);
  }
};

PolygonMesh contour(const FloatHermite& hermite, const ManifoldDualContouringOptions& options,
                    const AdaptivityField* field = nullptr) {
  RunContext context;
  return manifold_dual_contouring(view_of(hermite, context), options, field, context);
}
PolygonMesh contour(const FloatHermite& hermite, double tolerance, const AdaptivityField* field = nullptr) {
  return contour(hermite, {.tolerance = tolerance, .uniform = {}}, field);
}

/// Values between −1 and 1 at random.
FloatHermite noise(int x_size, int y_size, int z_size, unsigned seed) {
  initialize_openvdb();
  RunContext context;
  const auto grid = openvdb::FloatGrid::create(1.0f);
  auto access = grid->getAccessor();
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  for (int x = 0; x < x_size; ++x)
    for (int y = 0; y < y_size; ++y)
      for (int z = 0; z < z_size; ++z) access.setValue({x, y, z}, value(random));
  return sample_level_set(make_level_set(grid), 0.0, context);
}

double volume(const PolygonMesh& mesh) {
  double sum = 0;
  for (const Triangle& t : triangulated(mesh))
    sum += mesh.world(t[0]).dot(mesh.world(t[1]).cross(mesh.world(t[2]))) / 6.0;
  return sum;
}

TEST(ManifoldDualContouring, SphereStaysWithinTheTolerance) {
  const FloatHermite hermite = sphere();
  const PolygonMesh fine = contour(hermite, 0.0);
  for (const double tolerance : {0.05, 0.25, 1.0}) {
    const PolygonMesh mesh = contour(hermite, tolerance);
    EXPECT_LT(mesh.triangle_count(), fine.triangle_count() / (tolerance < 0.1 ? 2 : 6)) << tolerance;
    constexpr double kOfTheUniformMesh = 0.03;  // its points lie on tangent planes of the sphere
    for (const Eigen::Vector3f& p : mesh.points)
      EXPECT_NEAR(p.norm(), kRadius, tolerance + kOfTheUniformMesh);
    EXPECT_NEAR(volume(mesh), volume(fine), tolerance * 4 * M_PI * kRadius * kRadius);
  }
}

TEST(ManifoldDualContouring, AveragePlacementNeedsNoNormals) {
  FloatHermite hermite = TurnedCube().hermite();
  const auto average = [&] {
    return contour(hermite,
                   {.tolerance = 0, .uniform = {.placement = DualContouringOptions::Placement::average}});
  };
  const PolygonMesh with_normals = average();  // by vector code
  for (EdgeCrossing& crossing : hermite.crossings) crossing.normal = {};
  const PolygonMesh without = average();
  ASSERT_EQ(with_normals.points.size(), without.points.size());
  for (std::size_t i = 0; i < without.points.size(); ++i)
    EXPECT_LT((with_normals.points[i] - without.points[i]).norm(), 1e-5f) << i;
  // Every cell's edges of the cube are cut off: the mean of crossings lies within the cube, if not on a face
  // of it.
  EXPECT_LT(volume(with_normals), 8000.0 - 12 * 20 * 0.01);
  EXPECT_GT(volume(with_normals), 8000.0 - 12 * 20 * 0.5);
}

/// The box from `lower` to `upper`.
AnalyticSurface box(const Vector3d& lower, const Vector3d& upper) {
  const Vector3d middle = 0.5 * (lower + upper), half = 0.5 * (upper - lower);
  return {.value = [=](const Vector3d& p) { return ((p - middle).cwiseAbs() - half).maxCoeff(); },
          .gradient =
              [=](const Vector3d& p) {
                int axis;
                ((p - middle).cwiseAbs() - half).maxCoeff(&axis);
                return Vector3d(Vector3d::Unit(axis) * (p[axis] < middle[axis] ? -1.0 : 1.0));
              },
          .lipschitz = 1.0};
}

TEST(ManifoldDualContouring, BoxesWithFacesAtOrNearThePlanesOfTheLatticeAreExact) {
  // Multiples of powers of two, which single precision represents.
  for (const double off : {0.0, 1.0 / 4096, -1.0 / 4096, 1.0 / 1024, 0.25})
    for (const Vector3d& side : {Vector3d(1, 1, 1), Vector3d(1, 0, 0), Vector3d(-1, 1, 0)}) {
      RunContext context;
      const Vector3d lower = Vector3d(-3, -2, -4) - off * side, upper = Vector3d(5, 6, 4) + off * side;
      const AnalyticSurface surface = box(lower, upper);
      const FloatHermite hermite =
          sample_function(surface, IndexToWorld(), {-12, -12, -12}, {12, 12, 12}, 1e-12, context);
      const PolygonMesh fine = contour(hermite, 0.0), coarse = contour(hermite, 0.1);
      for (const PolygonMesh* mesh : {&fine, &coarse}) {
        for (std::size_t i = 0; i < mesh->points.size(); ++i)
          EXPECT_NEAR(surface.value(mesh->world(i)), 0.0, 2e-6)
              << off << " at " << mesh->world(i).transpose();
        EXPECT_NEAR(volume(*mesh), (upper - lower).prod(), 1e-3) << off;
      }
      EXPECT_EQ(coarse.triangle_count(), 12u) << off;
    }
}

TEST(ManifoldDualContouring, NoVertexIsBeyondACornerOfATurnedCube) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> angle(-3.0, 3.0);
  int minimal = 0;
  for (int i = 0; i < 20; ++i) {
    TurnedCube cube;
    cube.turn = (Eigen::AngleAxisd(angle(random), Vector3d::UnitZ()) *
                 Eigen::AngleAxisd(angle(random), Vector3d::UnitY()) *
                 Eigen::AngleAxisd(angle(random), Vector3d::UnitX()))
                    .matrix();
    const FloatHermite hermite = cube.hermite();
    const PolygonMesh fine = contour(hermite, 0.0), coarse = contour(hermite, 0.1);
    // Vertices that cannot move to the faces of their cells are 1/1024 voxel off, and those that have no room
    // on a crease are farther inside.
    std::size_t inside = 0;
    for (std::size_t p = 0; p < fine.points.size(); ++p) {
      const double place = (cube.turn.transpose() * fine.world(p)).cwiseAbs().maxCoeff();
      EXPECT_LT(place, TurnedCube::kHalf + 2e-3) << i;
      inside += place < TurnedCube::kHalf - 2e-3;
    }
    EXPECT_LE(inside, 2u) << i;
    minimal += coarse.triangle_count() == 12;
    EXPECT_LT(coarse.triangle_count(), 30u) << i;
  }
  EXPECT_GE(minimal, 18);
}

TEST(ManifoldDualContouring, TurnedCubeNeedsTwelveTrianglesAndKeepsItsCorners) {
  const TurnedCube cube;
  const PolygonMesh mesh = contour(cube.hermite(), 0.1);
  EXPECT_EQ(mesh.triangle_count(), 12u);  // of 5,000
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d wanted =
        cube.turn * Vector3d(corner & 1 ? 10 : -10, corner & 2 ? 10 : -10, corner & 4 ? 10 : -10);
    double nearest = 1e9;
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
      nearest = std::min(nearest, (mesh.world(i) - wanted).norm());
    EXPECT_LT(nearest, 1e-5) << corner;
  }
  EXPECT_NEAR(volume(mesh), 8000.0, 1e-5 * 2400.0);
}

/// Mean distance from positions along the edges of the turned cube to the mesh.
double mean_distance_from_edges(const TurnedCube& cube, const PolygonMesh& mesh) {
  double sum = 0.0;
  int places = 0;
  const std::vector<Triangle> triangles = triangulated(mesh);
  for (int edge = 0; edge < 12; ++edge)
    for (int step = 0; step <= 40; ++step, ++places) {
      const int axis = edge / 4;
      Vector3d p;
      p[axis] = -10.0 + 0.5 * step;
      p[(axis + 1) % 3] = edge & 1 ? 10 : -10;
      p[(axis + 2) % 3] = edge & 2 ? 10 : -10;
      p = cube.turn * p;
      double nearest = 1e9;
      for (const Triangle& t : triangles)
        if ((mesh.world(t[0]) - p).squaredNorm() < 9.0)
          nearest =
              std::min(nearest, squared_distance(p, mesh.world(t[0]), mesh.world(t[1]), mesh.world(t[2])));
      sum += std::sqrt(nearest);
    }
  return sum / places;
}

/// V − E + F of a closed mesh: twice the number of components without holes.
std::int64_t euler_characteristic(const PolygonMesh& mesh) {
  const auto triangles = static_cast<std::int64_t>(mesh.triangle_count());
  return static_cast<std::int64_t>(mesh.points.size()) - triangles / 2;
}

/// A plate along a diagonal of the lattice whose samples touch one another only across faces, and the same
/// plate as a gap that cuts a box in two: either is connected.
TEST(ManifoldDualContouring, ThinDiagonalPlatesAndGapsStayWhole) {
  const auto distance_to = [](const Vector3d& half, const Vector3d& p) {
    return (p.cwiseAbs() - half).maxCoeff();
  };
  const Vector3d plate(9.3, 0.6, 6.3), box(9.3, 5.2, 6.3);
  for (const bool gap : {false, true}) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(M_PI / 4, Vector3d::UnitZ()).matrix();
    const Vector3d longer = plate + Vector3d(9, 0, 9);
    const auto value = [=](const Vector3d& p) {
      const Vector3d q = turn.transpose() * p;
      return gap ? std::max(distance_to(box, q), -distance_to(longer, q)) : distance_to(plate, q);
    };
    const auto gradient = [=](const Vector3d& p) {
      Vector3d g;
      for (int a = 0; a < 3; ++a) {
        const Vector3d step = 1e-5 * Vector3d::Unit(a);
        g[a] = value(p + step) - value(p - step);
      }
      return g;
    };
    RunContext context;
    const FloatHermite hermite =
        sample_function({.value = value, .gradient = gradient, .lipschitz = 1.0}, IndexToWorld(),
                        {-16, -16, -16}, {16, 16, 16}, 1e-9, context);
    EXPECT_EQ(euler_characteristic(contour(hermite, 0.0)), gap ? 4 : 2) << gap;
    EXPECT_EQ(euler_characteristic(contour(hermite, 0.25)), gap ? 4 : 2) << gap;
  }
}

/// Inside corners of a convex solid that touch across a face belong together: cut off one by one they would
/// leave notches in the edges.
TEST(ManifoldDualContouring, TurnedCubeHasNoNotches) {
  for (const double angle : {0.1, 0.35, 0.6, 0.7854}) {
    TurnedCube cube;
    cube.turn =
        (Eigen::AngleAxisd(0.7854, Vector3d::UnitZ()) * Eigen::AngleAxisd(angle, Vector3d::UnitX())).matrix();
    const PolygonMesh mesh = contour(cube.hermite(), 0.0);
    double farthest = 0;
    for (const Triangle& t : triangulated(mesh)) {
      const Vector3d middle = (mesh.world(t[0]) + mesh.world(t[1]) + mesh.world(t[2])) / 3.0;
      farthest = std::max(
          farthest, std::abs((cube.turn.transpose() * middle).cwiseAbs().maxCoeff() - TurnedCube::kHalf));
    }
    EXPECT_LT(farthest, 0.03) << angle;
  }
}

TEST(ManifoldDualContouring, TurnedCubeKeepsItsEdges) {
  TurnedCube cube;
  cube.turn = (Eigen::AngleAxisd(0.7, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.5, Vector3d::UnitY()) *
               Eigen::AngleAxisd(0.35, Vector3d::UnitX()))
                  .matrix();
  const FloatHermite hermite = cube.hermite();
  const auto distance = [&](double reach) {
    return mean_distance_from_edges(cube, contour(hermite, {.tolerance = 0, .uniform = {.reach = reach}}));
  };
  EXPECT_LT(distance(1.0), 0.01);
  EXPECT_GT(distance(0.0), 0.02);  // no vertex leaves its cell
}

/// A tolerance of 0 somewhere must not prevent merges elsewhere.
TEST(ManifoldDualContouring, ScaleOfZeroKeepsEveryVertexThereAndMergesElsewhere) {
  const FloatHermite hermite = sphere();
  initialize_openvdb();
  const auto scale = openvdb::FloatGrid::create(0.0f);
  AdaptivityField field;
  field.scale = make_level_set(scale);
  EXPECT_EQ(contour(hermite, 1.0, &field).points.size(), contour(hermite, 0.0).points.size());
  scale->fill(openvdb::CoordBBox(openvdb::Coord(0, -30, -30), openvdb::Coord(30, 30, 30)), 1.0f);
  field.scale = make_level_set(scale);
  const PolygonMesh mesh = contour(hermite, 0.5, &field);
  const auto count = [](const PolygonMesh& of, float from, float to) {
    return std::ranges::count_if(of.points,
                                 [&](const Eigen::Vector3f& p) { return p[0] > from && p[0] < to; });
  };
  const PolygonMesh fine = contour(hermite, 0.0);
  EXPECT_EQ(count(mesh, -30, -2), count(fine, -30, -2));
  EXPECT_LT(count(mesh, 3, 30), count(fine, 3, 30) / 4);
}

TEST(ManifoldDualContouring, MaskLimitsTheMeshOrTheBound) {
  const FloatHermite hermite = sphere();
  initialize_openvdb();
  AdaptivityField field;
  field.mask = make_level_set(openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      12.0f, openvdb::Vec3f(0, 0, float(kRadius)), 1.0f));
  const std::size_t everywhere = contour(hermite, 0.05, &field).points.size();
  field.outside = AdaptivityField::Outside::simplify;
  EXPECT_LT(contour(hermite, 0.05, &field).points.size(), 3 * everywhere / 4);
  EXPECT_LT(contour(hermite, 0, &field).points.size(), 3 * contour(hermite, 0).points.size() / 4);
  field.outside = AdaptivityField::Outside::nothing;
  for (const double tolerance : {0.0, 0.05}) {
    const PolygonMesh part = contour(hermite, tolerance, &field);
    ASSERT_FALSE(part.empty());
    for (const Triangle& t : part.triangles) {
      const Vector3d middle = (part.world(t[0]) + part.world(t[1]) + part.world(t[2])) / 3.0;
      EXPECT_LT((middle - Vector3d(0, 0, kRadius)).norm(),
                12.0 + std::sqrt(3.0));  // its cell's middle is inside
    }
  }
}

/// The mesh of certified_octree() or of manifold_dual_contouring().
PolygonMesh certified(bool octree, const FloatHermite& hermite, double tolerance,
                      const AdaptivityField* field) {
  if (!octree) return contour(hermite, tolerance, field);
  RunContext context;
  return certified_octree(view_of(hermite, context), {.tolerance = tolerance, .uniform = {}}, field, context);
}

/// A flat face becomes two triangles, and the middles of both may be far from a mask that shows some of it.
TEST(ManifoldDualContouring, MaskLosesNothingOfWhatItShows) {
  initialize_openvdb();
  RunContext context;
  const AnalyticSurface box = {.value = [](const Vector3d& p) { return p.cwiseAbs().maxCoeff() - 20.4; },
                               .gradient =
                                   [](const Vector3d& p) {
                                     int axis;
                                     p.cwiseAbs().maxCoeff(&axis);
                                     return Vector3d(Vector3d::Unit(axis) * (p[axis] < 0 ? -1.0 : 1.0));
                                   }};
  const FloatHermite hermite =
      sample_function(box, IndexToWorld(), {-24, -24, -24}, {24, 24, 24}, 1e-9, context);
  constexpr float kMask = 8.0f;
  AdaptivityField field;
  field.outside = AdaptivityField::Outside::nothing;
  field.mask = make_level_set(
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(kMask, openvdb::Vec3f(20.4f, 10, 10), 0.5f));
  for (const bool octree : {false, true})
    for (const double tolerance : {0.5, 4.0}) {
      const PolygonMesh mesh = certified(octree, hermite, tolerance, &field);
      double area = 0;
      for (const Triangle& t : triangulated(mesh))
        area += 0.5 * (mesh.world(t[1]) - mesh.world(t[0])).cross(mesh.world(t[2]) - mesh.world(t[0])).norm();
      // The disc, except for a cell along its boundary.
      EXPECT_GT(area, std::numbers::pi * (kMask - 1) * (kMask - 1)) << octree << ' ' << tolerance;
      EXPECT_LT(area, std::numbers::pi * (kMask + 1) * (kMask + 1)) << octree << ' ' << tolerance;
      EXPECT_LT(mesh.triangle_count(), 220u);  // of some 400
    }
}

/// A mask of only the cells that the surface passes through excludes nothing, though merged polygons lie next
/// to them.
TEST(ManifoldDualContouring, MaskOfTheSurfacesOwnCellsLeavesOutNothing) {
  initialize_openvdb();
  const FloatHermite hermite = sphere();
  const auto cells = openvdb::FloatGrid::create(0.0f);
  cells->setTransform(openvdb::math::Transform::createLinearTransform(1.0));
  cells->transform().postTranslate(openvdb::Vec3d(0.5));  // to the cells' middles
  for (int x = -18; x < 18; ++x)
    for (int y = -18; y < 18; ++y)
      for (int z = -18; z < 18; ++z) {
        int inside = 0;
        for (int corner = 0; corner < 8; ++corner)
          inside += Vector3d(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)).norm() < kRadius;
        if (inside % 8 != 0) cells->tree().setValueOn(openvdb::Coord(x, y, z), 1.0f);
      }
  AdaptivityField field;
  field.outside = AdaptivityField::Outside::nothing;
  field.mask = make_level_set(cells);
  for (const bool octree : {false, true})
    for (const double tolerance : {0.0, 0.5, 4.0})
      EXPECT_EQ(certified(octree, hermite, tolerance, &field).triangle_count(),
                certified(octree, hermite, tolerance, nullptr).triangle_count())
          << octree << ' ' << tolerance;
}

/// A sphere in voxels of 1 × 1 × 2: half a voxel is one unit of the world along z, and less elsewhere.
TEST(ManifoldDualContouring, ToleranceInTheWorldHoldsAlongTheLongestSideOfAVoxel) {
  initialize_openvdb();
  const auto grid = openvdb::FloatGrid::create(3.0f);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(1.0));
  grid->transform().preScale({1, 1, 2});
  auto access = grid->getAccessor();
  for (int x = -14; x <= 14; ++x)
    for (int y = -14; y <= 14; ++y)
      for (int z = -8; z <= 8; ++z)
        access.setValue({x, y, z}, float(std::sqrt(double(x * x + y * y + 4 * z * z)) - 10.3));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  RunContext context;
  const LevelSet level_set = make_level_set(grid);
  const auto contoured = [&](const char* option, const char* value) {
    const Options options("manifold-dual-contouring", manifold_dual_contouring_options(), {{option, value}});
    return manifold_dual_contouring({.level_set = level_set, .options = options, .context = context});
  };
  EXPECT_TRUE(contoured("tolerance_world", "1") == contoured("tolerance", "0.5"));
  EXPECT_FALSE(contoured("tolerance_world", "1") == contoured("tolerance", "1"));
}

/// Share of the cells that are held to their segments in the uniform mesh.
double share_held(const FloatHermite& hermite) {
  RunContext context;
  manifold_dual_contouring(view_of(hermite, context), {.tolerance = 0.0, .uniform = {}}, nullptr, context);
  const auto figure = [&](const std::string& name) {
    return std::ranges::find(context.figures, name, [](const auto& entry) { return entry.first; })->second;
  };
  return figure("held_cells") / figure("cells");
}

TEST(ManifoldDualContouring, NeedsTheLastResortInHardlyACellOfWhiteNoise) {
  EXPECT_LT(share_held(noise(20, 20, 20, 11)), 0.005);
}

/// Most cells have two sheets, next to many of their kind.
TEST(ManifoldDualContouring, NeedsNoLastResortForAThinPlate) {
  RunContext context;
  const Vector3d across = Vector3d(3, 5, 2).normalized();
  const AnalyticSurface surface = {
      .value = [&](const Vector3d& p) { return std::max(std::abs(across.dot(p)) - 0.35, p.norm() - 12.0); },
      .gradient =
          [&](const Vector3d& p) {
            return std::abs(across.dot(p)) - 0.35 > p.norm() - 12.0
                       ? Vector3d(across.dot(p) < 0 ? -across : across)
                       : p;
          },
  };
  EXPECT_EQ(
      share_held(sample_function(surface, IndexToWorld(), {-20, -20, -20}, {20, 20, 20}, 1e-9, context)),
      0.0);
}

/// Two axes of the lattice nearly on one line: the nearer, the more voxels single precision's rounding is.
TEST(ManifoldDualContouring, RefusesALatticeOnWhichRoundingCouldMovePointsAcrossFaces) {
  FloatHermite hermite = sphere();
  hermite.placement.linear.row(1) = Eigen::RowVector3d(1.0, 1e-3, 0.0);
  EXPECT_FALSE(contour(hermite, 0.1).empty());
  hermite.placement.linear.row(1) = Eigen::RowVector3d(1.0, 1e-5, 0.0);
  EXPECT_THROW(contour(hermite, 0.1), Error);
}

TEST(ManifoldDualContouring, SameBytesAtAnyThreadCount) {
  const FloatHermite hermite = noise(5, 5, 64, 3);
  std::vector<PolygonMesh> meshes;
  for (const std::size_t threads : {1, 2, 7}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    meshes.push_back(contour(hermite, 0.5));
  }
  EXPECT_FALSE(meshes[0].empty());
  EXPECT_TRUE(meshes[0] == meshes[1]);
  EXPECT_TRUE(meshes[0] == meshes[2]);
}

}  // namespace manifold_dual_contouring_test
}  // namespace hermesh
