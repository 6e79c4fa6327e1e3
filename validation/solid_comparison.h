// Compares the solid bounded by a mesh with that of a reference. Distances alone are not enough: they do not
// detect false surfaces that coincide with inner walls of a soup.
#pragma once

#include <memory>

#include "algorithms/core/run_context.h"
#include "algorithms/io/mesh_file.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

struct SolidOptions {
  std::int64_t samples = 100'000;  ///< samples in space, and as many on each surface
  double voxel_size = 0.0;         ///< of the volume that the mesh comes from, world units; 0: unknown
  bool pieces = false;  ///< true if the mesh consists of all pieces of a fracture, whose seams are not walls
};

/// Compares the solid of a mesh, where its winding number is positive, with that of a reference, which may be
/// any soup (solid.h defines its inside, and where that is unknown). Points in space are stratified: one
/// random point, from a fixed seed, in each of as many equal boxes as there are samples. Intervals are
/// Wilson's for three standard deviations; as the samples are stratified, these are conservative.
///
/// Discretisation explains a distance between a mesh and the reference's boundary of up to √3 voxels if the
/// voxel size is given. Otherwise it explains up to three times the largest distance from the mesh to any
/// polygon of the reference (where a mesh cuts off a right-angled corner, its distance to the corner is √3
/// times that to the faces), but no more than 1/16 of the reference's longest side. The solids differ if,
/// beyond that distance,
///  - more than 0.1 % of the mesh's area is away from the reference's boundary, where the reference has
///    inside or outside on both sides: a false wall;
///  - more than 1 % of the reference's boundary is likewise away from the mesh: a lost part;
///  - more than 0.5 % of the reference's volume is inside one and outside the other, away from both
///    boundaries,
/// each by the lower end of its interval. Unknown parts of the reference count for neither. If they are more
/// than half of it, or the reference bounds nothing, the verdict is `unknown`, unless the solids certainly
/// differ. The constructor and compare() throw Cancelled. Points must be finite and corners valid, as the
/// validation of a mesh checks.
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

/// Compares a single mesh with a reference, as SolidReference::compare() does.
SolidComparison compare_solids(const MeshFile& mesh, const MeshFile& reference, const SolidOptions& options,
                               RunContext& context);

}  // namespace hermesh::validation
