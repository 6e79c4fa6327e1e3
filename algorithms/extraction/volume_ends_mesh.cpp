// What volume_ends.h does to meshes.
#include <cmath>
#include <unordered_map>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/extraction/volume_ends.h"
#include "algorithms/lattice/grid_placement.h"

namespace hermesh {
namespace {

/// How near to the plane of the last samples a point counts as in it, in voxels: that much single precision
/// may be off far from the origin, and nobody wants slivers as thin.
constexpr double kInPlane = 2e-3;

/// Index coordinates of a mesh's points.
class IndexSpace {
 public:
  IndexSpace(const PolygonMesh& mesh, const LevelSet& volume)
      : placement_(placement_of(*volume.grid().grid)),
        inverse_(placement_.linear.inverse()),
        shift_(mesh.origin - placement_.origin - placement_.offset) {}

  /// Index coordinate of the point along one axis, for which a row of the inverse map is enough.
  double coordinate(const Eigen::Vector3f& point, int axis) const {
    return inverse_.row(axis).dot(point.cast<double>() + shift_) + placement_.base[axis];
  }
  /// The point moved by so many voxels along the axis of the grid, which need not be one of the world.
  Eigen::Vector3f moved(const Eigen::Vector3f& point, int axis, double by) const {
    return (point.cast<double>() + by * placement_.linear.col(axis)).cast<float>();
  }

 private:
  IndexToWorld placement_;
  Eigen::Matrix3d inverse_;
  Eigen::Vector3d shift_;
};

/// Calls f(axis, side, last) for each end that is reached.
template <class F>
void for_each_end(const DataEnds& ends, F&& f) {
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      if (ends.reached[axis][side]) f(axis, side, ends.last[axis][side]);
}

/// Cuts off what lies beyond one plane.
class PlaneCut {
 public:
  /// Moves the points that all but lie in the plane into it.
  PlaneCut(PolygonMesh& mesh, const IndexSpace& space, int axis, int side, int last) : mesh_(mesh) {
    depth_.reserve(mesh.points.size());
    for (Eigen::Vector3f& point : mesh.points) {
      // Counted upwards along the axis, whichever side the data lie on; depths are counted towards the data.
      const double over = space.coordinate(point, axis) - last;
      const bool in_plane = std::fabs(over) < kInPlane;
      if (in_plane) point = space.moved(point, axis, -over);
      depth_.push_back(in_plane ? 0.0 : side ? -over : over);
    }
  }

  void cut() {
    std::vector<Triangle> triangles;
    LargeArray<Quad> quads;
    // Polygons are written anew, and points are only added: those beyond are left to drop_unused_points().
    triangles.swap(mesh_.triangles);
    quads.swap(mesh_.quads);
    for (const Triangle& t : triangles) {
      if (is_whole(t))
        mesh_.triangles.push_back(t);
      else
        add_part(t);
    }
    for (const Quad& q : quads) {
      if (is_whole(q)) {
        mesh_.quads.push_back(q);
      } else {
        // Cut along the diagonal between the corners 0 and 2, along which extractors mean their quads to be
        // split.
        add_part({q[0], q[1], q[2]});
        add_part({q[0], q[2], q[3]});
      }
    }
  }

 private:
  /// True for a polygon of which nothing lies beyond the plane, and not all in it.
  template <class Polygon>
  bool is_whole(const Polygon& polygon) const {
    bool some = false;
    for (const std::uint32_t corner : polygon) {
      if (depth_[corner] < 0.0) return false;
      some |= depth_[corner] > 0.0;
    }
    return some;
  }

  void add_part(const Triangle& triangle) {
    // A triangle cut by a plane leaves a triangle or a quad, in the same order of corners.
    std::array<std::uint32_t, 4> part{};
    std::size_t size = 0;
    bool some = false;
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t here = triangle[i], next = triangle[(i + 1) % 3];
      some |= depth_[here] > 0.0;
      if (depth_[here] >= 0.0) part[size++] = here;
      // A corner in the plane has depth 0, so that no edge is cut beside it.
      if (depth_[here] * depth_[next] < 0.0) part[size++] = point_between(here, next);
    }
    if (!some) return;
    if (size == 3) mesh_.triangles.push_back({part[0], part[1], part[2]});
    if (size == 4) mesh_.quads.push_back(part);
  }

  /// Number of the point where the edge from a to b meets the plane, one for both polygons of the edge. It is
  /// computed from the lower number on, so that it does not matter which polygon asks first.
  std::uint32_t point_between(std::uint32_t a, std::uint32_t b) {
    if (a > b) std::swap(a, b);
    const auto [entry, is_new] =
        cuts_.try_emplace(std::uint64_t{a} << 32 | b, static_cast<std::uint32_t>(mesh_.points.size()));
    if (is_new) {
      const double share = depth_[a] / (depth_[a] - depth_[b]);
      const Eigen::Vector3d from = mesh_.points[a].cast<double>(), to = mesh_.points[b].cast<double>();
      mesh_.points.push_back((from + share * (to - from)).cast<float>());
      depth_.push_back(0.0);
    }
    return entry->second;
  }

  PolygonMesh& mesh_;
  std::vector<double> depth_;  ///< how far each point lies below the plane, in voxels; negative beyond it
  std::unordered_map<std::uint64_t, std::uint32_t> cuts_;
};

}  // namespace

void flatten_ends(PolygonMesh& mesh, const LevelSet& closed, const DataEnds& ends) {
  const IndexSpace space(mesh, closed);
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const double plane = (side ? ends.caps.upper : ends.caps.lower)[axis];
      if (!std::isfinite(plane)) continue;
      const double least = ends.reached[axis][side] ? kInPlane - 0.5 : 0.0;
      for (Eigen::Vector3f& point : mesh.points) {
        const double at = space.coordinate(point, axis);
        if ((side ? at - plane : plane - at) > least) point = space.moved(point, axis, plane - at);
      }
    }
}

PolygonMesh open_ends(const PolygonMesh& mesh, const LevelSet& closed, const DataEnds& ends) {
  if (!ends.in_a_box)
    throw Error(
        "the volume's data end in no box, so that the surface cannot be left open there; use --ends closed");
  PolygonMesh result = mesh;
  result.attributes.clear();
  const IndexSpace space(mesh, closed);
  // One plane after the other: edges and corners of the box are cut by each of theirs.
  for_each_end(ends, [&](int axis, int side, int last) { PlaneCut(result, space, axis, side, last).cut(); });
  drop_unused_points(result);
  return result;
}

}  // namespace hermesh
