#include "algorithms/thesis/adaptive_dual_contouring/adaptive_dual_contouring.h"

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/hermite/samplers.h"

namespace hermesh {
namespace adaptive_dual_contouring_test {

using Eigen::Vector3d;
using Placement = AdaptiveOptions::Placement;

LevelSet sphere(double radius, const Vector3d& centre = Vector3d::Zero(), double voxel = 1.0) {
  initialize_openvdb();
  return make_level_set(openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      float(radius), openvdb::Vec3f(float(centre[0]), float(centre[1]), float(centre[2])), float(voxel)));
}

LevelSet noise(int size, unsigned seed) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  auto access = grid->getAccessor();
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  for (int i = 0; i < size * size * size; ++i)
    access.setValue({i / (size * size), i / size % size, i % size}, value(random));
  return make_level_set(grid);
}

struct Result {
  PolygonMesh mesh;
  std::map<std::string, double> figures;
};

Result contour(const LevelSet& level_set, const AdaptiveOptions& options,
               const AdaptivityField* field = nullptr) {
  RunContext context;
  const FloatHermite hermite = sample_level_set(level_set, 0.0, context);
  Result result{adaptive_dual_contouring(hermite, options, field, context), {}};
  result.figures.insert(context.figures.begin(), context.figures.end());
  return result;
}

/// The corners of each polygon, from the least on.
std::multiset<std::vector<std::uint32_t>> polygons(const PolygonMesh& mesh) {
  std::multiset<std::vector<std::uint32_t>> result;
  const auto add = [&](const auto& polygon) {
    std::vector<std::uint32_t> corners(polygon.begin(), polygon.end());
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    result.insert(corners);
  };
  for (const Triangle& triangle : mesh.triangles) add(triangle);
  for (const Quad& quad : mesh.quads) add(quad);
  return result;
}

/// Returns true if along each edge as many polygons run in one direction as in the other.
bool is_closed_and_oriented(const PolygonMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sum;
  for (const auto& polygon : polygons(mesh))
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const std::uint32_t a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      sum[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  return std::all_of(sum.begin(), sum.end(), [](const auto& edge) { return edge.second == 0; });
}

bool uses_all_points(const PolygonMesh& mesh) {
  std::set<std::uint32_t> used;
  for (const auto& polygon : polygons(mesh)) used.insert(polygon.begin(), polygon.end());
  return used.size() == mesh.points.size();
}

TEST(AdaptiveDualContouring, ThresholdZeroIsUniformDualContouring) {
  const LevelSet volume = sphere(20.3);
  RunContext context;
  const FloatHermite hermite = sample_level_set(volume, 0.0, context);
  const PolygonMesh uniform = dual_contouring(
      view_of(hermite, context), {.placement = DualContouringOptions::Placement::average}, context);
  const PolygonMesh mesh = contour(volume, {.placement = Placement::average, .threshold = 0.0}).mesh;
  ASSERT_EQ(mesh.points.size(), uniform.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    ASSERT_LT((mesh.points[i] - uniform.points[i]).norm(), 1e-5f);
  EXPECT_EQ(polygons(mesh), polygons(uniform));
  EXPECT_TRUE(mesh.triangles.empty());
  EXPECT_TRUE(is_closed_and_oriented(mesh));
  EXPECT_EQ(polygons(contour(volume, {.threshold = 0.0}).mesh), polygons(uniform));
}

/// A cube with faces across the axes.
AnalyticSurface cube(const Vector3d& centre, double half) {
  return {[=](const Vector3d& p) { return (p - centre).cwiseAbs().maxCoeff() - half; },
          [=](const Vector3d& p) {
            Vector3d q = p - centre, n = Vector3d::Zero();
            int axis;
            q.cwiseAbs().maxCoeff(&axis);
            n[axis] = q[axis];
            return n;
          }};
}

TEST(AdaptiveDualContouring, APlaneIsOnePointABlock) {
  // The top of a box at z = 35.5, and 8×8 blocks of 64 active cells of which those at the rim have other
  // faces, too.
  const AnalyticSurface box = cube(Vector3d::Constant(31.5), 31.0);
  RunContext context;
  const FloatHermite hermite = sample_function(box, {}, {-8, -8, -8}, {71, 71, 71}, 1e-6, context);
  for (const Placement placement : {Placement::optimal, Placement::average}) {
    const PolygonMesh mesh = adaptive_dual_contouring(hermite, {placement, 0.01, 0.1}, nullptr, context);
    std::map<std::pair<int, int>, int> points;
    for (const Eigen::Vector3f& point : mesh.points)
      if (point.z() > 60.0f) ++points[{int(std::floor(point.x() / 8)), int(std::floor(point.y() / 8))}];
    for (int x = 1; x < 7; ++x)
      for (int y = 1; y < 7; ++y) EXPECT_EQ((points[{x, y}]), 1) << x << ' ' << y;
    EXPECT_TRUE(is_closed_and_oriented(mesh));
  }
}

TEST(AdaptiveDualContouring, TheThresholdBoundsTheDistanceToThePlanes) {
  const LevelSet volume = sphere(40.0);
  std::size_t before = contour(volume, {.threshold = 0.0}).mesh.points.size();
  for (const double threshold : {1e-3, 1e-2, 1e-1, 1.0, 10.0})
    for (const Placement placement : {Placement::average, Placement::optimal}) {
      const Result result = contour(volume, {placement, threshold, 0.1});
      EXPECT_TRUE(is_closed_and_oriented(result.mesh));
      EXPECT_TRUE(uses_all_points(result.mesh));
      EXPECT_LE(result.figures.at("largest_plane_distance"), std::sqrt(threshold) + 1e-6);
      EXPECT_GT(
          result.figures.at("regions_1") + result.figures.at("regions_2") + result.figures.at("regions_3"),
          0.0);
      if (placement == Placement::average) continue;
      EXPECT_LT(result.mesh.points.size(), before);
      EXPECT_TRUE(threshold != 0.1 || !result.mesh.triangles.empty());
      before = result.mesh.points.size();
    }
}

TEST(AdaptiveDualContouring, ClosedAndOrientedOnNoise) {
  for (const double threshold : {0.0, 0.1, 1.0, 1e9})
    for (const Placement placement : {Placement::optimal, Placement::average}) {
      const PolygonMesh mesh = contour(noise(41, 3), {placement, threshold, 0.1}).mesh;
      EXPECT_TRUE(is_closed_and_oriented(mesh)) << threshold;
      EXPECT_TRUE(uses_all_points(mesh)) << threshold;
    }
}

TEST(AdaptiveDualContouring, SameBytesAtAnyNumberOfThreads) {
  const LevelSet volume = sphere(33.0);
  const LevelSet mask = sphere(15.0, {20, 0, 0}, 2.0);
  const AdaptivityField field{mask, AdaptivityField::Outside::nothing, mask};
  const AdaptivityField scaled{{}, AdaptivityField::Outside::everywhere, {}};
  std::vector<PolygonMesh> meshes;
  for (const std::size_t threads : {1, 2, 7}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    meshes.push_back(contour(volume, {.threshold = 0.05}, &scaled).mesh);
    EXPECT_EQ(meshes.back(), meshes.front());
  }
  EXPECT_THROW(contour(volume, {}, &field), Error);  // a level set is no scale: it has negative values
}

/// A ball within a hollow: its own surface lies wholly within one block, whose corners are all outside of the
/// shell.
LevelSet small_ball() {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(1.0f);
  auto access = grid->getAccessor();
  // Inside at one sample, in the middle of the region of 4³ cells from (0, 0, 0), and in a large ball far
  // away.
  access.setValue({2, 2, 2}, -1.0f);
  for (int x = 20; x < 60; ++x)
    for (int y = 0; y < 40; ++y)
      for (int z = 0; z < 40; ++z)
        access.setValue({x, y, z}, float(std::hypot(x - 40.1, y - 20.2, z - 19.7) - 15.0));
  return make_level_set(grid);
}

TEST(TopologyTests, EachKeepsWhatTheOtherLetsGo) {
  using Tests = AdaptiveOptions::TopologyTests;
  const auto made = [&](const LevelSet& volume, Tests tests) {
    AdaptiveOptions options;
    options.threshold = 1e9;
    options.topology_tests = tests;
    const Result result = contour(volume, options);
    EXPECT_TRUE(is_closed_and_oriented(result.mesh));
    EXPECT_TRUE(uses_all_points(result.mesh));
    return result.mesh;
  };
  const auto near_ball = [](const PolygonMesh& mesh) {
    return std::any_of(mesh.points.begin(), mesh.points.end(),
                       [](const auto& point) { return point.x() < 10.0f; });
  };
  // The corners around the single sample are all outside: the table refuses them, and so do the signs of the
  // middles.
  EXPECT_TRUE(near_ball(made(small_ball(), Tests::both)));
  EXPECT_TRUE(near_ball(made(small_ball(), Tests::table)));
  EXPECT_TRUE(near_ball(made(small_ball(), Tests::signs)));
  EXPECT_FALSE(near_ball(made(small_ball(), Tests::none)));
  // On noise each test refuses regions that the other lets pass, so both together leave the most points.
  const LevelSet volume = noise(33, 4);
  const std::size_t both = made(volume, Tests::both).points.size(),
                    table = made(volume, Tests::table).points.size(),
                    signs = made(volume, Tests::signs).points.size(),
                    none = made(volume, Tests::none).points.size();
  EXPECT_GT(both, table);
  EXPECT_GT(both, signs);
  EXPECT_GT(table, none);
  EXPECT_GT(signs, none);
}

TEST(AdaptiveDualContouring, TrianglesLieWhereLevelsMeet) {
  // A polygon has as many corners as there are different cells and regions around its edge. Around an edge
  // with regions of one level there are one, two or four of them, so a triangle needs two levels.
  for (const LevelSet& volume : {sphere(40.0), noise(41, 6)}) {
    const Result result = contour(volume, {.threshold = 0.05});
    const auto figure = [&](const std::string& name) { return result.figures.at(name); };
    EXPECT_EQ(figure("triangles_step_0"), 0.0);
    double quads = 0.0, triangles = 0.0;
    for (const char* step : {"0", "1", "2", "3"}) {
      quads += figure(std::string("quads_step_") + step);
      triangles += figure(std::string("triangles_step_") + step);
    }
    EXPECT_EQ(quads, double(result.mesh.quads.size()));
    EXPECT_EQ(triangles, double(result.mesh.triangles.size()));
    EXPECT_GT(triangles, 0.0);
  }
  const Result uniform = contour(sphere(20.0), {.threshold = 0.0});
  EXPECT_EQ(uniform.figures.at("quads_step_0"), double(uniform.mesh.quads.size()));
}

TEST(AdaptiveDualContouring, EscapesAreCountedByTheirDistance) {
  // Average placement never leaves a convex region, and minimisers may.
  const LevelSet volume = noise(41, 3);
  const auto escapes = [&](const AdaptiveOptions& options) {
    const Result result = contour(volume, options);
    double sum = result.figures.at("escaped_beyond_4");
    for (const char* to : {"0.01", "0.1", "0.5", "1", "2", "4"})
      sum += result.figures.at(std::string("escaped_to_") + to);
    EXPECT_EQ(sum, result.figures.at("escaped"));
    return result;
  };
  const Result average = escapes({.placement = Placement::average, .threshold = 1.0});
  EXPECT_EQ(average.figures.at("escaped"), 0.0);
  EXPECT_EQ(average.figures.at("largest_escape"), 0.0);
  const Result held = escapes({.threshold = 0.0}), free = escapes({.threshold = 0.0, .truncation = 0.0});
  EXPECT_GT(held.figures.at("escaped"), 0.0);
  EXPECT_GT(held.figures.at("largest_escape"), 0.0);
  EXPECT_GT(free.figures.at("escaped"), held.figures.at("escaped"));
  EXPECT_GT(free.figures.at("largest_escape"), held.figures.at("largest_escape"));
  // Every point that is put farther out by the measured distance than 4 voxels is in the last range.
  EXPECT_EQ(held.figures.at("largest_escape") > 4.0, held.figures.at("escaped_beyond_4") > 0.0);
}

TEST(AdaptiveDualContouring, TheBarePseudoInverseLeansTowardsTheCorner) {
  // On a plane every point of it is a minimiser: one lies below the mean of the crossings, one below the
  // cell's corner.
  RunContext context;
  const FloatHermite hermite =
      sample_function(cube({3.5, 3.5, -0.75}, 4.0), {}, {-8, -8, -8}, {15, 15, 15}, 1e-6, context);
  AdaptiveOptions options{.threshold = 0.0};
  const PolygonMesh mean = adaptive_dual_contouring(hermite, options, nullptr, context);
  options.nearest = AdaptiveOptions::Nearest::corner;
  const PolygonMesh corner = adaptive_dual_contouring(hermite, options, nullptr, context);
  ASSERT_EQ(mean.points.size(), corner.points.size());
  int cells = 0;
  for (std::size_t i = 0; i < mean.points.size(); ++i) {
    // Cells at the rim have other faces, too.
    const Eigen::Vector3f& at = mean.points[i];
    if (at.x() < 1.0f || at.y() < 1.0f || at.x() > 6.0f || at.y() > 6.0f || std::fabs(at.z() - 3.25f) > 1e-3f)
      continue;
    EXPECT_LT((at - Eigen::Vector3f(std::floor(at.x()) + 0.5f, std::floor(at.y()) + 0.5f, 3.25f)).norm(),
              1e-4f);
    EXPECT_LT((corner.points[i] - Eigen::Vector3f(std::floor(at.x()), std::floor(at.y()), 3.25f)).norm(),
              1e-4f);
    ++cells;
  }
  EXPECT_EQ(cells, 25);
}

TEST(AdaptiveDualContouring, AnEmptyVolumeGivesAnEmptyMesh) {
  EXPECT_TRUE(contour(noise(0, 1), {}).mesh.empty());
}

Vector3d middle_of(const PolygonMesh& mesh, const std::vector<std::uint32_t>& polygon) {
  Vector3d sum = Vector3d::Zero();
  for (const std::uint32_t corner : polygon) sum += mesh.world(corner);
  return sum / double(polygon.size());
}

/// The polygons near a point, as the positions of their vertices.
std::multiset<std::vector<float>> near(const PolygonMesh& mesh, const Vector3d& centre, double radius) {
  std::multiset<std::vector<float>> result;
  for (const auto& polygon : polygons(mesh)) {
    if ((middle_of(mesh, polygon) - centre).norm() > radius) continue;
    std::vector<std::vector<float>> corners;
    for (const std::uint32_t corner : polygon) {
      const Eigen::Vector3f& p = mesh.points[corner];
      corners.push_back({p.x(), p.y(), p.z()});
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    std::vector<float> flat;
    for (const auto& corner : corners) flat.insert(flat.end(), corner.begin(), corner.end());
    result.insert(flat);
  }
  return result;
}

constexpr double kMaskRadius = 35.0;
const Vector3d kMaskCentre(45.0, 0.0, 0.0);

TEST(AdaptivityMasks, NothingIsMadeOutside) {
  const LevelSet volume = sphere(45.0);
  for (const double voxel : {1.0, 2.5, 12.0}) {
    const AdaptivityField field{
        sphere(kMaskRadius, kMaskCentre, voxel), AdaptivityField::Outside::nothing, {}};
    const PolygonMesh whole = contour(volume, {Placement::average, 0.0, 0.1}).mesh;
    const PolygonMesh part = contour(volume, {Placement::average, 0.0, 0.1}, &field).mesh;
    // A point of a cell is at most half the cell's diagonal from its centre, which is inside the mask as
    // interpolated.
    const double slack = 0.5 * std::sqrt(3.0) + (voxel < 10 ? 0.1 * voxel : 0.5 * voxel);
    for (std::size_t i = 0; i < part.points.size(); ++i)
      EXPECT_LT((part.world(i) - kMaskCentre).norm(), kMaskRadius + slack);
    EXPECT_TRUE(uses_all_points(part));
    EXPECT_FALSE(is_closed_and_oriented(part));
    const double deep = kMaskRadius - 2.0 - 0.5 * voxel;
    EXPECT_EQ(near(part, kMaskCentre, deep), near(whole, kMaskCentre, deep));
    EXPECT_FALSE(near(part, kMaskCentre, deep).empty());
  }
}

TEST(AdaptivityMasks, OutsideIsSimplifiedAndInsideIsAsBefore) {
  const LevelSet volume = sphere(45.0);
  const AdaptivityField field{sphere(kMaskRadius, kMaskCentre, 2.0), AdaptivityField::Outside::simplify, {}};
  const PolygonMesh everywhere = contour(volume, {.threshold = 0.01}).mesh;
  const PolygonMesh simplified = contour(volume, {.threshold = 0.01}, &field).mesh;
  EXPECT_LT(simplified.points.size(), everywhere.points.size() / 2);
  EXPECT_TRUE(is_closed_and_oriented(simplified));
  const double deep = kMaskRadius - 2.0 * 8.0 * std::sqrt(3.0);  // no region of the mask's rim reaches so far
  EXPECT_EQ(near(simplified, kMaskCentre, deep), near(everywhere, kMaskCentre, deep));
  const AdaptivityField all{field.mask, AdaptivityField::Outside::everywhere, {}};
  EXPECT_EQ(contour(volume, {.threshold = 0.01}, &all).mesh, everywhere);
  // Outside it is as if the threshold were infinite.
  const PolygonMesh coarsest = contour(volume, {.threshold = 1e9}).mesh;
  EXPECT_EQ(near(simplified, {-45, 0, 0}, 20.0), near(coarsest, {-45, 0, 0}, 20.0));
}

TEST(AdaptivityMasks, AFogIsInsideWhereItDiffersFromTheBackground) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(0.0f);
  grid->fill(openvdb::CoordBBox({0, -100, -100}, {100, 100, 100}), 1.0f);
  const AdaptivityField field{make_level_set(grid), AdaptivityField::Outside::nothing, {}};
  const PolygonMesh half = contour(sphere(20.0), {Placement::average, 0.0, 0.1}, &field).mesh;
  ASSERT_FALSE(half.empty());
  for (const Eigen::Vector3f& point : half.points) EXPECT_GE(point.x(), -1.0f);
}

TEST(AdaptivityScale, MultipliesTheThreshold) {
  const LevelSet volume = sphere(30.0);
  const auto scaled = [&](float background) {
    initialize_openvdb();
    AdaptivityField field;
    field.scale = make_level_set(openvdb::FloatGrid::create(background));
    return contour(volume, {.threshold = 0.0625}, &field).mesh;
  };
  EXPECT_EQ(scaled(1.0f), contour(volume, {.threshold = 0.0625}).mesh);
  EXPECT_EQ(scaled(4.0f), contour(volume, {.threshold = 0.25}).mesh);
  EXPECT_EQ(scaled(0.0f), contour(volume, {.threshold = 0.0}).mesh);
  EXPECT_THROW(scaled(-1.0f), Error);
  EXPECT_THROW(scaled(NAN), Error);
}

}  // namespace adaptive_dual_contouring_test
}  // namespace hermesh
