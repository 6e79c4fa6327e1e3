#include "algorithms/extraction/embedded_mesh/envelope.h"

#include <cmath>
#include <optional>

namespace hermesh {
namespace {

using Corner = EnvelopeCorner;

/// Least area, with terms of the order of one, that is certainly positive: far above rounding.
constexpr double kLeastTurn = 1e-5;
/// Distance of heights from the ends of the edge, in lengths of the edge.
constexpr double kMargin = 1e-6;

double cross(const Corner& a, const Corner& b) { return a.u * b.v - a.v * b.u; }

/// Returns the height at which the edge intersects the two triangles of diagonal (d, d+2), if both lie in the
/// envelope; the corners run around the edge. The diagonal passes the edge on one side, through the
/// half-plane of the corner k there. If it intersects the triangle of the edge and k, the triangle on that
/// side is within the two tetrahedra of k; if the edge also intersects the other triangle, that one is within
/// all four.
std::optional<double> height_if_safe(const std::array<Corner, 4>& r, int d) {
  const Corner &a = r[d], &c = r[d + 2];
  const bool left = cross(a, c) > 0;  // the edge is on the left of the diagonal, and so is corner d+3
  const Corner &beyond = r[left ? d + 1 : (d + 3) % 4], &other = r[left ? (d + 3) % 4 : d + 1];
  // The diagonal intersects the half-plane of `beyond` at q, `share` of the distance to it from the edge.
  const double from_a = cross(beyond, a), from_c = cross(beyond, c);
  const double t = from_a / (from_a - from_c);
  const Corner q = {a.u + t * (c.u - a.u), a.v + t * (c.v - a.v), a.h + t * (c.h - a.h)};
  const double share = (q.u * beyond.u + q.v * beyond.v) / (beyond.u * beyond.u + beyond.v * beyond.v);
  if (!(share > -kMargin && share < 1 - kMargin)) return std::nullopt;
  if (!(q.h > share * beyond.h + kMargin && q.h < 1 - share * (1 - beyond.h) - kMargin)) return std::nullopt;
  const double wa = cross(c, other), wc = cross(other, a), wo = cross(a, c), sum = wa + wc + wo;
  if (std::abs(sum) < kLeastTurn) return std::nullopt;
  const double height = (wa * a.h + wc * c.h + wo * other.h) / sum;
  if (!(height > kMargin && height < 1 - kMargin)) return std::nullopt;
  return height;
}

}  // namespace

EnvelopeCut cut_quad(const std::array<Corner, 4>& r, double hit) {
  // Corners that do not run around the edge, each by less than half a turn, have no envelope.
  for (int i = 0; i < 4; ++i)
    if (cross(r[i], r[(i + 1) % 4]) < kLeastTurn) return {.height = hit};
  std::array<std::optional<double>, 2> heights;
  for (int d = 0; d < 2; ++d) heights[d] = height_if_safe(r, d);
  if (!heights[0] && !heights[1]) return {.height = hit};
  const auto cut = [&](int d) { return EnvelopeCut{false, d, *heights[d]}; };
  if (!heights[0] || !heights[1]) return cut(heights[1] ? 1 : 0);
  // Triangles that pass nearer to the crossing, which lies on the surface, follow a crease; among equals, a
  // shorter diagonal gives better shapes.
  constexpr double kAlike = 1e-4;
  const double off[2] = {std::abs(*heights[0] - hit), std::abs(*heights[1] - hit)};
  if (std::abs(off[0] - off[1]) > kAlike) return cut(off[1] < off[0]);
  const auto squared = [&](int i, int j) {
    const double du = r[i].u - r[j].u, dv = r[i].v - r[j].v, dh = r[i].h - r[j].h;
    return du * du + dv * dv + dh * dh;
  };
  return cut(squared(1, 3) < squared(0, 2));
}

EnvelopeCut cut_triangle(const std::array<Corner, 3>& r, double hit) {
  const double wa = cross(r[1], r[2]), wb = cross(r[2], r[0]), wc = cross(r[0], r[1]);
  if (wa < kLeastTurn || wb < kLeastTurn || wc < kLeastTurn) return {.height = hit};
  // Barycentric weights: the edge is at the origin of (u, v).
  const double height = (wa * r[0].h + wb * r[1].h + wc * r[2].h) / (wa + wb + wc);
  if (!(height > kMargin && height < 1 - kMargin)) return {.height = hit};
  return {false, 0, height};
}

}  // namespace hermesh
