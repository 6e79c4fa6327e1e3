#include "algorithms/voxelization/distance/wide_band.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "algorithms/voxelization/voxelize_for_tests.h"

namespace hermesh {
namespace wide_band_test {

using namespace voxelize_for_tests;

Voxelization wide(const PolygonMesh& mesh, double exterior, double interior, double voxel_size = 1.0,
                  SignRule signs = SignRule::flood_fill) {
  RunContext context;
  return voxelize(mesh,
                  {.voxel_size = voxel_size,
                   .exterior_band = exterior,
                   .interior_band = interior,
                   .signs = signs,
                   .nearest = true},
                  context);
}

TEST(WideBand, FilledBoxHasItsExactDistances) {
  const Vector3d low(-20.3, -11.6, 0.4), high(41.2, 38.1, 52.7);
  const PolygonMesh mesh = box(low, high);
  const Voxelization result = wide(mesh, 3, 100);
  const auto distance = result.distance->getConstAccessor();
  const auto nearest = result.nearest->getConstAccessor();
  int inside = 0;
  for (int x = -28; x <= 48; ++x)
    for (int y = -20; y <= 46; ++y)
      for (int z = -8; z <= 61; ++z) {
        const double truth = to_box({double(x), double(y), double(z)}, low, high);
        const openvdb::Coord at(x, y, z);
        ASSERT_EQ(distance.isValueOn(at), truth < 3) << x << ' ' << y << ' ' << z;
        ASSERT_EQ(nearest.isValueOn(at), truth < 3);
        ASSERT_NEAR(distance.getValue(at), std::min(truth, 3.0), 2e-5);
        inside += truth < 0 ? 1 : 0;
      }
  EXPECT_EQ(inside, 62 * 50 * 52);
}

TEST(WideBand, BothSidesAreAsWideAsAsked) {
  const Vector3d low(0.1, 0.2, 0.3), high(60.7, 60.6, 60.4);
  const PolygonMesh mesh = box(low, high);
  const Voxelization result = wide(mesh, 19.5, 23.25);
  const auto distance = result.distance->getConstAccessor();
  for (int x = -24; x <= 85; ++x)
    for (int y = -24; y <= 85; y += 3)
      for (int z = -24; z <= 85; z += 5) {
        const double truth = to_box({double(x), double(y), double(z)}, low, high);
        ASSERT_EQ(distance.isValueOn({x, y, z}), truth < 19.5 && truth > -23.25) << x << ' ' << y << ' ' << z;
        ASSERT_NEAR(distance.getValue({x, y, z}), std::clamp(truth, -23.25, 19.5), 2e-5);
      }
}

/// Both searches must give the same distances, even if parts intersect, whose inner walls bound nothing.
TEST(WideBand, AgreesWithTheNarrowSearchWherePartsIntersect) {
  PolygonMesh mesh = box({0.2, 0.3, 0.1}, {50.4, 40.7, 40.6});
  append(mesh, box({30.6, 10.7, 9.8}, {80.3, 60.2, 33.9}));
  const Voxelization narrow = wide(mesh, 3, 16), filled = wide(mesh, 3, 40);
  const auto exact = filled.distance->getConstAccessor();
  const auto ids = filled.nearest->getConstAccessor();
  const auto narrow_ids = narrow.nearest->getConstAccessor();
  std::size_t other_triangle = 0;
  for (auto value = narrow.distance->cbeginValueOn(); value; ++value) {
    ASSERT_NEAR(exact.getValue(value.getCoord()), *value, 3e-5) << value.getCoord();
    other_triangle += ids.getValue(value.getCoord()) != narrow_ids.getValue(value.getCoord()) ? 1 : 0;
  }
  // Where several are equally near, it may be any of them.
  EXPECT_LT(double(other_triangle), 0.1 * double(narrow.distance->activeVoxelCount()));
  EXPECT_GT(filled.distance->activeVoxelCount(), narrow.distance->activeVoxelCount());
  for (auto value = filled.distance->cbeginValueOn(); value; ++value) ASSERT_LT(*value, 3.0f);
}

TEST(WideBand, CapsOfHolesCountAsBoundary) {
  PolygonMesh mesh = box({0.5, 0.5, 0.5}, {64.5, 64.5, 64.5});
  mesh.quads.erase(mesh.quads.begin());  // the side at z = 0.5
  const Voxelization narrow = wide(mesh, 3, 16, 1.0, SignRule::winding_number),
                     filled = wide(mesh, 3, 50, 1.0, SignRule::winding_number);
  const auto exact = filled.distance->getConstAccessor();
  for (auto value = narrow.distance->cbeginValueOn(); value; ++value)
    ASSERT_NEAR(exact.getValue(value.getCoord()), *value, 3e-5) << value.getCoord();
}

TEST(WideBand, SameBytesAtAnyThreadCount) {
  const PolygonMesh mesh = box({-7.3, -5.1, -6.2}, {9.4, 8.8, 11.5});
  const Voxelization many = wide(mesh, 20, 30, 0.25);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Voxelization single = wide(mesh, 20, 30, 0.25);
  ASSERT_EQ(many.distance->activeVoxelCount(), single.distance->activeVoxelCount());
  const auto accessor = single.distance->getConstAccessor();
  const auto ids = single.nearest->getConstAccessor();
  for (auto value = many.distance->cbeginValueOn(); value; ++value)
    ASSERT_EQ(*value, accessor.getValue(value.getCoord()));
  for (auto value = many.nearest->cbeginValueOn(); value; ++value)
    ASSERT_EQ(*value, ids.getValue(value.getCoord()));
}

}  // namespace wide_band_test
}  // namespace hermesh
