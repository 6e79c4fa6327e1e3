// Hermite data of closed polygons for a part of the lattice, in memory of the size of the part.
#pragma once

#include <optional>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "algorithms/lattice/part_placement.h"
#include "algorithms/voxelization/inside/winding_number.h"

namespace hermesh {

/// Width of the band on either side within which distances are computed, in voxels.
inline constexpr double kPartBand = 3.0;

/// Polygons without boundary that are voxelized part by part, with the signs of their winding number, whose
/// value at a sample does not depend on the part.
class ClosedPolygons {
 public:
  /// @param mesh must outlive this
  /// @param voxel_size world units
  /// @throws Error if an edge does not have two faces, or if the faces have no orientation; as
  ///   check_voxelization_fits() for an invalid size
  ClosedPolygons(const PolygonMesh& mesh, double voxel_size);

  /// Returns the box that contains the blocks of the data of all parts.
  const SampleBox& extent() const { return extent_; }
  /// Returns the outline_of() all parts, and the placement of their data.
  const LevelSet& outline() const { return outline_; }
  const IndexToWorld& placement() const { return placement_; }
  /// Returns the numbers of the triangles, as triangulated() numbers them, that matter to a box of samples,
  /// whose corners are multiples of 8.
  std::vector<std::uint32_t> triangles_near(const SampleBox& box) const;
  /// Returns the crossings of all edges that start in blocks of the box, except that edges out of the box are
  /// not crossed. They are equal to those of sample_polygons() of the level set with the winding number's
  /// signs and bands of kPartBand voxels, as long as no polygon lies within the solid: distances to such may
  /// differ near the ends of the box, and with them the choice between several polygons on one edge.
  /// @throws Error if the box does not fit in memory; Cancelled
  FloatHermite hermite(const SampleBox& box, RunContext& context) const;

 private:
  const PolygonMesh& mesh_;
  const double voxel_size_;
  const std::vector<Triangle> triangles_;
  const OrientedWinding winding_;
  const SampleBox extent_;
  const LevelSet outline_;
  const IndexToWorld placement_;
  const bool inside_out_;
};

}  // namespace hermesh
