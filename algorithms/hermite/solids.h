// Booleans of polygonal solids: both on one lattice, as level sets for the signs and with their exact Hermite
// data, which keep the operands' creases and those where their surfaces meet.
#pragma once

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

/// The lattice of two meshes, about choose_origin() of the box about both, so that it does not matter which
/// comes first, and near the zero of the world samples lie at multiples of the voxel size.
SharedLattice shared_lattice(const PolygonMesh& a, const PolygonMesh& b, double voxel_size);

struct SampledSolid {
  LevelSet level_set;    ///< on the shared lattice
  FloatHermite hermite;  ///< crossings of its edges, from the polygons
  PolygonSampling sampling;
};

/// Samples polygons at multiples of the voxel size from the mesh's origin.
using SampleMesh = std::function<SampledSolid(const PolygonMesh&)>;

/// Samples a mesh where it lies near the lattice's origin as it is, and elsewhere about a sample nearby, so
/// that single precision is lost by no more than 2⁻¹³ voxels.
/// @throws Error for a mesh of more than 2³⁰ voxels' distance; if the level set has no sample inside.
SampledSolid sample_solid(const PolygonMesh& mesh, const SharedLattice& lattice, const SampleMesh& sample);

/// A sentence on the crossing edges of a solid that hit no polygon; empty where all hit one.
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

}  // namespace hermesh
