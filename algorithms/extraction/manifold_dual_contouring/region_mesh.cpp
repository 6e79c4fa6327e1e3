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

/// Counts per block, then fills.
class Filling {
 public:
  Filling(const Regions& regions, const EdgePolygons& polygons, const std::vector<Vector3d>& points, RunContext& context)
      : regions_(regions),
        cells_(regions.cells()),
        polygons_(polygons),
        points_(points),
        context_(context),
        number_(polygons.point_count()),
        cube_number_(regions.cube_count()),
        made_(cells_.size()) {}

  RegionMesh run() {
    const std::size_t n = cells_.size();
    std::vector<std::uint64_t> points(n), quads(n), triangles(n);
    parallel_blocks(n, context_, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      for_each_cell_point(block, [&](const Region&) { ++points[b]; }, [&](std::uint32_t) { ++points[b]; });
      for_each_polygon(
          block, false, [&](const Quad&) { ++quads[b]; }, [&](const Triangle&) { ++triangles[b]; },
          [&](const CellBlocks::Edge& edge) { made_[b].kept.push_back(polygons_.crossing_point(edge)); },
          [&](const RegionPolygon& fan) { make_points(fan, made_[b]); });
      points[b] += made_[b].kept.size() + made_[b].places.size();
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
            cube_number_[regions_.number(region)] = at;
            mesh.points[at++] = regions_.point(region);
          },
          keep);
      for (const std::uint32_t point : made_[b].kept) keep(point);
      for (Fan& fan : made_[b].fans) fan.first += at;
      std::ranges::copy(made_[b].places, mesh.points.begin() + at);
    });
    parallel_blocks(n, context_, [&](std::size_t b) {
      Quad* quad = mesh.quads.data() + quads[b];
      Triangle* triangle = mesh.triangles.data() + triangles[b];
      for_each_polygon(
          static_cast<std::int32_t>(b), true, [&](const Quad& q) { *quad++ = q; }, [&](const Triangle& t) { *triangle++ = t; },
          [](const CellBlocks::Edge&) {}, [](const RegionPolygon&) {});
    });
    return mesh;
  }

 private:
  /// A fan that the uniform mesh does not have: its middle's number, and behind it those of the sides' points that it owns.
  struct Fan {
    std::uint16_t key;
    std::uint32_t first;  ///< among the block's, until these have numbers
  };
  /// Points on a block's edges.
  struct Made {
    std::vector<std::uint32_t> kept;  ///< those that the uniform mesh has, too
    std::vector<Fan> fans;            ///< ascending by key
    std::vector<Vector3d> places;     ///< of the fans' points
  };
  static std::uint16_t key(const CellBlocks::Edge& edge) { return static_cast<std::uint16_t>(edge.axis << 9 | edge.sample); }

  /// Of the two polygons beside a side that is held to a point.
  bool owns(const RegionPolygon& polygon, int side) const {
    return polygon.sides[side].held && cells_.comes_first(polygon.crossing, polygon.sides[side].partner);
  }
  void make_points(const RegionPolygon& fan, Made& made) const {
    made.fans.push_back({key(fan.crossing), static_cast<std::uint32_t>(made.places.size())});
    made.places.push_back(fan.middle);
    for (int i = 0; i < fan.corners; ++i)
      if (owns(fan, i)) made.places.push_back(fan.sides[i].place);
  }

  /// Calls cube(Region) and kept(point of the uniform mesh).
  template <class Cube, class Kept>
  void for_each_cell_point(std::int32_t block, Cube&& cube, Kept&& kept) const {
    regions_.for_each(block, cube, [&](int cell) {
      for (int sheet = 0; sheet < cells_.point_count(block, cell); ++sheet) kept(cells_.point(block, cell, sheet));
    });
  }

  std::uint32_t number_of(const Region& region) const {
    return region.merged() ? cube_number_[regions_.number(region)]
                           : number_[cells_.point(region.block, region.cell, 0)];
  }
  std::uint32_t middle_of(const CellBlocks::Edge& edge) const {
    return std::ranges::lower_bound(made_[static_cast<std::size_t>(edge.block)].fans, key(edge), {}, &Fan::key)->first;
  }
  std::uint32_t number_of_side(const RegionPolygon& polygon, int side) const {
    std::uint32_t number = middle_of(polygon.crossing);
    for (int i = 0; i <= side; ++i) number += owns(polygon, i);
    return number;
  }

  /// `numbered` is false as long as there are no numbers, and polygons are only counted. Calls kept_fan(edge)
  /// for the edges that are fanned as in the uniform mesh, and fan(RegionPolygon) for those that are
  /// otherwise.
  template <class OnQuad, class OnTriangle, class OnKept, class OnFan>
  void for_each_polygon(std::int32_t block, bool numbered, OnQuad&& quad, OnTriangle&& triangle,
                        OnKept&& kept_fan, OnFan&& fan) const {
    const auto all_numbered = [&](auto polygon) {
      if (numbered)
        for (std::uint32_t& p : polygon) p = number_[p];
      return polygon;
    };
    regions_.for_each_outer_edge(block, [&](const CellBlocks::Edge& edge) {
      const RegionRing ring = ring_of(regions_, edge);
      if (!ring.has_polygon()) return;
      if (ring.any_merged) {
        const RegionPolygon polygon = *polygon_of(regions_, edge, ring);
        if (polygon.cut.fanned) fan(polygon);
        return add(polygon, numbered, quad, triangle);
      }
      if (polygons_.is_fanned(edge)) kept_fan(edge);
      polygons_.polygons_of(
          edge, [&](const Quad& q) { quad(all_numbered(q)); },
          [&](const Triangle& t) { triangle(all_numbered(t)); });
    });
  }

  template <class OnQuad, class OnTriangle>
  void add(const RegionPolygon& polygon, bool numbered, OnQuad&& quad, OnTriangle&& triangle) const {
    std::array<std::uint32_t, RegionPolygon::kFirstSide + 4> numbers{};
    if (numbered) {
      for (int i = 0; i < polygon.corners; ++i) numbers[i] = number_of(polygon.regions[i]);
      if (polygon.cut.fanned) numbers[RegionPolygon::kMiddle] = middle_of(polygon.crossing);
      for (int i = 0; i < polygon.corners; ++i) {
        if (!polygon.sides[i].held) continue;
        std::uint32_t& number = numbers[RegionPolygon::kFirstSide + i];
        if (owns(polygon, i)) {
          number = number_of_side(polygon, i);
        } else {
          const RegionPolygon other = *polygon_of(regions_, polygon.sides[i].partner);
          for (int side = 0; side < other.corners; ++side)
            if (owns(other, side) && has_same_regions(polygon, i, other, side)) number = number_of_side(other, side);
        }
      }
    }
    if (polygon.corners == 4 && !polygon.cut.fanned) {
      const int d = polygon.cut.diagonal;
      Quad q = {numbers[d], numbers[d + 1], numbers[d + 2], numbers[(d + 3) % 4]};
      if (!polygon.outwards) std::swap(q[1], q[3]);
      quad(q);
      return;
    }
    polygon.for_each_triangle([&](int a, int b, int c) { triangle({numbers[a], numbers[b], numbers[c]}); });
  }

  const Regions& regions_;
  const CellBlocks& cells_;
  const EdgePolygons& polygons_;
  const std::vector<Vector3d>& points_;
  RunContext& context_;
  std::vector<std::uint32_t> number_;       ///< by the uniform mesh's point
  std::vector<std::uint32_t> cube_number_;  ///< by cube
  std::vector<Made> made_;                  ///< by block
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
