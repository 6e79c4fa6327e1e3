// Makes the faces of a mesh agree on which side is out, before winding numbers are computed.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// The orientation of each face, and statistics.
struct Orientation {
  /// Suitability of the oriented faces to distinguish inside from outside.
  enum class Verdict {
    usable,
    no_area,        ///< every face is degenerate
    cancelling,     ///< most of the area exists with both windings, so it bounds nothing
    not_orientable  ///< most of the area belongs to patches with one side only, such as a Möbius strip
  };

  std::vector<std::int8_t> turns;  ///< for each face 1 as given, −1 flipped, 0 left out
  /// `turns` of the faces of closed patches that agreed from the start and have negative volume, 0 for all
  /// others; empty if there are none.
  std::vector<std::int8_t> inward;
  std::size_t flipped = 0;     ///< flipped faces
  std::size_t duplicates = 0;  ///< faces left out because others represent them
  std::size_t patches = 0;     ///< sets of faces connected over edges that have exactly two
  std::size_t non_orientable_patches = 0;
  std::size_t boundary_edges = 0;      ///< edges of one face
  std::size_t non_manifold_edges = 0;  ///< edges of more than two faces
  Verdict verdict = Verdict::usable;
};

/// Orients the faces of a mesh so that they agree on which side is out. Points at equal positions count as
/// one, so that soups work too. Of faces with the same three points one is used, in the winding of most, and
/// the others are duplicates. If as many have one winding as the other, and the surface continues around them
/// without them, none is used. Faces with two equal points are not changed.
///
/// In each patch faces are flipped to agree, to the winding that more of its area was given with. If the
/// volume of all patches together is then negative, for every apex in the mesh's box from which that of an
/// open patch may be measured, the mesh was given inside out and every patch is flipped. So patches that
/// agreed from the start keep their winding relative to each other, by which a shell inside another one is a
/// hole or not. Only a closed patch whose faces did not agree gets positive volume whatever its winding was.
/// If more edges have three faces or more than two, there is no surface along which to agree, and every face
/// keeps its winding relative to the others.
///
/// A patch is left out, too, if all of its border meets others that would be closed along it without the
/// patch: a wall within a solid, or a fin of no thickness.
///
/// The result does not depend on the number of threads. Takes O(n log n) time, and about 70 bytes a face
/// while it runs. There must be fewer than 2^31 faces.
Orientation orient_faces(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles);

/// Returns the reason why there is no inside; empty for a usable orientation.
const char* explanation(Orientation::Verdict verdict);

}  // namespace hermesh
