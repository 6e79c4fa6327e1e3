// Ends of the data of a volume, and the treatment of a surface that runs into them.
//
// A scan is a box of samples, and the surface in it mostly continues beyond. The volume then counts as
// outside beyond its data, and the surface is either closed there or left open, in the same way by every
// extractor:
//
// - closed: a flat cap half a voxel beyond the last samples, on the outer faces of the last voxels (a sample
//   represents the voxel around it). Between the last samples and the cap the surface is extrapolated.
// - open: the surface is cut off in the plane of the last samples, which contains the boundary.
//
// The data end:
// - In a level set, where a sample inside is adjacent to an inactive one outside and the value rises by more
//   than distances can from one sample to the next. A narrow band whose background has the right signs has no
//   end; a level set that was clipped through its surface or its inside has one. For bands of a voxel and
//   less the same rule holds, except for clips at which the rise is not too large; those are closed without a
//   flat cap, as if the background were data. A complete band whose inactive samples inside have the sign of
//   outside (its inside was not flooded) gets the signs of the band, and a note, and then has no end.
// - In any other volume, at the box of its active voxels. But sparse fog, whose active voxels do not fill
//   their box, is known everywhere, because its background is the density of empty space.
#pragma once

#include <array>
#include <string>

#include "algorithms/core/variant.h"

namespace hermesh {

enum class Ends { closed, open };

/// The ends that a surface runs into.
struct DataEnds {
  /// True if the surface reaches an end of the data, by axis of the grid, then below (0) and above (1).
  std::array<std::array<bool, 2>, 3> reached{};
  /// Index coordinate of the last samples at each reached end.
  std::array<std::array<int, 2>, 3> last{};
  /// False if the ends of a level set lie in no box (it was clipped by a mask): those caps are closed, but
  /// flat only where a sample beyond has one neighbour inside, and they cannot be opened.
  bool in_a_box = true;
  /// The box of index coordinates that ends half a voxel beyond the last samples, at the caps. Unbounded if
  /// the ends lie in no box, and on each side on which the surface continues beyond the active samples.
  Bounds caps = Bounds::unbounded();

  bool any() const;
  std::string text() const;  ///< names of the ends, e.g. "-x, +z"
};

struct ClosedVolume {
  LevelSet volume;
  DataEnds ends;
};

/// Returns the volume whose surface extractors close half a voxel beyond the data. The sample beyond each
/// sample inside at the end gets the value mirrored at the isovalue, 2·isovalue − value, and is active: the
/// edge between the two is crossed in its middle, and differences of samples across the cap cancel, so its
/// normals are the grid's axis. No other sample beyond is active, so the background is not treated as data.
/// Samples of the last layer keep their values; normals in it lean towards the cap if it is less than a voxel
/// away. A level set with ends loses its grid class, because the background's magnitude no longer marks its
/// band; the inside is unchanged. A volume without ends that the surface runs into is returned unchanged, not
/// copied.
/// @throws Error for values that are not finite; Cancelled
ClosedVolume close_ends(const LevelSet& level_set, double isovalue, RunContext& context);

/// Moves the vertices of a mesh of close_ends()' volume that lie beyond the last samples of an end onto the
/// plane half a voxel beyond, along the grid's axis, because extractors that place vertices inside cells
/// round the cap's boundary. On other sides it moves only vertices beyond that plane. May cause
/// self-intersections, so extractors that guarantee otherwise keep their vertices within the caps themselves
/// (ExtractionInput::caps): their caps may have round boundaries, but do not pass the plane.
void flatten_ends(PolygonMesh& mesh, const LevelSet& closed, const DataEnds& ends);

/// Cuts the mesh of close_ends()' volume off in the planes of the last samples. Polygons that straddle a
/// plane are cut at their edges; vertices within 0.002 voxel of the plane are moved into it, and polygons
/// that lie in it are removed. Edges stay manifold; where the surface comes that near to the plane without
/// crossing it (samples at or nearly at the isovalue), the boundary may touch itself, and polygons as thin as
/// that may intersect.
/// @throws Error if the ends lie in no box.
PolygonMesh open_ends(const PolygonMesh& mesh, const LevelSet& closed, const DataEnds& ends);

struct EndedMesh {
  PolygonMesh mesh;
  DataEnds ends;
};

/// Closes the volume's ends, runs the extractor, and flattens or opens its mesh there. @throws as these
/// functions
EndedMesh extract_with_ends(const Extractor& extractor, const ExtractionInput& input, Ends ends);

}  // namespace hermesh
