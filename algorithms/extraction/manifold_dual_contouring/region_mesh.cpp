#include "algorithms/extraction/manifold_dual_contouring/region_mesh.h"

#include <algorithm>
#include <array>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/region_polygon.h"
#include "algorithms/extraction/manifold_dual_contouring/region_proof.h"
#include "algorithms/extraction/manifold_dual_contouring/regions.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Whether a side of one polygon lies between the two regions that a side of another one does.
bool has_same_regions(const RegionPolygon& a, int i, const RegionPolygon& b, int j) {
  const Region &a0 = a.regions[i], &a1 = a.regions[a.next(i)], &b0 = b.regions[j], &b1 = b.regions[b.next(j)];
  return (a0 == b0 && a1 == b1) || (a0 == b1 && a1 == b0);
}

/// Makes the polygons block by block, with names instead of numbers, and numbers them when all points are
/// known.
class Filling {
 public:
  Filling(const Regions& regions, const EdgePolygons& polygons, const std::vector<Vector3d>& points,
          RunContext& context)
      : regions_(regions),
        cells_(regions.cells()),
        polygons_(polygons),
        points_(points),
        context_(context),
        first_cube_(static_cast<std::uint32_t>(polygons.point_count())),
        number_(polygons.point_count() + regions.cube_count()),
        made_(cells_.size()) {
    check_indices(number_.size(), "points and cubes");
  }

  RegionMesh run() {
    const std::size_t n = cells_.size();
    std::vector<std::uint64_t> points(n), quads(n), triangles(n);
    parallel_blocks(n, context_, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      Made& made = made_[b];
      for_each_cell_point(block, [&](const Region&) { ++points[b]; }, [&](std::uint32_t) { ++points[b]; });
      regions_.for_each_outer_edge(block, [&](const CellBlocks::Edge& edge) { make(edge, made); });
      points[b] += made.kept.size() + made.places.size();
      quads[b] = made.quads.size();
      triangles[b] = made.triangles.size() + made.fan_triangles;
    });
    RegionMesh mesh;
    mesh.points.resize(exclusive_scan(points, "points"));
    mesh.quads.resize(exclusive_scan(quads, "quads"));
    mesh.triangles.resize(exclusive_scan(triangles, "triangles"));
    parallel_blocks(n, context_, [&](std::size_t b) {
      auto at = static_cast<std::uint32_t>(points[b]);
      const auto keep = [&](std::uint32_t point) {
        number_[point] = at;
        mesh.points[at++] = points_[point];
      };
      for_each_cell_point(
          static_cast<std::int32_t>(b),
          [&](const Region& region) {
            number_[name_of(region)] = at;
            mesh.points[at++] = regions_.point(region);
          },
          keep);
      for (const std::uint32_t point : made_[b].kept) keep(point);
      for (Fan& fan : made_[b].fans) fan.first += at;
      std::ranges::copy(made_[b].places, mesh.points.begin() + at);
    });
    parallel_blocks(n, context_, [&](std::size_t b) {
      const Made& made = made_[b];
      const auto numbered = [&](auto polygon) {
        for (std::uint32_t& corner : polygon) corner = number_[corner];
        return polygon;
      };
      std::ranges::transform(made.quads, mesh.quads.data() + quads[b], numbered);
      Triangle* triangle = mesh.triangles.data() + triangles[b];
      triangle = std::ranges::transform(made.triangles, triangle, numbered).out;
      for (const Fan& fan : made.fans)
        number_fan(*polygon_of(regions_, edge_of(static_cast<std::int32_t>(b), fan.key)),
                   [&](const Triangle& t) { *triangle++ = t; });
    });
    return mesh;
  }

 private:
  /// A fan that the uniform mesh does not have: its middle's number, and behind it those of the sides' points that it owns.
  struct Fan {
    std::uint16_t key;
    std::uint32_t first;  ///< among the block's, until these have numbers
  };
  /// Of a block.
  struct Made {
    std::vector<Quad> quads;  ///< of names: a point's number in the uniform mesh, or first_cube_ and a cube's
    std::vector<Triangle> triangles;  ///< but for those of fans
    std::vector<std::uint32_t> kept;  ///< points on edges that the uniform mesh has, too
    std::vector<Fan> fans;            ///< ascending by key
    std::vector<Vector3d> places;     ///< of the fans' points
    std::size_t fan_triangles = 0;
  };
  static std::uint16_t key_of(const CellBlocks::Edge& edge) {
    return static_cast<std::uint16_t>(edge.axis << 9 | edge.sample);
  }
  static CellBlocks::Edge edge_of(std::int32_t block, std::uint16_t key) {
    return {block, key & 511, key >> 9};
  }
  std::uint32_t name_of(const Region& region) const {
    return region.merged() ? first_cube_ + regions_.number(region)
                           : cells_.point(region.block, region.cell, 0);
  }

  void make(const CellBlocks::Edge& edge, Made& made) const {
    const RegionRing ring = ring_of(regions_, edge);
    if (!ring.has_polygon()) return;
    if (!ring.any_merged) {
      if (polygons_.is_fanned(edge)) made.kept.push_back(polygons_.crossing_point(edge));
      polygons_.polygons_of(
          edge, [&](const Quad& q) { made.quads.push_back(q); },
          [&](const Triangle& t) { made.triangles.push_back(t); });
      return;
    }
    const RegionPolygon polygon = *polygon_of(regions_, edge, ring);
    if (polygon.cut.fanned) return make_fan(polygon, made);
    std::array<std::uint32_t, RegionPolygon::kFirstSide + 4> names{};  // only the first four are used
    for (int i = 0; i < polygon.corners; ++i) names[i] = name_of(polygon.regions[i]);
    if (polygon.corners == 3) {
      polygon.for_each_triangle([&](int a, int b, int c) {
        made.triangles.push_back({names[a], names[b], names[c]});
      });
      return;
    }
    const int d = polygon.cut.diagonal;
    Quad q = {names[d], names[d + 1], names[d + 2], names[(d + 3) % 4]};
    if (!polygon.outwards) std::swap(q[1], q[3]);
    made.quads.push_back(q);
  }

  /// Of the two polygons beside a side that is held to a point.
  bool owns(const RegionPolygon& polygon, int side) const {
    return polygon.sides[side].held && cells_.comes_first(polygon.crossing, polygon.sides[side].partner);
  }
  void make_fan(const RegionPolygon& fan, Made& made) const {
    made.fans.push_back({key_of(fan.crossing), static_cast<std::uint32_t>(made.places.size())});
    made.places.push_back(fan.middle);
    for (int i = 0; i < fan.corners; ++i)
      if (owns(fan, i)) made.places.push_back(fan.sides[i].place);
    fan.for_each_triangle([&](int, int, int) { ++made.fan_triangles; });
  }

  /// Calls cube(Region) and kept(point of the uniform mesh).
  template <class Cube, class Kept>
  void for_each_cell_point(std::int32_t block, Cube&& cube, Kept&& kept) const {
    regions_.for_each(block, cube, [&](int cell) {
      for (int sheet = 0; sheet < cells_.point_count(block, cell); ++sheet) kept(cells_.point(block, cell, sheet));
    });
  }

  std::uint32_t middle_of(const CellBlocks::Edge& edge) const {
    return std::ranges::lower_bound(made_[static_cast<std::size_t>(edge.block)].fans, key_of(edge), {},
                                    &Fan::key)
        ->first;
  }
  std::uint32_t number_of_side(const RegionPolygon& polygon, int side) const {
    std::uint32_t number = middle_of(polygon.crossing);
    for (int i = 0; i <= side; ++i) number += owns(polygon, i);
    return number;
  }

  template <class OnTriangle>
  void number_fan(const RegionPolygon& fan, OnTriangle&& triangle) const {
    std::array<std::uint32_t, RegionPolygon::kFirstSide + 4> numbers{};
    for (int i = 0; i < fan.corners; ++i) numbers[i] = number_[name_of(fan.regions[i])];
    numbers[RegionPolygon::kMiddle] = middle_of(fan.crossing);
    for (int i = 0; i < fan.corners; ++i) {
      if (!fan.sides[i].held) continue;
      std::uint32_t& number = numbers[RegionPolygon::kFirstSide + i];
      if (owns(fan, i)) {
        number = number_of_side(fan, i);
      } else {
        const RegionPolygon other = *polygon_of(regions_, fan.sides[i].partner);
        for (int side = 0; side < other.corners; ++side)
          if (owns(other, side) && has_same_regions(fan, i, other, side))
            number = number_of_side(other, side);
      }
    }
    fan.for_each_triangle([&](int a, int b, int c) {
      triangle(Triangle{numbers[a], numbers[b], numbers[c]});
    });
  }

  const Regions& regions_;
  const CellBlocks& cells_;
  const EdgePolygons& polygons_;
  const std::vector<Vector3d>& points_;
  RunContext& context_;
  const std::uint32_t first_cube_;     ///< name of the first
  std::vector<std::uint32_t> number_;  ///< by name
  std::vector<Made> made_;             ///< by block
};

}  // namespace

RegionMesh merge_regions(const CellBlocks& cells, const EdgePolygons& polygons, const std::vector<Vector3d>& points,
                         std::span<const float> tolerance, const FilePoints& file, RunContext& context) {
  Regions regions(cells, points, tolerance, file, context);
  const std::size_t splits = prove_regions(regions, polygons, points, tolerance, context);
  context.figure("split_regions", double(splits));
  Stage stage(context, "connect regions");
  RegionMesh mesh = Filling(regions, polygons, points, context).run();
  if (mesh.points.size() <= polygons.point_count()) return mesh;
  regions.split_all();
  return Filling(regions, polygons, points, context).run();
}

}  // namespace hermesh
