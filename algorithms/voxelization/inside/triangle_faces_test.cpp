// Cuts by hand: a triangle of area 8 in the plane z = 0.
#include "algorithms/voxelization/inside/triangle_faces.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace hermesh {
namespace triangle_faces_test {

using Eigen::Vector3d;

const Facet kTriangle({0, 0, 0}, {4, 0, 0}, {0, 4, 0});

/// An upright triangle in the plane x = `x`, which intersects the plane z = 0 from y = `from` to `to`.
Facet upright(double x, double from, double to, double lowest = -5) {
  return {{x, from, lowest}, {x, 2 * to - from, lowest}, {x, from, -lowest}};
}

bool always(const TriangleFace&) { return true; }

void expect_areas(const std::vector<Facet>& others, const std::vector<double>& expected) {
  std::vector<double> found;
  for (const TriangleFace& face : cut_triangle(kTriangle, others, 100, always)) {
    EXPECT_TRUE(face.whole);
    found.push_back(face.area());
  }
  std::ranges::sort(found);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-9);
}

TEST(CutTriangle, CutsAlongLinesOfCrossing) {
  const Facet at_1 = upright(1, -10, 10), at_2 = upright(2, -10, 10);
  expect_areas({at_1}, {3.5, 4.5});
  expect_areas({at_1, at_2}, {2, 2.5, 3.5});
  expect_areas({at_1, at_2, at_2}, {2, 2.5, 3.5});
}

TEST(CutTriangle, CutsNothingAtItsBorderOrInAPoint) {
  expect_areas({{{0, 0, 0}, {4, 0, 0}, {2, 0, 3}},
                {{4, 0, 0}, {0, 4, 0}, {4, 4, 0}},  // beside it
                {{1, 1, 0}, {1, 2, 3}, {2, 1, 3}},
                upright(5, -10, 10),
                {{0, 0, 2}, {4, 0, 2}, {0, 4, 2}}},
               {});
}

TEST(CutTriangle, CutsWhereAnotherEndsOrLies) {
  expect_areas({{{1, -1, 5e-4}, {1, 9, 5e-4}, {1, 0, 4}}}, {3.5, 4.5});
  expect_areas({{{1, -1, 5e-3}, {1, 9, 5e-3}, {1, 0, 4}}}, {});
  expect_areas({{{1, -1, 0}, {1, 9, 0}, {-9, 4, 0}}}, {3.5, 4.5});
}

TEST(CutTriangle, MakesNoMoreFacesThanItMay) {
  std::vector<Facet> others;
  for (int i = 1; i < 40; ++i) others.push_back(upright(0.1 * i, -10, 10));
  EXPECT_EQ(cut_triangle(kTriangle, others, 100, always).size(), 40u);
  const std::vector<TriangleFace> few = cut_triangle(kTriangle, others, 7, always);
  EXPECT_EQ(few.size(), 7u);
  double area = 0;
  for (const TriangleFace& face : few) area += face.area();
  EXPECT_NEAR(area, 8.0, 1e-9);
  EXPECT_TRUE(std::ranges::any_of(few, [](const TriangleFace& face) { return !face.whole; }));
  EXPECT_EQ(cut_triangle(kTriangle, others, 100, [](const TriangleFace&) { return false; }).size(), 1u);
}

}  // namespace triangle_faces_test
}  // namespace hermesh
