#include "algorithms/extraction/certified_octree/region_mesh.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_octree/loose_polygons.h"
#include "algorithms/extraction/certified_octree/polygon_stars.h"
#include "algorithms/extraction/certified_octree/region_polygon.h"
#include "algorithms/extraction/certified_octree/region_proof.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// The polygons with a cube at a corner, by block, and those of the uniform mesh elsewhere. Corners have
/// names: first the cells' vertices, as numbered in the uniform mesh, then cubes, whose names do not change
/// when others are proposed, and then vertices on fanned edges, whose names do change.
class RegionPolygons {
 public:
  RegionPolygons(const CellRegions& regions, const UniformPoints& points, const RunContext& context)
      : regions_(regions),
        cells_(regions.cells()),
        points_(points),
        first_cube_(static_cast<std::uint32_t>(cells_.point_count())),
        lone_edges_(cells_.size()),
        made_(cells_.size()),
        untested_(filled(cells_.size(), BlockMask{}, context)) {}

  /// Rebuilds the polygons of blocks in which any have changed: `changed` has the samples, by block, whose
  /// edges may have different polygons.
  void update(std::span<const BlockMask> changed, RunContext& context) {
    Stage stage(context, "connect regions");
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      if (!any(changed[b])) return;
      for (std::size_t word = 0; word < 8; ++word) untested_[b][word] |= changed[b][word];
      const auto block = static_cast<std::int32_t>(b);
      const std::array<BlockMask, 3> lone = regions_.lone_edges(block);
      // If cubes merge most of the surface, few blocks have such edges, and memory is allocated only for
      // those.
      if (any(lone[0]) || any(lone[1]) || any(lone[2]))
        lone_edges_.at(b) = lone;
      else
        lone_edges_.clear(b);
      const std::array<BlockMask, 3> edges = regions_.merged_edges(block, lone);
      made_[b] = {};
      made_[b].polygons.reserve(
          static_cast<std::size_t>(count(edges[0]) + count(edges[1]) + count(edges[2])));
      for_each_edge(b, edges, [&](const CellBlocks::Edge& edge) { make(edge, made_[b]); });
    });
  }

  const EdgeMasks& lone_edges() const { return lone_edges_; }
  std::size_t loose_count() const {
    std::size_t sum = 0;
    for (const Made& made : made_) sum += made.loose.size();
    return sum;
  }

  /// Returns the edges of loose polygons that intersect others with a cube at a corner, if either of the two
  /// is new.
  std::vector<CellBlocks::Edge> loose_that_meet(std::span<const BlockMask> changed,
                                                RunContext& context) const {
    Stage stage(context, "test loose polygons");
    const std::vector<std::uint8_t> near = two_on(changed);
    const PolygonStars stars = stars_of_loose(changed, near, context);
    return that_meet(changed, near, &stars, context, [&](std::size_t b, auto&& test) {
      for (const Polygon& polygon : made_[b].polygons)
        test(polygon.sample(), [&] { return named(polygon, &stars); });
    });
  }

  /// Returns the edges of loose polygons that intersect others of the uniform mesh, if either of the two is
  /// new since the last call.
  std::vector<CellBlocks::Edge> loose_that_meet(const EdgePolygons& fine, RunContext& context) {
    Stage stage(context, "test loose polygons");
    const LargeArray<BlockMask> changed =
        std::exchange(untested_, filled(made_.size(), BlockMask{}, context));
    return that_meet(changed, two_on(changed), nullptr, context, [&](std::size_t b, auto&& test) {
      // The triangles of a fan have one edge, and are distinguished by a count over the block.
      std::uint64_t part = 0;
      for_each_edge(b, lone_edges_[b], [&](const CellBlocks::Edge& edge) {
        const auto on_polygon = [&](auto corners) {
          Polygon polygon{name_of(edge, ++part), static_cast<int>(corners.size()), {}};
          std::ranges::transform(corners, polygon.names.begin(),
                                 [&](std::uint32_t point) { return name_of(point); });
          test(edge.sample, [&] { return named(polygon, nullptr); });
        };
        fine.polygons_of(edge, on_polygon, on_polygon);
      });
    });
  }

  /// Moves the polygons into the mesh, and leaves none here: the data of the blocks are also freed in
  /// parallel. `fine` has the polygons of lone edges.
  RegionMesh take_mesh(const EdgePolygons& fine, RunContext& context) {
    Stage stage(context, "connect regions");
    const std::size_t n = cells_.size();
    check_indices(cells_.point_count() + regions_.cube_count() + fine.fanned_edges(), "points and cubes");
    LargeArray<std::uint32_t> number_of_point(points_.slots()), number_of_cube(regions_.cube_count());
    const auto number = [&](std::uint32_t name) -> std::uint32_t& {
      return is_cube(name) ? number_of_cube[name - first_cube_]
                           : number_of_point[points_.slot(point_of(name))];
    };
    // Count, scan, fill. Vertices are numbered before any polygon is written, because its corners may be
    // those of other blocks.
    std::vector<std::uint64_t> points(n), quads(n), triangles(n);
    parallel_blocks(n, context, [&](std::size_t b) {
      for_each_point(b, fine, [&](std::uint32_t) { ++points[b]; });
      for_each_polygon(
          b, fine, [&](const Quad&) { ++quads[b]; }, [&](const Triangle&) { ++triangles[b]; });
    });
    RegionMesh mesh;
    mesh.points.resize(exclusive_scan(points, "points"));
    mesh.of_cube.resize(mesh.points.size());
    mesh.quads.resize(exclusive_scan(quads, "quads"));
    mesh.triangles.resize(exclusive_scan(triangles, "triangles"));
    parallel_blocks(n, context, [&](std::size_t b) {
      auto at = static_cast<std::uint32_t>(points[b]);
      for_each_point(b, fine, [&](std::uint32_t name) {
        number(name) = at;
        mesh.of_cube[at] = is_cube(name);
        mesh.points[at++] = place(name);
      });
    });
    parallel_blocks(n, context, [&](std::size_t b) {
      Quad* quad = mesh.quads.data() + quads[b];
      Triangle* triangle = mesh.triangles.data() + triangles[b];
      const auto numbered = [&](auto corners) {
        for (std::uint32_t& corner : corners) corner = number(corner);
        return corners;
      };
      for_each_polygon(
          b, fine, [&](const Quad& q) { *quad++ = numbered(q); },
          [&](const Triangle& t) { *triangle++ = numbered(t); });
      made_[b] = {};
    });
    return mesh;
  }

 private:
  struct Polygon {
    std::uint64_t name;  ///< determines its edge, see name_of()
    int corners;
    std::array<std::uint32_t, 4> names;
    int sample() const { return static_cast<int>(name & 511); }
    CellBlocks::Edge edge() const {
      return {static_cast<std::int32_t>(name >> 11), sample(), static_cast<int>((name >> 9) & 3)};
    }
    std::span<const std::uint32_t> corner_names() const {
      return std::span(names).first(static_cast<std::size_t>(corners));
    }
  };
  /// The polygons of a block.
  struct Made {
    std::vector<Polygon> polygons;
    std::vector<std::uint32_t> loose;  ///< indices of the loose polygons
  };

  template <class F>
  static void for_each_edge(std::size_t block, const std::array<BlockMask, 3>& edges, F&& f) {
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(edges[axis], [&](int sample) {
        f(CellBlocks::Edge{static_cast<std::int32_t>(block), sample, axis});
      });
  }

  std::uint32_t first_fan() const { return first_cube_ + static_cast<std::uint32_t>(regions_.cube_count()); }
  /// Returns the name of a region's vertex.
  std::uint32_t name_of(const Region& region) const {
    return region.merged() ? first_cube_ + regions_.number(region)
                           : cells_.point(region.block, region.cell, 0);
  }
  /// Returns the name of a vertex of the uniform mesh.
  std::uint32_t name_of(std::uint32_t point) const {
    return point < first_cube_ ? point : point - first_cube_ + first_fan();
  }
  /// Returns the name of a polygon; `part` is 0 for polygons of regions, and counts those of the uniform
  /// mesh.
  static std::uint64_t name_of(const CellBlocks::Edge& edge, std::uint64_t part) {
    return (part << 44) + (static_cast<std::uint64_t>(edge.block) << 11 |
                           static_cast<std::uint64_t>(edge.axis << 9 | edge.sample));
  }
  const Vector3d& place(std::uint32_t name) const {
    return is_cube(name) ? regions_.cube(name - first_cube_).place : points_[point_of(name)];
  }
  /// Returns the vertex of the uniform mesh with a name, which must not be that of a cube.
  std::uint32_t point_of(std::uint32_t name) const {
    return name < first_cube_ ? name : name - first_fan() + first_cube_;
  }
  bool is_cube(std::uint32_t name) const { return name >= first_cube_ && name < first_fan(); }
  /// Converts a polygon for LoosePolygons, with the corners that `stars` settles; none if that is null.
  NamedPolygon named(const Polygon& polygon, const PolygonStars* stars) const {
    NamedPolygon result{polygon.name, polygon.corners, polygon.names, {}, 0};
    for (std::size_t i = 0; i < static_cast<std::size_t>(polygon.corners); ++i) {
      const std::uint32_t name = polygon.names[i];
      result.points[i] = place(name);
      if (stars && is_cube(name) && stars->is_plain(name - first_cube_)) result.settled |= 1u << i;
    }
    return result;
  }

  /// Returns the stars of the cubes of new loose polygons. A cube's polygons are in its own block or the
  /// adjacent ones, so the blocks in `near`, which is two_on(changed), contain all of them.
  PolygonStars stars_of_loose(std::span<const BlockMask> changed, const std::vector<std::uint8_t>& near,
                              RunContext& context) const {
    PolygonStars stars(regions_.cube_count());
    parallel_blocks(made_.size(), context, [&](std::size_t b) {
      for (const std::uint32_t polygon : made_[b].loose)
        if (test(changed[b], made_[b].polygons[polygon].sample()))
          for (const std::uint32_t name : made_[b].polygons[polygon].corner_names())
            if (is_cube(name)) stars.ask(name - first_cube_);
    });
    parallel_blocks(made_.size(), context, [&](std::size_t b) {
      if (!near[b]) return;
      for (const Polygon& polygon : made_[b].polygons) {
        const auto names = polygon.corner_names();
        for (std::size_t i = 0; i < names.size(); ++i) {
          const std::uint32_t cube = names[i] - first_cube_;
          if (!is_cube(names[i]) || !stars.is_asked(cube)) continue;
          // Seen along the cube's mean normal, along which its polygons should face up.
          const Vector3d &point = place(names[i]), up = regions_.cube(cube).normal.cast<double>();
          const auto add = [&](std::size_t first, std::size_t second) {
            stars.add(cube, up, place(names[first]) - point, place(names[second]) - point);
          };
          const std::size_t n = names.size(), next = (i + 1) % n, last = (i + n - 1) % n;
          if (n == 4 && i % 2 == 0) {  // the diagonal ends here
            add(next, i ^ 2);
            add(i ^ 2, last);
          } else {
            add(next, last);
          }
        }
      }
    });
    return stars;
  }

  /// Returns the edges of loose polygons that intersect others. A loose polygon is at most one block away
  /// from its edge's, so two polygons can only intersect if their blocks are at most two apart.
  /// @param changed samples whose edges have new polygons, by block
  /// @param near two_on(changed)
  /// @param stars as for named()
  /// @param context receives the request to cancel
  /// @param others called with a block and a function, which it calls with samples of edges, and functions
  ///   for their polygons
  template <class F>
  std::vector<CellBlocks::Edge> that_meet(std::span<const BlockMask> changed,
                                          const std::vector<std::uint8_t>& near, const PolygonStars* stars,
                                          RunContext& context, F&& others) const {
    std::vector<CellBlocks::Edge> result;
    // New loose polygons against all others, and then the other loose polygons against new ones.
    for (const bool is_new : {true, false}) {
      const auto for_each_asked = [&](std::size_t b, auto&& f) {
        if (!near[b]) return;
        for (const std::uint32_t number : made_[b].loose)
          if (const Polygon& polygon = made_[b].polygons[number];
              test(changed[b], polygon.sample()) == is_new)
            f(polygon);
      };
      // Count, scan, fill: the list, and so the result, is in the order of blocks.
      std::vector<std::uint64_t> first(made_.size());
      parallel_blocks(made_.size(), context,
                      [&](std::size_t b) { for_each_asked(b, [&](const Polygon&) { ++first[b]; }); });
      LargeArray<const Polygon*> asked(exclusive_scan(first, "loose polygons"));
      if (asked.empty()) continue;
      LargeArray<NamedPolygon> polygons(asked.size());
      parallel_blocks(made_.size(), context, [&](std::size_t b) {
        for_each_asked(b, [&, at = first[b]](const Polygon& polygon) mutable {
          asked[at] = &polygon;
          polygons[at++] = named(polygon, stars);
        });
      });
      LoosePolygons loose(std::move(polygons), context);
      parallel_blocks(made_.size(), context, [&](std::size_t b) {
        if (!near[b]) return;
        // The polygons of one block are near one another, so test_against() is fast.
        thread_local std::vector<NamedPolygon> beside;
        beside.clear();
        others(b, [&](int sample, auto&& polygon) {
          if (is_new || test(changed[b], sample)) beside.push_back(polygon());
        });
        loose.test_against(beside);
      });
      for (const std::size_t i : loose.that_meet()) result.push_back(asked[i]->edge());
    }
    return result;
  }

  /// Builds the polygon of an edge: rotated so that a quad is cut from its first corner to its third, and
  /// reversed if the outside is below.
  void make(const CellBlocks::Edge& edge, Made& made) const {
    const RegionPolygon polygon = polygon_of(regions_, edge, ring_of(regions_, edge));
    if (polygon.loose) made.loose.push_back(static_cast<std::uint32_t>(made.polygons.size()));
    Polygon result{name_of(edge, 0), polygon.corners, {}};
    for (std::size_t i = 0; i < static_cast<std::size_t>(polygon.corners); ++i)
      result.names[i] = name_of(polygon.regions[(static_cast<std::size_t>(polygon.diagonal) + i) %
                                                static_cast<std::size_t>(polygon.corners)]);
    if (!polygon.outwards) std::swap(result.names[1], result.names[polygon.corners - 1]);
    made.polygons.push_back(result);
  }

  /// Calls quad(Quad) or triangle(Triangle) for the polygons of a block, by names of corners.
  template <class OnQuad, class OnTriangle>
  void for_each_polygon(std::size_t b, const EdgePolygons& fine, OnQuad&& quad, OnTriangle&& triangle) const {
    for (const Polygon& polygon : made_[b].polygons) {
      const auto& p = polygon.names;
      if (polygon.corners == 4)
        quad(Quad{p[0], p[1], p[2], p[3]});
      else
        triangle(Triangle{p[0], p[1], p[2]});
    }
    const auto named = [&](auto corners) {
      for (std::uint32_t& corner : corners) corner = name_of(corner);
      return corners;
    };
    for_each_edge(b, lone_edges_[b], [&](const CellBlocks::Edge& edge) {
      fine.polygons_of(
          edge, [&](const Quad& q) { quad(named(q)); }, [&](const Triangle& t) { triangle(named(t)); });
    });
  }

  /// Calls f(name) for the vertices of the mesh in a block: cubes, single cells, vertices on fans.
  template <class F>
  void for_each_point(std::size_t b, const EdgePolygons& fine, F&& f) const {
    const auto block = static_cast<std::int32_t>(b);
    regions_.for_each_cube(block, [&](const Region& cube) { f(name_of(cube)); });
    for_each_bit(regions_.alone(block), [&](int cell) {
      for (int sheet = 0; sheet < cells_.point_count(block, cell); ++sheet)
        f(cells_.point(block, cell, sheet));
    });
    for_each_edge(b, lone_edges_[b], [&](const CellBlocks::Edge& edge) {
      if (fine.is_fanned(edge)) f(name_of(fine.crossing_point(edge)));
    });
  }

  /// Returns a flag per block, 1 for those at most two steps from a block with any of the cells.
  std::vector<std::uint8_t> two_on(std::span<const BlockMask> cells) const {
    std::vector<std::uint8_t> result(cells.size());
    std::vector<std::size_t> last, next;
    for (std::size_t b = 0; b < cells.size(); ++b)
      if (any(cells[b])) {
        result[b] = 1;
        last.push_back(b);
      }
    // All blocks, as in the first round, when everything is new.
    if (last.size() == cells.size()) return result;
    for (int step = 0; step < 2; ++step) {
      for (const std::size_t b : last)
        for (const std::int32_t there : cells_.source(b).neighbours)
          if (there >= 0 && !std::exchange(result[there], 1)) next.push_back(static_cast<std::size_t>(there));
      last = std::exchange(next, {});
    }
    return result;
  }

  const CellRegions& regions_;
  const CellBlocks& cells_;
  const UniformPoints& points_;
  const std::uint32_t first_cube_;  ///< name
  EdgeMasks lone_edges_;            ///< edges with polygons of the uniform mesh
  std::vector<Made> made_;          ///< one for each block
  LargeArray<BlockMask> untested_;  ///< changed samples not yet tested against the uniform mesh, by block
};

/// Returns the tolerance of each vertex of the uniform mesh, including those on fanned edges, whose tolerance
/// is the least of the four cells around.
std::vector<float> tolerances_of_points(const CellBlocks& cells, const EdgePolygons& polygons,
                                        const CellTolerances& tolerance, RunContext& context) {
  std::vector<float> result(polygons.point_count());
  parallel_blocks(cells.size(), context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    for_each_bit(cells[block].active, [&](int cell) {
      for (int sheet = 0; sheet < cells.point_count(block, cell); ++sheet)
        result[cells.point(block, cell, sheet)] = tolerance.least(cells, block, cell, 1);
    });
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(polygons.fanned(block, axis), [&](int sample) {
        float least = std::numeric_limits<float>::max();
        for (const CellBlocks::Cell& cell : cells.around({block, sample, axis}).cells)
          least = std::min(least, tolerance.least(cells, cell.block, cell.cell, 1));
        result[polygons.crossing_point({block, sample, axis})] = least;
      });
  });
  return result;
}

/// Splits cubes until all guarantees hold, and builds the mesh. `connect(edges)` returns the polygons of the
/// uniform mesh, at least those of the given edges.
template <class Connect>
RegionMesh merge(const CellRegions& regions, const UniformPoints& points, RegionProof& proof,
                 Connect&& connect, RunContext& context) {
  RegionPolygons merged(regions, points, context);
  const auto call_unproven = [&](const std::vector<CellBlocks::Edge>& meeting) {
    for (const CellBlocks::Edge& edge : meeting) proof.call_unproven(edge);
    return !meeting.empty();
  };
  // Each round splits the cubes that it finds, so there are at most as many rounds as cubes. Distances are
  // proved first; only polygons that pass are tested for self-intersections, and last against the uniform
  // mesh, which may have to be built for that.
  for (std::size_t splits = 0;;) {
    splits += proof.run();
    const LargeArray<BlockMask> changed = proof.take_changed();
    merged.update(changed, context);
    if (call_unproven(merged.loose_that_meet(changed, context))) continue;
    const auto& fine = connect(merged.lone_edges());
    if (call_unproven(merged.loose_that_meet(fine, context))) continue;
    context.figure("split_regions", double(splits));
    context.figure("loose_polygons", double(merged.loose_count()));
    return merged.take_mesh(fine, context);
  }
}

}  // namespace

RegionMesh merge_regions(UniformCells& uniform, bool in_hulls, const RegionOptions& options,
                         const FilePoints& file, RunContext& context) {
  const CellBlocks& cells = uniform.cells();
  const UniformPoints& points = uniform.points();
  // Large tolerances need only the remaining parts of the uniform mesh: beyond the cubes' diagonal no
  // distance needs a proof, and below it layers prove it (region_proof.h).
  if (options.tolerance.least() > RegionLayers::kLeast) {
    const bool needs_layers =
        options.tolerance.least() <= RegionProof::kDiagonal * float(options.largest_cube);
    if (needs_layers && !in_hulls) uniform.place_all(context);
    CellRegions regions(cells, points, options, file, context);
    std::optional<RegionLayers> layers;
    if (needs_layers) layers.emplace(regions, in_hulls ? nullptr : &points, context);
    RegionProof proof(regions, layers ? &*layers : nullptr, nullptr, &uniform, context);
    // Computed again after each split, for the current lone edges.
    std::optional<EdgePolygons> fine;
    return merge(
        regions, points, proof,
        [&](const EdgeMasks& lone) -> const EdgePolygons& {
          return fine.emplace(uniform.connect(&lone, context));
        },
        context);
  }
  // Up to two voxels, a shell compares each polygon with the uniform mesh around it, so all of that is built
  // first.
  uniform.place_all(context);
  const EdgePolygons fine = uniform.connect(nullptr, context);
  CellRegions regions(cells, points, options, file, context);
  const std::vector<float> tolerance = tolerances_of_points(cells, fine, options.tolerance, context);
  const RegionShell shell = [&] {
    Stage stage(context, "prepare the proof");
    return RegionShell(regions, fine, points, tolerance, context);
  }();
  RegionProof proof(regions, nullptr, &shell, nullptr, context);
  return merge(
      regions, points, proof, [&](const EdgeMasks&) -> const EdgePolygons& { return fine; }, context);
}

}  // namespace hermesh
