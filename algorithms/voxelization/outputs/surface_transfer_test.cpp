#include "algorithms/voxelization/outputs/surface_transfer.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/voxelization/outputs/volume_outputs.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;

// ---- A mesh whose attributes have closed forms.

/// A unit sphere of latitudes and longitudes; its poles are triangles, all else quads. Every corner has its
/// own uv, so that there is no seam inside a polygon.
struct UvSphere {
  PolygonMesh mesh;
  std::vector<std::array<double, 2>> triangle_uv, quad_uv;  ///< polar and azimuth by corner
};

constexpr int kRings = 48, kSides = 96;

UvSphere uv_sphere() {
  UvSphere sphere;
  const auto add_point = [&](double polar, double azimuth) {
    sphere.mesh.points.emplace_back(float(std::sin(polar) * std::cos(azimuth)),
                                    float(std::sin(polar) * std::sin(azimuth)), float(std::cos(polar)));
  };
  add_point(0, 0);
  for (int ring = 1; ring < kRings; ++ring)
    for (int side = 0; side < kSides; ++side) add_point(kPi * ring / kRings, 2 * kPi * side / kSides);
  add_point(kPi, 0);
  const auto point = [](int ring, int side) {
    if (ring == 0) return std::uint32_t(0);
    if (ring == kRings) return std::uint32_t(1 + (kRings - 1) * kSides);
    return std::uint32_t(1 + (ring - 1) * kSides + side % kSides);
  };
  const auto uv = [](int ring, int side) { return std::array{double(ring) / kRings, double(side) / kSides}; };
  for (int ring = 0; ring < kRings; ++ring)
    for (int side = 0; side < kSides; ++side) {
      const int below = ring + 1, next = side + 1;
      if (ring == 0) {
        sphere.mesh.triangles.push_back({point(0, side), point(1, side), point(1, next)});
        sphere.triangle_uv.insert(sphere.triangle_uv.end(), {uv(0, side), uv(1, side), uv(1, next)});
      } else if (below == kRings) {
        sphere.mesh.triangles.push_back({point(ring, next), point(ring, side), point(below, side)});
        sphere.triangle_uv.insert(sphere.triangle_uv.end(),
                                  {uv(ring, next), uv(ring, side), uv(below, side)});
      } else {
        sphere.mesh.quads.push_back(
            {point(ring, side), point(below, side), point(below, next), point(ring, next)});
        sphere.quad_uv.insert(sphere.quad_uv.end(),
                              {uv(ring, side), uv(below, side), uv(below, next), uv(ring, next)});
      }
    }
  return sphere;
}

/// A colour that is a linear function of the place, so that barycentric interpolation gives it exactly.
Vector3d linear_colour(const Vector3d& p) {
  return {0.5 + 0.25 * p.x() - 0.125 * p.y(), 0.5 + 0.3 * p.z(), 0.25 + 0.1 * (p.x() + p.y() + p.z())};
}

PolygonMesh sphere_with_attributes() {
  UvSphere sphere = uv_sphere();
  PolygonMesh& mesh = sphere.mesh;
  std::vector<float> normal, colour, uv;
  for (const Eigen::Vector3f& p : mesh.points) {
    const Vector3d c = linear_colour(p.cast<double>());
    normal.insert(normal.end(), {p.x(), p.y(), p.z()});
    colour.insert(colour.end(), {float(c.x()), float(c.y()), float(c.z()), float(p.x())});
  }
  for (const auto* corners : {&sphere.triangle_uv, &sphere.quad_uv})
    for (const auto& [u, v] : *corners) uv.insert(uv.end(), {float(u), float(v)});
  std::vector<std::int32_t> material, label;
  for (std::size_t i = 0; i < mesh.triangles.size() + mesh.quads.size(); ++i)
    material.push_back(i < mesh.triangles.size() ? 16777217 : int(i % 3));  // 2^24 + 1 is no float
  for (std::size_t i = 0; i < mesh.points.size(); ++i) label.push_back(mesh.points[i].z() > 0 ? 5 : 7);
  mesh.attributes = {{"normal", AttributeDomain::point, 3, normal, {}},
                     {"colour", AttributeDomain::point, 4, colour, {}},
                     {"uv", AttributeDomain::corner, 2, uv, {}},
                     {"material", AttributeDomain::polygon, 1, material, {"wood", "iron", "glass"}},
                     {"label", AttributeDomain::point, 1, label, {}},
                     {"fog", AttributeDomain::point, 1, std::vector<float>(mesh.points.size(), 0.25f), {}}};
  return mesh;
}

VolumeOutputs make(const PolygonMesh& mesh, double voxel_size, const std::string& grids) {
  RunContext context;
  return make_volume_outputs(mesh, {.voxel_size = voxel_size}, parse_volume_request(grids), context);
}

template <class Grid>
typename Grid::Ptr find(const VolumeOutputs& outputs, const std::string& name) {
  for (const auto& grid : outputs.grids)
    if (grid->getName() == name) return openvdb::gridPtrCast<Grid>(grid);
  return nullptr;
}

TEST(SurfaceTransfer, AttributesOfASphere) {
  const PolygonMesh mesh = sphere_with_attributes();
  const VolumeOutputs outputs = make(mesh, 0.04, "sdf,closest-point,triangle-id,attributes");
  const auto closest = find<openvdb::Vec3SGrid>(outputs, "closest-point");
  const auto normal = find<openvdb::Vec3SGrid>(outputs, "normal"),
             colour = find<openvdb::Vec3SGrid>(outputs, "colour"),
             uv = find<openvdb::Vec3SGrid>(outputs, "uv");
  const auto alpha = find<openvdb::FloatGrid>(outputs, "colour-alpha");
  const auto named_fog = find<openvdb::FloatGrid>(outputs, "attribute-fog");
  const auto material = find<openvdb::Int32Grid>(outputs, "material"),
             label = find<openvdb::Int32Grid>(outputs, "label"),
             id = find<openvdb::Int32Grid>(outputs, "triangle-id");
  ASSERT_TRUE(closest && normal && colour && uv && alpha && named_fog && material && label && id);
  EXPECT_EQ(normal->getVectorType(), openvdb::VEC_COVARIANT_NORMALIZE);
  EXPECT_EQ(material->metaValue<std::string>("label_1"), "iron");
  EXPECT_EQ(material->background(), -1);
  for (auto voxel = closest->cbeginValueOn(); voxel; ++voxel) {
    const openvdb::Coord at = voxel.getCoord();
    const Vector3d foot = to_eigen(*voxel), p = to_eigen(closest->indexToWorld(at));
    const Vector3d n = to_eigen(normal->tree().getValue(at));
    ASSERT_NEAR(n.norm(), 1.0, 1e-6);
    ASSERT_LT((n - foot.normalized()).norm(), 1e-6) << at;
    ASSERT_LT((n - p.normalized()).norm(), 0.05) << at;
    ASSERT_LT((to_eigen(colour->tree().getValue(at)) - linear_colour(foot)).norm(), 1e-6) << at;
    ASSERT_NEAR(alpha->tree().getValue(at), foot.x(), 1e-6);
    ASSERT_EQ(named_fog->tree().getValue(at), 0.25f);
    const Vector3d place = to_eigen(uv->tree().getValue(at));
    ASSERT_EQ(place.z(), 0.0);
    ASSERT_NEAR(place.x(), std::acos(std::clamp(foot.normalized().z(), -1.0, 1.0)) / kPi, 0.5 / kRings) << at;
    if (std::abs(p.normalized().z()) < 0.9) {
      const double azimuth = std::atan2(foot.y(), foot.x()) / (2 * kPi);
      ASSERT_NEAR(std::remainder(place.y() - azimuth, 1.0), 0.0, 0.5 / kSides) << at;
    }
    const std::int32_t triangle = id->tree().getValue(at);
    const auto triangles = std::int32_t(mesh.triangles.size());
    const std::int32_t polygon = triangle < triangles ? triangle : triangles + (triangle - triangles) / 2;
    ASSERT_EQ(material->tree().getValue(at), polygon < triangles ? 16777217 : polygon % 3);
    if (std::abs(foot.z()) > 0.1) {
      ASSERT_EQ(label->tree().getValue(at), foot.z() > 0 ? 5 : 7) << at;
    }
  }
}

TEST(SurfaceTransfer, NormalsThatCancelGiveTheTrianglesOwn) {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.points.emplace_back(i & 1 ? 1.f : -1.f, i & 2 ? 1.f : -1.f, i & 4 ? 1.f : -1.f);
  mesh.quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  mesh.attributes = {{"normal", AttributeDomain::corner, 3, std::vector<float>(72, 0.0f), {}}};
  const auto normal = find<openvdb::Vec3SGrid>(make(mesh, 0.25, "attributes"), "normal");
  EXPECT_EQ(to_eigen(normal->tree().getValue(openvdb::Coord(5, 1, 1))), Vector3d(1, 0, 0));
  EXPECT_EQ(to_eigen(normal->tree().getValue(openvdb::Coord(1, -3, 0))), Vector3d(0, -1, 0));
}

}  // namespace
}  // namespace hermesh
