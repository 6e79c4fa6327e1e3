#include "algorithms/extraction/manifold_dual_contouring/region_mesh.h"

#include <algorithm>
#include <array>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/loose_polygons.h"
#include "algorithms/extraction/manifold_dual_contouring/region_polygon.h"
#include "algorithms/extraction/manifold_dual_contouring/region_proof.h"
#include "algorithms/extraction/manifold_dual_contouring/regions.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

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
      points[b] += made.kept.size();
      quads[b] = made.quads.size();
      triangles[b] = made.triangles.size();
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
    });
    parallel_blocks(n, context_, [&](std::size_t b) {
      const Made& made = made_[b];
      const auto numbered = [&](auto polygon) {
        for (std::uint32_t& corner : polygon) corner = number_[corner];
        return polygon;
      };
      std::ranges::transform(made.quads, mesh.quads.data() + quads[b], numbered);
      std::ranges::transform(made.triangles, mesh.triangles.data() + triangles[b], numbered);
    });
    for (std::size_t b = 0; b < n; ++b)
      for (LooseEdge loose : made_[b].loose) {
        loose.polygon.number += static_cast<std::uint32_t>((loose.polygon.is_quad ? quads : triangles)[b]);
        loose_.push_back(loose);
      }
    return mesh;
  }

  struct LooseEdge {
    CellBlocks::Edge edge;
    LoosePolygon polygon;
  };
  /// All there are.
  const std::vector<LooseEdge>& loose() const { return loose_; }

 private:
  /// Of a block.
  struct Made {
    std::vector<Quad> quads;  ///< of names: a point's number in the uniform mesh, or first_cube_ and a cube's
    std::vector<Triangle> triangles;
    std::vector<std::uint32_t> kept;  ///< points on edges
    std::vector<LooseEdge> loose;     ///< with numbers among the block's polygons
  };

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
    const bool is_quad = polygon.corners == 4;
    const auto number = static_cast<std::uint32_t>(is_quad ? made.quads.size() : made.triangles.size());
    if (polygon.loose) made.loose.push_back({edge, {number, is_quad}});
    std::array<std::uint32_t, 4> names{};
    for (int i = 0; i < polygon.corners; ++i) names[i] = name_of(polygon.regions[i]);
    if (!is_quad) {
      polygon.for_each_triangle([&](int a, int b, int c) {
        made.triangles.push_back({names[a], names[b], names[c]});
      });
      return;
    }
    const int d = polygon.diagonal;
    Quad q = {names[d], names[d + 1], names[d + 2], names[(d + 3) % 4]};
    if (!polygon.outwards) std::swap(q[1], q[3]);
    made.quads.push_back(q);
  }

  /// Calls cube(Region) and kept(point of the uniform mesh).
  template <class Cube, class Kept>
  void for_each_cell_point(std::int32_t block, Cube&& cube, Kept&& kept) const {
    regions_.for_each(block, cube, [&](int cell) {
      for (int sheet = 0; sheet < cells_.point_count(block, cell); ++sheet) kept(cells_.point(block, cell, sheet));
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
  std::vector<LooseEdge> loose_;
};

}  // namespace

RegionMesh merge_regions(const CellBlocks& cells, const EdgePolygons& polygons, const std::vector<Vector3d>& points,
                         std::span<const float> tolerance, const FilePoints& file, RunContext& context) {
  Regions regions(cells, points, tolerance, file, context);
  RegionProof proof = [&] {
    Stage stage(context, "prepare the proof");
    return RegionProof(regions, polygons, points, tolerance, context);
  }();
  for (std::size_t splits = 0;;) {
    splits += [&] {
      Stage stage(context, "prove regions");
      return proof.run();
    }();
    Filling filling(regions, polygons, points, context);
    RegionMesh mesh = [&] {
      Stage stage(context, "connect regions");
      return filling.run();
    }();
    Stage stage(context, "test loose polygons");
    std::vector<LoosePolygon> tested;
    for (const auto& loose : filling.loose()) tested.push_back(loose.polygon);
    const std::vector<std::size_t> meeting =
        loose_polygons_that_meet(mesh.points, mesh.quads, mesh.triangles, tested, context);
    if (meeting.empty()) {
      context.figure("split_regions", double(splits));
      context.figure("loose_polygons", double(tested.size()));
      return mesh;
    }
    for (const std::size_t i : meeting) proof.call_bold(filling.loose()[i].edge);
  }
}

}  // namespace hermesh
