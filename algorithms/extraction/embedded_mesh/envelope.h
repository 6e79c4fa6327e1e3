// When the polygon of a crossing edge stays within the edge's envelope, so that it meets no other polygon.
#pragma once

#include <array>

namespace hermesh {

/// A corner of the polygon in the edge's own frame, whose unit is the edge's length: along (axis+1) % 3, (axis+2) % 3 and
/// the axis, from the edge's start. Corners go around the edge counter-clockwise seen against its axis.
struct EnvelopeCorner {
  double u, v, h;
};

/// How a polygon is cut into triangles.
struct EnvelopeCut {
  bool fanned = true;   ///< from the crossing itself, for no diagonal will do
  int diagonal = 0;     ///< else of a quad: from this corner to the one after the next
  double height = 0.0;  ///< where the edge passes through it, in its length
};

/// Of the two diagonals that keep the triangles in the envelope the one that passes nearer to the crossing, or the shorter
/// one where both are as good (Ju & Udeshi 2006).
/// @param hit where the surface crosses the edge, in its length
EnvelopeCut cut_quad(const std::array<EnvelopeCorner, 4>& corners, double hit);

/// Where three cells are around an edge. Fanned where the edge does not pass through the triangle.
EnvelopeCut cut_triangle(const std::array<EnvelopeCorner, 3>& corners, double hit);

}  // namespace hermesh
