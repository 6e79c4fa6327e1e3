#include "algorithms/extraction/embedded_mesh/envelope.h"

#include <gtest/gtest.h>

namespace hermesh {
namespace envelope_test {

/// The corners of a quad at these heights, in the middles of the four cells around the edge, in their order.
std::array<EnvelopeCorner, 4> around(double a, double b, double c, double d) {
  return {{{-0.5, -0.5, a}, {0.5, -0.5, b}, {0.5, 0.5, c}, {-0.5, 0.5, d}}};
}

TEST(Envelope, FlatQuadIsCutAlongAnyDiagonal) {
  const EnvelopeCut cut = cut_quad(around(0.4, 0.4, 0.4, 0.4), 0.4);
  EXPECT_FALSE(cut.fanned);
  EXPECT_NEAR(cut.height, 0.4, 1e-12);
}

TEST(Envelope, DiagonalThatPassesNearerToTheCrossingIsTaken) {
  // Corners 0 and 2 are high, 1 and 3 low: the two diagonals pass the edge at 0.7 and at 0.3.
  const EnvelopeCut high = cut_quad(around(0.7, 0.3, 0.7, 0.3), 0.65),
                    low = cut_quad(around(0.7, 0.3, 0.7, 0.3), 0.35);
  EXPECT_FALSE(high.fanned);
  EXPECT_FALSE(low.fanned);
  EXPECT_NEAR(high.height, 0.7, 1e-9);
  EXPECT_NEAR(low.height, 0.3, 1e-9);
  EXPECT_NE(high.diagonal, low.diagonal);
}

TEST(Envelope, PolygonThatMissesTheEdgeIsFanned) {
  EXPECT_TRUE(cut_quad(around(1.5, 1.5, 1.5, 1.5), 0.9).fanned);
  EXPECT_EQ(cut_quad(around(1.5, 1.5, 1.5, 1.5), 0.9).height, 0.9);
  EXPECT_TRUE(cut_triangle({{{1, 0, -0.2}, {-0.5, 0.8, -0.2}, {-0.5, -0.8, -0.2}}}, 0.1).fanned);
}

TEST(Envelope, TriangleIsCutWhereTheEdgePassesThroughIt) {
  // Weights of the corners, by hand: 0.8 : 0.8 : 0.8 over 2.4 for an edge through the middle.
  const EnvelopeCut cut = cut_triangle({{{1, 0, 0.2}, {-0.5, 0.8, 0.5}, {-0.5, -0.8, 0.8}}}, 0.4);
  EXPECT_FALSE(cut.fanned);
  EXPECT_NEAR(cut.height, 0.5, 1e-12);
}

TEST(Envelope, CornersThatDoNotGoAroundTheEdgeAreFanned) {
  EXPECT_TRUE(cut_triangle({{{1, 0, 0.5}, {1, 1, 0.5}, {0, 1, 0.5}}}, 0.5).fanned);
}

}  // namespace envelope_test
}  // namespace hermesh
