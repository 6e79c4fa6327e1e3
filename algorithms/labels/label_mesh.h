// Meshes of the labels of a label map that share their walls.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/fracture/fracture.h"
#include "algorithms/labels/label_map.h"

namespace hermesh {

struct LabelMeshOptions {
  /// Largest distance of vertices from the boundary between the voxels of different labels, in voxels, from
  /// kLeastSmoothing to 1/2. Smaller follows the staircase of the voxels more closely.
  double smoothing = 0.5;
};
inline constexpr double kLeastSmoothing = 0.01;

/// The boundaries of all labels of a map as one mesh.
///
/// **Guarantees** (fracture/labelled_mesh.h): the boundary of each label is a closed, oriented manifold
/// without self-intersections; the wall between two labels consists of the same triangles in both; no two
/// labels overlap, and there are no gaps, so the volumes of the labels add up to that inside the surface
/// against the background. All of this holds for coordinates as written to a file.
///
/// A label stays one mesh if it is disconnected; parts and labels of a single sample are preserved. Where the
/// boundary of a label cannot be manifold, the labels of a few samples change (fracture/label_repair.h);
/// samples of the background never do.
///
/// Vertices are at most LabelMeshOptions::smoothing from the boundary between voxels, except for the vertices
/// of cells with several sheets of surface (at most 1/2) and those around samples whose labels changed (at
/// most 1/2 if all of these have a neighbour with another label in the map).
struct LabelMeshes {
  /// A label, in ascending order.
  struct Label {
    std::uint32_t label;
    std::uint64_t samples;  ///< samples of the label in the map
    std::uint32_t piece;    ///< number among the pieces of `fracture`; 0 if all of its samples changed
  };
  LabelledFracture fracture;  ///< its pieces are the labels that remain
  std::vector<Label> labels;

  /// Returns the boundary of a label, with polygons counter-clockwise seen from outside of it; empty if all
  /// of its samples changed. Polygons have the attributes `surface` (0 against the background, 1 at a wall
  /// between labels) and `neighbour` (the label on the other side, 0 for the background).
  PolygonMesh mesh_of(const Label& label) const;
  /// Returns all walls once, with the attributes `label` (behind a polygon) and `neighbour` (the label that
  /// it faces; 0 for the background).
  PolygonMesh shared_walls() const;
};

/// Meshes a label map. Flat faces of boxes along the axes are flat, their edges sharp, and their volumes
/// exact (label_surface.h has the method). The result has the same bytes at any number of threads.
/// @throws Error for a map without a label, and for smoothing out of range; Cancelled
LabelMeshes label_meshes(const LabelMap& map, const LabelMeshOptions& options, RunContext& context);

/// Returns the distance of a position from the boundary between the voxels of different labels of a map, in
/// voxels, if that is less than about 1; else infinity. @param place index coordinates relative to the
/// placement's base
double distance_from_voxel_boundary(const LabelMap& map, const Eigen::Vector3d& place);

}  // namespace hermesh
