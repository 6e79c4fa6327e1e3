// When the polygon of a crossing edge stays within the edge's envelope, so that it meets no other polygon.
#pragma once

#include <array>

namespace hermesh {

/// A corner of the polygon in the edge's own frame, whose unit is the edge's length: `u` along axis (axis +
/// 1) % 3, `v` along (axis + 2) % 3 and `h` along the axis, from the edge's start. Corners go around the edge
/// counter-clockwise seen against its axis.
struct EnvelopeCorner {
  double u, v, h;
};

/// How a polygon is cut into triangles.
struct EnvelopeCut {
  bool fanned = true;   ///< from the crossing itself, for no diagonal will do
  int diagonal = 0;     ///< else where a quad is cut: from this corner to the one after the next
  double height = 0.0;  ///< where the edge passes through the polygon, in lengths of the edge
};

/// Cuts a quad. Among the diagonals that keep both triangles in the envelope it takes the one that passes
/// nearer to the crossing, or the shorter one where both are as near (Ju & Udeshi 2006); where neither keeps
/// them there the quad is fanned. `hit` is where the surface crosses the edge, in lengths of the edge.
EnvelopeCut cut_quad(const std::array<EnvelopeCorner, 4>& corners, double hit);

/// Tests the triangle of an edge that three cells are around: fanned where the edge does not pass through it.
/// `hit` is as for cut_quad().
EnvelopeCut cut_triangle(const std::array<EnvelopeCorner, 3>& corners, double hit);

}  // namespace hermesh
