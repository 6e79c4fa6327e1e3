// Where the data of a volume end, and what becomes of a surface that runs into that end.
//
// A scan is a box of samples, and the surface in it mostly goes on beyond. The volume then counts as outside
// beyond its data, and the surface is either closed there or left open, the same way by every extractor:
//
// - closed: a flat cap half a voxel beyond the last samples, on the outer faces of the last voxels (a sample
// stands for
//   the voxel around it). Between the last samples and the cap the surface goes on as it came.
// - open: the surface is cut off in the plane of the last samples, beyond which nothing is known. The
// boundary lies in
//   that plane.
//
// Where the data end:
// - Of a level set, where a sample inside stands beside an inactive one outside and the value rises by more
// than distances
//   can from one sample to the next. A narrow band whose background has the right signs has no end; a level
//   set that was clipped through its surface or its inside has one. Bands of a voxel and less are told apart
//   by the same rule, down to clips at which the rise is none too large; those are closed without a flat cap,
//   as if the background were data. A band that is whole, but whose inactive samples inside have the
//   background of outside (nobody flooded its inside), ends nowhere once they have the signs of the band: it
//   gets them, and a note.
// - Of any other volume at the box of its active voxels. But sparse fog, whose active voxels do not fill
// their box, is
//   known everywhere, for its background is the density of empty space.
#pragma once

#include <array>
#include <string>

#include "algorithms/core/variant.h"

namespace hermesh {

enum class Ends { closed, open };

/// The ends that a surface runs into.
struct DataEnds {
  /// Whether the surface runs into an end of the data, by axis of the grid, then below (0) and above (1).
  std::array<std::array<bool, 2>, 3> reached{};
  /// Index coordinate of the last samples at each end that is reached, in the order of `reached`.
  std::array<std::array<int, 2>, 3> last{};
  /// False where the ends of a level set lie in no box (it was clipped by a mask): those caps are closed, but
  /// only flat where one sample beyond has one neighbour inside, and they cannot be opened.
  bool in_a_box = true;
  /// The box of index coordinates that ends half a voxel beyond the last samples, at the caps. It is
  /// unbounded if the ends lie in no box, and on each side on which the surface continues beyond the active
  /// samples.
  Bounds caps = Bounds::unbounded();

  bool any() const;
  std::string text() const;  ///< names of the ends, such as "-x, +z"
};

struct ClosedVolume {
  LevelSet volume;
  DataEnds ends;
};

/// The volume as extractors should get it, so that they close its surface half a voxel beyond the data.
/// Beside each sample inside at the end, the sample beyond gets the value mirrored at the isovalue,
/// 2·isovalue − value, and is active: each edge between the two crosses in its middle, and differences of
/// samples across the cap cancel, so that its normals are the grid's axis. No other sample beyond is active,
/// so nobody takes the background for data. Samples of the last layer keep their values; normals in it lean
/// towards the cap where it is less than a voxel away. A level set with ends is no longer called one (grid
/// class), for the background's magnitude does not mark its band any more; what is inside stays so. A volume
/// without ends that the surface runs into is returned as it is, not copied.
/// @throws Error for values that are not finite; Cancelled
ClosedVolume close_ends(const LevelSet& level_set, double isovalue, RunContext& context);

/// Moves the points of an extractor's mesh that lie beyond the last samples of an end onto the plane half a
/// voxel beyond, along the grid's axis: extractors that place points inside cells round the cap's rim. On
/// other sides it moves only points beyond that plane. For meshes of close_ends()' volume. May make polygons
/// intersect, so extractors that guarantee otherwise keep their points within the caps themselves
/// (ExtractionInput::caps): their rims may be round, but do not pass the plane.
void flatten_ends(PolygonMesh& mesh, const LevelSet& closed, const DataEnds& ends);

/// Cuts the mesh of close_ends()' volume off in the planes of the last samples. Polygons that straddle a
/// plane are cut at their edges; points within 0.002 voxel of the plane are moved into it, and polygons that
/// lie in it are left out. Edges stay manifold; where the surface comes that near to the plane without
/// crossing it (samples at the isovalue, or all but at it), the boundary may touch itself, and polygons as
/// thin as that may meet.
/// @throws Error if the ends lie in no box.
PolygonMesh open_ends(const PolygonMesh& mesh, const LevelSet& closed, const DataEnds& ends);

struct EndedMesh {
  PolygonMesh mesh;
  DataEnds ends;
};

/// Closes the volume's ends (close_ends()), runs the extractor, and has its mesh flattened (flatten_ends())
/// or opened (open_ends()) there. @throws what these throw.
EndedMesh extract_with_ends(const Extractor& extractor, const ExtractionInput& input, Ends ends);

}  // namespace hermesh
