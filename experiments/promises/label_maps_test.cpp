// Label maps: closed boundaries with shared walls, near the voxels' boundary, validated as written to files.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <random>

#include "algorithms/core/error.h"
#include "algorithms/fracture/mass_properties.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/labels/label_mesh.h"
#include "algorithms/labels/label_surface.h"
#include "validation/fracture_report.h"

namespace hermesh {
namespace label_maps_test {

using Eigen::Vector3d;
using LabelAt = std::function<std::uint32_t(int x, int y, int z)>;

LabelMap made_map(const std::array<int, 3>& dims, const LabelAt& label, const IndexToWorld& placement = {}) {
  std::vector<std::uint32_t> values;
  for (int z = 0; z < dims[2]; ++z)
    for (int y = 0; y < dims[1]; ++y)
      for (int x = 0; x < dims[0]; ++x) values.push_back(label(x, y, z));
  RunContext context;
  return label_map(values, dims, placement, context);
}

LabelMeshes meshes_of(const LabelMap& map, double smoothing = 0.5) {
  RunContext context;
  return label_meshes(map, {.smoothing = smoothing}, context);
}

double volume_of(const LabelMeshes& made, std::uint32_t label) {
  for (const LabelMeshes::Label& each : made.labels)
    if (each.label == label) return mass_properties(made.mesh_of(each)).volume;
  return 0.0;
}

/// The largest distance of a vertex from the boundary between voxels, voxels.
double farthest(const LabelMap& map, const LabelMeshes& made) {
  double result = 0.0;
  for (const Vector3d& point : made.fracture.mesh.points)
    result = std::max(result, distance_from_voxel_boundary(map, point));
  return result;
}

/// The volume inside the surface against the background.
double volume_of_all(const LabelMeshes& made) {
  PolygonMesh walls = made.shared_walls();
  const auto& neighbours = std::get<std::vector<std::int32_t>>(walls.attributes[1].values);
  std::vector<Triangle> outer;
  for (std::size_t t = 0; t < walls.triangles.size(); ++t)
    if (neighbours[t] == 0) outer.push_back(walls.triangles[t]);
  walls.triangles = std::move(outer);
  walls.attributes.clear();
  return mass_properties(walls).volume;
}

/// Checks that all labels fit without gaps and overlaps, each watertight.
void expect_complex(const LabelMeshes& made) {
  std::vector<MeshFile> files;
  validation::ExpectedVolumes expected;
  for (const LabelMeshes::Label& label : made.labels) {
    if (label.piece == 0) continue;
    const PolygonMesh mesh = made.mesh_of(label);
    files.push_back(to_mesh_file(mesh));
    expected.pieces.push_back(mass_properties(mesh).volume);
    EXPECT_GT(expected.pieces.back(), 0.0) << label.label;
  }
  expected.whole = volume_of_all(made);
  RunContext context;
  const validation::FractureReport report = validation::check_fracture(files, context, expected);
  std::string all;
  for (const std::string& sentence : report.sentences()) all += sentence + " ";
  for (const std::string& place : report.places) all += "\n" + place;
  EXPECT_TRUE(report.is_valid()) << all;
  EXPECT_EQ(report.unmatched_cut, 0);
  EXPECT_EQ(report.intersecting_pairs, 0);
  EXPECT_LE(report.volume_difference(), 1e-9);
  EXPECT_NEAR(report.pieces_volume, *expected.whole, 1e-9 * *expected.whole);
}

/// A random map of the Voronoi cells of 2 to 30 seeds, some of them of the background, in a random box.
struct RandomMap {
  std::array<int, 3> dims{};
  LabelMap map;
  int labels = 0;
};
RandomMap random_map(unsigned seed) {
  std::mt19937 random(seed);
  const auto number = [&](int least, int most) {
    return least + static_cast<int>(random() % static_cast<unsigned>(most - least + 1));
  };
  RandomMap result;
  for (int& dim : result.dims) dim = number(6, 28);
  result.labels = number(2, 30);
  const int empty = number(0, result.labels / 4);
  std::vector<std::pair<Vector3d, std::uint32_t>> seeds;
  for (int i = 0; i < result.labels + empty; ++i) {
    Vector3d at;
    for (int a = 0; a < 3; ++a) at[a] = double(number(0, 1000)) / 1000.0 * (result.dims[a] - 1);
    seeds.emplace_back(at, i < result.labels ? static_cast<std::uint32_t>(1 + 37 * i) : 0u);
  }
  result.map = made_map(result.dims, [&](int x, int y, int z) {
    const Vector3d at(x, y, z);
    std::uint32_t label = 0;
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [place, own] : seeds)
      if (const double squared = (place - at).squaredNorm(); squared < least) least = squared, label = own;
    return label;
  });
  return result;
}

struct Totals {
  std::uint64_t changed = 0, samples = 0, lost = 0, fanned = 0, joints = 0, several = 0;
  double farthest = 0.0;
};

void expect_random_map(unsigned seed, Totals& totals) {
  SCOPED_TRACE(seed);
  const RandomMap random = random_map(seed);
  const LabelMeshes made = meshes_of(random.map);
  expect_complex(made);
  const double off = farthest(random.map, made);
  // A thousandth of a voxel is the distance of vertices from the faces of their cells.
  EXPECT_LE(off, 0.5 + 2e-3);
  totals.farthest = std::max(totals.farthest, off);
  totals.changed += made.fracture.repair.changed_samples;
  totals.joints += made.fracture.mesh.joints;
  totals.fanned += made.fracture.mesh.fanned_edges;
  totals.several += made.fracture.mesh.several_sheets;
  for (const LabelMeshes::Label& label : made.labels) {
    totals.samples += label.samples;
    totals.lost += label.piece == 0;
  }
}

void print(const Totals& totals) {
  std::printf(
      "%llu of %llu samples changed, %llu labels lost, %llu joints, %llu cells of several sheets, "
      "%llu fans, farthest %.5f\n",
      (unsigned long long)totals.changed, (unsigned long long)totals.samples, (unsigned long long)totals.lost,
      (unsigned long long)totals.joints, (unsigned long long)totals.several,
      (unsigned long long)totals.fanned, totals.farthest);
}

TEST(LabelMaps, BoxesSideBySideAreExact) {
  // As v21_labels of the inputs of other programs: 7 x 8 x 8 voxels each.
  const LabelMap map = made_map({27, 14, 14}, [](int x, int y, int z) -> std::uint32_t {
    if (x < 3 || x >= 24 || y < 3 || y >= 11 || z < 3 || z >= 11) return 0;
    return static_cast<std::uint32_t>(1 + (x - 3) / 7);
  });
  const LabelMeshes made = meshes_of(map);
  ASSERT_EQ(made.labels.size(), 3u);
  for (const LabelMeshes::Label& label : made.labels) {
    EXPECT_EQ(label.samples, 448u);
    EXPECT_NEAR(volume_of(made, label.label), 448.0, 1e-9);
  }
  expect_complex(made);
  EXPECT_EQ(made.fracture.repair.changed_samples, 0u);
  EXPECT_LE(farthest(map, made), 1e-6);
  // Every vertex lies on a face of the boxes.
  for (const Vector3d& p : made.fracture.mesh.points) {
    bool on = false;
    for (const double x : {2.5, 9.5, 16.5, 23.5}) on = on || std::abs(p.x() - x) < 1e-6;
    for (const int a : {1, 2})
      for (const double at : {2.5, 10.5}) on = on || std::abs(p[a] - at) < 1e-6;
    EXPECT_TRUE(on) << p.transpose();
  }
}

TEST(LabelMaps, BoxesOfUnequalHeightAndThinPlatesAreExact) {
  const LabelMap map = made_map({30, 20, 20}, [](int x, int y, int z) -> std::uint32_t {
    if (x >= 2 && x < 10 && y >= 2 && y < 12 && z >= 2 && z < 12) return 5;
    if (x >= 10 && x < 20 && y >= 2 && y < 12 && z >= 2 && z < 11) return 2147483647;
    if (x >= 22 && x < 24 && y >= 2 && y < 18 && z >= 2 && z < 18) return 9;  // two voxels thick
    if (x == 26 && y >= 2 && y < 18 && z >= 2 && z < 18) return 10;           // one
    if (x == 28 && y == 5 && z == 5) return 11;                               // a single sample
    return 0;
  });
  const LabelMeshes made = meshes_of(map);
  for (const LabelMeshes::Label& label : made.labels)
    EXPECT_NEAR(volume_of(made, label.label), double(label.samples), 1e-6) << label.label;
  expect_complex(made);
}

TEST(LabelMaps, BallsAndPlanesAreSmooth) {
  // A ball of two labels: the wall between them is an oblique plane through its centre.
  const Vector3d centre(20.3, 20.6, 19.8), normal = Vector3d(1.0, 0.4, 0.7).normalized();
  constexpr double kBall = 15.2;
  const LabelMap map = made_map({41, 41, 41}, [&](int x, int y, int z) -> std::uint32_t {
    const Vector3d from = Vector3d(x, y, z) - centre;
    return from.norm() >= kBall ? 0 : from.dot(normal) < 0 ? 1 : 2;
  });
  const LabelMeshes made = meshes_of(map);
  expect_complex(made);
  double most_ball = 0.0, most_plane = 0.0, sum_ball = 0.0, sum_plane = 0.0;
  int balls = 0, planes = 0;
  for (std::size_t t = 0; t < made.fracture.mesh.triangles.size(); ++t)
    for (const std::uint32_t p : made.fracture.mesh.triangles[t]) {
      const Vector3d from = made.fracture.mesh.points[p] - centre;
      if (made.fracture.mesh.sides[t].front == 0) {
        const double off = std::abs(from.norm() - kBall);
        most_ball = std::max(most_ball, off), sum_ball += off * off, ++balls;
      } else {
        const double off = std::abs(from.dot(normal));
        most_plane = std::max(most_plane, off), sum_plane += off * off, ++planes;
      }
    }
  std::printf(
      "ball: largest %.3f rms %.3f; plane: largest %.3f rms %.3f; volumes %.2f %.2f of %.2f; farthest %.3f\n",
      most_ball, std::sqrt(sum_ball / balls), most_plane, std::sqrt(sum_plane / planes), volume_of(made, 1),
      volume_of(made, 2), 4.0 / 3.0 * M_PI * std::pow(kBall, 3), farthest(map, made));
  EXPECT_LE(std::sqrt(sum_ball / balls), 0.15);
  EXPECT_LE(std::sqrt(sum_plane / planes), 0.15);
  EXPECT_LE(most_ball, 0.6);
  EXPECT_LE(most_plane, 0.6);
  EXPECT_NEAR(volume_of(made, 1) + volume_of(made, 2), 4.0 / 3.0 * M_PI * std::pow(kBall, 3), 30.0);
}

TEST(LabelMaps, SmallerSmoothingFollowsTheVoxels) {
  const RandomMap random = random_map(3);
  for (const double smoothing : {0.5, 0.25, 0.1}) {
    const LabelMeshes made = meshes_of(random.map, smoothing);
    expect_complex(made);
    std::size_t beyond = 0;
    for (const Vector3d& point : made.fracture.mesh.points)
      beyond += distance_from_voxel_boundary(random.map, point) > smoothing;
    EXPECT_LE(beyond, made.fracture.mesh.several_sheets * 4 + made.fracture.repair.changed_samples * 8);
  }
}

TEST(LabelMaps, RandomMapsAreComplexes) {
  Totals totals;
  for (unsigned seed = 0; seed < 12; ++seed) expect_random_map(seed, totals);
  print(totals);
}

TEST(LabelMaps, RepairsStayNearTheBoundary) {
  // Maps in which some change that makes cells simple would move a wall to a sample whose six neighbours have
  // its label, i.e. by more than half a voxel: in the first three such a change is the best of a cell, in the
  // others it is necessary once all inside corners of an adjacent cell have the same label.
  Totals totals;
  for (const unsigned seed : {1000u, 1054u, 1072u, 10806u, 11222u, 15015u, 16992u})
    expect_random_map(seed, totals);
  print(totals);
}

TEST(LabelMaps, ANoisyBallStaysNearTheBoundary) {
  // Three labels in a ball, and a tenth of the samples with random labels. Adjacent samples of one label get
  // two different ones.
  constexpr int kSize = 48, kHalf = kSize / 2;
  std::mt19937 random(7);
  const LabelMap map = made_map({kSize, kSize, kSize}, [&](int x, int y, int z) -> std::uint32_t {
    const auto draw = static_cast<std::uint32_t>(random());
    if (draw / 64 % 100 < 10) return draw % 4;
    if ((Vector3d(x, y, z) - Vector3d::Constant(kHalf)).norm() > kHalf - 2) return 0;
    return 3 * x + y > 2 * kSize ? 1 : z > kHalf ? 2 : 3;
  });
  const LabelMeshes made = meshes_of(map);
  EXPECT_GT(made.fracture.repair.changed_samples, 100u);
  EXPECT_LE(farthest(map, made), 0.5 + 2e-3);
}

TEST(Slow, TwoHundredRandomLabelMaps) {
  Totals totals;
  for (unsigned seed = 1000; seed < 1200; ++seed) expect_random_map(seed, totals);
  print(totals);
  EXPECT_EQ(totals.lost, 0u);
}

TEST(LabelMaps, NoiseIsAComplex) {
  std::mt19937 random(7);
  const LabelMap map =
      made_map({10, 9, 11}, [&](int, int, int) { return static_cast<std::uint32_t>(random() % 4); });
  const LabelMeshes made = meshes_of(map);
  expect_complex(made);
}

TEST(LabelMaps, TheSolidOfAllLabelsIsConsistent) {
  const RandomMap random = random_map(5);
  RunContext context;
  const FloatHermite solid = LabelSurface(random.map, 0.5, context).solid(context);
  EXPECT_NO_THROW(check_consistent(solid));
}

TEST(LabelMaps, TheSameForAnyNumberOfThreads) {
  const RandomMap random = random_map(11);
  const auto on = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return meshes_of(random.map).shared_walls();
  };
  EXPECT_TRUE(on(1) == on(4));
}

TEST(LabelMaps, AMirroringPlacementFacesOutwards) {
  IndexToWorld mirrored;
  mirrored.linear = Vector3d(-1.0, 0.5, 2.0).asDiagonal();
  mirrored.offset = Vector3d(5.0, 6.0, 7.0);
  const LabelMap map = made_map(
      {8, 8, 8},
      [](int x, int y, int z) {
        return std::min({x, y, z}) >= 2 && x < 6 ? 4u : 0u;
      },
      mirrored);
  EXPECT_NEAR(volume_of(meshes_of(map), 4), 4 * 6 * 6, 1e-6);
}

TEST(LabelMaps, BadInputIsRefused) {
  RunContext context;
  const std::vector<std::uint32_t> values = {1, 2, 3};
  EXPECT_THROW(label_map(values, {2, 2, 1}, {}, context), Error);
  const LabelMap none = made_map({4, 4, 4}, [](int, int, int) { return 0u; });
  EXPECT_THROW(label_meshes(none, {}, context), Error);
  const LabelMap one = made_map({4, 4, 4}, [](int, int, int) { return 1u; });
  EXPECT_THROW(label_meshes(one, {.smoothing = 0.6}, context), Error);
  EXPECT_THROW(label_meshes(one, {.smoothing = 0.0}, context), Error);
}

TEST(Slow, LargeLabelMap) {
  // 30 Voronoi cells of 256³ samples.
  std::mt19937 random(1);
  std::vector<Vector3d> seeds;
  for (int i = 0; i < 30; ++i) seeds.push_back(Vector3d(random() % 256, random() % 256, random() % 256));
  const LabelMap map = made_map({256, 256, 256}, [&](int x, int y, int z) {
    const Vector3d at(x, y, z);
    if ((at - Vector3d::Constant(127.5)).norm() > 126) return 0u;
    std::uint32_t nearest = 0;
    for (std::uint32_t i = 1; i < seeds.size(); ++i)
      if ((seeds[i] - at).squaredNorm() < (seeds[nearest] - at).squaredNorm()) nearest = i;
    return nearest + 1;
  });
  const auto start = std::chrono::steady_clock::now();
  RunContext context;
  const LabelMeshes made = label_meshes(map, {}, context);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  for (const auto& [stage, time] : context.stage_seconds) std::printf("%-32s %.3f s\n", stage.c_str(), time);
  std::printf("256³, 30 labels: %.2f s, %zu triangles, %llu samples changed\n", seconds.count(),
              made.fracture.mesh.triangles.size(), (unsigned long long)made.fracture.repair.changed_samples);
  EXPECT_EQ(made.labels.size(), map.samples().size()) << "a cell may lie outside of the ball";
  EXPECT_GE(made.labels.size(), 29u);
}

}  // namespace label_maps_test
}  // namespace hermesh
