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
        fans_(cells_.size()) {}

  RegionMesh run() {
    const std::size_t n = cells_.size();
    std::vector<std::uint64_t> points(n), quads(n), triangles(n);
    parallel_blocks(n, context_, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      for_each_point(block, [&](const Region&) { ++points[b]; }, [&](std::uint32_t) { ++points[b]; },
                     [&](const RegionPolygon& polygon) { points[b] += static_cast<std::uint64_t>(1 + owned_sides(polygon)); });
      for_each_polygon(block, false, [&](const Quad&) { ++quads[b]; }, [&](const Triangle&) { ++triangles[b]; });
    });
    RegionMesh mesh;
    mesh.points.resize(exclusive_scan(points, "points"));
    mesh.quads.resize(exclusive_scan(quads, "quads"));
    mesh.triangles.resize(exclusive_scan(triangles, "triangles"));
    parallel_blocks(n, context_, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      auto at = static_cast<std::uint32_t>(points[b]);
      for_each_point(
          block,
          [&](const Region& region) {
            cube_number_[regions_.number(region)] = at;
            mesh.points[at++] = regions_.point(region);
          },
          [&](std::uint32_t point) {
            number_[point] = at;
            mesh.points[at++] = points_[point];
          },
          [&](const RegionPolygon& polygon) {
            fans_[b].push_back({key(polygon.crossing), at});
            mesh.points[at++] = polygon.middle;
            for (int i = 0; i < polygon.corners; ++i)
              if (owns(polygon, i)) mesh.points[at++] = polygon.sides[i].place;
          });
    });
    parallel_blocks(n, context_, [&](std::size_t b) {
      Quad* quad = mesh.quads.data() + quads[b];
      Triangle* triangle = mesh.triangles.data() + triangles[b];
      for_each_polygon(
          static_cast<std::int32_t>(b), true, [&](const Quad& q) { *quad++ = q; }, [&](const Triangle& t) { *triangle++ = t; });
    });
    return mesh;
  }

 private:
  /// A fan that the uniform mesh does not have: its middle's number, and behind it those of the sides' points that it owns.
  struct Fan {
    std::uint16_t key;
    std::uint32_t first;
  };
  static std::uint16_t key(const CellBlocks::Edge& edge) { return static_cast<std::uint16_t>(edge.axis << 9 | edge.sample); }

  /// Of the two polygons beside a side that is held to a point.
  bool owns(const RegionPolygon& polygon, int side) const {
    return polygon.sides[side].held && cells_.comes_first(polygon.crossing, polygon.sides[side].partner);
  }
  int owned_sides(const RegionPolygon& polygon) const {
    int sum = 0;
    for (int i = 0; i < polygon.corners; ++i) sum += owns(polygon, i);
    return sum;
  }

  /// Calls cube(Region), kept(point of the uniform mesh) and fan(RegionPolygon).
  template <class Cube, class Kept, class OnFan>
  void for_each_point(std::int32_t block, Cube&& cube, Kept&& kept, OnFan&& fan) const {
    regions_.for_each(block, cube, [&](int cell) {
      for (int sheet = 0; sheet < cells_.point_count(block, cell); ++sheet) kept(cells_.point(block, cell, sheet));
    });
    regions_.for_each_outer_edge(block, [&](const CellBlocks::Edge& edge) {
      const RegionRing ring = ring_of(regions_, edge);
      if (!ring.has_polygon()) return;
      if (!ring.any_merged) {
        if (polygons_.is_fanned(edge)) kept(polygons_.crossing_point(edge));
      } else if (const RegionPolygon polygon = *polygon_of(regions_, edge); polygon.cut.fanned) {
        fan(polygon);
      }
    });
  }

  std::uint32_t number_of(const Region& region) const {
    return region.merged() ? cube_number_[regions_.number(region)]
                           : number_[cells_.point(region.block, region.cell, 0)];
  }
  std::uint32_t middle_of(const CellBlocks::Edge& edge) const {
    return std::ranges::lower_bound(fans_[static_cast<std::size_t>(edge.block)], key(edge), {}, &Fan::key)->first;
  }
  std::uint32_t number_of_side(const RegionPolygon& polygon, int side) const {
    std::uint32_t number = middle_of(polygon.crossing);
    for (int i = 0; i <= side; ++i) number += owns(polygon, i);
    return number;
  }

  /// `numbered` is false as long as there are no numbers, and polygons are only counted.
  template <class OnQuad, class OnTriangle>
  void for_each_polygon(std::int32_t block, bool numbered, OnQuad&& quad, OnTriangle&& triangle) const {
    const auto all_numbered = [&](auto polygon) {
      if (numbered)
        for (std::uint32_t& p : polygon) p = number_[p];
      return polygon;
    };
    regions_.for_each_outer_edge(block, [&](const CellBlocks::Edge& edge) {
      const RegionRing ring = ring_of(regions_, edge);
      if (!ring.has_polygon()) return;
      if (ring.any_merged) return add(*polygon_of(regions_, edge), numbered, quad, triangle);
      polygons_.polygons_of(
          edge, [&](const Quad& q) { quad(all_numbered(q)); }, [&](const Triangle& t) { triangle(all_numbered(t)); });
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
  std::vector<std::vector<Fan>> fans_;      ///< by block, ascending
};

}  // namespace

RegionMesh merge_regions(const CellBlocks& cells, const EdgePolygons& polygons, const std::vector<Vector3d>& points,
                         std::span<const float> tolerance, const FilePoints& file, RunContext& context) {
  Regions regions(cells, points, tolerance, file, context);
  const std::size_t splits = prove_regions(regions, polygons, points, tolerance, context);
  context.figure("split_regions", double(splits));
  Stage stage(context, "connect regions");
  return Filling(regions, polygons, points, context).run();
}

}  // namespace hermesh
