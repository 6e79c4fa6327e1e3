#include "algorithms/voxelization/voxelize.h"

#include <gtest/gtest.h>
#include <openvdb/tools/ValueTransformer.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <numbers>
#include <random>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/lattice/simd/simd_level.h"
#include "algorithms/search/triangle_tree.h"
#include "algorithms/voxelization/inside/winding_number.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

void add_triangle(PolygonMesh& mesh, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const std::uint32_t n = std::uint32_t(mesh.points.size());
  for (const Vector3d& p : {a, b, c}) mesh.points.push_back(p.cast<float>());
  mesh.triangles.push_back({n, n + 1, n + 2});
}

/// Sphere of latitudes and longitudes, the faces outwards.
PolygonMesh sphere(const Vector3d& centre, double radius, int n = 24) {
  PolygonMesh mesh;
  const auto at = [&](int i, int j) {
    const double theta = std::numbers::pi * i / n, phi = std::numbers::pi * (j % (2 * n)) / n;
    // Both poles exactly on the axis, so that the mesh is closed.
    const double r = i == 0 || i == n ? 0.0 : std::sin(theta);
    return Vector3d(centre +
                    radius * Vector3d(r * std::cos(phi), r * std::sin(phi), i == n ? -1.0 : std::cos(theta)));
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < 2 * n; ++j) {
      if (i > 0) add_triangle(mesh, at(i, j), at(i + 1, j), at(i, j + 1));
      if (i < n - 1) add_triangle(mesh, at(i, j + 1), at(i + 1, j), at(i + 1, j + 1));
    }
  return mesh;
}

PolygonMesh box(const Vector3d& low, const Vector3d& high) {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.points.push_back(
        Vector3d(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z())
            .cast<float>());
  mesh.quads = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return mesh;
}

void append(PolygonMesh& mesh, const PolygonMesh& other, bool turned = false) {
  const std::uint32_t n = std::uint32_t(mesh.points.size());
  mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
  for (const Triangle& t : triangulated(other))
    mesh.triangles.push_back(turned ? Triangle{t[0] + n, t[2] + n, t[1] + n}
                                    : Triangle{t[0] + n, t[1] + n, t[2] + n});
}

Voxelization run(const PolygonMesh& mesh, VoxelizeOptions options = {}) {
  RunContext context;
  return voxelize(mesh, options, context);
}

double at(const Voxelization& v, int x, int y, int z) {
  return v.distance->tree().getValue(openvdb::Coord(x, y, z));
}

struct Errors {
  double worst = 0;        ///< largest error of a magnitude, voxels
  std::size_t active = 0;  ///< voxels whose state is wrong by more than the tolerance
  std::size_t checked = 0;
};

/// Compares every voxel of the box with the tree of triangles, which is exact in double precision, and independent of
/// blocks and vector code.
Errors compare(const PolygonMesh& mesh, const Voxelization& v, double voxel_size, double band, int margin) {
  const std::vector<Triangle> triangles = triangulated(mesh);
  const TriangleTree tree(mesh.points, triangles, 1.0 / voxel_size);
  const Bounds bounds = hermesh::bounds(mesh);
  Errors errors;
  const auto accessor = v.distance->getConstAccessor();
  Eigen::Vector3i low, high;
  for (int a = 0; a < 3; ++a) {
    low[a] = int(std::floor((bounds.lower[a] - mesh.origin[a]) / voxel_size)) - margin;
    high[a] = int(std::ceil((bounds.upper[a] - mesh.origin[a]) / voxel_size)) + margin;
  }
  for (int x = low[0]; x <= high[0]; ++x)
    for (int y = low[1]; y <= high[1]; ++y)
      for (int z = low[2]; z <= high[2]; ++z) {
        const double truth = std::sqrt(tree.nearest(Vector3d(x, y, z)).squared);
        float value;
        const bool on = accessor.probeValue({x, y, z}, value);
        ++errors.checked;
        if (on) errors.worst = std::max(errors.worst, std::abs(std::abs(value) / voxel_size - truth));
        errors.active += on ? truth > band + 1e-4 : truth < band - 1e-4;
      }
  return errors;
}

TEST(Voxelize, BoxByHand) {
  // Faces at ±10, so that distances are whole numbers.
  const Voxelization v = run(box({-10, -10, -10}, {10, 10, 10}));
  EXPECT_EQ(v.distance->getName(), "sdf");
  EXPECT_TRUE(v.is_signed);
  EXPECT_FLOAT_EQ(at(v, 12, 0, 0), 2.0f);
  EXPECT_FLOAT_EQ(at(v, 8, 0, 0), -2.0f);
  EXPECT_FLOAT_EQ(at(v, 10, 3, 3), 0.0f);
  EXPECT_NEAR(at(v, 11, 11, 0), std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(at(v, 11, 11, 11), std::sqrt(3.0), 1e-6);
  EXPECT_FLOAT_EQ(at(v, 0, 0, 0), -3.0f) << "the inside beyond the band";
  EXPECT_FLOAT_EQ(at(v, 20, 0, 0), 3.0f);
  EXPECT_FALSE(v.distance->tree().isValueOn({13, 0, 0})) << "at the width, not below it";
  EXPECT_TRUE(v.distance->tree().isValueOn({12, 0, 0}));
}

TEST(Voxelize, ExactOnSpheresOfAnySize) {
  for (const double radius : {0.01, 0.7, 5.0, 23.0})
    for (const double band : {1.0, 3.0, 5.5}) {
      const PolygonMesh mesh = sphere({0.3, -0.2, 0.1}, radius);
      const Voxelization v = run(mesh, {.exterior_band = band, .interior_band = band});
      const Errors errors = compare(mesh, v, 1.0, band, int(band) + 3);
      EXPECT_LT(errors.worst, 1e-5) << radius << ' ' << band;
      EXPECT_EQ(errors.active, 0u) << radius << ' ' << band;
    }
}

TEST(Voxelize, ManySmallTrianglesAreExact) {
  // 80,000 triangles over some 300 voxels of surface, where voxels look for triangles.
  const PolygonMesh mesh = sphere({0, 0, 0}, 5.0, 140);
  const Voxelization v = run(mesh, {.nearest = true});
  const Errors errors = compare(mesh, v, 1.0, 3.0, 6);
  EXPECT_LT(errors.worst, 1e-5);
  EXPECT_EQ(errors.active, 0u);
  for (auto voxel = v.nearest->cbeginValueOn(); voxel; ++voxel) {
    const Triangle t = mesh.triangles.at(std::size_t(*voxel));
    const openvdb::Coord c = voxel.getCoord();
    const double d = std::sqrt(
        squared_distance({double(c.x()), double(c.y()), double(c.z())}, mesh.points[t[0]].cast<double>(),
                         mesh.points[t[1]].cast<double>(), mesh.points[t[2]].cast<double>()));
    ASSERT_NEAR(d, std::abs(v.distance->tree().getValue(c)), 1e-5);
  }
}

TEST(Voxelize, BandsOfDifferentWidths) {
  const Voxelization v =
      run(sphere({0, 0, 0}, 20.0, 48), {.voxel_size = 1.0, .exterior_band = 1.5, .interior_band = 6.0});
  EXPECT_FLOAT_EQ(v.distance->background(), 1.5f);
  EXPECT_TRUE(v.distance->tree().isValueOn({15, 0, 0}));
  EXPECT_NEAR(at(v, 15, 0, 0), -5.0, 0.05);
  EXPECT_FALSE(v.distance->tree().isValueOn({22, 0, 0}));
  EXPECT_FLOAT_EQ(at(v, 22, 0, 0), 1.5f);
  EXPECT_FLOAT_EQ(at(v, 0, 0, 0), -6.0f);
}

TEST(Voxelize, FarFromTheOrigin) {
  PolygonMesh mesh = sphere({0, 0, 0}, 0.5);
  mesh.origin = Vector3d(1e6, -1e6, 1e6);
  const Voxelization v = run(mesh, {.voxel_size = 0.02});
  const Errors errors = compare(mesh, v, 0.02, 3.0, 6);
  EXPECT_LT(errors.worst, 1e-5);
  const openvdb::Vec3d world = v.distance->transform().indexToWorld(openvdb::Vec3d(0, 0, 0));
  EXPECT_EQ(world, openvdb::Vec3d(1e6, -1e6, 1e6));
}

TEST(Voxelize, TurnedDoubledAndShuffledFacesChangeNothing) {
  PolygonMesh mesh = sphere({0.1, 0.2, 0.3}, 12.0);
  const Voxelization plain = run(mesh);
  std::mt19937 random(7);
  PolygonMesh dirty = mesh;
  dirty.triangles.insert(dirty.triangles.end(), mesh.triangles.begin(), mesh.triangles.end());
  for (Triangle& t : dirty.triangles)
    if (random() % 2) std::swap(t[1], t[2]);
  std::shuffle(dirty.triangles.begin(), dirty.triangles.end(), random);
  const Voxelization v = run(dirty);
  std::size_t different = 0;
  for (auto voxel = plain.distance->cbeginValueAll(); voxel; ++voxel)
    different += std::abs(*voxel - v.distance->tree().getValue(voxel.getCoord())) > 1e-5f ? 1 : 0;
  EXPECT_EQ(different, 0u);
  EXPECT_EQ(plain.distance->activeVoxelCount(), v.distance->activeVoxelCount());
}

TEST(Voxelize, UnionOfOverlappingSpheres) {
  // Every triangle twice, in random orientation; the truth is analytic but for the facets.
  const double radius = 20.0, apart = 12.0;
  PolygonMesh mesh;
  append(mesh, sphere({-apart, 0, 0}, radius, 64));
  append(mesh, sphere({apart, 0, 0}, radius, 64), true);
  std::vector<Triangle> twice = mesh.triangles;
  std::mt19937 random(11);
  for (Triangle& t : twice)
    if (random() % 2) std::swap(t[1], t[2]);
  mesh.triangles.insert(mesh.triangles.end(), twice.begin(), twice.end());
  const Voxelization v = run(mesh);
  std::size_t wrong_signs = 0, stray = 0;
  double worst = 0;
  for (auto voxel = v.distance->cbeginValueOn(); voxel; ++voxel) {
    const openvdb::Coord c = voxel.getCoord();
    const double x = std::abs(c.x()), rho = std::hypot(double(c.y()), double(c.z()));
    const double outside = std::hypot(x - apart, rho) - radius;
    // Inside, the nearest place is on the sphere of this half space, or on the circle where the spheres meet.
    const double seam = std::hypot(x, rho - std::sqrt(radius * radius - apart * apart));
    const bool sphere_is_nearest =
        std::hypot(x - apart, rho) > 0 && x * radius >= apart * (radius - std::hypot(x - apart, rho));
    const double truth = outside > 0 ? outside : -(sphere_is_nearest ? -outside : seam);
    wrong_signs += std::abs(truth) > 0.05 && (truth < 0) != (*voxel < 0) ? 1 : 0;
    stray += truth < -3.2 ? 1 : 0;
    worst = std::max(worst, std::abs(*voxel - truth));
  }
  EXPECT_EQ(wrong_signs, 0u);
  EXPECT_EQ(stray, 0u);
  EXPECT_LT(worst, 0.06) << "facets are 0.03 off the spheres";
}

TEST(Voxelize, WallsOfAGapStayWhereInteriorFacesGo) {
  // Two boxes with a gap of 0.3 voxels that no voxel lies in, and a bar across it, above z = 5.2. The walls
  // of the gap bound the solid below the bar, and are inside it within the bar: both are two sheets on the
  // same edge.
  PolygonMesh mesh = box({-20, -10.2, -10.2}, {0.35, 10.2, 10.2});
  PolygonMesh right = box({0.65, -10.2, -10.2}, {20, 10.2, 10.2}), bar = box({-8.5, -30, 5.2}, {9.5, 30, 15});
  append(mesh, right);
  append(mesh, bar);
  const Voxelization v = run(mesh);
  EXPECT_NEAR(at(v, 0, 0, 0), -0.35, 1e-5);
  EXPECT_NEAR(at(v, 1, 0, 0), -0.35, 1e-5);
  EXPECT_NEAR(at(v, 0, 3, -6), -0.35, 1e-5);
  EXPECT_FLOAT_EQ(at(v, 0, 0, 9), -3.0f);
  EXPECT_FLOAT_EQ(at(v, 1, 0, 9), -3.0f);
  EXPECT_FALSE(v.distance->tree().isValueOn({0, 0, 9}));
  EXPECT_NEAR(at(v, 0, 0, 7), -std::hypot(0.35, 1.8), 1e-5) << "the bar's bottom above the gap";
}

TEST(Voxelize, UnionOfABoxAndATurnedOne) {
  // A few triangles, each of whose boxes holds more blocks than have anything to do with the seam. Outside,
  // the distance to the union is that to the nearer box.
  const Vector3d half(70.3, 61.7, 50.2), turned_half(90.1, 20.4, 30.6);
  PolygonMesh mesh = box(-half, half), turned = box(-turned_half, turned_half);
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(0.7, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.5, Vector3d::UnitY()))
          .toRotationMatrix();
  for (Eigen::Vector3f& p : turned.points) p = (turn * p.cast<double>()).cast<float>();
  append(mesh, turned);
  const Voxelization v = run(mesh);
  // Negative inside.
  const auto distance = [](const Vector3d& p, const Vector3d& to) {
    const Vector3d beyond = p.cwiseAbs() - to;
    return beyond.maxCoeff() > 0 ? beyond.cwiseMax(0.0).norm() : beyond.maxCoeff();
  };
  std::size_t wrong = 0, outside = 0, stray = 0;
  double nearest = 0;
  for (auto voxel = v.distance->cbeginValueOn(); voxel; ++voxel) {
    const openvdb::Coord c = voxel.getCoord();
    const Vector3d p(c.x(), c.y(), c.z());
    const double truth = std::min(distance(p, half), distance(turn.transpose() * p, turned_half));
    outside += truth > 0;
    wrong += truth > 0 ? std::abs(*voxel - truth) > 1e-3 : *voxel > 1e-3;
    // Inside, the surface is no nearer than that of the box that the place is deeper in.
    if (truth <= 0) nearest = std::max(nearest, *voxel - truth);
    stray += truth < -3.11;
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_LT(nearest, 1e-3);
  EXPECT_EQ(stray, 0u);
  EXPECT_GT(outside, 200'000u);
}

TEST(Voxelize, InsideTwoBoxesThatCrossDistancesAreThoseToTheirUnion) {
  const Vector3d low[2] = {{-20.3, -6.2, -7.4}, {-5.7, -18.6, -3.3}}, high[2] = {{20.3, 6.2, 7.4}, {8.1, 17.2, 12.9}};
  PolygonMesh mesh = box(low[0], high[0]);
  append(mesh, box(low[1], high[1]));
  const Voxelization v = run(mesh);
  // What is outside is boxes between the planes of all sides.
  std::array<std::vector<double>, 3> planes;
  for (int a = 0; a < 3; ++a) {
    planes[std::size_t(a)] = {-100, low[0][a], low[1][a], high[0][a], high[1][a], 100};
    std::sort(planes[std::size_t(a)].begin(), planes[std::size_t(a)].end());
  }
  std::vector<std::pair<Vector3d, Vector3d>> outside;
  for (std::size_t x = 0; x < 5; ++x)
    for (std::size_t y = 0; y < 5; ++y)
      for (std::size_t z = 0; z < 5; ++z) {
        const Vector3d from(planes[0][x], planes[1][y], planes[2][z]),
            to(planes[0][x + 1], planes[1][y + 1], planes[2][z + 1]), middle = 0.5 * (from + to);
        bool inside = false;
        for (int i = 0; i < 2; ++i)
          inside |= (middle.array() > low[i].array()).all() && (middle.array() < high[i].array()).all();
        if (!inside) outside.emplace_back(from, to);
      }
  std::size_t inside = 0, off = 0;
  for (int x = -22; x <= 22; ++x)
    for (int y = -20; y <= 20; ++y)
      for (int z = -9; z <= 14; ++z) {
        const Vector3d p(x, y, z);
        double truth = 3.0;
        for (const auto& [from, to] : outside)
          truth = std::min(truth, (p - p.cwiseMax(from).cwiseMin(to)).norm());
        inside += truth > 0;
        off += truth > 0 && std::abs(at(v, x, y, z) + truth) > 1e-5;
      }
  EXPECT_EQ(off, 0u);
  EXPECT_GT(inside, 10'000u);
}

TEST(Voxelize, InsideATorusThatCrossesItselfDistancesAreThoseToItsOuterPart) {
  constexpr double kMajor = 6.0, kMinor = 20.0;
  constexpr std::uint32_t kRings = 96, kSides = 64;
  PolygonMesh mesh;
  for (std::uint32_t i = 0; i < kRings; ++i)
    for (std::uint32_t j = 0; j < kSides; ++j) {
      const double u = 2 * std::numbers::pi * i / kRings, v = 2 * std::numbers::pi * j / kSides;
      const double rho = kMajor + kMinor * std::cos(v);
      mesh.points.push_back(
          Vector3d(rho * std::cos(u) + 0.31, rho * std::sin(u) - 0.17, kMinor * std::sin(v) + 0.23).cast<float>());
      const auto at = [&](std::uint32_t k, std::uint32_t l) { return (k % kRings) * kSides + l % kSides; };
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  const Voxelization v = run(mesh);
  const double tip = std::sqrt(kMinor * kMinor - kMajor * kMajor);  // where the axis leaves the solid
  std::size_t inside = 0;
  double worst_off_tips = 0, worst_at_tips = 0;
  for (auto voxel = v.distance->cbeginValueAll(); voxel; ++voxel) {
    if (!voxel.isVoxelValue()) continue;
    const openvdb::Coord c = voxel.getCoord();
    const double rho = std::hypot(c.x() - 0.31, c.y() + 0.17), z = c.z() - 0.23;
    const double from_circle = std::hypot(rho - kMajor, z);
    if (from_circle > kMinor) continue;
    const double hit = kMajor + (rho - kMajor) * kMinor / from_circle;  // of the ray through the place
    const double truth = hit >= 0 ? kMinor - from_circle : std::hypot(rho, std::abs(z) - tip);
    ++inside;
    // Facets of two sides of the axis cross it together, and leave dents at the tips.
    double& worst = hit > 1.0 ? worst_off_tips : worst_at_tips;
    worst = std::max(worst, std::abs(std::min(truth, 3.0) + *voxel));
  }
  EXPECT_LT(worst_off_tips, 0.045) << "facets are 0.04 off";
  EXPECT_LT(worst_at_tips, 0.2);
  EXPECT_GT(inside, 10'000u);
}

TEST(Voxelize, SaysWhereTrianglesCrossMoreOftenThanThereAreSamples) {
  std::mt19937 random(7);
  PolygonMesh mesh;
  for (std::uint32_t i = 0; i < 2100; ++i) {
    mesh.points.push_back(16.0f * Eigen::Vector3f(float(random()), float(random()), float(random())) / float(random.max()));
    if (i % 3 == 2) mesh.triangles.push_back({i - 2, i - 1, i});
  }
  RunContext context;
  voxelize(mesh, {}, context);
  EXPECT_EQ(std::ranges::count_if(context.notes,
                                  [](const std::string& note) { return note.find("cross one another") != note.npos; }),
            1);
}

TEST(Voxelize, NestedShellsAreFilledOrKept) {
  PolygonMesh mesh = sphere({0, 0, 0}, 20.0);
  append(mesh, sphere({0, 0, 0}, 10.0), true);
  const Voxelization filled = run(mesh, {.signs = SignRule::flood_fill});
  EXPECT_FLOAT_EQ(at(filled, 0, 0, 0), -3.0f);
  EXPECT_FALSE(filled.distance->tree().isValueOn({10, 0, 0})) << "the wall of a filled cavity bounds nothing";
  const Voxelization kept = run(mesh, {.signs = SignRule::winding_number});
  EXPECT_FLOAT_EQ(at(kept, 0, 0, 0), 3.0f);
  EXPECT_LT(at(kept, 12, 0, 0), 0.0);
  EXPECT_GT(at(kept, 8, 0, 0), 0.0);
}

/// A sphere without its cap above z = `cut`.
PolygonMesh opened(double radius, double cut) {
  PolygonMesh mesh = sphere({0, 0, 0}, radius, 48);
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return mesh.points[t[0]].z() > cut && mesh.points[t[1]].z() > cut && mesh.points[t[2]].z() > cut;
  });
  return mesh;
}

TEST(Voxelize, AutomaticSignsCloseAHole) {
  const PolygonMesh mesh = opened(20.0, 15.0);
  RunContext context;
  const Voxelization v = voxelize(mesh, {}, context);
  ASSERT_EQ(context.notes.size(), 1u);
  EXPECT_NE(context.notes[0].find("leaks"), std::string::npos);
  EXPECT_FLOAT_EQ(at(v, 0, 0, 0), -3.0f);
  EXPECT_FLOAT_EQ(at(v, 0, 0, 24), 3.0f);
  // Signs as the exact winding number has them, and a surface across the hole with a band around it.
  for (int z = 8; z < 22; ++z)
    for (int x = -6; x < 6; ++x) {
      const double w = exact_winding_number(mesh.points, mesh.triangles, 1.0, Vector3d(x, 1, z));
      if (std::abs(w - 0.5) > 0.02) {
        EXPECT_EQ(at(v, x, 1, z) < 0, w > 0.5) << x << ' ' << z << ' ' << w;
      }
      if (at(v, x, 1, z) < 0 && at(v, x, 1, z + 1) > 0) {
        EXPECT_LT(at(v, x, 1, z + 1) - at(v, x, 1, z), 1.6);
      }
    }
}

/// Its samples have coordinates of both signs, which a cut towards 0 instead of down once mixed up.
TEST(Voxelize, TheSurfaceAcrossAHoleDoesNotDependOnWhereTheHoleIs) {
  // The border is a saddle's, so that the surface across is bent.
  PolygonMesh here = sphere({0, 0, 0}, 9.0, 48);
  std::erase_if(here.triangles, [&](const Triangle& t) {
    const Vector3f& p = here.points[t[0]];
    return p.z() > -2 + 0.05f * (p.x() * p.x() - p.y() * p.y());
  });
  PolygonMesh there = here;
  for (Vector3f& p : there.points) p += Vector3f(64, 64, 64);
  RunContext context;
  const Voxelization a = voxelize(here, {}, context), b = voxelize(there, {}, context);
  int in_cap = 0;
  for (int x = -6; x <= 6; ++x)
    for (int y = -6; y <= 6; ++y)
      for (int z = -8; z <= 6; ++z) {
        EXPECT_NEAR(at(a, x, y, z), at(b, x + 64, y + 64, z + 64), 1e-3) << x << ' ' << y << ' ' << z;
        in_cap += std::abs(at(a, x, y, z)) < 1;
      }
  EXPECT_GT(in_cap, 200);
}

TEST(Voxelize, AVoxelAtTheBottomOfACreviceIsOutside) {
  // Two boxes 0.4 voxels apart along the diagonal plane: no grid edge leads into the gap, which voxels lie
  // in.
  PolygonMesh mesh;
  const Vector3d along = Vector3d(1, 1, 0).normalized(), across = Vector3d(1, -1, 0).normalized();
  for (const double side : {-1.0, 1.0}) {
    PolygonMesh half = box({-15, 0.2, -8.3}, {15, 9, 8.3});
    for (Vector3f& p : half.points)
      p = (double(p.x()) * along + side * double(p.y()) * across + double(p.z()) * Vector3d::UnitZ())
              .cast<float>();
    append(mesh, half, side > 0);
  }
  const Voxelization v = run(mesh);
  EXPECT_GT(at(v, 9, 9, 0), 0.0) << "near the mouth";
  EXPECT_LT(at(v, 4, -2, 0), 0.0);
  EXPECT_LT(at(v, -2, 4, 0), 0.0);
}

TEST(Voxelize, VoxelsOneBehindTheOtherInASlitAreOutside) {
  // Between two boxes 0.2 to 0.4 voxel apart, which no grid edge goes along: a voxel deep in the slit sees
  // others in it, and only those at its mouth see what is around the boxes.
  for (int turn = 0; turn < 3; ++turn) {
    const Eigen::Matrix3d rotation =
        (Eigen::AngleAxisd(0.5 + 0.13 * turn, Vector3d::UnitX()) * Eigen::AngleAxisd(0.3, Vector3d::UnitY()))
            .toRotationMatrix();
    const double half = 0.1 + 0.05 * turn;
    PolygonMesh mesh;
    for (const double side : {-1.0, 1.0}) {
      PolygonMesh plate = box({-15, -15, side > 0 ? half : -8}, {15, 15, side > 0 ? 8 : -half});
      for (Vector3f& p : plate.points) p = (rotation * p.cast<double>()).cast<float>();
      append(mesh, plate);
    }
    const Voxelization v = run(mesh);
    int in_slit = 0;
    for (auto value = v.distance->cbeginValueOn(); value; ++value) {
      const openvdb::Coord c = value.getCoord();
      const Vector3d p = rotation.transpose() * Vector3d(c.x(), c.y(), c.z());
      if (std::abs(p.z()) > half - 1e-3 || std::max(std::abs(p.x()), std::abs(p.y())) > 15) continue;
      ++in_slit;
      EXPECT_GT(*value, 0.0) << p.transpose();
    }
    EXPECT_GT(in_slit, 100);
  }
}

TEST(Voxelize, AVoxelThatOnlyAWayWithABendLeadsToIsOutside) {
  // A chamber around (0, 0, z) with a narrow passage that turns twice before it ends at y = 8.2; no straight way leads
  // through it. Plugged, it is a cavity.
  const auto block = [](double gap, bool plugged) {
    PolygonMesh mesh = box({-8.2, -8.2, -6.3}, {-0.3, 8.2, 6.3});
    append(mesh, box({-0.5, -8.2, -6.3}, {8.2, -0.3, 6.3}));
    append(mesh, box({-0.5, 0.3, -6.3}, {0.5, 8.2, 6.3}));
    append(mesh, box({0.3, -0.5, -6.3}, {0.7, 0.3 - gap, 6.3}));
    append(mesh, box({0.5 + gap, -0.5, -6.3}, {8.2, 8.2, 6.3}));
    append(mesh, box({-8.2, -8.2, 6.1}, {8.2, 8.2, 9.2}));
    append(mesh, box({-8.2, -8.2, -9.2}, {8.2, 8.2, -6.1}));
    if (plugged) append(mesh, box({0.45, 5.3, -6.3}, {0.65, 5.7, 6.3}));
    return mesh;
  };
  for (const double gap : {0.1, 0.002}) {
    const Voxelization open = run(block(gap, false)), closed = run(block(gap, true));
    for (int z = -5; z <= 5; ++z) {
      EXPECT_NEAR(at(open, 0, 0, z), 0.3, 1e-5) << gap;
      EXPECT_LT(at(closed, 0, 0, z), 0.0) << gap;
    }
    EXPECT_LT(at(open, -3, 3, 0), 0.0) << gap;
  }
}

TEST(Voxelize, APocketThatLooksIntoASharpCreaseFromWithinIsNotOutside) {
  // A closed prism, inside out, that narrows to a crease on the lattice: a hair off one of the walls there is behind
  // the other.
  PolygonMesh mesh;
  for (const float z : {-1.3f, 1.3f})
    for (const Vector3f& p : {Vector3f(3.5f, 0, z), Vector3f(3.2f, 0.0685714286f, z), Vector3f(-3.5f, 1.6f, z),
                              Vector3f(-3.5f, -1.6f, z), Vector3f(3.2f, -0.0685714286f, z)})
      mesh.points.push_back(p);
  for (std::uint32_t i = 0; i < 5; ++i) {
    const std::uint32_t j = (i + 1) % 5;
    mesh.triangles.push_back({i, j + 5, j});
    mesh.triangles.push_back({i, i + 5, j + 5});
  }
  for (std::uint32_t i = 1; i < 4; ++i) {
    mesh.triangles.push_back({0, i, i + 1});
    mesh.triangles.push_back({5, i + 6, i + 5});
  }
  const Voxelization v = run(mesh, {.signs = SignRule::flood_fill});
  for (int x = -3; x <= 3; ++x) EXPECT_LT(at(v, x, 0, 0), 0.0) << x;
}

TEST(Voxelize, WindingNumbersOnVoxelsOfTheSurfaceMakeNoCaps) {
  const PolygonMesh mesh = box({-10, -10, -10}, {10, 10, 10});
  const Voxelization v = run(mesh, {.signs = SignRule::winding_number});
  EXPECT_LT(compare(mesh, v, 1.0, 3.0, 5).worst, 1e-5);
  EXPECT_EQ(compare(mesh, v, 1.0, 3.0, 5).active, 0u);
}

TEST(Voxelize, FloodFillStaysAFloodFillWhenAsked) {
  RunContext context;
  const Voxelization v = voxelize(opened(20.0, 15.0), {.signs = SignRule::flood_fill}, context);
  EXPECT_GT(at(v, 0, 0, 0), 0.0) << "the outside gets in through the hole";
}

TEST(Voxelize, AThinPlateIsNoLeak) {
  RunContext context;
  const Voxelization v = voxelize(box({-20, -20, 0.4}, {20, 20, 0.6}), {}, context);
  EXPECT_TRUE(v.is_signed);
  EXPECT_EQ(context.notes.size(), 0u) << context.notes[0];
  EXPECT_NEAR(at(v, 0, 0, 0), 0.4, 1e-6);
}

TEST(Voxelize, WithoutAnInsideThereIsNoSign) {
  PolygonMesh strip;  // Möbius
  constexpr int n = 60;
  for (int i = 0; i < n; ++i) {
    const double phi = 2 * std::numbers::pi * i / n;
    for (const double s : {-4.0, 4.0})
      strip.points.push_back(Vector3d((15 + s * std::cos(phi / 2)) * std::cos(phi),
                                      (15 + s * std::cos(phi / 2)) * std::sin(phi), s * std::sin(phi / 2))
                                 .cast<float>());
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t a = 2 * i, b = a + 1;
    const std::uint32_t c = i + 1 < n ? a + 2 : 1, d = i + 1 < n ? a + 3 : 0;
    strip.triangles.push_back({a, b, c});
    strip.triangles.push_back({c, b, d});
  }
  RunContext context;
  const Voxelization v = voxelize(strip, {}, context);
  EXPECT_FALSE(v.is_signed);
  EXPECT_EQ(v.distance->getName(), "udf");
  ASSERT_EQ(context.notes.size(), 1u);
  EXPECT_LT(compare(strip, v, 1.0, 3.0, 5).worst, 1e-5);
}

// ---- Random soups: slivers, coincident and degenerate faces, needles, points, far from the origin.

// ---- The same bytes.

std::vector<float> bytes_of(const PolygonMesh& mesh, SignRule signs) {
  const Voxelization v = run(mesh, {.signs = signs});
  std::vector<float> result;
  for (auto leaf = v.distance->tree().cbeginLeaf(); leaf; ++leaf) {
    for (int a = 0; a < 3; ++a) result.push_back(float(leaf->origin()[a]));
    result.insert(result.end(), leaf->buffer().data(), leaf->buffer().data() + 512);
  }
  return result;
}

PolygonMesh mixed() {
  PolygonMesh mesh = opened(18.0, 12.0);
  append(mesh, sphere({12, 3, 1}, 4.0, 90));
  append(mesh, box({-30, -2.3, -2.1}, {5, 2.2, 2.4}));
  return mesh;
}

TEST(Voxelize, SameBytesAtAnyThreadCount) {
  const PolygonMesh mesh = mixed();
  const std::vector<float> reference = bytes_of(mesh, SignRule::automatic);
  ASSERT_GT(reference.size(), 10000u);
  for (const std::size_t threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_TRUE(bytes_of(mesh, SignRule::automatic) == reference) << threads << " threads";
  }
}

TEST(Voxelize, SameBytesAtAnyLevelOfVectorCode) {
  const PolygonMesh mesh = mixed();
  const std::vector<float> reference = bytes_of(mesh, SignRule::automatic);
  for (const SimdLevel level : available_simd_levels()) {
    setenv("HERMESH_SIMD", std::string(name(level)).c_str(), 1);
    EXPECT_TRUE(bytes_of(mesh, SignRule::automatic) == reference) << name(level);
  }
  setenv("HERMESH_SIMD", "mmx", 1);
  EXPECT_THROW(bytes_of(mesh, SignRule::automatic), Error);
  unsetenv("HERMESH_SIMD");
}

TEST(Voxelize, CancelEndsIt) {
  const std::atomic<bool> cancel = true;
  RunContext context;
  context.cancel = &cancel;
  EXPECT_THROW(voxelize(sphere({0, 0, 0}, 30), {}, context), Cancelled);
}

}  // namespace
}  // namespace hermesh
