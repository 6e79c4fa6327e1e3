// Solids at a distance from polygons: all points within a distance of them (a shell), and a solid that grows
// or shrinks by a distance beyond its narrow band.
//
// The surface is { p : d(p) = r } for the unsigned distance d to the polygons, on one side of the solid or on
// both. d is exact at all samples that matter, and crossings of lattice edges are found to 1e-8 voxel, with
// the direction from the nearest point of the polygons as normal, so creases and rounded edges are those of
// the offset (compare Pavić and Kobbelt, High-Resolution Volumetric Computation of Offset Surfaces with
// Feature Preservation, 2008). d has slope 1, so a cube of samples around c contains no surface if |d(c) − r|
// exceeds the distance of its samples from c; such cubes are never divided.
#pragma once

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/solids.h"

namespace hermesh {

/// Offset of polygons.
struct Offset {
  enum class Kind {
    shell,  ///< all points within distance / 2 of the polygons, so that sheets become walls of that thickness
    solid   ///< all points within `distance` of the solid, or deeper than −distance in it
  };
  Kind kind = Kind::solid;
  double distance = 0.0;  ///< world units; greater than 0 for a shell

  /// Distance of the offset surface from the polygons, world units.
  double radius() const {
    return kind == Kind::shell ? 0.5 * distance : distance < 0.0 ? -distance : distance;
  }
};

/// Least radius of a shell in voxels: the proof of remesh/shell.h holds for it.
inline constexpr double kLeastShellRadius = 0.6;

/// Returns the offset of polygons with exact Hermite data, on the lattice of samples at multiples of the
/// voxel size from the mesh's origin. The bytes are the same for every number of threads.
/// @param mesh polygons that distances are measured to. For Kind::solid they have to be the boundary of the
///   solid, without holes and without polygons within it
/// @param solid level set of the solid on that lattice; unused for a shell
/// @param voxel_size world units
/// @throws Error for a shell thinner than 1.2 voxels, and if no sample is inside; Cancelled
SampledSolid offset_solid(const PolygonMesh& mesh, const LevelSet& solid, double voxel_size,
                          const Offset& offset, RunContext& context);

/// Returns true if polygons are the boundary of the solid that their level set represents: each crossing edge
/// hits one of them, and none is farther than a voxel within the solid.
bool bound_their_solid(const PolygonMesh& mesh, const LevelSet& solid, RunContext& context);

/// Difference of a mesh from the offset of polygons, both ways.
struct OffsetErrors {
  double below = 0.0, above = 0.0;  ///< largest of radius − d and d − radius, world units; at least 0
  double from_offset = 0.0;  ///< largest distance of a point of the offset surface from the mesh, world units
  std::size_t samples = 0, offset_samples = 0;
};
/// Measures the distance d of a mesh's vertices and triangle centres from polygons, and compares it with
/// Offset::radius(); and the distance of the offset surface's crossings with the lattice from the mesh.
/// @param offset data of the offset, exact as by offset_solid()
OffsetErrors offset_errors(const PolygonMesh& polygons, const FloatHermite& offset, const PolygonMesh& mesh,
                           double radius, RunContext& context);

}  // namespace hermesh
