#include "algorithms/hermite/solids.h"

#include <gtest/gtest.h>

#include "algorithms/core/error.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/variants.h"

namespace hermesh {
namespace solids_test {

using Eigen::Vector3d;

PolygonMesh box(const Vector3d& lower, const Vector3d& upper) {
  MeshFile file;
  for (int i = 0; i < 8; ++i)
    file.points.emplace_back(i & 1 ? upper.x() : lower.x(), i & 2 ? upper.y() : lower.y(),
                             i & 4 ? upper.z() : lower.z());
  for (const Quad& q :
       {Quad{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}})
    file.quads.push_back(q);
  return to_polygon_mesh(file);
}

class Solids : public testing::Test {
 protected:
  SampledSolid sampled(const PolygonMesh& mesh, const SharedLattice& lattice) {
    const Voxelizer voxelizer = find_variant(our_voxelizers(), "hermesh");
    return sample_solid(mesh, lattice, [&](const PolygonMesh& framed) {
      SampledSolid solid;
      solid.level_set = voxelizer.voxelize({.mesh = framed,
                                            .voxel_size = lattice.voxel_size,
                                            .context = context,
                                            .options = Options("hermesh", voxelizer.options, {})});
      solid.hermite = sample_polygons(solid.level_set, 0.0, framed, context, &solid.sampling);
      return solid;
    });
  }
  RunContext context;
};

TEST_F(Solids, SliversAreThePartsOfEdgesBetweenTheSamples) {
  const SharedLattice unit{1.0, Vector3d::Zero()};
  const SampledSolid left = sampled(box({-4.3, -4.3, -4.3}, {0.7, 4.3, 4.3}), unit);
  const SampledSolid right = sampled(box({0.2, -4.3, -4.3}, {5.3, 4.3, 4.3}), unit);
  const SampledSolid beyond = sampled(box({0.8, -4.3, -4.3}, {5.3, 4.3, 4.3}), unit);
  // Edges along x from 0 to 1 at the 9 × 9 samples of −4 … 4, half a voxel of each.
  const LostSlivers lost = lost_slivers(Boolean::intersect, left.hermite, right.hermite);
  EXPECT_EQ(lost.edges, 81u);
  EXPECT_NEAR(lost.volume, 40.5, 1e-4);
  EXPECT_NEAR(lost.longest, 0.5, 1e-6);
  EXPECT_NEAR(lost.place.x(), 0.45, 1e-6);
  EXPECT_EQ(lost_slivers(Boolean::unite, left.hermite, right.hermite).edges, 0u);
  // A gap of a tenth.
  EXPECT_EQ(lost_slivers(Boolean::intersect, left.hermite, beyond.hermite).edges, 0u);
  EXPECT_NEAR(lost_slivers(Boolean::unite, beyond.hermite, left.hermite).volume, 8.1, 1e-4);
  // Both end at the edges from 0 to 1: of the left one there is nothing beyond 0.7, nor before.
  const SampledSolid shorter = sampled(box({-5.3, -5.3, -5.3}, {0.4, 5.3, 5.3}), unit);
  EXPECT_NEAR(lost_slivers(Boolean::subtract, left.hermite, shorter.hermite).volume, 24.3, 1e-4);
  EXPECT_EQ(lost_slivers(Boolean::subtract, shorter.hermite, left.hermite).edges, 0u);
}

TEST_F(Solids, TheLatticeIsTheSameWhicheverComesFirst) {
  const PolygonMesh a = box({100.1, 2, 3}, {101.3, 4, 5}), b = box({103, 2, 3}, {104.7, 5, 9});
  const SharedLattice one = shared_lattice(a, b, 0.1), other = shared_lattice(b, a, 0.1);
  EXPECT_EQ(one.origin, other.origin);
  EXPECT_EQ(one.voxel_size, 0.1);
}

TEST_F(Solids, ASolidFarFromTheLatticesOriginIsSampledAsFinely) {
  // 20 million voxels away single precision about the lattice's origin would be 2 voxels.
  const double h = 0.05;
  const Vector3d far(1e6, -1e6, 0);
  const SharedLattice lattice{h, Vector3d::Zero()};
  const SampledSolid solid =
      sampled(box(far - Vector3d::Constant(0.52), far + Vector3d::Constant(0.53)), lattice);
  EXPECT_EQ(solid.sampling.nearest + solid.sampling.fallback, 0u);
  const IndexToWorld& placement = solid.hermite.placement;
  std::size_t crossings = 0;
  for (std::size_t leaf = 0; leaf < solid.hermite.leaves.size(); ++leaf)
    for_each_crossing(solid.hermite, leaf, [&](int axis, int sample, const EdgeCrossing& crossing) {
      Vector3d index(sample >> 6, (sample >> 3) & 7, sample & 7);
      index[axis] += crossing.offset;
      for (int i = 0; i < 3; ++i) index[i] += solid.hermite.leaves[leaf].lower[i] - placement.base[i];
      const double at = (placement.origin + placement.local(index) - far)[axis];
      EXPECT_NEAR(std::abs(at - 0.005), 0.525, 2e-4 * h);
      ++crossings;
    });
  EXPECT_GT(crossings, 2000u);
  EXPECT_THROW(sampled(box(Vector3d::Constant(1e9), Vector3d::Constant(1e9 + 1)), lattice), Error);
}

TEST_F(Solids, ASampleOnTheSecondSurfaceIsInTheDifferenceOrTheIntersectionNeverInBothOrNeither) {
  const SharedLattice unit{1.0, Vector3d::Zero()};
  const SampledSolid a = sampled(box({-4.3, -4.3, -4.3}, {4.3, 4.3, 4.3}), unit);
  const SampledSolid b = sampled(box({-2, -2, -2}, {2, 2, 2}), unit);
  const auto inside = [&](const CombinedSolid& solid) {
    std::size_t samples = 0;
    for (const SignLeaf& leaf : solid.hermite.leaves) samples += std::size_t(count(leaf.inside));
    return samples;
  };
  const CombinedSolid both = combine(Boolean::intersect, a, b, context),
                      without = combine(Boolean::subtract, a, b, context);
  EXPECT_EQ(inside(both) + inside(without), 729u);
  // Signs of the level set are those of the Hermite data.
  for (const CombinedSolid* solid : {&both, &without}) {
    const FloatHermite from_values = sample_level_set(solid->level_set, 0.0, context);
    ASSERT_EQ(from_values.leaves.size(), solid->hermite.leaves.size());
    for (std::size_t i = 0; i < from_values.leaves.size(); ++i)
      EXPECT_EQ(from_values.leaves[i], solid->hermite.leaves[i]);
  }
}

TEST_F(Solids, WhatEnclosesNothingIsRefused) {
  MeshFile sheet;
  sheet.points = {{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}};
  sheet.quads.push_back(Quad{0, 1, 2, 3});
  EXPECT_THROW(sampled(to_polygon_mesh(sheet), {1.0, Vector3d::Zero()}), Error);
}

}  // namespace solids_test
}  // namespace hermesh
