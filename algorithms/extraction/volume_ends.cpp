#include "algorithms/extraction/volume_ends.h"

#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/lattice/leaf_table.h"

namespace hermesh {
namespace {

using openvdb::Coord;

constexpr BlockMask kAllSamples{~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull};

/// An edge of the grid from a sample inside to the sample beyond the data.
struct EndEdge {
  Coord beyond;
  float value;  ///< value of the sample inside
  int axis;
  int side;  ///< 0: the sample beyond lies below, 1: above

  /// Sorts edges to the same sample next to each other.
  bool operator<(const EndEdge& other) const {
    return std::tie(beyond, axis, side) < std::tie(other.beyond, other.axis, other.side);
  }
};

/// Decides which edges with a change of sign are ends of the data.
struct EndRule {
  bool level_set = false;
  openvdb::CoordBBox box;               ///< box of the data, unless it is a level set
  std::array<float, 3> largest_rise{};  ///< of distances from one sample to the next along each axis

  bool operator()(const Coord& inside, float value, float beyond, int axis, int side) const {
    if (level_set) return std::fabs(double(beyond) - double(value)) > largest_rise[axis];
    return inside[axis] == (side ? box.max() : box.min())[axis];
  }
};

/// Fills in the rule for a volume. Returns false if the volume has no ends.
bool find_rule(const openvdb::FloatGrid& grid, double isovalue, EndRule& rule) {
  rule.level_set = grid.getGridClass() == openvdb::GRID_LEVEL_SET;
  if (rule.level_set) {
    // Distances stored in half precision, or advected, rise a little more than they should.
    constexpr double kTolerance = 1.01;
    // A distance rises by at most the length of the step, in world units a column of the map.
    const IndexToWorld placement = placement_of(grid);
    for (int axis = 0; axis < 3; ++axis)
      rule.largest_rise[axis] = static_cast<float>(kTolerance * placement.linear.col(axis).norm());
    return double(grid.background()) >= isovalue;  // otherwise space beyond is inside
  }
  rule.box = active_box(grid.tree());
  if (rule.box.empty()) return false;
  // Fog that fills its box is a scan; fog that does not is sparse, and its background is empty space.
  const bool is_fog = grid.getGridClass() == openvdb::GRID_FOG_VOLUME;
  return !is_fog || grid.activeVoxelCount() == rule.box.volume();
}

class EndFinder {
 public:
  EndFinder(const LeafTable& table, const EndRule& rule) : table_(table), rule_(rule) {}

  /// Returns all edges that cross an end of the data, in the order of the samples beyond.
  std::vector<EndEdge> find(const RunContext& context) const {
    std::vector<std::vector<EndEdge>> found(table_.size());
    parallel_blocks(table_.size(), context, [&](std::size_t i) { search(i, found[i]); });
    std::vector<EndEdge> all;
    for (const auto& list : found) all.insert(all.end(), list.begin(), list.end());
    std::sort(all.begin(), all.end());
    return all;
  }

 private:
  void search(std::size_t leaf, std::vector<EndEdge>& found) const {
    std::array<BlockMask, 3> edges = table_.crossing_edges(leaf);
    for (int axis = 0; axis < 3; ++axis) {
      BlockMask& crossing = edges[std::size_t(axis)];
      // Without sign changes, the states of samples are not read.
      if (!::hermesh::any(crossing)) continue;
      const int dx = axis == 0, dy = axis == 1, dz = axis == 2;
      const BlockMask &inside = table_.inside(leaf), &active = table_.active(leaf);
      // The table has the signs of tiles, but their states are only in the tree.
      const std::int32_t there = table_.neighbour(leaf, dx, dy, dz);
      const BlockMask beyond = there >= 0 ? table_.active(static_cast<std::size_t>(there))
                               : table_.is_active_at(leaf, 8 * dx, 8 * dy, 8 * dz) ? kAllSamples
                                                                                   : BlockMask{};
      const BlockMask next_active =
          shifted_mask(dx, dy, dz, [&](int x, int y, int z) { return x + y + z == 0 ? active : beyond; });
      for (int x = 0; x < 8; ++x)  // the outer end must be inactive
        crossing[x] &= (inside[x] & ~next_active[x]) | (~inside[x] & ~active[x]);
      for_each_bit(crossing,
                   [&](int sample) { add(leaf, sample, axis, test(inside, sample) ? 1 : 0, found); });
    }
  }

  void add(std::size_t leaf, int sample, int axis, int side, std::vector<EndEdge>& found) const {
    const auto [x, y, z] = table_.lower(leaf);
    const Coord first(x + (sample >> 6), y + ((sample >> 3) & 7), z + (sample & 7));
    Coord second = first;
    ++second[axis];
    // At an end above, the sample inside comes first along the axis, below second.
    const Coord inside = side ? first : second, beyond = side ? second : first;
    const float value = table_.tree().getValue(inside);
    if (rule_(inside, value, table_.tree().getValue(beyond), axis, side))
      found.push_back({beyond, value, axis, side});
  }

  const LeafTable& table_;
  const EndRule& rule_;
};

/// Returns true if an edge along the axis that starts at `first` to `last` changes sign.
bool any_crossing(const LeafTable& table, int axis, int first, int last) {
  for (std::size_t leaf = 0; leaf < table.size(); ++leaf) {
    const int lower = table.lower(leaf)[static_cast<std::size_t>(axis)];
    if (lower > last || lower + 7 < first) continue;
    bool found = false;
    for_each_bit(table.crossing_edges(leaf)[static_cast<std::size_t>(axis)], [&](int sample) {
      const int at = lower + (sample >> (6 - 3 * axis) & 7);
      found = found || (at >= first && at <= last);
    });
    if (found) return true;
  }
  return false;
}

/// Returns the ends that the edges cross. They are in a box if each lies at the side of the active box.
DataEnds ends_of(const std::vector<EndEdge>& edges, const openvdb::CoordBBox& active,
                 const LeafTable& table) {
  DataEnds ends;
  for (const EndEdge& edge : edges) {
    const int last = edge.beyond[edge.axis] - (edge.side ? 1 : -1);
    bool& reached = ends.reached[edge.axis][edge.side];
    ends.last[edge.axis][edge.side] = last;
    reached = true;
    if (last != (edge.side ? active.max() : active.min())[edge.axis]) ends.in_a_box = false;
  }
  if (!ends.in_a_box) return ends;
  constexpr int kLast = std::numeric_limits<int>::max();
  for (int axis = 0; axis < 3; ++axis) {
    // The edges of an end cross its cap. A sample inside beyond the data has another edge farther out.
    const int below = active.min()[axis] - 1 - ends.reached[axis][0],
              above = active.max()[axis] + ends.reached[axis][1];
    // A sample represents the voxel around it, which ends half a voxel farther out.
    if (!any_crossing(table, axis, -kLast, below)) ends.caps.lower[axis] = active.min()[axis] - 0.5;
    if (!any_crossing(table, axis, above, kLast)) ends.caps.upper[axis] = active.max()[axis] + 0.5;
  }
  return ends;
}

/// Returns the value mirrored at the isovalue, which is outside for one inside.
float mirrored(float value, const InsideRule& rule) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  const double wanted = 2.0 * double(rule.isovalue) - double(value);
  const float result = static_cast<float>(std::clamp(wanted, -kLargest, kLargest));
  // Rounding may put it onto the isovalue, and the surface onto the sample.
  if (rule.signed_value(result) > 0.0f) return result;
  return std::nextafter(rule.isovalue, rule.scale * std::numeric_limits<float>::infinity());
}

/// Returns a copy of the grid, not a level set, in which the samples beyond the ends are active and mirror
/// those inside.
openvdb::FloatGrid::Ptr with_mirrored_samples(const openvdb::FloatGrid& grid,
                                              const std::vector<EndEdge>& edges, const InsideRule& rule) {
  const openvdb::FloatGrid::Ptr copy = grid.deepCopy();
  if (copy->getGridClass() == openvdb::GRID_LEVEL_SET) copy->setGridClass(openvdb::GRID_UNKNOWN);
  auto access = copy->getAccessor();
  for (std::size_t i = 0; i < edges.size();) {
    // If the data were clipped by a mask, a sample beyond may have several neighbours inside: it gets their
    // mean.
    std::size_t end = i;
    double sum = 0.0;
    for (; end < edges.size() && edges[end].beyond == edges[i].beyond; ++end)
      sum += mirrored(edges[end].value, rule);
    access.setValueOn(edges[i].beyond, static_cast<float>(sum / static_cast<double>(end - i)));
    i = end;
  }
  return copy;
}

/// Returns a copy of the grid whose inactive samples have the signs of adjacent active ones. Requires a
/// background above 0.
LevelSet with_flooded_signs(const openvdb::FloatGrid& grid) {
  const openvdb::FloatGrid::Ptr copy = grid.deepCopy();
  openvdb::tools::signedFloodFill(copy->tree());
  return make_level_set(copy);
}

/// Distance from the plane of the last samples within which a vertex counts as in it, in voxels: the error of
/// single precision far from the origin; thinner slivers are useless.
constexpr double kInPlane = 2e-3;

/// Index coordinates of a mesh's vertices.
class IndexSpace {
 public:
  IndexSpace(const PolygonMesh& mesh, const LevelSet& volume)
      : placement_(placement_of(*volume.grid().grid)),
        inverse_(placement_.linear.inverse()),
        shift_(mesh.origin - placement_.origin - placement_.offset) {}

  /// Returns the index coordinate of a vertex along one axis, by a row of the inverse map.
  double coordinate(const Eigen::Vector3f& point, int axis) const {
    return inverse_.row(axis).dot(point.cast<double>() + shift_) + placement_.base[axis];
  }
  /// Returns a vertex moved by a number of voxels along an axis of the grid, which need not be one of the
  /// world.
  Eigen::Vector3f moved(const Eigen::Vector3f& point, int axis, double by) const {
    return (point.cast<double>() + by * placement_.linear.col(axis)).cast<float>();
  }

 private:
  IndexToWorld placement_;
  Eigen::Matrix3d inverse_;
  Eigen::Vector3d shift_;
};

/// Cuts off the part of a mesh beyond one plane.
class PlaneCut {
 public:
  /// Moves the vertices within kInPlane of the plane into it.
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
    // Vertices beyond are left to drop_unused_points().
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
        add_part({q[0], q[1], q[2]});
        add_part({q[0], q[2], q[3]});
      }
    }
  }

 private:
  /// Returns true if no corner of a polygon lies beyond the plane, and not all lie in it.
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
    // A triangle cut by a plane becomes a triangle or a quad, in the same order of corners.
    std::array<std::uint32_t, 4> part{};
    std::size_t size = 0;
    bool some = false;
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t here = triangle[i], next = triangle[(i + 1) % 3];
      some |= depth_[here] > 0.0;
      if (depth_[here] >= 0.0) part[size++] = here;
      // A corner in the plane has depth 0, so no edge is cut next to it.
      if (depth_[here] * depth_[next] < 0.0) part[size++] = point_between(here, next);
    }
    if (!some) return;
    if (size == 3) mesh_.triangles.push_back({part[0], part[1], part[2]});
    if (size == 4) mesh_.quads.push_back(part);
  }

  /// Returns the vertex where the edge from a to b intersects the plane, the same for both polygons of the
  /// edge. It is computed from the lower index, so the order of the polygons does not matter.
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

bool DataEnds::any() const {
  return std::ranges::any_of(reached, [](const auto& axis) { return axis[0] || axis[1]; });
}

std::string DataEnds::text() const {
  std::string result;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      if (reached[axis][side])
        result += (result.empty() ? "" : ", ") + std::string(side ? "+" : "-") + "xyz"[axis];
  return result;
}

ClosedVolume close_ends(const LevelSet& level_set, double isovalue, RunContext& context) {
  const Stage stage(context, "ends of the data");
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  const InsideRule inside = inside_rule(grid, isovalue);
  EndRule rule;
  if (!find_rule(grid, isovalue, rule)) return {level_set, {}};
  const LeafTable table(level_set, isovalue, context);
  const std::vector<EndEdge> edges = EndFinder(table, rule).find(context);
  if (edges.empty()) return {level_set, {}};
  // Without a leaf there is no band to flood from: OpenVDB would use the sign of a node's first tile for all.
  if (rule.level_set && grid.background() > 0.0f && grid.tree().leafCount() > 0) {
    const LevelSet flooded = with_flooded_signs(grid);
    if (EndFinder(LeafTable(flooded, isovalue, context), rule).find(context).empty()) {
      context.note(
          "the level set's inactive samples had no signs (its inside was not flooded): they got those of the "
          "band");
      return {flooded, {}};
    }
  }
  const openvdb::CoordBBox active = rule.level_set ? active_box(grid.tree()) : rule.box;
  return {make_level_set(with_mirrored_samples(grid, edges, inside)), ends_of(edges, active, table)};
}

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
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      if (ends.reached[axis][side]) PlaneCut(result, space, axis, side, ends.last[axis][side]).cut();
  drop_unused_points(result);
  return result;
}

EndedMesh extract_with_ends(const Extractor& extractor, const ExtractionInput& input, Ends ends) {
  const ClosedVolume closed = close_ends(input.level_set, input.isovalue, input.context);
  const bool is_unchanged = closed.volume.grid().grid == input.level_set.grid().grid;
  EndedMesh result{extractor.extract({.level_set = closed.volume,
                                      .isovalue = input.isovalue,
                                      .source = input.source,
                                      .options = input.options,
                                      .context = input.context,
                                      .field = input.field,
                                      .hermite = is_unchanged ? input.hermite : nullptr,
                                      .written_in_single = input.written_in_single,
                                      .caps = closed.ends.caps}),
                   closed.ends};
  if (!closed.ends.any()) return result;
  if (ends == Ends::open)
    result.mesh = open_ends(result.mesh, closed.volume, closed.ends);
  else if (!extractor.promises.no_self_intersection)
    flatten_ends(result.mesh, closed.volume, closed.ends);  // may cause self-intersections
  return result;
}

}  // namespace hermesh
