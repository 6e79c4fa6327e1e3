// Booleans of polygonal solids. Both operands are sampled on one lattice, as level sets for the signs and
// with exact Hermite data, which preserve the operands' creases and those where their surfaces intersect.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/hermite/boolean_rule.h"
#include "algorithms/hermite/samplers.h"

namespace hermesh {

/// A lattice with its samples at origin + voxel_size · (i, j, k), world units.
struct SharedLattice {
  double voxel_size = 1.0;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};

/// Returns the lattice of two meshes. Its origin is choose_origin() of their common box, so it does not
/// depend on their order, and near the world origin samples lie at multiples of the voxel size.
SharedLattice shared_lattice(const PolygonMesh& a, const PolygonMesh& b, double voxel_size);

struct SampledSolid {
  LevelSet level_set;    ///< on the shared lattice
  FloatHermite hermite;  ///< crossings of its edges, from the polygons
  PolygonSampling sampling;
};

/// Samples polygons at multiples of the voxel size from the mesh's origin.
using SampleMesh = std::function<SampledSolid(const PolygonMesh&)>;

/// Samples a mesh unchanged if it is near the lattice's origin, and otherwise relative to a nearby sample, so
/// that single precision loses at most 2⁻¹³ voxels.
/// @throws Error if the mesh is more than 2³⁰ voxels away, or if the level set has no sample inside.
SampledSolid sample_solid(const PolygonMesh& mesh, const SharedLattice& lattice, const SampleMesh& sample);

/// Returns a note on the crossing edges of a solid that hit no polygon; empty if all hit one.
std::string missed_edges_note(const PolygonSampling& sampling);

/// Signs and crossings of a combination, by the rule of boolean_rule.h: a sample's sign is the Boolean of the
/// operands' signs, and the edges with crossings are those whose ends differ. The values of the level set are
/// the minima (maxima) of the operands'.
struct CombinedSolid {
  LevelSet level_set;
  FloatHermite hermite;
};
/// Combines two solids on one lattice. The bytes of a union and an intersection do not depend on which
/// operand comes first. @throws Error as combine() of the Hermite data does.
CombinedSolid combine(Boolean boolean, const SampledSolid& a, const SampledSolid& b, RunContext& context);

/// Loss of a combination between samples (trap T10, boolean_rule.h). If the operands cross an edge in
/// opposite directions, the part between the two crossings contains no sample: an intersection or a
/// difference loses it, a sliver of material, and a union fills it, a gap.
struct LostSlivers {
  std::size_t edges = 0;  ///< number of edges with such a part
  double volume = 0.0;    ///< estimate in voxels³, from the lattice lines of the axis with the largest sum
  double longest =
      0.0;  ///< length of the longest part, voxels: the thickness there if the edge is perpendicular
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< middle of the longest part, world units
};

/// Computes the loss of the combination of two operands on one lattice. Parts of less than a thousandth of a
/// voxel count as rounding. Symmetric in the operands of a union and an intersection.
LostSlivers lost_slivers(Boolean boolean, const FloatHermite& a, const FloatHermite& b);

/// Returns a note on parts of the result that are thinner than a voxel (`voxel_size` in world units). (Parts
/// that an operand lost by itself are reported when it is voxelized.)
std::string lost_slivers_note(const LostSlivers& lost, Boolean boolean, double voxel_size);

}  // namespace hermesh
