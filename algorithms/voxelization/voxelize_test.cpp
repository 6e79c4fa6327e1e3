#include "algorithms/voxelization/voxelize.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <numbers>
#include <random>

#include "algorithms/io/mesh_file.h"
#include "algorithms/lattice/simd/simd_level.h"
#include "algorithms/voxelization/voxelize_for_tests.h"

namespace hermesh {
namespace voxelize_test {

using Eigen::Vector3d;
using Eigen::Vector3f;
using namespace voxelize_for_tests;

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

TEST(Voxelize, ABandOfOneVoxelHasTheSignsOfFacesOnSamples) {
  // Faces between two leaves: of the edges that they cross, one end is the only voxel of its leaf that
  // matters, a whole voxel away and so not active.
  for (const VoxelizeOptions& options : {VoxelizeOptions{.exterior_band = 1, .interior_band = 1},
                                         VoxelizeOptions{.exterior_band = 1, .interior_band = 3},
                                         VoxelizeOptions{.exterior_band = 3, .interior_band = 1}})
    for (const double half : {8.0, 7.0, 9.0, 16.0}) {
      const Voxelization narrow = run(box({-half, -half, -half}, {half, half, half}), options),
                         wide = run(box({-half, -half, -half}, {half, half, half}));
      const int most = int(half) + 2;
      for (int x = -most; x <= most; ++x)
        for (int y = -most; y <= most; ++y)
          for (int z = -most; z <= most; ++z) {
            const double should =
                std::clamp(at(wide, x, y, z), -options.interior_band, options.exterior_band);
            ASSERT_EQ(at(narrow, x, y, z), should) << openvdb::Coord(x, y, z) << ' ' << half;
          }
    }
}

TEST(Voxelize, AnUnsignedBandOfOneVoxelIsNoWider) {
  // Faces that cancel enclose nothing, so by either rule no voxel has a sign.
  PolygonMesh sheet;
  add_triangle(sheet, {-9, -9, 0}, {9, -9, 0}, {0, 9, 0});
  append(sheet, PolygonMesh(sheet), true);
  for (const SignRule rule : {SignRule::none, SignRule::automatic}) {
    const Voxelization v = run(sheet, {.exterior_band = 1, .interior_band = 1, .signs = rule});
    EXPECT_FALSE(v.is_signed);
    for (auto value = v.distance->cbeginValueOn(); value; ++value) ASSERT_LT(*value, 1.0f);
    EXPECT_EQ(at(v, 0, 0, 1), 1.0);
  }
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

TEST(Voxelize, SamplesBeyondTheBandHaveItsWidth) {
  // Exactly, for OpenVDB's tools, and stencils, compare with the background to detect missing data.
  std::mt19937 random(20110411);
  std::uniform_real_distribution<double> size(1e-3, 1.0);
  for (int i = 0; i < 40; ++i) {
    const double h = size(random), exterior = i % 2 ? 3.0 : 2.0;
    const Voxelization v = run(sphere({0, 0, 0}, 9.3 * h, 8),
                               {.voxel_size = h, .exterior_band = exterior, .interior_band = 3.0});
    const float outside = v.distance->background(), inside = -float(3.0 * h);
    ASSERT_EQ(outside, float(exterior * h));
    for (auto value = v.distance->tree().cbeginValueOff(); value; ++value)
      ASSERT_TRUE(*value == outside || *value == inside) << h << ": " << *value;
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
  // Every triangle twice, in random orientation; the truth is analytic except for the facets.
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
    // Inside, the nearest point is on the sphere of this half space, or on the circle where the spheres meet.
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
    // Inside, the surface is no nearer than that of the box in which the point is deeper.
    if (truth <= 0) nearest = std::max(nearest, *voxel - truth);
    stray += truth < -3.11;
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_LT(nearest, 1e-3);
  EXPECT_EQ(stray, 0u);
  EXPECT_GT(outside, 200'000u);
}

TEST(Voxelize, InsideTwoBoxesThatCrossDistancesAreThoseToTheirUnion) {
  const Vector3d low[2] = {{-20.3, -6.2, -7.4}, {-5.7, -18.6, -3.3}},
                 high[2] = {{20.3, 6.2, 7.4}, {8.1, 17.2, 12.9}};
  PolygonMesh mesh = box(low[0], high[0]);
  append(mesh, box(low[1], high[1]));
  const Voxelization v = run(mesh);
  // The outside consists of boxes between the planes of all sides.
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
          Vector3d(rho * std::cos(u) + 0.31, rho * std::sin(u) - 0.17, kMinor * std::sin(v) + 0.23)
              .cast<float>());
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
    const double hit = kMajor + (rho - kMajor) * kMinor / from_circle;  // of the ray through the point
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
    mesh.points.push_back(16.0f * Eigen::Vector3f(float(random()), float(random()), float(random())) /
                          float(random.max()));
    if (i % 3 == 2) mesh.triangles.push_back({i - 2, i - 1, i});
  }
  RunContext context;
  voxelize(mesh, {}, context);
  EXPECT_EQ(
      std::ranges::count_if(
          context.notes, [](const std::string& note) { return note.find("cross one another") != note.npos; }),
      1);
}

// ---- Random soups, compared with the nearest triangle that a tree finds.

class Soups {
 public:
  explicit Soups(std::uint64_t seed) : random_(seed) {}

  PolygonMesh next() {
    PolygonMesh mesh;
    const int kind = int(random_() % 8), n = 1 + int(random_() % 24);
    for (int i = 0; i < n; ++i) {
      const Vector3d a = point(12), b = kind == 3 ? a : Vector3d(a + point(kind == 5 ? 60 : 6));
      Vector3d c = a + point(6);
      if (kind == 1) c = 0.5 * (a + b) + 1e-4 * point(1);  // slivers
      if (kind == 2) c = a + 0.3 * (b - a);                // segments
      if (kind == 3) c = a;                                // points
      if (kind == 4) c = a + 1e-6 * point(1);              // needles
      if (kind == 6) {
        for (const Vector3d& v : {a, b, c}) add_whole(mesh, v);  // corners on voxels
      }
      if (kind != 6) add_triangle(mesh, a, b, c);
      if (kind == 7) add_triangle(mesh, a, c, b);  // coincident
    }
    if (kind == 6) {
      mesh.triangles.clear();
      for (std::uint32_t i = 0; i + 2 < mesh.points.size(); i += 3)
        mesh.triangles.push_back({i, i + 1, i + 2});
    }
    if (random_() % 4 == 0) mesh.origin = Vector3d(1e7, -3e8, 12345.678);
    return mesh;
  }
  double band() { return std::array{1.0, 1.5, 3.0, 4.25}[random_() % 4]; }
  double voxel_size() { return std::array{1.0, 0.37, 2.9}[random_() % 3]; }

 private:
  Vector3d point(double size) {
    std::uniform_real_distribution<double> uniform(-size, size);
    const double x = uniform(random_), y = uniform(random_);
    return {x, y, uniform(random_)};
  }
  static void add_whole(PolygonMesh& mesh, const Vector3d& v) {
    mesh.points.push_back(v.array().round().matrix().cast<float>());
  }
  std::mt19937_64 random_;
};

/// Compares the bands of `count` random soups with the nearest triangles, one by one.
void check_soups(int count, unsigned seed) {
  Soups soups(seed);
  std::size_t checked = 0;
  for (int i = 0; i < count; ++i) {
    const PolygonMesh mesh = soups.next();
    const double band = soups.band(), voxel_size = soups.voxel_size();
    RunContext context;
    const Voxelization v = voxelize(
        mesh,
        {.voxel_size = voxel_size, .exterior_band = band, .interior_band = band, .signs = SignRule::none},
        context);
    // A random sample of the box, or the whole of it where it is small, keeps this to seconds.
    const std::vector<Triangle> triangles = triangulated(mesh);
    const TriangleTree tree(mesh.points, triangles, 1.0 / voxel_size);
    const auto accessor = v.distance->getConstAccessor();
    std::size_t looked = 0;
    for (auto voxel = v.distance->cbeginValueAll(); voxel && looked < 60000; ++voxel) {
      if (!voxel.isVoxelValue()) continue;
      if (++looked % 37 != std::size_t(i % 37)) continue;
      const openvdb::Coord c = voxel.getCoord();
      const double truth = std::sqrt(tree.nearest(Vector3d(c.x(), c.y(), c.z())).squared);
      ++checked;
      if (voxel.isValueOn()) {
        ASSERT_NEAR(*voxel / voxel_size, truth, 1e-5) << "soup " << i << " at " << c;
      } else {
        ASSERT_GT(truth, band - 1e-4) << "soup " << i << " at " << c;
      }
    }
    // And every leaf is there: around each corner the band is active.
    for (const Triangle& t : triangles)
      for (const std::uint32_t p : t) {
        const Vector3d at = mesh.points[p].cast<double>() / voxel_size;
        const openvdb::Coord c(int(std::lround(at.x())), int(std::lround(at.y())), int(std::lround(at.z())));
        ASSERT_TRUE(accessor.isValueOn(c)) << "soup " << i;
      }
  }
  EXPECT_GT(checked, 50u * std::size_t(count));
}

/// Its corners are collinear except for rounding, so its normal is noise, which must not lose either end.
TEST(Voxelize, ANeedleHasTheBandAroundBothEnds) {
  PolygonMesh needle;
  needle.points = {{1.9281562566757202f, 0.71781373023986816f, 2.6251864433288574f},
                   {-2.2653148174285889f, -0.73634469509124756f, 4.4785332679748535f},
                   {0.67011493444442749f, 0.28156620264053345f, 3.1811904907226562f}};
  needle.triangles = {{0, 1, 2}};
  RunContext context;
  const Voxelization v = voxelize(
      needle, {.voxel_size = 0.37, .exterior_band = 1.5, .interior_band = 1.5, .signs = SignRule::none},
      context);
  const auto accessor = v.distance->getConstAccessor();
  for (int step = 0; step <= 100; ++step) {
    const Eigen::Vector3f at = needle.points[0] + 0.01f * float(step) * (needle.points[1] - needle.points[0]);
    const Eigen::Vector3d voxels = at.cast<double>() / 0.37;
    const openvdb::Coord c(int(std::lround(voxels.x())), int(std::lround(voxels.y())),
                           int(std::lround(voxels.z())));
    EXPECT_TRUE(accessor.isValueOn(c)) << c;
  }
}

TEST(Voxelize, ThreeHundredSoupsAreExact) { check_soups(300, 20111); }
TEST(Slow, TwentyThousandSoupsAreExact) { check_soups(20000, 20112); }

// ---- Placement in the world, far from the origin above all.

/// A box whose coordinates went through a file of decimal numbers.
PolygonMesh box_from_file(const Vector3d& low, const Vector3d& high) {
  const auto path =
      std::filesystem::temp_directory_path() / ("hermesh-placement-" + std::to_string(getpid()) + ".obj");
  {
    std::ofstream file(path);
    file << std::setprecision(17);
    for (int i = 0; i < 8; ++i)
      file << "v " << (i & 1 ? high : low).x() << ' ' << (i & 2 ? high : low).y() << ' '
           << (i & 4 ? high : low).z() << '\n';
    file << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  }
  RunContext context;
  const PolygonMesh mesh = read_mesh(path, context);
  std::filesystem::remove(path);
  return mesh;
}

TEST(Placement, ObjectOfSizeOneAMillionAwayKeepsWhatTheFileHolds) {
  // A thousandth of a voxel is 1e-5 here, and single precision at a million has steps of 0.06.
  const Vector3d low(1e6 + 0.10437, -2e6 + 0.20591, 3e6 + 0.30113),
      high = low + Vector3d(1.00217, 0.80541, 0.9);
  const PolygonMesh mesh = box_from_file(low, high);
  RunContext context;
  const Voxelization result = voxelize(mesh, {.voxel_size = 0.01}, context);
  const openvdb::math::Transform& transform = result.distance->transform();
  std::size_t inside = 0;
  for (auto value = result.distance->cbeginValueOn(); value; ++value) {
    const openvdb::Vec3d at = transform.indexToWorld(value.getCoord());
    ASSERT_NEAR(*value, to_box({at[0], at[1], at[2]}, low, high), 3e-7) << value.getCoord();
    inside += *value < 0 ? 1 : 0;
  }
  EXPECT_GT(inside, 100'000u);
}

TEST(Placement, OriginOfTheMeshMovesTheTransformAlone) {
  const PolygonMesh near = box_from_file({0.1, 0.2, 0.3}, {1.1, 0.9, 1.3});
  PolygonMesh far = near;
  far.origin = {1e6, -2.5e6, 1e9};
  RunContext context;
  const Voxelization here = voxelize(near, {.voxel_size = 0.02}, context),
                     there = voxelize(far, {.voxel_size = 0.02}, context);
  ASSERT_TRUE(here.distance->tree().hasSameTopology(there.distance->tree()));
  for (auto a = here.distance->tree().cbeginLeaf(), b = there.distance->tree().cbeginLeaf(); a; ++a, ++b)
    ASSERT_EQ(std::memcmp(a->buffer().data(), b->buffer().data(), 512 * sizeof(float)), 0);
  const openvdb::Vec3d first = there.distance->transform().indexToWorld(openvdb::Coord(0, 0, 0));
  EXPECT_EQ(first, openvdb::Vec3d(1e6, -2.5e6, 1e9));
}

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

}  // namespace voxelize_test
}  // namespace hermesh
