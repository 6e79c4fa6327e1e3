#include "algorithms/extraction/certified_octree/region_mesh.h"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <tbb/global_control.h>

#include <cmath>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/extraction/certified_collapse/manifold_dual_contouring.h"
#include "algorithms/extraction/certified_octree/certified_octree.h"
#include "algorithms/extraction/certified_octree/region_proof.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"
#include "algorithms/hermite/normal_codes.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh {
namespace region_mesh_test {

using Eigen::Vector3d;

FloatHermite sample(const AnalyticSurface& surface) {
  RunContext context;
  return sample_function(surface, IndexToWorld(), {-24, -24, -24}, {24, 24, 24}, 1e-9, context);
}
FloatHermite sphere(double radius) {
  return sample({.value = [=](const Vector3d& p) { return p.norm() - radius; },
                 .gradient = [](const Vector3d& p) { return p; }});
}

PolygonMesh contour(const FloatHermite& hermite, double tolerance, double flatness = 0) {
  RunContext context;
  return certified_octree(view_of(hermite, context),
                          {.tolerance = tolerance, .flatness = flatness, .uniform = {}}, nullptr, context);
}

/// Returns the largest distance of a mesh's vertices, edge midpoints and triangle centres from a sphere about
/// the origin.
double farthest_from_sphere(const PolygonMesh& mesh, double radius) {
  double farthest = 0;
  for (const Triangle& t : triangulated(mesh))
    for (const Vector3d& weights :
         {Vector3d(1, 0, 0), Vector3d(0.5, 0.5, 0), Vector3d(Vector3d(1, 1, 1) / 3.0)}) {
      const Vector3d place =
          weights[0] * mesh.world(t[0]) + weights[1] * mesh.world(t[1]) + weights[2] * mesh.world(t[2]);
      farthest = std::max(farthest, std::abs(place.norm() - radius));
    }
  return farthest;
}

TEST(RegionMesh, FewPointsThatAreNearASphere) {
  constexpr double kRadius = 20.0;
  const FloatHermite hermite = sphere(kRadius);
  const PolygonMesh fine = contour(hermite, 0.0);
  // The uniform mesh is within 0.05 voxel of the sphere: a chord of at most 3 voxels is 0.056 deep.
  const PolygonMesh coarse = contour(hermite, 0.5);
  EXPECT_LT(coarse.points.size(), fine.points.size() / 6);
  EXPECT_LT(farthest_from_sphere(coarse, kRadius), 0.56);
  const PolygonMesh coarser = contour(hermite, 4.0);
  EXPECT_LT(coarser.points.size(), fine.points.size() / 15);
  EXPECT_LT(farthest_from_sphere(coarser, kRadius), 4.06);
}

TEST(RegionMesh, FlatnessKeepsCubesSmall) {
  const FloatHermite hermite = sphere(20.0);
  const PolygonMesh coarse = contour(hermite, 4.0), flat = contour(hermite, 4.0, 0.03);
  EXPECT_GT(flat.points.size(), 2 * coarse.points.size());
  EXPECT_LT(farthest_from_sphere(flat, 20.0), farthest_from_sphere(coarse, 20.0) / 2);
}

/// Uses tolerances beyond the cubes' diagonal, so that no distance needs a proof.
TEST(RegionMesh, CubesAreAtMostAsLargeAsAsked) {
  const FloatHermite hermite = sphere(20.0);
  RunContext context;
  std::vector<std::size_t> points;
  for (const int largest : {2, 4, 8}) {
    const CertifiedOctreeOptions options{.tolerance = 1.74 * largest, .largest_cube = largest, .uniform = {}};
    const PolygonMesh mesh = certified_octree(view_of(hermite, context), options, nullptr, context);
    EXPECT_LT(farthest_from_sphere(mesh, 20.0), options.tolerance);
    points.push_back(mesh.points.size());
  }
  EXPECT_GT(points[0], 2 * points[1]);
  EXPECT_GT(points[1], 2 * points[2]);
}

/// Returns V − E + F of closed triangles.
std::int64_t euler_characteristic(const PolygonMesh& mesh) {
  return std::int64_t(mesh.points.size()) - std::int64_t(mesh.triangle_count()) / 2;
}

TEST(RegionMesh, HasTheUniformMeshesTopology) {
  // A torus whose tube is two voxels thick, so that the walls of one cube are near one another.
  const auto value = [](const Vector3d& p) { return std::hypot(std::hypot(p[0], p[1]) - 14.0, p[2]) - 2.0; };
  const FloatHermite hermite =
      sample({.value = value, .gradient = [](const Vector3d& p) {
                const double ring = std::hypot(p[0], p[1]);
                return Vector3d(p[0] * (1 - 14.0 / ring), p[1] * (1 - 14.0 / ring), p[2]);
              }});
  const PolygonMesh fine = contour(hermite, 0.0);
  EXPECT_EQ(euler_characteristic(fine), 0);
  for (const double tolerance : {0.3, 1.0, 3.0, 6.0, 16.0}) {
    const PolygonMesh coarse = contour(hermite, tolerance);
    EXPECT_LT(coarse.points.size(), fine.points.size()) << tolerance;
    EXPECT_EQ(euler_characteristic(coarse), 0) << tolerance;
  }
}

/// One sample that is barely inside: two cubes may have four cells of it each, all in the face between them,
/// and no edge has a third region around it.
TEST(RegionMesh, NoSpeckVanishes) {
  initialize_openvdb();
  for (int place = 0; place < 8; ++place)
    for (const float depth : {0.001f, 0.3f}) {
      auto grid = openvdb::FloatGrid::create(1.0f);
      auto access = grid->getAccessor();
      for (int x = 0; x < 5; ++x)
        for (int y = 0; y < 5; ++y)
          for (int z = 0; z < 5; ++z) access.setValue({x, y, z}, 1.0f);
      access.setValue({2 + (place & 1), 2 + (place >> 1 & 1), 2 + (place >> 2)}, -depth);
      RunContext context;
      const PolygonMesh mesh = contour(sample_level_set(make_level_set(grid), 0.0, context), 1.0);
      EXPECT_FALSE(mesh.empty());
      EXPECT_EQ(euler_characteristic(mesh), 2) << place << ' ' << depth;
    }
}

TEST(RegionMesh, ToleranceOfZeroIsTheUniformMeshWithPointsInTheirCells) {
  const FloatHermite hermite = sphere(9.3);
  RunContext context;
  ManifoldDualContouringOptions options{.tolerance = 0, .uniform = {}};
  options.uniform.reach = 0;
  EXPECT_TRUE(contour(hermite, 0) ==
              manifold_dual_contouring(view_of(hermite, context), options, nullptr, context));
}

/// Returns a sphere with waves of some fifteen voxels, on which cubes of all sizes remain.
FloatHermite waves() {
  return sample(
      {.value = [](const Vector3d& p) { return p.norm() - 18 - std::sin(p[0] / 2.5) * std::cos(p[1] / 3.0); },
       .gradient =
           [](const Vector3d& p) {
             const Vector3d slope(std::cos(p[0] / 2.5) * std::cos(p[1] / 3.0) / 2.5,
                                  -std::sin(p[0] / 2.5) * std::sin(p[1] / 3.0) / 3.0, 0);
             return Vector3d(p.normalized() - slope);
           }});
}

TEST(RegionMesh, SameBytesAtAnyThreadCount) {
  const FloatHermite hermite = waves();
  for (const double tolerance : {0.3, 4.0, 16.0}) {
    std::vector<PolygonMesh> meshes;
    for (const std::size_t threads : {1, 2, 7}) {
      tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      meshes.push_back(contour(hermite, tolerance));
    }
    EXPECT_LT(meshes[0].points.size(), contour(hermite, 0).points.size() / 2);
    EXPECT_TRUE(meshes[0] == meshes[1]);
    EXPECT_TRUE(meshes[0] == meshes[2]);
  }
}

/// Packed crossings are decoded on access; decoding them beforehand must give the same result.
TEST(RegionMesh, SameFromPackedDataAsFromWhatTheyUnpackTo) {
  RunContext context;
  const PackedHermite packed = pack(waves(), NormalCodeId::octahedral, context);
  const FloatHermite unpacked = unpack(packed, context);
  for (const double tolerance : {0.0, 0.3, 4.0, 16.0}) {
    const CertifiedOctreeOptions options{.tolerance = tolerance, .uniform = {}};
    const PolygonMesh direct = with_normal_code(packed.normal_code, [&](auto code) {
      return certified_octree(view_of(packed, code, context), options, nullptr, context);
    });
    EXPECT_FALSE(direct.points.empty());
    EXPECT_TRUE(direct == contour(unpacked, tolerance)) << tolerance;
  }
}

TEST(RegionMesh, SameBytesAtEverySimdLevel) {
  const FloatHermite hermite = waves();
  for (const double tolerance : {0.0, 0.3, 4.0, 16.0}) {
    std::vector<PolygonMesh> meshes;
    for (const SimdLevel level : available_simd_levels()) {
      setenv("HERMESH_SIMD", std::string(name(level)).c_str(), 1);
      meshes.push_back(contour(hermite, tolerance));
      EXPECT_TRUE(meshes.back() == meshes.front()) << name(level);
    }
  }
  unsetenv("HERMESH_SIMD");
}

/// Proposals that are good for one tolerance are all rejected if a smaller one is requested, which none can
/// satisfy: the proof does not rely on the proposals.
TEST(RegionProof, SplitsWhatIsNotNear) {
  const FloatHermite hermite = sphere(12.0);
  RunContext context;
  const auto view = view_of(hermite, context);
  const FilePoints file(view.placement());
  UniformCells uniform(view, {.placement = DualContouringOptions::Placement::average, .reach = 0}, file,
                       context);
  const CellBlocks& cells = uniform.cells();
  const auto cubes = [&](const CellRegions& regions) {
    std::size_t sum = 0;
    for (std::size_t b = 0; b < cells.size(); ++b)
      regions.for_each_cube(static_cast<std::int32_t>(b), [&](const Region&) { ++sum; });
    return sum;
  };
  uniform.place_all(context);
  const EdgePolygons polygons = uniform.connect(nullptr, context);
  {
    RegionOptions options{CellTolerances(1.0f)};
    CellRegions regions(cells, uniform.points(), options, file, context);
    EXPECT_GT(cubes(regions), 20u);
    options.tolerance = CellTolerances(1e-4f);
    const std::vector<float> narrow(polygons.point_count(), 1e-4f);
    const RegionShell shell(regions, polygons, uniform.points(), narrow, context);
    RegionProof(regions, nullptr, &shell, nullptr, context).run();
    EXPECT_EQ(cubes(regions), 0u);
  }
  {
    RegionOptions options{CellTolerances(4.0f)};
    CellRegions regions(cells, uniform.points(), options, file, context);
    EXPECT_GT(cubes(regions), 20u);
    options.tolerance = CellTolerances(1e-4f);
    RegionLayers layers(regions, nullptr, context);
    RegionProof(regions, &layers, nullptr, &uniform, context).run();
    EXPECT_EQ(cubes(regions), 0u);
  }
}

/// A box along the axes: flat parts merge right up to the cells that an edge passes through.
TEST(RegionProof, KeepsWhatIsFlat) {
  const FloatHermite hermite =
      sample({.value = [](const Vector3d& p) { return p.cwiseAbs().maxCoeff() - 20.4; },
              .gradient =
                  [](const Vector3d& p) {
                    int axis;
                    p.cwiseAbs().maxCoeff(&axis);
                    return Vector3d(Vector3d::Unit(axis) * (p[axis] < 0 ? -1.0 : 1.0));
                  }});
  EXPECT_LT(contour(hermite, 0.1).points.size(), contour(hermite, 0.0).points.size() / 5);
}

}  // namespace region_mesh_test
}  // namespace hermesh
