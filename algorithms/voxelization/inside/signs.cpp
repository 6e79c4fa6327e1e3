#include "algorithms/voxelization/inside/signs.h"

#include <Eigen/Geometry>
#include <optional>

#include "algorithms/core/parallel.h"
#include "algorithms/lattice/sample_side.h"
#include "algorithms/voxelization/inside/cavities.h"
#include "algorithms/voxelization/inside/oriented_winding.h"
#include "algorithms/voxelization/inside/pockets.h"
#include "algorithms/voxelization/inside/winding_signs.h"

namespace hermesh {
namespace {

/// The voxels of each block that are not connected to infinity: the inside as the flood sees it.
std::vector<BlockMask> enclosed_voxels(const Regions& regions, std::size_t blocks) {
  std::vector<BlockMask> result(blocks, BlockMask{});
  for (std::size_t i = 0; i < blocks; ++i)
    for (std::uint32_t c = regions.first[i]; c < regions.first[i + 1]; ++c)
      if (regions.components[c].region != Regions::kOutside)
        for (std::size_t x = 0; x < 8; ++x) result[i][x] |= regions.components[c].voxels[x];
  return result;
}

/// A crossed edge both of whose ends the flood reached.
struct OpenEdge {
  Eigen::Vector3d end[2];
};

/// Counts of the block's edges that are crossed, and of those of them with both ends outside. Edges that lead
/// to another block are left out: a sample of the block's edges is enough to tell a leak.
struct CrossedEdges {
  int all = 0, open = 0;
  OpenEdge example;
};

CrossedEdges crossed_edges(const Band& band, std::size_t block, const BlockMask& inside) {
  CrossedEdges result;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t x = 0; x < (axis == 0 ? 7u : 8u); ++x) {
      const std::uint64_t within = axis == 0 ? ~0ull : axis == 1 ? kBelowTopY : kBelowTopZ;
      const std::uint64_t crossed = band.crossed[block].word[axis][x] & within;
      // The upper neighbour's bit, moved to where the edge's own bit is.
      const std::uint64_t upper = axis == 0   ? inside[(x + 1) & 7]
                                  : axis == 1 ? inside[x] >> 8
                                              : inside[x] >> 1;
      const std::uint64_t open = crossed & ~inside[x] & ~upper;
      result.all += __builtin_popcountll(crossed);
      if (open && result.open == 0) {
        const int place = __builtin_ctzll(open);
        const BlockAt& at = band.blocks[block];
        Eigen::Vector3d lower =
            side_place(at[0] * 8.0 + double(x), at[1] * 8.0 + place / 8, at[2] * 8.0 + place % 8);
        result.example.end[0] = lower;
        lower[axis] += 1.0;
        result.example.end[1] = lower;
      }
      result.open += __builtin_popcountll(open);
    }
  }
  return result;
}

/// What the flood did.
struct Flood {
  double share = 0;             ///< of the crossed edges that have an end inside
  std::vector<OpenEdge> leaks;  ///< one open edge of every block in which nearly all are open
};

/// Counts the open edges block by block. Nearly all edges of a block are open where the flood leaked in, and
/// at a plate thinner than a voxel. Single open edges are at thin features and mean nothing.
Flood look_at_flood(const Band& band, const std::vector<BlockMask>& inside, const RunContext& context) {
  constexpr int kEnough = 12;
  std::vector<CrossedEdges> edges(band.blocks.size());
  parallel_blocks(edges.size(), context,
                  [&](std::size_t i) { edges[i] = crossed_edges(band, i, inside[i]); });
  Flood flood;
  double all = 0, closed = 0;
  // Each block has a place of its own above, and one thread adds up in their order.
  for (const CrossedEdges& e : edges) {
    all += e.all;
    closed += e.all - e.open;
    if (e.open >= kEnough && 4 * e.open >= 3 * e.all) flood.leaks.push_back(e.example);
  }
  flood.share = all > 0 ? closed / all : 0.0;
  return flood;
}

/// Whether the flood reached what the polygons wind around: an even sample of the open edges is asked for.
bool leaked(const std::vector<OpenEdge>& open, const WindingNumber& winding) {
  constexpr std::size_t kMost = 256;
  const std::size_t step = std::max<std::size_t>(1, open.size() / kMost);
  for (std::size_t i = 0; i < open.size(); i += step)
    for (const Eigen::Vector3d& end : open[i].end)
      if (winding.at(end) > 0.5) return true;
  return false;
}

/// Caps with a larger share of the polygons' area close more than the holes of a solid.
constexpr double kMostCapped = 0.015;

/// Area of triangles, voxels².
double area_of(const TriangleCorners& c) {
  const Eigen::Map<const Eigen::Vector3d> p(c.data()), q(c.data() + 3), r(c.data() + 6);
  return 0.5 * (q - p).cross(r - p).norm();
}
double area_of(const std::vector<TriangleCorners>& triangles) {
  double area = 0.0;
  for (const TriangleCorners& t : triangles) area += area_of(t);
  return area;
}
double area_of(const IndexSoup& soup) {
  double area = 0.0;
  for (std::size_t i = 0; i < soup.size(); ++i) area += area_of(soup.corners(i));
  return area;
}

}  // namespace

Signs find_signs(const IndexSoup& soup, SignRule rule, const TriangleBins& bins, const Band& band,
                 double reach, RunContext& context) {
  Signs signs;
  const bool is_automatic = rule == SignRule::automatic || rule == SignRule::automatic_sheets;
  Regions regions = find_regions(bins.blocks(), band.crossed, context);
  std::optional<OrientedWinding> winding;
  // Winding numbers are made when first asked for: a closed mesh never needs them.
  const auto wound = [&]() -> const OrientedWinding& {
    context.check();
    if (!winding) winding.emplace(soup);
    context.check();
    return *winding;
  };
  Flood flood;
  bool leaks = false;
  const auto flood_from_infinity = [&] {
    signs.inside = enclosed_voxels(regions, band.blocks.size());
    if (rule == SignRule::flood_fill) return;
    flood = look_at_flood(band, signs.inside, context);
    leaks = !flood.leaks.empty() && wound().usable() && leaked(flood.leaks, wound().number());
  };
  if (rule != SignRule::winding_number) {
    if (is_automatic) flood_from_infinity();
    // Pockets only make the outside larger: what leaks without them leaks with them, and there may be
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
    // Nobody gets signs that are made up: voxelize() gives distances alone.
    context.note(std::string("The distances have no sign: ") + explanation(wound().orientation().verdict) +
                 ".");
    signs.inside.clear();
    signs.usable = false;
    return signs;
  }
  if (is_automatic && !leaks) return signs;
  const Orientation& orientation = wound().orientation();
  // A surface of which every edge has two faces has no rim for a cap to begin at.
  const bool open = orientation.boundary_edges + orientation.non_manifold_edges > 0;
  Signs by_number = winding_signs(wound().number(), bins.blocks(), band, regions, open, reach, context);
  if (rule == SignRule::automatic_sheets && area_of(by_number.caps) > kMostCapped * area_of(soup)) {
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
