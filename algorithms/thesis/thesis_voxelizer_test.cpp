#include "algorithms/thesis/thesis_voxelizer.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <set>
#include <thread>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/search/triangle_point.h"
#include "algorithms/thesis/thesis_volumes.h"

namespace hermesh {
namespace thesis_voxelizer_test {

using Eigen::Vector3d;
using openvdb::Coord;

/// A subdivided octahedron of 8·4^levels triangles.
PolygonMesh sphere(double radius, int levels, const Vector3d& centre = Vector3d::Zero()) {
  PolygonMesh mesh;
  std::vector<Vector3d> points = {Vector3d::UnitX(),  -Vector3d::UnitX(), Vector3d::UnitY(),
                                  -Vector3d::UnitY(), Vector3d::UnitZ(),  -Vector3d::UnitZ()};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, is_new] = middles.try_emplace(std::minmax(a, b), std::uint32_t(points.size()));
      if (is_new) points.push_back((points[a] + points[b]).normalized());
      return entry->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = finer;
  }
  for (const Vector3d& p : points) mesh.points.push_back((centre + radius * p).cast<float>());
  return mesh;
}

Eigen::Matrix3d turn() {
  return (Eigen::AngleAxisd(0.7, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.5, Vector3d::UnitY()) *
          Eigen::AngleAxisd(0.35, Vector3d::UnitX()))
      .toRotationMatrix();
}

/// A cube of six quads with edge 2·half, turned about the origin.
PolygonMesh cube(double half) {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.points.push_back(
        (turn() * Vector3d(i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half)).cast<float>());
  mesh.quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  return mesh;
}

PolygonMesh joined(PolygonMesh mesh, const PolygonMesh& other) {
  const auto shift = std::uint32_t(mesh.points.size());
  mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({a + shift, b + shift, c + shift});
  return mesh;
}

openvdb::FloatGrid::ConstPtr voxelize(const PolygonMesh& mesh, double voxel_size,
                                      const ThesisVoxelizerOptions& options = {}, double exterior = 3.0,
                                      double interior = 3.0) {
  RunContext context;
  return thesis_voxelizer({mesh, voxel_size, exterior, interior, context}, options).grid().grid;
}

Vector3d position(const Coord& xyz) { return {double(xyz.x()), double(xyz.y()), double(xyz.z())}; }

/// Calls f(voxel) for all voxels of the cube about the origin with edge 2·half + 1.
template <class F>
void for_each_voxel(int half, F&& f) {
  for (int x = -half; x <= half; ++x)
    for (int y = -half; y <= half; ++y)
      for (int z = -half; z <= half; ++z) f(Coord(x, y, z));
}

/// Returns true if two grids have the same value and the same state in every voxel and tile.
bool same(const openvdb::FloatGrid& a, const openvdb::FloatGrid& b) {
  if (a.tree().leafCount() != b.tree().leafCount() || !a.tree().hasSameTopology(b.tree())) return false;
  auto other = b.cbeginValueAll();
  for (auto value = a.cbeginValueAll(); value; ++value, ++other)
    if (*value != *other || value.getCoord() != other.getCoord()) return false;
  return true;
}

TEST(ThesisVoxelizer, SphereIsRightInSignAndCloseInDistance) {
  const double radius = 20.0;
  const auto grid = voxelize(sphere(radius, 5), 1.0);
  double largest = 0.0, nearby = 0.0;
  std::size_t missing = 0, band = 0;
  for_each_voxel(26, [&](const Coord& xyz) {
    const double truth = position(xyz).norm() - radius;
    const double value = grid->tree().getValue(xyz);
    if (std::abs(truth) > 0.05) {
      ASSERT_EQ(truth < 0, value < 0) << xyz;
    }
    if (std::abs(truth) > 2.9) return;
    ++band;
    missing += grid->tree().isValueOn(xyz) ? 0 : 1;
    largest = std::max(largest, std::abs(value - truth));
    if (std::abs(truth) < 0.5) nearby = std::max(nearby, std::abs(value - truth));
  });
  std::printf("largest error: %.3f voxels, %.3f within half a voxel; %zu of %zu voxels missing\n", largest,
              nearby, missing, band);
  EXPECT_LT(nearby, 0.05);  // of which the facets' sag is 0.02
  EXPECT_LT(largest, 0.3);
  EXPECT_LT(double(missing), 0.01 * double(band));
  EXPECT_FLOAT_EQ(grid->tree().getValue({0, 0, 0}), -3.0f);
  EXPECT_FLOAT_EQ(grid->tree().getValue({100, 0, 0}), 3.0f);
}

TEST(ThesisVoxelizer, CubeOfQuadsIsRightInSign) {
  const double half = 11.0;
  const auto grid = voxelize(cube(half), 1.0);
  std::size_t wrong = 0;
  for_each_voxel(24, [&](const Coord& xyz) {
    const Vector3d q = (turn().transpose() * position(xyz)).cwiseAbs() - Vector3d::Constant(half);
    const double truth = q.cwiseMax(0.0).norm() + std::min(0.0, q.maxCoeff());
    const double value = grid->tree().getValue(xyz);
    if (std::abs(truth) > 0.5) {
      ASSERT_EQ(truth < 0, value < 0) << xyz;
    }
    if (std::abs(truth) > 1e-4) wrong += (truth < 0) != (value < 0) ? 1 : 0;
  });
  std::printf("%zu voxels with the wrong sign\n", wrong);
  EXPECT_LT(wrong, 40u);  // along the edges
}

TEST(ThesisVoxelizer, BandsAndPlacementFollowTheInput) {
  PolygonMesh mesh = sphere(10.0, 4);
  mesh.origin = Vector3d(1e6, -1e6, 0.0);
  for (const auto& [exterior, interior] : {std::pair(1.0, 1.0), std::pair(2.0, 6.0), std::pair(5.5, 1.5)}) {
    const auto grid = voxelize(mesh, 0.5, {}, exterior, interior);
    EXPECT_EQ(grid->getName(), "sdf");
    EXPECT_EQ(grid->getGridClass(), openvdb::GRID_LEVEL_SET);
    float least = 0.0f, most = 0.0f;
    for (auto value = grid->cbeginValueOn(); value; ++value) {
      least = std::min(least, *value);
      most = std::max(most, *value);
    }
    EXPECT_NEAR(least, -0.5 * interior, 0.1);
    EXPECT_GE(least, -0.5 * interior);
    EXPECT_NEAR(most, 0.5 * exterior, 0.1);
    EXPECT_LE(most, 0.5 * exterior);
    EXPECT_FLOAT_EQ(grid->tree().getValue({0, 0, 0}), float(-0.5 * interior));
    EXPECT_FLOAT_EQ(grid->background(), float(0.5 * exterior));
    const Vector3d centre(1e6, -1e6, 0.0);
    EXPECT_EQ(grid->transform().worldToIndexCellCentered({centre.x(), centre.y(), centre.z()}),
              Coord(0, 0, 0));
  }
}

// Trap T9: the flood starts outside and never reaches a closed cavity.
TEST(ThesisVoxelizer, NestedShellsAreFilled) {
  const auto nested = voxelize(joined(sphere(20.0, 4), sphere(10.0, 4)), 1.0);
  const auto plain = voxelize(sphere(20.0, 4), 1.0);
  EXPECT_TRUE(same(*nested, *plain));
  EXPECT_LT(nested->tree().getValue({0, 0, 0}), 0.0f);
  EXPECT_LT(nested->tree().getValue({10, 0, 0}), 0.0f);
}

TEST(ThesisVoxelizer, VoxelsOfSelfIntersectionsAreRemoved) {
  const double radius = 30.0;
  const Vector3d left(-14, 0, 0), right(14, 0, 0);
  const auto grid = voxelize(joined(sphere(radius, 5, left), sphere(radius, 5, right)), 1.0);
  double deepest_wrong = 0.0;
  std::size_t wrong = 0, left_over = 0;
  for_each_voxel(46, [&](const Coord& xyz) {
    const double truth = std::min((position(xyz) - left).norm(), (position(xyz) - right).norm()) - radius;
    if (std::abs(truth) > 0.05 && (truth < 0) != (grid->tree().getValue(xyz) < 0)) {
      ++wrong;
      deepest_wrong = std::max(deepest_wrong, std::abs(truth));
    }
    // The boundary voxels next to the spheres' common circle stay, and the band around their triangles.
    if (truth < -8.0) left_over += grid->tree().isValueOn(xyz) ? 1 : 0;
  });
  std::printf("%zu voxels with the wrong sign, up to %.2f voxels from the surface\n", wrong, deepest_wrong);
  EXPECT_LT(deepest_wrong, 1.5);
  EXPECT_EQ(left_over, 0u);
}

TEST(ThesisVoxelizer, SameBytesAtAnyNumberOfThreads) {
  const PolygonMesh mesh = joined(sphere(15.3, 5, Vector3d(-8, 1, 0)), sphere(14.1, 4, Vector3d(8, 0, 2)));
  std::vector<openvdb::FloatGrid::ConstPtr> grids;
  for (const std::size_t threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    grids.push_back(voxelize(mesh, 0.3));
  }
  EXPECT_TRUE(same(*grids[0], *grids[1]));
  EXPECT_TRUE(same(*grids[0], *grids[2]));
}

TEST(ThesisVoxelizer, OrderOfTrianglesChangesDistancesButNoSigns) {
  const PolygonMesh mesh = sphere(20.0, 5);
  const auto plain = voxelize(mesh, 1.0), again = voxelize(mesh, 1.0, {.shuffle_seed = 1});
  EXPECT_TRUE(same(*again, *voxelize(mesh, 1.0, {.shuffle_seed = 1})));
  std::size_t changed = 0;
  double largest = 0.0;
  for_each_voxel(24, [&](const Coord& xyz) {
    const float a = plain->tree().getValue(xyz), b = again->tree().getValue(xyz);
    ASSERT_EQ(a < 0, b < 0) << xyz;
    changed += a != b ? 1 : 0;
    largest = std::max(largest, double(std::abs(a - b)));
  });
  std::printf("%zu of %zu voxels changed, by up to %.3f voxels\n", changed,
              std::size_t(plain->activeVoxelCount()), largest);
  EXPECT_GT(changed, 0u);
}

// Trap T8 again: whatever the samples miss, the flood finds no way through a closed mesh.
TEST(ThesisVoxelizer, SampledShellsSeparateInsideFromOutside) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> within(0.0, 1.0);
  const auto uniform = [&] { return Vector3d(within(random), within(random), within(random)); };
  const double sizes[] = {4.0, 10.0, 30.0};
  int leaks = 0, shells = 0;
  for (int i = 0; i < 240; ++i, ++shells) {
    PolygonMesh mesh = i % 6 == 5 ? cube(1.0) : sphere(1.0, i % 6);
    // Stretched, turned and moved: triangles of every size, down to needles and to less than a voxel.
    const Vector3d scale = Vector3d::Constant(5.0) + sizes[i % 3] * uniform(), shift = uniform();
    const Eigen::Quaterniond turned(
        Eigen::Vector4d(uniform().x(), uniform().x(), uniform().x(), 1.0).normalized());
    for (Eigen::Vector3f& p : mesh.points)
      p = (turned * scale.cwiseProduct(p.cast<double>()) + shift).cast<float>();
    leaks += voxelize(mesh, 1.0)->tree().getValue({0, 0, 0}) < 0.0f ? 0 : 1;
  }
  std::printf("%d of %d shells leaked\n", leaks, shells);
  EXPECT_EQ(leaks, 0);
}

TEST(ThesisVoxelizer, NoShellLeaksWhereSamplesLieHalfwayBetweenVoxels) {
  for (int side = 4; side <= 40; ++side) {
    PolygonMesh box;
    for (int i = 0; i < 8; ++i)
      box.points.emplace_back(0.1f * Eigen::Vector3f(i & 1 ? float(side) + 0.5f : 0.5f, i & 2 ? 9.5f : 0.5f,
                                                     i & 4 ? 6.5f : -6.5f));
    box.quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    EXPECT_LT(voxelize(box, 0.1)->tree().getValue({3, 5, 0}), 0.0f) << side;
  }
}

// Trap T8 a third time. Half the box's depth is 12.5 voxels, or 12.499999999999998 in double precision, so
// that d_T is 25 and samples are one voxel apart and halfway between voxels. Of two neighbours one may round
// up and the other down, to voxels that are two apart, and the flood goes through the voxel between.
TEST(ThesisVoxelizer, ShellsLeakWhereRoundingTakesSamplesTwoVoxelsApart) {
  constexpr double kVoxel = 1.1, kDepth = 13.75 / kVoxel;
  const std::vector<Voxel> face =
      rasterize_by_samples({Vector3d(9.2, kDepth, 0), Vector3d(-9.2, kDepth, 0), Vector3d(-9.2, -kDepth, 0)});
  const auto is_hit = [&](int x, int y) {
    return std::binary_search(face.begin(), face.end(), Voxel{x, y, 0});
  };
  int holes = 0;
  for (int x = -9; x <= 8; ++x)
    for (int y = -11; y <= 11; ++y) holes += !is_hit(x, y) && is_hit(x, y - 1) && is_hit(x, y + 1);
  EXPECT_GT(holes, 0);

  PolygonMesh box;
  for (int i = 0; i < 8; ++i)
    box.points.emplace_back(i & 1 ? 10.12f : -10.12f, i & 2 ? 13.75f : -13.75f, i & 4 ? 8.9f : -8.9f);
  box.quads = {{3, 2, 0, 1}, {7, 5, 4, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  EXPECT_GE(voxelize(box, kVoxel)->tree().getValue({0, 0, 0}), 0.0f) << "the fault of the print is gone";
  for (Eigen::Vector3f& p : box.points) p += Eigen::Vector3f(0.1f, 0.1f, 0.1f);
  EXPECT_LT(voxelize(box, kVoxel)->tree().getValue({0, 0, 0}), 0.0f) << "samples are not halfway";
}

TEST(ThesisVoxelizer, OddMeshesDoNoHarm) {
  PolygonMesh single;
  single.points = {{0, 0, 0}, {9, 0, 0}, {0, 7, 3}};
  single.triangles = {{0, 1, 2}};
  EXPECT_GT(voxelize(single, 1.0)->activeVoxelCount(), 0u);
  PolygonMesh degenerate = single;
  degenerate.triangles = {{0, 0, 0}, {1, 1, 2}, {0, 1, 0}};
  EXPECT_GT(voxelize(degenerate, 1.0)->activeVoxelCount(), 0u);
  PolygonMesh far = single;
  for (Eigen::Vector3f& p : far.points) p += Eigen::Vector3f(1e6f, -1e6f, 1e6f);
  EXPECT_GT(voxelize(far, 1.0)->activeVoxelCount(), 0u);
  EXPECT_THROW(voxelize(PolygonMesh(), 1.0), Error);
  EXPECT_THROW(voxelize(single, 0.0), Error);
}

TEST(ThesisVoxelizer, DegenerateTrianglesLeaveASphereAsItIs) {
  const PolygonMesh clean = sphere(12.0, 4);
  PolygonMesh dirty = clean;
  const auto [p, q, r] = clean.triangles.front();
  dirty.triangles.insert(dirty.triangles.end(), {{p, p, q}, {r, r, r}});
  const auto a = voxelize(clean, 1.0), b = voxelize(dirty, 1.0);
  for_each_voxel(16, [&](const Coord& xyz) {
    EXPECT_EQ(a->tree().getValue(xyz) < 0, b->tree().getValue(xyz) < 0) << xyz;
  });
}

TEST(ThesisVoxelizer, OpenMeshGetsANote) {
  PolygonMesh open = sphere(12.0, 3);
  open.triangles.resize(open.triangles.size() / 2);
  RunContext context;
  thesis_voxelizer({open, 1.0, 3.0, 3.0, context});
  ASSERT_EQ(context.notes.size(), 1u);
}

TEST(ThesisVoxelizer, SignAngleIsCheckedAndMatters) {
  const PolygonMesh mesh = cube(11.0);
  for (const double angle : {0.0, -1.0, 181.0, std::nan("")})
    EXPECT_THROW(voxelize(mesh, 1.0, {.sign_angle = angle}), Error) << angle;
  EXPECT_FALSE(same(*voxelize(mesh, 1.0, {.sign_angle = 20}), *voxelize(mesh, 1.0, {.sign_angle = 150})));
}

// Stage 4 (fig. 5.5): without it the band includes the voxels that self-intersections left inside.
TEST(ThesisVoxelizer, WithoutCleanUpVoxelsOfSelfIntersectionsStay) {
  const Vector3d left(-14, 0, 0), right(14, 0, 0);
  const PolygonMesh mesh = joined(sphere(30.0, 5, left), sphere(30.0, 5, right));
  const auto clean = voxelize(mesh, 1.0), kept = voxelize(mesh, 1.0, {.clean_up = false});
  std::size_t deep = 0, gone = 0;
  for_each_voxel(46, [&](const Coord& xyz) {
    const double truth = std::min((position(xyz) - left).norm(), (position(xyz) - right).norm()) - 30.0;
    if (truth < -8.0) deep += kept->tree().isValueOn(xyz) ? 1 : 0;
    gone += clean->tree().isValueOn(xyz) && !kept->tree().isValueOn(xyz) ? 1 : 0;
  });
  EXPECT_GT(deep, 1000u);
  // The expansion rests on other neighbours, so single voxels at the band's end are not found.
  EXPECT_LT(gone, 30u);
  EXPECT_GT(kept->activeVoxelCount(), clean->activeVoxelCount());
  // A mesh that does not intersect itself has almost nothing to remove.
  const PolygonMesh single = sphere(20.0, 5);
  EXPECT_TRUE(same(*voxelize(single, 1.0), *voxelize(single, 1.0, {.clean_up = false})));
}

// Stage 5 (fig. 5.6): without it the band is that of fig. 5.2.
TEST(ThesisVoxelizer, WithoutExpansionTheBandIsThatOfTheRasterisation) {
  const PolygonMesh mesh = sphere(20.0, 5);
  const auto wide = voxelize(mesh, 1.0), first = voxelize(mesh, 1.0, {.expansion = false});
  double most = 0.0;
  for (auto value = first->cbeginValueOn(); value; ++value) {
    most = std::max(most, double(std::abs(*value)));
    EXPECT_EQ(*value, wide->tree().getValue(value.getCoord()));
  }
  // A neighbour of a voxel that the surface touches is at most √3/2 + √2 from it.
  EXPECT_GT(most, 1.0);
  EXPECT_LT(most, 2.3);
  EXPECT_LT(2 * first->activeVoxelCount(), wide->activeVoxelCount() * 3 / 2);
  EXPECT_FLOAT_EQ(first->tree().getValue({0, 0, 0}), -3.0f);
}

TEST(ThesisVoxelizer, WithoutSignsDistancesArePositive) {
  const PolygonMesh mesh = sphere(20.0, 5);
  const auto with = voxelize(mesh, 1.0), without = voxelize(mesh, 1.0, {.signs = false});
  EXPECT_EQ(without->getName(), "udf");
  EXPECT_NE(without->getGridClass(), openvdb::GRID_LEVEL_SET);
  EXPECT_EQ(without->activeVoxelCount(), with->activeVoxelCount());
  for (auto value = without->cbeginValueOn(); value; ++value)
    EXPECT_EQ(*value, std::abs(with->tree().getValue(value.getCoord())));
  EXPECT_FLOAT_EQ(without->tree().getValue({0, 0, 0}), 3.0f);
}

// §5.1: the triangle of each voxel is the one that its distance is from, whatever the order that they came
// in.
TEST(ThesisVoxelizer, EachVoxelHasTheTriangleOfItsDistance) {
  initialize_openvdb();
  const PolygonMesh mesh = joined(cube(9.3), sphere(6.0, 2, Vector3d(4, 3, 8)));
  const std::vector<Triangle> triangles = triangulated(mesh);
  for (const std::uint64_t seed : {0, 7}) {
    RunContext context;
    const Voxelization made =
        thesis_voxelization({mesh, 0.5, 3.0, 3.0, context}, {.shuffle_seed = seed}, true);
    ASSERT_TRUE(made.nearest);
    EXPECT_EQ(made.nearest->getName(), "triangle-id");
    EXPECT_TRUE(made.nearest->tree().hasSameTopology(made.distance->tree()));
    std::set<std::int32_t> seen;
    for (auto id = made.nearest->cbeginValueOn(); id; ++id) {
      ASSERT_GE(*id, 0);
      ASSERT_LT(std::size_t(*id), triangles.size());
      seen.insert(*id);
      const auto at = [&](int corner) -> Vector3d {
        return mesh.points[triangles[std::size_t(*id)][corner]].cast<double>();
      };
      const Vector3d p = 0.5 * position(id.getCoord());
      const double distance = (closest_point(p, at(0), at(1), at(2)).position - p).norm();
      ASSERT_NEAR(std::abs(made.distance->tree().getValue(id.getCoord())), distance, 1e-5);
    }
    EXPECT_GT(seen.size(), triangles.size() / 2);
    EXPECT_FALSE(thesis_voxelization({mesh, 0.5, 3.0, 3.0, context}, {}, false).nearest);
  }
}

TEST(ThesisVoxelizer, StopsSoonWhenAskedTo) {
  const PolygonMesh mesh = sphere(20.0, 7);
  std::atomic<bool> cancel{false};
  RunContext context;
  context.cancel = &cancel;
  std::chrono::steady_clock::time_point asked;
  std::thread canceller([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    asked = std::chrono::steady_clock::now();
    cancel = true;
  });
  EXPECT_THROW(thesis_voxelizer({mesh, 0.05, 3.0, 3.0, context}), Cancelled);
  const auto end = std::chrono::steady_clock::now();
  canceller.join();
  EXPECT_LT(std::chrono::duration<double>(end - asked).count(), 1.0);
}

}  // namespace thesis_voxelizer_test
}  // namespace hermesh
