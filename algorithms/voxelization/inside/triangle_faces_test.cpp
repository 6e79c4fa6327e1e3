// Cuts by hand: a triangle of area 8 in the plane z = 0.
#include "algorithms/voxelization/inside/triangle_faces.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace hermesh {
namespace {

using Eigen::Vector3d;

const Facet kTriangle({0, 0, 0}, {4, 0, 0}, {0, 4, 0});

/// An upright triangle in the plane x = `x`, which meets the plane z = 0 from y = `from` to `to`.
Facet upright(double x, double from, double to, double lowest = -5) {
  return {{x, from, lowest}, {x, 2 * to - from, lowest}, {x, from, -lowest}};
}

bool always(const TriangleFace&) { return true; }

std::vector<double> areas(const std::vector<TriangleFace>& faces) {
  std::vector<double> areas;
  for (const TriangleFace& face : faces) areas.push_back(face.area());
  std::ranges::sort(areas);
  return areas;
}

void expect_areas(const TriangleCutter& cutter, const std::vector<double>& expected) {
  const std::vector<double> found = areas(cutter.faces(100, always));
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-9);
}

TEST(TriangleCutter, CutsAlongLinesOfCrossing) {
  TriangleCutter cutter(kTriangle);
  cutter.add(upright(1, -10, 10));
  expect_areas(cutter, {3.5, 4.5});
  cutter.add(upright(2, -10, 10));
  expect_areas(cutter, {2, 2.5, 3.5});
  cutter.add(upright(2, -10, 10));  // once more
  expect_areas(cutter, {2, 2.5, 3.5});
  for (const TriangleFace& face : cutter.faces(100, always)) EXPECT_TRUE(face.whole);
}

TEST(TriangleCutter, CutsNothingAtItsBorderOrInAPoint) {
  TriangleCutter cutter(kTriangle);
  cutter.add({{0, 0, 0}, {4, 0, 0}, {2, 0, 3}});
  cutter.add({{4, 0, 0}, {0, 4, 0}, {4, 4, 0}});  // beside it
  cutter.add({{1, 1, 0}, {1, 2, 3}, {2, 1, 3}});
  cutter.add(upright(5, -10, 10));
  cutter.add({{0, 0, 2}, {4, 0, 2}, {0, 4, 2}});
  EXPECT_FALSE(cutter.has_cuts());
}

TEST(TriangleCutter, CutsWhereAnotherEndsOrLies) {
  TriangleCutter touched(kTriangle), apart(kTriangle), covered(kTriangle);
  touched.add({{1, -1, 5e-4}, {1, 9, 5e-4}, {1, 0, 4}});
  expect_areas(touched, {3.5, 4.5});
  apart.add({{1, -1, 5e-3}, {1, 9, 5e-3}, {1, 0, 4}});
  EXPECT_FALSE(apart.has_cuts());
  covered.add({{1, -1, 0}, {1, 9, 0}, {-9, 4, 0}});
  expect_areas(covered, {3.5, 4.5});
}

TEST(TriangleCutter, MakesNoMoreFacesThanItMay) {
  TriangleCutter cutter(kTriangle);
  for (int i = 1; i < 40; ++i) cutter.add(upright(0.1 * i, -10, 10));
  EXPECT_EQ(cutter.faces(100, always).size(), 40u);
  const std::vector<TriangleFace> few = cutter.faces(7, always);
  EXPECT_EQ(few.size(), 7u);
  double area = 0;
  for (const TriangleFace& face : few) area += face.area();
  EXPECT_NEAR(area, 8.0, 1e-9);
  EXPECT_TRUE(std::ranges::any_of(few, [](const TriangleFace& face) { return !face.whole; }));
  EXPECT_EQ(cutter.faces(100, [](const TriangleFace&) { return false; }).size(), 1u);
}

}  // namespace
}  // namespace hermesh
