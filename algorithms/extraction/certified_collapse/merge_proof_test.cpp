#include "algorithms/extraction/certified_collapse/merge_proof.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <random>
#include <utility>

#include "algorithms/extraction/certified_collapse/distance_certificate.h"

namespace hermesh {
namespace merge_proof_test {

using Eigen::Vector3d;

/// A torus of n x n quads, each cut in two; points by number i * n + j. Its tube is `tube` thick.
FineMesh torus(int n, double ring = 20.0, double tube = 8.0) {
  std::vector<Vector3d> points;
  std::vector<Triangle> triangles;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double a = 2 * M_PI * i / n, b = 2 * M_PI * j / n, r = ring + tube * std::cos(b);
      points.emplace_back(r * std::cos(a), r * std::sin(a), tube * std::sin(b));
    }
  const auto at = [n](int i, int j) { return static_cast<std::uint32_t>((i % n) * n + j % n); };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return FineMesh(std::move(points), std::move(triangles));
}

MergeForest::Node set(std::uint32_t first, const Vector3d& place = Vector3d::Zero()) {
  MergeForest::Node node;
  node.first = first;
  node.merges = true;
  node.place = place;
  return node;
}

/// A forest of pairs of points, each merged in its middle, moved outwards by `off`.
MergeForest pairs(const FineMesh& fine, const std::vector<std::array<std::uint32_t, 2>>& of, double off = 0) {
  std::vector<std::uint32_t> node_of(fine.points().size(), MergeForest::kNone);
  std::vector<MergeForest::Node> nodes;
  for (const auto& [p, q] : of) {
    node_of[p] = node_of[q] = static_cast<std::uint32_t>(nodes.size());
    const Vector3d outwards = fine.normal(fine.around(p).front()).cast<double>();
    nodes.push_back(set(p, 0.5 * (fine.points()[p] + fine.points()[q]) + off * outwards));
  }
  return MergeForest(std::move(nodes), std::move(node_of));
}

/// An octahedron as wide as two voxels.
FineMesh octahedron() {
  std::vector<Vector3d> points;
  for (int a = 0; a < 3; ++a)
    for (const double side : {-1.0, 1.0}) points.push_back(side * Vector3d::Unit(a));
  std::vector<Triangle> triangles;
  for (std::uint32_t octant = 0; octant < 8; ++octant) {
    const std::uint32_t x = octant & 1, y = 2 + (octant >> 1 & 1), z = 4 + (octant >> 2);
    triangles.push_back((x + y + z) % 2 ? Triangle{x, y, z} : Triangle{x, z, y});
  }
  return FineMesh(std::move(points), std::move(triangles));
}

double volume(const FineMesh& mesh) {
  double six = 0;
  for (std::uint32_t t = 0; t < mesh.triangles().size(); ++t) {
    const Corners c = mesh.corners(t);
    six += c[0].dot(c[1].cross(c[2]));
  }
  return six / 6;
}

TEST(MergeProof, ABodyIsNotMovedIntoItsMirrorImage) {
  const FineMesh fine = octahedron();
  ASSERT_NEAR(volume(fine), 4.0 / 3.0, 1e-12);
  MergeForest forest({}, std::vector<std::uint32_t>(6, MergeForest::kNone));
  for (std::uint32_t p = 0; p < 6; ++p) {
    MergeForest::Node node = set(p, -fine.points()[p]);
    node.moves = true;
    forest.join(p, node);
  }
  forest.settle();
  RunContext context;
  const std::vector<float> tolerance(6, 4.0f);
  MergeProof proof(forest, fine, tolerance, context);
  EXPECT_GT(volume(*proof.prove().mesh), 0.0);
}

TEST(ShellVolumes, AreThoseOfThePiecesOfAComplex) {
  // Two tetrahedra that share a triangle, which faces the second one.
  const FineMesh fine({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 2}},
                      {{0, 1, 2}, {1, 0, 3}, {2, 1, 3}, {0, 2, 3}, {0, 1, 4}, {1, 2, 4}, {2, 0, 4}});
  const std::vector<TrianglePieces> pieces = {{1, 2}, {1, 0}, {1, 0}, {1, 0}, {2, 0}, {2, 0}, {2, 0}};
  const std::vector<std::uint32_t> origin = {0, 1, 2, 3, 4, 5, 6};
  const ShellVolumes shells(fine, pieces);
  std::vector<Vector3d> points = fine.points();
  const auto changed = [&](double most) { return shells.changed(points, fine.triangles(), origin, most); };
  using Flags = std::vector<std::uint8_t>;
  EXPECT_EQ(changed(0.0), (Flags{0, 0}));
  points[3].z() = -1.02;  // the first is larger by a fiftieth
  EXPECT_EQ(changed(0.01), (Flags{1, 0}));
  EXPECT_EQ(changed(0.03), (Flags{0, 0}));
  EXPECT_TRUE(shells.is_in({1, 0}, 0));
  EXPECT_TRUE(shells.is_in({0, 1}, 0));
  EXPECT_FALSE(shells.is_in({1, 0}, 5));
  points[4].z() = -0.5;  // the second is inside out
  EXPECT_EQ(changed(10.0), (Flags{0, 1}));
}

TEST(FineMesh, ItsMakingEndsWhenTheWorkIsCancelled) {
  const std::atomic<bool> cancel = true;
  RunContext context;
  context.cancel = &cancel;
  const FineMesh fine = torus(8);
  EXPECT_THROW(FineMesh(fine.points(), fine.triangles(), context), Cancelled);
}

TEST(MergeForest, SplitsIntoWhatWasJoined) {
  // Points 0 to 5; {0, 1} and {2, 3}, then {0, 1} with {2, 3}, then that with 4.
  constexpr std::uint32_t kNone = MergeForest::kNone;
  MergeForest forest({set(0), set(2)}, {0, 0, 1, 1, kNone, kNone});
  forest.join(2, set(0));
  forest.join(4, set(0));
  forest.settle();
  for (std::uint32_t p = 0; p < 5; ++p) EXPECT_EQ(forest.set_of(p), 3u);
  EXPECT_EQ(forest.set_of(5), kNone);
  EXPECT_EQ(forest.members(3).size(), 5u);
  EXPECT_EQ(forest.members(2).size(), 4u);
  forest.split(3);
  EXPECT_EQ(forest.set_of(3), 2u);
  EXPECT_EQ(forest.set_of(4), kNone);
  forest.split(2);
  EXPECT_EQ(forest.leader(1), 0u);
  EXPECT_EQ(forest.leader(3), 2u);
  EXPECT_EQ(forest.set_of(1), 0u);
}

TEST(MergeProof, KeepsWhatIsNearAndTakesBackWhatIsNot) {
  const FineMesh fine = torus(60);
  RunContext context;
  const std::vector<float> tolerance(fine.points().size(), 0.2f);
  for (const double off : {0.0, 0.15, 0.3}) {
    MergeForest forest = pairs(fine, {{0, 60}, {600, 601}}, off);
    MergeProof proof(forest, fine, tolerance, context);
    const MergedMesh& merged = proof.prove();
    EXPECT_EQ(merged.mesh->points().size(), fine.points().size() - (off < 0.2 ? 2 : 0)) << off;
  }
}

/// A torus whose points lie off it by up to `rough`, at random.
FineMesh rough_torus(int n, double rough, std::mt19937& random) {
  const FineMesh smooth = torus(n);
  std::uniform_real_distribution<double> off(-rough, rough);
  std::vector<Vector3d> points = smooth.points();
  for (std::uint32_t p = 0; p < points.size(); ++p)
    points[p] += off(random) * smooth.normal(smooth.around(p).front()).cast<double>();
  return FineMesh(std::move(points), smooth.triangles());
}

/// Returns the largest distance from points on one mesh to another, each found by comparison with all
/// triangles of the other.
double largest_distance(const FineMesh& from, const FineMesh& to) {
  double largest = 0;
  for (std::uint32_t t = 0; t < from.triangles().size(); ++t) {
    const Corners c = from.corners(t);
    for (int i = 0; i <= 2; ++i)
      for (int j = 0; i + j <= 2; ++j) {
        const Vector3d p = c[0] + 0.5 * i * (c[1] - c[0]) + 0.5 * j * (c[2] - c[0]);
        double squared = 1e300;
        for (std::uint32_t u = 0; u < to.triangles().size(); ++u) {
          const Corners d = to.corners(u);
          squared = std::min(squared, squared_distance(p, d[0], d[1], d[2]));
        }
        largest = std::max(largest, std::sqrt(squared));
      }
  }
  return largest;
}

/// Sets of two by two vertices on a rough torus: fine triangles extend across the sides of merged ones
/// everywhere, and roughness puts some of them beyond the tolerance there. More sets are joined, and the
/// proof is repeated, reusing its previous results.
TEST(MergeProof, PromisesNothingThatSamplesContradict) {
  std::mt19937 random(3);
  constexpr int kSide = 16;
  RunContext context;
  for (const double rough : {0.1, 1.0, 2.5}) {
    const FineMesh fine = rough_torus(kSide, rough, random);
    const float within = 2.5f;
    const std::vector<float> tolerance(fine.points().size(), within);
    std::vector<std::uint32_t> node_of(fine.points().size(), MergeForest::kNone);
    std::vector<MergeForest::Node> nodes;
    for (int i = 0; i < kSide; i += 2)
      for (int j = 0; j < kSide; j += 2) {
        const auto p = static_cast<std::uint32_t>(i * kSide + j);
        Vector3d middle = Vector3d::Zero();
        for (const std::uint32_t q : {p, p + 1, p + kSide, p + kSide + 1}) {
          node_of[q] = static_cast<std::uint32_t>(nodes.size());
          middle += 0.25 * fine.points()[q];
        }
        nodes.push_back(set(p, middle));
      }
    MergeForest forest(std::move(nodes), std::move(node_of));
    MergeProof proof(forest, fine, tolerance, context);
    proof.prove();
    const std::size_t before = proof.merged().leaders.size();
    EXPECT_LT(before, fine.points().size()) << rough;
    EXPECT_LE(largest_distance(*proof.merged().mesh, fine), within + kDistanceSlack) << rough;
    EXPECT_LE(largest_distance(fine, *proof.merged().mesh), within + kDistanceSlack) << rough;
    // Every tenth edge of the mesh, if both of its ends still exist.
    std::vector<std::uint8_t> used(fine.points().size());
    for (std::uint32_t t = 0; t < proof.merged().mesh->triangles().size(); t += 10) {
      const Triangle& c = proof.merged().mesh->triangles()[t];
      const std::uint32_t p = proof.merged().leaders[c[0]], q = proof.merged().leaders[c[1]];
      if (std::exchange(used[p], 1) || std::exchange(used[q], 1)) continue;
      forest.join(p,
                  set(q, 0.5 * (proof.merged().mesh->points()[c[0]] + proof.merged().mesh->points()[c[1]])));
    }
    forest.settle();
    proof.prove();
    EXPECT_LE(proof.merged().leaders.size(), before) << rough;
    EXPECT_LE(largest_distance(*proof.merged().mesh, fine), within + kDistanceSlack) << rough;
    EXPECT_LE(largest_distance(fine, *proof.merged().mesh), within + kDistanceSlack) << rough;
  }
}

/// Six rings of six points about the tube: halves that become one make rings of two points, whose edges occur
/// twice.
TEST(MergeProof, TakesBackWhatChangesTheTopology) {
  const FineMesh fine = torus(6);
  RunContext context;
  std::vector<MergeForest::Node> nodes;
  std::vector<std::uint32_t> node_of(36, MergeForest::kNone);
  for (std::uint32_t i = 0; i < 6; ++i)
    for (const std::uint32_t half : {0u, 3u}) {
      const auto n = static_cast<std::uint32_t>(nodes.size());
      nodes.push_back(set(6 * i + half, fine.points()[6 * i + half]));
      for (std::uint32_t j = 0; j < 3; ++j) node_of[6 * i + half + j] = n;
    }
  MergeForest forest(nodes, node_of);
  MergeProof proof(forest, fine, {}, context);
  const MergedMesh& merged = proof.sort_out();
  const FineMesh& mesh = *merged.mesh;
  EXPECT_EQ(std::ssize(mesh.triangles()), 2 * std::ssize(mesh.points()));  // Euler characteristic 0
  for (std::uint32_t p = 0; p < mesh.points().size(); ++p) {
    std::vector<std::uint32_t> next;
    for (const std::uint32_t t : mesh.around(p)) next.push_back(mesh.next(t, p));
    std::sort(next.begin(), next.end());
    EXPECT_EQ(std::adjacent_find(next.begin(), next.end()), next.end());
  }
}

/// A closed surface all of whose points are in two sets: no triangle has three sets at its corners, so
/// nothing would be left of it.
TEST(MergeProof, BringsBackWhatHasVanished) {
  const std::vector<Vector3d> points = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  const FineMesh fine(
      points, {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}});
  RunContext context;
  MergeForest forest({set(0, Vector3d(0.5, 0.5, 0.5)), set(2, Vector3d(-0.5, -0.5, -0.5))},
                     {0, 0, 1, 1, 0, 1});
  const std::vector<float> tolerance(6, 10.0f);
  MergeProof proof(forest, fine, tolerance, context);
  const MergedMesh& merged = proof.prove();
  EXPECT_GE(merged.mesh->points().size(), 4u);
  EXPECT_EQ(merged.mesh->triangles().size() + 4, 2 * merged.mesh->points().size());
}

/// A thin ring; a set at its outer rim that would go into its hole, through the other side.
TEST(MergeProof, TakesBackWhatMeetsAnotherSheet) {
  const FineMesh fine = torus(40, 20.0, 1.5);
  RunContext context;
  const std::vector<float> tolerance(fine.points().size(), 100.0f);
  std::vector<std::uint32_t> node_of(fine.points().size(), MergeForest::kNone);
  node_of[0] = node_of[40] = 0;  // at the outer rim, to within the hole
  MergeForest forest({set(0, Vector3d(10, 0, 0))}, node_of);
  EXPECT_EQ(MergeProof(forest, fine, tolerance, context).prove().mesh->points().size(), fine.points().size());
}

/// The certificate has to fail before it is trusted.
TEST(DistanceCertificate, SeesAPointThatIsTooFarAway) {
  const FineMesh fine = torus(60);
  for (const double off : {0.0, 0.19, 0.21}) {
    std::vector<Vector3d> points = fine.points();
    points[100] += off * fine.normal(fine.around(100).front()).cast<double>();
    const FineMesh moved(points, fine.triangles());
    TriangleOverlay over_moved(fine.triangles().size()), over_fine(fine.triangles().size());
    int far = 0;
    for (std::uint32_t t = 0; t < fine.triangles().size(); ++t) {
      const auto bound = [](std::uint32_t) { return 0.2; };
      const auto nothing = [](std::uint32_t, const std::array<OverTriangle::Place, 3>&) {};
      far += !DistanceCertificate(moved, over_moved).holds(fine.corners(t), t, bound, nothing);
      far += !DistanceCertificate(fine, over_fine).holds(moved.corners(t), t, bound, nothing);
    }
    EXPECT_EQ(far > 0, off > 0.205) << off;
  }
}

}  // namespace merge_proof_test
}  // namespace hermesh
