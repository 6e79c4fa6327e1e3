#include "algorithms/thesis/adaptive_dual_contouring/edge_source.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <map>
#include <random>

#include "algorithms/hermite/samplers.h"
#include "algorithms/thesis/adaptive_dual_contouring/adaptive_dual_contouring.h"
#include "algorithms/thesis/voxels/dense_hermite.h"

namespace hermesh {
namespace edge_source_test {

using Eigen::Vector3d;

class EdgeSourceTest : public testing::Test {
 protected:
  /// A box about a point, rotated about y.
  FloatHermite box(const Vector3d& centre, const Vector3d& half, double degrees) {
    const double angle = degrees * 3.14159265358979 / 180.0;
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Vector3d::UnitY()).toRotationMatrix();
    const AnalyticSurface surface{
        [=](const Vector3d& p) { return ((turn.transpose() * (p - centre)).cwiseAbs() - half).maxCoeff(); },
        [=](const Vector3d& p) -> Vector3d {
          const Vector3d q = turn.transpose() * (p - centre);
          Vector3d n = Vector3d::Zero();
          int axis;
          (q.cwiseAbs() - half).maxCoeff(&axis);
          n[axis] = q[axis];
          return turn * n;
        }};
    return sample_function(surface, {}, {-8, -8, -8}, {39, 39, 39}, 1e-6, context_);
  }
  FloatHermite ball(const Vector3d& centre, double radius) {
    const AnalyticSurface surface{[=](const Vector3d& p) { return (p - centre).norm() - radius; },
                                  [=](const Vector3d& p) -> Vector3d { return p - centre; }};
    return sample_function(surface, {}, {-8, -8, -8}, {39, 39, 39}, 1e-6, context_);
  }
  ThesisDense packed(const FloatHermite& hermite) { return to_dense<ThesisVoxel>(hermite, context_); }
  PolygonMesh mesh(const ThesisDense& hermite, double threshold) {
    return adaptive_dual_contouring(hermite, {.threshold = threshold}, nullptr, context_);
  }
  PolygonMesh mesh(const FloatHermite& hermite, double threshold) {
    return adaptive_dual_contouring(hermite, {.threshold = threshold}, nullptr, context_);
  }
  double figure(const std::string& name) const {
    for (auto at = context_.figures.rbegin(); at != context_.figures.rend(); ++at)
      if (at->first == name) return at->second;
    return -1.0;
  }
  RunContext context_;
};

/// Edges that have one polygon.
std::size_t boundary_edges(const PolygonMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  const auto add = [&](const auto& polygon) {
    for (std::size_t i = 0; i < polygon.size(); ++i)
      ++uses[std::minmax(polygon[i], polygon[(i + 1) % polygon.size()])];
  };
  for (const Triangle& triangle : mesh.triangles) add(triangle);
  for (const Quad& quad : mesh.quads) add(quad);
  std::size_t open = 0;
  for (const auto& [edge, count] : uses) open += count == 1;
  return open;
}

// A ball that the 10 bytes lose nothing of: then reading them packed or unpacked makes one mesh.
TEST_F(EdgeSourceTest, PackedDataGiveTheMeshOfTheSameDataUnpacked) {
  const ThesisDense dense = packed(ball({14.3, 16.1, 15.7}, 13.2));
  std::size_t lost = 1;
  const FloatHermite sparse = to_sparse(dense, context_, &lost);
  ASSERT_EQ(lost, 0u);
  const PackedEdges edges(dense, context_);
  EXPECT_EQ(edges.tagged(), sparse.crossings.size());
  EXPECT_EQ(edges.lost(), 0u);
  EXPECT_EQ(edges.needless(), 0u);
  for (const double threshold : {0.0, 0.1, 10.0})
    EXPECT_EQ(mesh(dense, threshold), mesh(sparse, threshold)) << threshold;
}

TEST_F(EdgeSourceTest, BothFormsHaveTheSameSigns) {
  const FloatHermite sparse = box({15.2, 14.9, 16.4}, {11.3, 9.1, 10.2}, 20.0);
  const SparseEdges of_sparse(sparse, context_);
  const PackedEdges of_packed(packed(sparse), context_);
  ASSERT_EQ(of_sparse.blocks().size(), of_packed.blocks().size());
  for (std::size_t b = 0; b < of_sparse.blocks().size(); ++b) {
    ASSERT_EQ(of_sparse.blocks()[b].lower, of_packed.blocks()[b].lower);
    EXPECT_EQ(of_sparse.blocks()[b].crossing, of_packed.blocks()[b].crossing);
    const SignLattice one(of_sparse.signs(std::int32_t(b))), other(of_packed.signs(std::int32_t(b)));
    for (int x = 0; x < 8; x += 2)
      for (int y = 0; y < 8; y += 2)
        for (int z = 0; z < 8; z += 2) EXPECT_EQ(one.around(x, y, z, 2), other.around(x, y, z, 2));
  }
}

// Trap T2: the upper face of a box turned by 0.3° about y crosses edges along x with normals that pack to 0.
TEST_F(EdgeSourceTest, LostCrossingsAreHolesInTheMesh) {
  const FloatHermite sparse = box({12.5, 12.5, 12.0}, {10.0, 10.0, 10.0}, 0.3);
  const ThesisDense dense = packed(sparse);
  std::size_t lost = 0;
  const FloatHermite repaired = to_sparse(dense, context_, &lost);
  ASSERT_GT(lost, 10u);
  const PolygonMesh open = mesh(dense, 0.0);
  EXPECT_EQ(figure("lost_crossings"), double(lost));
  EXPECT_EQ(figure("needless_crossings"), 0.0);
  ASSERT_FALSE(context_.notes.empty());
  EXPECT_NE(context_.notes.back().find("leave holes"), std::string::npos);
  // At threshold 0 every edge with data is a quad, and none without.
  EXPECT_EQ(open.quads.size(), sparse.crossings.size() - lost);
  EXPECT_GE(boundary_edges(open), lost);
  EXPECT_EQ(boundary_edges(mesh(repaired, 0.0)), 0u);
  EXPECT_EQ(mesh(repaired, 0.0).quads.size(), sparse.crossings.size());
  // Holes of a row of cells within one region close where the region's point covers them; the statistic does
  // not change.
  mesh(dense, 1.0);
  EXPECT_EQ(figure("lost_crossings"), double(lost));
}

// Trap T11: eq. 7.1 leaves data between samples of one sign where its operands cross an edge against each
// other.
TEST_F(EdgeSourceTest, DataBetweenSamplesOfOneSignMakePolygons) {
  // Two boxes with a gap of 0.4 voxel between x = 9.3 and 9.7: edges from 9 to 10 lie within the union.
  const FloatHermite left = box({5.0, 10.0, 10.0}, {4.3, 6.2, 6.2}, 0.0),
                     right = box({15.0, 10.0, 10.0}, {5.3, 6.2, 6.2}, 0.0);
  const ThesisDense both = combine(Boolean::unite, packed(left), packed(right), context_);
  const PackedEdges edges(both, context_);
  EXPECT_EQ(edges.tagged(), both.crossings());
  // The faces are 13 × 13 samples.
  EXPECT_EQ(edges.needless(), 169u);
  EXPECT_EQ(edges.lost(), 0u);
  EXPECT_EQ(mesh(both, 0.0).quads.size(), both.crossings());
  EXPECT_EQ(figure("needless_crossings"), 169.0);
}

TEST_F(EdgeSourceTest, SameBytesAtAnyNumberOfThreads) {
  const ThesisDense dense = packed(box({12.5, 12.5, 12.0}, {10.0, 10.0, 10.0}, 0.3));
  PolygonMesh first;
  for (const std::size_t threads : {1, 2, 7}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const PolygonMesh next = mesh(dense, 0.05);
    if (threads == 1) first = next;
    EXPECT_EQ(next, first);
    EXPECT_FALSE(next.empty());
  }
}

TEST_F(EdgeSourceTest, NoDataMakeNoMesh) { EXPECT_TRUE(mesh(packed(FloatHermite{}), 0.1).empty()); }

}  // namespace edge_source_test
}  // namespace hermesh
