#include "algorithms/voxelization/inside/signs.h"

#include <Eigen/Geometry>
#include <optional>

#include "algorithms/core/parallel.h"
#include "algorithms/lattice/sample_side.h"
#include "algorithms/voxelization/inside/enclosed_regions.h"

namespace hermesh {
namespace {

/// The ends of a crossed edge, both of which the flood reached.
using OpenEdge = std::array<Eigen::Vector3d, 2>;

/// Counts of the block's edges that are crossed, and of those of them with both ends outside. Edges to
/// another block are left out: a sample of the block's edges is enough to detect a leak.
struct CrossedEdges {
  int all = 0, open = 0;
  OpenEdge example;  ///< the first open edge
};

CrossedEdges crossed_edges(const Band& band, std::size_t block, const BlockMask& inside) {
  CrossedEdges result;
  for (int axis = 0; axis < 3; ++axis) {
    const BlockMask crossed = std::to_array(band.crossed[block].word[axis]) &
                              upper_neighbours(kAllInside, kAllOutside, axis),
                    open = crossed & ~inside & ~upper_neighbours(inside, kAllOutside, axis);
    result.all += count(crossed);
    if (result.open == 0 && any(open)) {
      const auto x = std::ranges::find_if(open, [](std::uint64_t word) { return word != 0; }) - open.begin();
      Eigen::Vector3d& lower = result.example[0];
      lower = side_place(voxel_in(band.blocks[block], int(64 * x) + std::countr_zero(open[std::size_t(x)])));
      result.example[1] = lower + Eigen::Vector3d::Unit(axis);
    }
    result.open += count(open);
  }
  return result;
}

/// The result of the flood.
struct Flood {
  double share = 0;             ///< of the crossed edges that have an end inside
  std::vector<OpenEdge> leaks;  ///< one open edge of every block in which nearly all are open
};

/// Counts the open edges block by block. Nearly all edges of a block are open where the flood leaked in, and
/// at a plate thinner than a voxel. Single open edges are at thin features and are ignored.
Flood check_flood(const Band& band, const std::vector<BlockMask>& inside, const RunContext& context) {
  constexpr int kEnough = 12;
  std::vector<CrossedEdges> edges(band.blocks.size());
  parallel_blocks(edges.size(), context,
                  [&](std::size_t i) { edges[i] = crossed_edges(band, i, inside[i]); });
  Flood flood;
  double all = 0, closed = 0;
  for (const CrossedEdges& e : edges) {
    all += e.all;
    closed += e.all - e.open;
    if (e.open >= kEnough && 4 * e.open >= 3 * e.all) flood.leaks.push_back(e.example);
  }
  flood.share = all > 0 ? closed / all : 0.0;
  return flood;
}

/// Returns true if the flood reached a space that the polygons wind around, at an even sample of the open
/// edges.
bool leaked(const std::vector<OpenEdge>& open, const WindingNumber& winding) {
  constexpr std::size_t kMost = 256;
  const std::size_t step = std::max<std::size_t>(1, open.size() / kMost);
  for (std::size_t i = 0; i < open.size(); i += step)
    for (const Eigen::Vector3d& end : open[i])
      if (winding.at(end) > 0.5) return true;
  return false;
}

/// Caps with a larger share of the polygons' area close more than the holes of a solid.
constexpr double kMostCapped = 0.015;

/// Returns the area of a triangle, voxels².
double area_of(const TriangleCorners& corners) { return 0.5 * Facet(corners).normal().norm(); }

}  // namespace

Signs find_signs(const IndexSoup& soup, SignRule rule, const TriangleBins& bins, const Band& band,
                 double reach, RunContext& context) {
  Signs signs;
  const bool is_automatic = rule == SignRule::automatic || rule == SignRule::automatic_sheets;
  Regions regions = find_regions(bins.blocks(), band.crossed, context);
  std::optional<OrientedWinding> winding;
  // Winding numbers are made when first needed: most closed meshes never need them.
  const auto wound = [&]() -> const OrientedWinding& {
    context.check();
    if (!winding) winding.emplace(soup);
    context.check();
    return *winding;
  };
  Flood flood;
  bool leaks = false;
  const auto flood_from_infinity = [&] {
    signs.inside = voxels_of(regions, [](std::uint32_t region) { return region != Regions::kOutside; });
    if (rule == SignRule::flood_fill) return;
    flood = check_flood(band, signs.inside, context);
    leaks = !flood.leaks.empty() && wound().usable() && leaked(flood.leaks, wound().number());
  };
  if (rule != SignRule::winding_number) {
    if (is_automatic) flood_from_infinity();
    // Pockets only enlarge the outside, so the flood leaks with them if it leaks without them; there may be
    // thousands.
    if (!leaks) {
      open_pockets(soup, bins, band.blocks, regions, context);
      if (is_automatic) open_cavities(soup, bins, band, wound, regions, context);
      flood_from_infinity();
    }
    if (rule == SignRule::flood_fill) return signs;
    // The flood found an inside and no block through which it might have leaked.
    if (flood.leaks.empty() && flood.share > 0) return signs;
  }
  if (!wound().usable()) {
    // Faces that cancel can still enclose something.
    if (rule == SignRule::automatic_sheets || (rule == SignRule::automatic && flood.share > 0.5))
      return signs;
    // voxelize() returns distances without signs.
    context.note(std::string("The distances have no sign: ") + explanation(wound().orientation().verdict) +
                 ".");
    signs.inside.clear();
    signs.usable = false;
    return signs;
  }
  if (is_automatic && !leaks) return signs;
  const Orientation& orientation = wound().orientation();
  // If every edge has two faces, the surface has no boundary at which a cap could begin.
  const bool open = orientation.boundary_edges + orientation.non_manifold_edges > 0;
  Signs by_number = winding_signs(wound().number(), bins.blocks(), band, regions, open, reach, context);
  double area = 0.0, capped = 0.0;
  for (std::size_t i = 0; i < soup.size(); ++i) area += area_of(soup.corners(i));
  for (const TriangleCorners& cap : by_number.caps) capped += area_of(cap);
  if (rule == SignRule::automatic_sheets && capped > kMostCapped * area) {
    context.note(
        "the polygons have holes too large to be closed, so open parts are sheets that enclose nothing");
    open_pockets(soup, bins, band.blocks, regions, context);
    flood_from_infinity();
    return signs;
  }
  if (is_automatic)
    context.note(
        "Flooding leaks in through holes of the mesh, so the signs are those of its winding numbers.");
  return by_number;
}

}  // namespace hermesh
