// The condition for the polygon of a crossed edge to stay within the edge's envelope, so that it intersects
// no other polygon.
#pragma once

#include <array>

namespace hermesh {

/// A corner of the polygon in the frame of the edge, whose length is the unit: `u` along axis (axis + 1) % 3,
/// `v` along (axis + 2) % 3 and `h` along the axis, from the edge's start. Corners run counter-clockwise
/// around the edge, seen against its axis.
struct EnvelopeCorner {
  double u, v, h;
};

/// The division of a polygon into triangles.
struct EnvelopeCut {
  bool fanned = true;   ///< from the crossing, because no diagonal is suitable
  int diagonal = 0;     ///< otherwise a quad is cut from this corner to the one after the next
  double height = 0.0;  ///< of the intersection of edge and polygon, in lengths of the edge
};

/// Cuts a quad along the diagonal whose triangles stay within the envelope; if both do, along the one that
/// passes nearer to the crossing, or the shorter one of equals (Ju & Udeshi 2006); if none does, the quad is
/// fanned. `hit` is the offset of the crossing, in lengths of the edge.
EnvelopeCut cut_quad(const std::array<EnvelopeCorner, 4>& corners, double hit);

/// Tests the triangle of an edge with three cells around it: fanned if the edge does not intersect it. `hit`
/// is as for cut_quad().
EnvelopeCut cut_triangle(const std::array<EnvelopeCorner, 3>& corners, double hit);

}  // namespace hermesh
