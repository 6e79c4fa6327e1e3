// Whether a mesh bounds the solid of a reference: what a soup's inner walls hide from distances.
#pragma once

#include <memory>

#include "algorithms/core/run_context.h"
#include "algorithms/io/mesh_file.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

struct SolidOptions {
  std::int64_t samples = 100'000;  ///< samples in space, and as many on each surface
  /// Size of the voxels that the mesh was made from, world units; 0 if it is not known.
  double voxel_size = 0.0;
  /// Whether the mesh is all pieces of a fracture together: then its seams, where two pieces meet, are no
  /// walls.
  bool pieces = false;
};

/// Compares the solid that a mesh winds around with that of a reference, which may be any soup (solid.h says
/// what its inside is, and where that is unknown). Points in space are stratified: one at random, from a
/// fixed seed, in each of as many equal boxes as there are samples. Intervals are Wilson's for three standard
/// deviations, which strata can only make narrower.
///
/// Discretisation explains that a mesh and the reference's boundary lie some way apart: up to √3 voxels where
/// the voxel size is given, and otherwise up to three times the largest distance from the mesh to any polygon
/// of the reference (a mesh cuts a right-angled corner √3 times as far as it then lies from the faces), but
/// no more than 1/16 of the reference's longest side. The solids differ if beyond that way
///  - more than 0.1 % of the mesh's area lies from all that bounds the reference, with inside or with outside
///    on both sides of it there: a wall that is none;
///  - more than 1 % of what bounds the reference lies from the mesh, likewise: a part that was lost;
///  - more than 0.5 % of the reference's volume is inside one and outside the other, farther from either
///    boundary,
/// each as the lower end of its interval. What is unknown of the reference counts for neither. If that is
/// more than half of it, or the reference bounds nothing, the verdict is `unknown`, unless they differ for
/// certain. The constructor and compare() throw Cancelled. Points must be finite, and the points of all
/// corners there, as judge() sees to.
class SolidReference {
 public:
  SolidReference(const MeshFile& reference, RunContext& context);
  ~SolidReference();
  SolidReference(const SolidReference&) = delete;
  SolidReference& operator=(const SolidReference&) = delete;

  SolidComparison compare(const MeshFile& mesh, const SolidOptions& options, RunContext& context) const;

 private:
  struct Parts;
  class Comparison;
  std::unique_ptr<const Parts> parts_;  ///< null if no polygon has an area
};

/// SolidReference::compare() for a reference that only one mesh is compared with.
SolidComparison compare_solids(const MeshFile& mesh, const MeshFile& reference, const SolidOptions& options,
                               RunContext& context);

}  // namespace hermesh::validation
