// Surfaces that run into the end of the data: closed flat or left open, by our extractors and OpenVDB's.
#include "algorithms/extraction/volume_ends.h"

#include <openvdb/tools/LevelSetUtil.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <random>

#include "experiments/promises/methods_for_tests.h"
#include "reference/variants.h"

namespace hermesh {
namespace volume_ends_test {

using openvdb::Coord;
using test_methods::sphere_band;
using Field = std::function<float(int, int, int)>;

openvdb::FloatGrid::Ptr dense(const Coord& lower, const Coord& upper, float background, const Field& value) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(background);
  for (const Coord& at : openvdb::CoordBBox(lower, upper))
    grid->tree().setValue(at, value(at.x(), at.y(), at.z()));
  return grid;
}

/// A ball about (10, 9, z) of radius 6.3 whose values are greater inside, as in a scan.
openvdb::FloatGrid::Ptr ball(double z) {
  return dense(Coord(0, 0, 0), Coord(20, 19, 15), -100.0f, [=](int x, int y, int k) {
    return static_cast<float>(100.0 * (6.3 - std::hypot(x - 10.0, y - 9.0, k - z)));
  });
}

/// Clips like openvdb::tools::clip(), which does not compile as C++20: other voxels become inactive
/// background.
openvdb::FloatGrid::Ptr clip(const openvdb::FloatGrid::Ptr& grid, int reach,
                             const std::function<bool(const Coord&)>& keep) {
  const openvdb::FloatGrid::Ptr clipped = grid->deepCopy();
  for (const Coord& at : openvdb::CoordBBox(Coord(-reach), Coord(reach)))
    if (!keep(at)) clipped->tree().setValueOff(at, grid->background());
  return clipped;
}

validation::MeshReport counts_of(const PolygonMesh& mesh) {
  RunContext context;
  return validation::check_mesh(to_mesh_file(mesh), kCounts, context);
}

/// Returns the points of edges with one polygon.
std::vector<Eigen::Vector3d> boundary_points(const PolygonMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  const auto add = [&](const auto& polygon) {
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const std::uint32_t a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      ++uses[{std::min(a, b), std::max(a, b)}];
    }
  };
  for (const Triangle& triangle : mesh.triangles) add(triangle);
  for (const Quad& quad : mesh.quads) add(quad);
  std::vector<Eigen::Vector3d> points;
  for (const auto& [edge, count] : uses)
    if (count == 1) points.insert(points.end(), {mesh.world(edge.first), mesh.world(edge.second)});
  return points;
}

std::vector<Extractor> table() {
  const auto ours = our_extractors();
  std::vector<Extractor> all(ours.begin(), ours.end());
  all.push_back(find_variant(reference_extractors(), "openvdb"));
  return all;
}

/// Returns 12³ samples under a turned map with scales that differ by axis: a slab, a wedge, a rod or a ball
/// that leaves the data obliquely, or the same with noise. Values are greater inside.
openvdb::FloatGrid::Ptr oblique_cut(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  const auto vector = [&] { return Eigen::Vector3d(share(random), share(random), share(random)); };
  const Eigen::Vector3d n = vector().normalized(), m = vector().normalized(),
                        centre = Eigen::Vector3d::Constant(5.5) + 5.0 * vector();
  const double size = 3.0 + 1.5 * share(random), noise = seed % 3 == 0 ? 1.0 : 0.0;
  const auto grid = dense(Coord(0), Coord(11), -100.0f, [&](int x, int y, int z) {
    const Eigen::Vector3d p = Eigen::Vector3d(x, y, z) - centre;
    const double slab = size - std::abs(n.dot(p)), wedge = std::min(n.dot(p), m.dot(p)),
                 rod = size - n.cross(p).norm(), ball = size + 1.0 - p.norm();
    const double inside = seed % 4 == 0 ? slab : seed % 4 == 1 ? wedge : seed % 4 == 2 ? rod : ball;
    return static_cast<float>(std::max(inside + noise * share(random), -99.0));
  });
  const Eigen::Vector3d scales(1.3, share(random) < 0 ? -0.7 : 0.7, 2.1);
  const Eigen::Matrix3d m3 =
      Eigen::AngleAxisd(3.0 * share(random), vector().normalized()) * scales.asDiagonal();
  grid->setTransform(openvdb::math::Transform::createLinearTransform(openvdb::math::Mat4d(  // of rows
      m3(0, 0), m3(1, 0), m3(2, 0), 0.0, m3(0, 1), m3(1, 1), m3(2, 1), 0.0, m3(0, 2), m3(1, 2), m3(2, 2), 0.0,
      40.0, -30.0, 20.0, 1.0)));
  return grid;
}

/// Expects the caps of oblique cuts to be in or below their planes, and the guarantees of the extractor.
void expect_no_vertex_beyond_caps(const Extractor& extractor, std::uint32_t cuts) {
  RunContext context;
  std::size_t ended = 0;
  for (std::uint32_t seed = 0; seed < cuts; ++seed) {
    SCOPED_TRACE(extractor.name + ", cut " + std::to_string(seed));
    const openvdb::FloatGrid::Ptr grid = oblique_cut(seed);
    const EndedMesh closed =
        test_methods::extract_all(extractor, make_level_set(grid), 0.0, Ends::closed, context);
    ended += closed.ends.any();
    double farthest = 0.0;  // from the middle, along any axis
    for (std::size_t i = 0; i < closed.mesh.points.size(); ++i) {
      const Eigen::Vector3d p = closed.mesh.world(i);
      const openvdb::Vec3d index = grid->worldToIndex(openvdb::Vec3d(p.x(), p.y(), p.z()));
      for (int axis = 0; axis < 3; ++axis) farthest = std::max(farthest, std::abs(index[axis] - 5.5));
    }
    EXPECT_LE(farthest, 6.0 + 1e-4);
    test_methods::expect_guarantees(extractor.promises, to_mesh_file(closed.mesh), context);
  }
  EXPECT_GT(ended, cuts * 9 / 10);
}

class VolumeEnds : public testing::TestWithParam<Extractor> {
 protected:
  EndedMesh extract(const LevelSet& volume, double isovalue, Ends ends) {
    return test_methods::extract_all(GetParam(), volume, isovalue, ends, context);
  }
  /// Largest distance of a cap below its plane, in voxels. Extractors without self-intersections do not move
  /// points onto it afterwards: their uniform mesh is near it by its normals, plus the tolerance of 0.1.
  double off() const { return test_methods::has_option(GetParam(), "tolerance") ? 0.15 : 1e-6; }
  RunContext context;
};

TEST_P(VolumeEnds, HalfFilledBoxIsClosedHalfAVoxelBeyond) {
  // The lower half in x is full: a block of 10.5 x 18 x 16 voxels.
  const LevelSet box = make_level_set(dense(Coord(0, 0, 0), Coord(20, 17, 15), -1.0f,
                                            [](int x, int, int) { return x < 10 ? 100.0f : 0.0f; }));
  const EndedMesh ended = extract(box, 50.0, Ends::closed);
  EXPECT_EQ(ended.ends.text(), "-x, -y, +y, -z, +z");
  const validation::MeshReport report = counts_of(ended.mesh);
  EXPECT_EQ(report.boundary_edges, 0);
  EXPECT_EQ(report.inconsistent_edges, 0);
  EXPECT_EQ(report.components, 1);
  // Marching cubes and means of crossings cut the edges of the block off.
  EXPECT_NEAR(report.volume, 10.0 * 18.0 * 16.0, 30.0);
  for (std::size_t i = 0; i < ended.mesh.points.size(); ++i) {
    const Eigen::Vector3d p = ended.mesh.world(i);
    EXPECT_GE(p.minCoeff(), -0.5 - 1e-6);
    EXPECT_LE(p.x(), 9.51);  // no end, but a surface of the data
    EXPECT_LE(p.y(), 17.5 + 1e-6);
    EXPECT_LE(p.z(), 15.5 + 1e-6);
  }
  EXPECT_NEAR(bounds(ended.mesh).lower.x(), -0.5, off());
  EXPECT_NEAR(bounds(ended.mesh).upper.z(), 15.5, off());
}

/// Moving points onto the caps' planes made the mesh of a CT intersect itself.
TEST_P(VolumeEnds, CapsSatisfyTheGuarantees) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> value(0.0f, 100.0f);
  const LevelSet noise = make_level_set(
      dense(Coord(0, 0, 0), Coord(11, 11, 11), -1.0f, [&](int, int, int) { return value(random); }));
  const MeshFile mesh = to_mesh_file(extract(noise, 50.0, Ends::closed).mesh);
  EXPECT_EQ(test_methods::expect_guarantees(GetParam().promises, mesh, context).boundary_edges, 0);
}

TEST_P(VolumeEnds, CutBallHasAFlatCap) {
  const LevelSet volume = make_level_set(ball(12.4));
  for (const double isovalue : {0.0, 33.3, -70.0, 0.1}) {
    const EndedMesh ended = extract(volume, isovalue, Ends::closed);
    EXPECT_EQ(ended.ends.text(), "+z");
    const validation::MeshReport report = counts_of(ended.mesh);
    EXPECT_EQ(report.boundary_edges, 0);
    EXPECT_EQ(report.components, 1);
    EXPECT_EQ(report.euler_characteristic, 2);
    std::size_t cap = 0;
    for (std::size_t i = 0; i < ended.mesh.points.size(); ++i) {
      const double z = ended.mesh.world(i).z();
      if (z <= 15.0 + 2e-3) continue;
      ++cap;
      EXPECT_LE(z, 15.5 + 1e-6);
      if (off() < 0.1) {  // rims are round where points stay where they were placed
        EXPECT_NEAR(z, 15.5, off());
      }
    }
    EXPECT_NEAR(bounds(ended.mesh).upper.z(), 15.5, off());
    EXPECT_GE(cap, 4u);  // some extractors merge flat regions
  }
}

TEST_P(VolumeEnds, NoVertexLiesBeyondTheCapsOfObliqueCuts) { expect_no_vertex_beyond_caps(GetParam(), 12); }

TEST(Slow, NoVertexLiesBeyondTheCapsOf300ObliqueCuts) {
  for (const Extractor& extractor : table()) expect_no_vertex_beyond_caps(extractor, 300);
}

TEST_P(VolumeEnds, OpenBallHasOneLoopInThePlaneOfTheLastSamples) {
  const EndedMesh ended = extract(make_level_set(ball(12.4)), 0.0, Ends::open);
  const validation::MeshReport report = counts_of(ended.mesh);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.euler_characteristic, 1);  // a disc
  EXPECT_EQ(report.non_manifold_edges, 0);
  EXPECT_EQ(report.non_manifold_vertices, 0);
  EXPECT_EQ(report.inconsistent_edges, 0);
  EXPECT_EQ(report.isolated_points, 0);
  const std::vector<Eigen::Vector3d> loop = boundary_points(ended.mesh);
  EXPECT_EQ(loop.size(), 2 * std::size_t(report.boundary_edges));
  EXPECT_GT(report.boundary_edges, 20);
  const double radius = std::sqrt(6.3 * 6.3 - 2.6 * 2.6);
  for (const Eigen::Vector3d& p : loop) {
    EXPECT_NEAR(p.z(), 15.0, 1e-6);
    EXPECT_NEAR(std::hypot(p.x() - 10.0, p.y() - 9.0), radius, 0.35);
  }
  for (std::size_t i = 0; i < ended.mesh.points.size(); ++i) EXPECT_LE(ended.mesh.world(i).z(), 15.0 + 1e-6);
}

TEST_P(VolumeEnds, TurnedMirroredAndFarAway) {
  const openvdb::FloatGrid::Ptr grid = ball(12.4);
  const openvdb::math::Mat4d matrix(0.0, 2.0, 0.0, 0.0, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 1000.0,
                                    -2000.0, 500.0,
                                    1.0);  // of rows; mirrors
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  const EndedMesh closed = extract(make_level_set(grid), 0.0, Ends::closed);
  const validation::MeshReport report = counts_of(closed.mesh);
  EXPECT_EQ(report.boundary_edges, 0);
  EXPECT_GT(report.volume, 0.0);  // counter-clockwise seen from outside
  EXPECT_NEAR(bounds(closed.mesh).upper.z(), 500 + 3 * 15.5, 1e-4 + 3 * off());
  for (const Eigen::Vector3d& p : boundary_points(extract(make_level_set(grid), 0.0, Ends::open).mesh))
    EXPECT_NEAR(p.z(), 500 + 3 * 15.0, 1e-4);
}

TEST_P(VolumeEnds, ClippedLevelSet) {
  const openvdb::FloatGrid::Ptr sphere = sphere_band(10.0f, 0.5f, 3.0f);
  const openvdb::FloatGrid::Ptr clipped = clip(sphere, 26, [](const Coord& at) { return at.y() <= 6; });
  const int last = clipped->evalActiveVoxelBoundingBox().max().y();
  const EndedMesh closed = extract(make_level_set(clipped), 0.0, Ends::closed);
  EXPECT_EQ(closed.ends.text(), "+y");
  EXPECT_TRUE(closed.ends.in_a_box);
  const validation::MeshReport report = counts_of(closed.mesh);
  EXPECT_EQ(report.boundary_edges, 0);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.euler_characteristic, 2);
  const double plane = 0.5 * (last + 0.5);
  EXPECT_NEAR(bounds(closed.mesh).upper.y(), plane, off());
  // A ball of radius 10 below the plane.
  const double height = 10.0 + plane, exact = M_PI * height * height * (30.0 - height) / 3.0;
  EXPECT_NEAR(report.volume, exact, 0.02 * exact);
  const EndedMesh open = extract(make_level_set(clipped), 0.0, Ends::open);
  EXPECT_EQ(counts_of(open.mesh).euler_characteristic, 1);
  for (const Eigen::Vector3d& p : boundary_points(open.mesh)) EXPECT_NEAR(p.y(), 0.5 * last, 1e-6);
}

TEST_P(VolumeEnds, LevelSetClippedByAMaskIsClosedButCannotBeOpened) {
  const openvdb::FloatGrid::Ptr sphere = sphere_band(10.0f, 0.5f, 3.0f);
  const openvdb::FloatGrid::Ptr clipped =
      clip(sphere, 26, [](const Coord& at) { return (at - Coord(16, 2, 4)).asVec3d().length() < 12.0; });
  const EndedMesh closed = extract(make_level_set(clipped), 0.0, Ends::closed);
  EXPECT_FALSE(closed.ends.in_a_box);
  EXPECT_EQ(counts_of(closed.mesh).boundary_edges, 0);
  EXPECT_THROW(extract(make_level_set(clipped), 0.0, Ends::open), Error);
}

TEST_P(VolumeEnds, SameBytesEachTime) {
  const LevelSet volume = make_level_set(ball(12.4));
  for (const Ends ends : {Ends::closed, Ends::open})
    EXPECT_TRUE(extract(volume, 1.0, ends).mesh == extract(volume, 1.0, ends).mesh);
}

INSTANTIATE_TEST_SUITE_P(All, VolumeEnds, testing::ValuesIn(table()), test_methods::test_name);

TEST(CloseEnds, LeavesVolumesWithoutEndsAlone) {
  RunContext context;
  const auto expect_untouched = [&](const LevelSet& volume, double isovalue) {
    const ClosedVolume closed = close_ends(volume, isovalue, context);
    EXPECT_FALSE(closed.ends.any());
    EXPECT_EQ(closed.volume.grid().grid, volume.grid().grid);
  };
  for (const float width : {0.6f, 1.0f, 1.5f, 3.0f, 8.0f})
    for (const double isovalue : {-0.2, 0.0, 0.2}) {
      const openvdb::FloatGrid::Ptr sphere = sphere_band(5.0f, 0.5f, width);
      expect_untouched(make_level_set(sphere), isovalue * width);
    }
  expect_untouched(make_level_set(ball(7.0)), 0.0);  // it does not reach the box
  const openvdb::FloatGrid::Ptr fog = sphere_band(5.0f, 0.5f, 3.0f);
  openvdb::tools::sdfToFogVolume(*fog);
  expect_untouched(make_level_set(fog), 0.1);
  expect_untouched(make_level_set(openvdb::FloatGrid::create(1.0f)), 0.0);
}

TEST(CloseEnds, NoSampleOfTheDataChanges) {
  RunContext context;
  const openvdb::FloatGrid::Ptr grid = ball(12.4);
  const ClosedVolume closed = close_ends(make_level_set(grid), 0.0, context);
  std::size_t changed = 0;
  for (auto it = closed.volume.grid().grid->cbeginValueOn(); it; ++it) {
    if (it.getCoord().z() <= 15) {
      ASSERT_EQ(*it, grid->tree().getValue(it.getCoord()));
    } else {
      ++changed;
      ASSERT_EQ(it.getCoord().z(), 16);
      ASSERT_EQ(*it, -grid->tree().getValue(it.getCoord().offsetBy(0, 0, -1)));
    }
  }
  EXPECT_GT(changed, 50u);
}

}  // namespace volume_ends_test
}  // namespace hermesh
