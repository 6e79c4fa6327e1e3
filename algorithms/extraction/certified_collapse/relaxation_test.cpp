#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <atomic>
#include <cmath>

#include "algorithms/extraction/certified_collapse/certified_decimation.h"
#include "algorithms/extraction/certified_collapse/merge_proposals.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace relaxation_test {

using Eigen::Vector3d;

/// A sphere about the origin: the faces of a box of n³ cells, projected.
FineMesh sphere(int n, double radius) {
  std::vector<Vector3d> points;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> number(std::size_t(n + 1) * (n + 1) * (n + 1), FineMesh::kNone);
  const auto at = [&](int x, int y, int z) {
    std::uint32_t& known = number[(std::size_t(x) * (n + 1) + y) * (n + 1) + z];
    if (known == FineMesh::kNone) {
      known = static_cast<std::uint32_t>(points.size());
      points.push_back(radius * (Vector3d(x, y, z) - Vector3d::Constant(0.5 * n)).normalized());
    }
    return known;
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (const int side : {0, n})
        for (int axis = 0; axis < 3; ++axis) {
          const auto corner = [&](int a, int b) {
            std::array<int, 3> c{};
            c[axis] = side;
            c[(axis + 1) % 3] = a;
            c[(axis + 2) % 3] = b;
            return at(c[0], c[1], c[2]);
          };
          std::array<std::uint32_t, 4> quad = {corner(i, j), corner(i + 1, j), corner(i + 1, j + 1),
                                               corner(i, j + 1)};
          if (side == 0) std::swap(quad[1], quad[3]);
          triangles.push_back({quad[0], quad[1], quad[2]});
          triangles.push_back({quad[0], quad[2], quad[3]});
        }
  return FineMesh(std::move(points), std::move(triangles));
}

/// A forest that moves one vertex.
MergeForest one_move(const FineMesh& fine, std::uint32_t point, const Vector3d& place) {
  MergeForest forest({}, std::vector<std::uint32_t>(fine.points().size(), MergeForest::kNone));
  forest.join(point, {.first = point, .merges = true, .moves = true, .place = place, .quadric = {}});
  forest.settle();
  return forest;
}

/// Distances of the vertices of a fine mesh from a coarse one, by all of its triangles.
std::vector<double> distances(const FineMesh& fine, const CertifiedMesh& coarse) {
  std::vector<double> result;
  for (const Vector3d& p : fine.points()) {
    double least = 1e300;
    for (const Triangle& t : coarse.triangles)
      least =
          std::min(least, squared_distance(p, coarse.points[t[0]], coarse.points[t[1]], coarse.points[t[2]]));
    result.push_back(std::sqrt(least));
  }
  return result;
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double x : values) sum += x * x;
  return std::sqrt(sum / double(values.size()));
}

CertifiedMesh decimated(const FineMesh& fine, float tolerance, const Nearness& nearness) {
  RunContext context;
  return decimate_certified(fine, std::vector<float>(fine.points().size(), tolerance), {},
                            FilePoints(IndexToWorld()), context, nearness);
}

TEST(Relaxation, BringsAPointBackThatWasMovedOff) {
  const FineMesh fine = sphere(24, 20.0);
  RunContext context;
  const std::vector<float> tolerance(fine.points().size(), 1.0f);
  std::vector<std::uint8_t> pinned(fine.points().size(), 1);
  pinned[100] = 0;
  const Vector3d home = fine.points()[100];
  MergeForest forest = one_move(fine, 100, 1.02 * home);
  MergeProof proof(forest, fine, tolerance, context);
  const FilePoints file{IndexToWorld()};
  propose_relaxation(forest, proof.prove(), {fine, tolerance, pinned, 0.0, file, Bounds::unbounded()}, 4,
                     context);
  // With all others unmoved the sum of squares is 0 at the vertex's origin, 0.4 below; along the sphere,
  // where it hardly grows, the vertex may be elsewhere.
  const Vector3d& place = forest.node(forest.set_of(100)).place;
  EXPECT_NEAR(place.norm(), 20.0, 0.01);
  EXPECT_NEAR((place - home).norm(), 0.0, 0.05);
  for (std::uint32_t p = 0; p < pinned.size(); ++p)
    EXPECT_EQ(forest.set_of(p) == MergeForest::kNone, p != 100);
}

TEST(Relaxation, AMoveIsTakenBackAndWhatItMovedStays) {
  const FineMesh fine = sphere(24, 20.0);
  RunContext context;
  const std::vector<float> tolerance(fine.points().size(), 0.2f);
  const Vector3d near = 1.005 * fine.points()[100];
  for (const double part : {0.5, 1.0}) {
    // The first move is by 0.1, the second by 0.05 more, which may be, or by 0.3 more, which may not.
    MergeForest forest = one_move(fine, 100, near);
    const Vector3d far = (part < 1 ? 1.0025 : 1.015) * near;
    forest.join(100, {.first = 100, .merges = true, .moves = true, .place = far, .quadric = {}});
    forest.settle();
    MergeProof proof(forest, fine, tolerance, context);
    const MergedMesh& merged = proof.prove();
    EXPECT_EQ(merged.mesh->points()[merged.number[100]], part < 1 ? far : near);
  }
}

TEST(Relaxation, ASphereIsNearerByAFourthWithItsTriangles) {
  const FineMesh fine = sphere(40, 25.0);
  const CertifiedMesh before = decimated(fine, 0.3f, {}), after = decimated(fine, 0.3f, {.relaxation = 3});
  EXPECT_LT(after.triangles.size(), 1.01 * double(before.triangles.size()));
  const std::vector<double> apart = distances(fine, after);
  EXPECT_LT(rms(apart), 0.75 * rms(distances(fine, before)));
  for (const double d : apart) EXPECT_LE(d, 0.305);  // the bound and its slack
}

TEST(Relaxation, AGreaterMomentGivesFewerTriangles) {
  const FineMesh fine = sphere(40, 25.0);
  const std::size_t all = decimated(fine, 2.0f, {}).triangles.size();
  const std::size_t few = decimated(fine, 2.0f, {.moment = 1.0}).triangles.size();
  const std::size_t many = decimated(fine, 2.0f, {.moment = 0.01}).triangles.size();
  EXPECT_LT(all, few);
  EXPECT_LT(few, many);
  EXPECT_LT(many, fine.triangles().size());
  // Any collapse costs less, so only the tolerance limits them.
  EXPECT_LT(decimated(fine, 2.0f, {.moment = 1e6}).triangles.size(), few);
}

TEST(Relaxation, EndsWhenTheWorkIsCancelled) {
  const FineMesh fine = sphere(8, 10.0);
  const std::vector<float> tolerance(fine.points().size(), 0.2f);
  const std::vector<std::uint8_t> pinned(fine.points().size());
  RunContext context;
  MergeForest forest({}, std::vector<std::uint32_t>(fine.points().size(), MergeForest::kNone));
  MergeProof proof(forest, fine, tolerance, context);
  const MergedMesh& merged = proof.prove();
  const std::atomic<bool> cancel = true;
  context.cancel = &cancel;
  const FilePoints file{IndexToWorld()};
  EXPECT_THROW(propose_relaxation(forest, merged, {fine, tolerance, pinned, 0.0, file, Bounds::unbounded()},
                                  1, context),
               Cancelled);
}

TEST(Relaxation, SameBytesAtAnyThreadCount) {
  const FineMesh fine = sphere(40, 25.0);
  std::vector<CertifiedMesh> meshes;
  for (const std::size_t threads : {1, 2, 7}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    meshes.push_back(decimated(fine, 0.5f, {.moment = 0.1, .relaxation = 2}));
  }
  for (const CertifiedMesh& mesh : meshes) {
    EXPECT_EQ(mesh.points, meshes[0].points);
    EXPECT_EQ(mesh.triangles, meshes[0].triangles);
  }
}

}  // namespace relaxation_test
}  // namespace hermesh
