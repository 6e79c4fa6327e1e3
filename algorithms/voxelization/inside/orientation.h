// Makes the faces of a mesh agree on which side is out, before signs are taken from winding numbers.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// How to turn each face, and what was found on the way.
struct Orientation {
  /// Whether the turned faces tell inside from outside.
  enum class Verdict {
    usable,
    no_area,        ///< every face is degenerate
    cancelling,     ///< most of the area is there with both windings, so that it bounds nothing
    not_orientable  ///< most of the area belongs to patches with one side only, such as a Möbius strip
  };

  std::vector<std::int8_t> turns;  ///< for each face 1 as given, −1 turned over, 0 left out
  /// `turns` of the faces of closed patches that agreed from the start and have negative volume, 0 for all
  /// others; empty if there are none.
  std::vector<std::int8_t> inward;
  std::size_t flipped = 0;     ///< faces turned over
  std::size_t duplicates = 0;  ///< faces left out because others stand for them
  std::size_t patches = 0;     ///< sets of faces connected over edges that have exactly two
  std::size_t non_orientable_patches = 0;
  std::size_t boundary_edges = 0;      ///< edges of one face
  std::size_t non_manifold_edges = 0;  ///< edges of more than two faces
  Verdict verdict = Verdict::usable;
};

/// Turns the faces of a mesh so that they agree on which side is out. Points at equal positions count as one,
/// so that soups work too; of faces with the same three points one is taken and the others are duplicates.
/// Where as many are wound one way as the other, and the faces around go on without them, none is taken
/// (find_double_walls()). Faces with two equal points stay as they are.
///
/// In each patch faces are turned to agree, to the winding that more of its area was given with. If the
/// volume of all patches together is then negative, wherever in the mesh's box the apex is that an open one's
/// is measured from, the mesh was given inside out and every patch is turned over. So patches that agreed
/// from the start keep their winding relative to each other, by which shells inside one another say which is
/// a hole. Only a closed patch whose faces did not agree gets positive volume whatever its winding was. Where
/// more edges have three faces or more than two, there is no surface along which to agree, and every face
/// keeps its winding relative to the others.
///
/// A patch is left out, too, if all of its border meets others that would be closed along it without the
/// patch: a wall within a solid, or a fin of no thickness.
///
/// The result does not depend on the number of threads. It takes O(n log n) time, and about 70 bytes a face
/// while it runs. There may be fewer than 2^31 faces.
Orientation orient_faces(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles);

/// One sentence that says why there is no inside; empty for a usable orientation.
const char* explanation(Orientation::Verdict verdict);

}  // namespace hermesh
