#include "algorithms/voxelization/closed_polygons.h"

#include <algorithm>
#include <string>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/hermite/polygon_parts.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/lattice/sample_side.h"
#include "algorithms/voxelization/inside/boundary_distances.h"

namespace hermesh {
namespace {

/// Distance from a box within which triangles are filed with others that matter to it, in voxels beyond the
/// reach: all of a bin are then known, so that distances are rounded alike (triangle_bins.h).
constexpr double kWholeBins = 16.0;

/// Returns the signs of the samples of a block's last layer along `axis`, packed as SignLeaf::beyond.
std::uint64_t last_layer(const BlockMask& inside, int axis) {
  if (axis == 0) return inside[7];
  BlockMask shifted = inside;
  for (std::uint64_t& word : shifted) word >>= axis == 1 ? 56 : 7;
  return first_layer(shifted, axis);
}

/// Returns a part of a mesh with its own points, in the order of the triangles.
PolygonMesh part_of(const PolygonMesh& mesh, std::span<const Triangle> triangles,
                    std::span<const std::uint32_t> wanted) {
  PolygonMesh part;
  part.origin = mesh.origin;
  std::vector<std::uint32_t> used;
  for (const std::uint32_t t : wanted) used.insert(used.end(), triangles[t].begin(), triangles[t].end());
  std::ranges::sort(used);
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (const std::uint32_t p : used) part.points.push_back(mesh.points[p]);
  for (const std::uint32_t t : wanted) {
    Triangle& own = part.triangles.emplace_back(triangles[t]);
    for (std::uint32_t& p : own)
      p = static_cast<std::uint32_t>(std::ranges::lower_bound(used, p) - used.begin());
  }
  return part;
}

/// The signed band of a part as Hermite data.
class BandCrossings {
 public:
  BandCrossings(const Band& band, const BlockTable& table, const Signs& signs)
      : band_(band),
        table_(table),
        signs_(signs),
        least_(static_cast<float>(kLeastDepth * band.voxel_size)) {}

  /// Fills the leaves, ascending, and the crossings, those of linear interpolation without a normal.
  void fill(FloatHermite& hermite, RunContext& context) const {
    const std::size_t n = band_.blocks.size();
    std::vector<SignLeaf> leaves(n);
    std::vector<std::uint8_t> crossed(n, 0);
    parallel_blocks(n, context, [&](std::size_t i) {
      leaves[i] = leaf(i);
      for (const BlockMask& edges : crossing_edges(leaves[i])) crossed[i] = crossed[i] || any(edges);
    });
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < n; ++i)
      if (crossed[i]) order.push_back(i);
    std::ranges::sort(order, {}, [&](std::uint32_t i) { return band_.blocks[i]; });
    hermite.leaves.resize(order.size());
    std::vector<std::uint64_t> first(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      hermite.leaves[i] = leaves[order[i]];
      for (const BlockMask& edges : crossing_edges(hermite.leaves[i])) first[i] += count(edges);
    }
    hermite.crossings.resize(exclusive_scan(first, "edge crossings"));
    parallel_blocks(order.size(), context, [&](std::size_t i) {
      SignLeaf& leaf = hermite.leaves[i];
      leaf.first = static_cast<std::uint32_t>(first[i]);
      EdgeCrossing* next = hermite.crossings.data() + first[i];
      const std::array<BlockMask, 3> edges = crossing_edges(leaf);
      for (int axis = 0; axis < 3; ++axis)
        for_each_bit(edges[axis], [&](int sample) { *next++ = crossing(order[i], sample, axis); });
    });
  }

 private:
  std::uint32_t above(std::size_t block, int axis) const {
    BlockAt at = band_.blocks[block];
    ++at[static_cast<std::size_t>(axis)];
    return table_.find(at);
  }
  SignLeaf leaf(std::size_t block) const {
    SignLeaf leaf{.lower = {}, .first = 0, .inside = signs_.inside[block], .beyond = {}};
    for (int axis = 0; axis < 3; ++axis) {
      leaf.lower[axis] = 8 * band_.blocks[block][static_cast<std::size_t>(axis)];
      // No edge into a block without a triangle nearby is crossed.
      const std::uint32_t next = above(block, axis);
      leaf.beyond[axis] =
          next == BlockTable::kNone ? last_layer(leaf.inside, axis) : first_layer(signs_.inside[next], axis);
    }
    return leaf;
  }
  float value(std::uint32_t block, int sample) const {
    const float distance = band_.leaves[block] ? band_.leaves[block]->buffer().data()[sample]
                                               : static_cast<float>(kPartBand * band_.voxel_size);
    return test(signs_.inside[block], sample) ? 0.0f - std::max(distance, least_) : distance;
  }
  EdgeCrossing crossing(std::uint32_t block, int sample, int axis) const {
    const int step = axis == 0 ? 64 : axis == 1 ? 8 : 1;
    const bool leaves = (sample / step) % 8 == 7;
    const float from = value(block, sample),
                to = leaves ? value(above(block, axis), sample - 7 * step) : value(block, sample + step);
    EdgeCrossing result{};
    result.offset = from / (from - to);  // as sample_level_set() does
    result.normal[axis] = from < 0 ? 1.0f : -1.0f;
    return result;
  }

  const Band& band_;
  const BlockTable& table_;
  const Signs& signs_;
  const float least_;  ///< distance of a sample inside that lies on the surface
};

double checked_voxel_size(const PolygonMesh& mesh, double voxel_size) {
  // The corners of the box pass the same checks as the polygons, but need no memory.
  PolygonMesh corners;
  if (const Bounds box = bounds(mesh); !box.empty()) {
    corners.points = {(box.lower - mesh.origin).cast<float>(), (box.upper - mesh.origin).cast<float>()};
    corners.triangles = {{0, 0, 0}, {1, 1, 1}};
  }
  corners.origin = mesh.origin;
  check_voxelization_fits(corners, voxel_size, kPartBand, kPartBand);
  return voxel_size;
}

SampleBox checked_extent(const PolygonMesh& mesh, double voxel_size, const OrientedWinding& winding) {
  const Orientation& orientation = winding.orientation();
  if (const std::size_t open = orientation.boundary_edges + orientation.non_manifold_edges; open > 0)
    throw Error(
        "the polygons are not closed: " + std::to_string(orientation.boundary_edges) +
        " edges have one face and " + std::to_string(orientation.non_manifold_edges) +
        " more than two; tiles need closed polygons, so repair them, or make them closed with 'hermesh "
        "remesh' at a lower resolution without --tiles");
  if (!winding.usable()) throw Error(explanation(orientation.verdict));
  return extent_of(mesh, voxel_size);
}

}  // namespace

ClosedPolygons::ClosedPolygons(const PolygonMesh& mesh, double voxel_size)
    : mesh_(mesh),
      voxel_size_(checked_voxel_size(mesh, voxel_size)),
      triangles_(triangulated(mesh)),
      winding_(IndexSoup(mesh, voxel_size)),
      extent_(checked_extent(mesh, voxel_size, winding_)),
      outline_(outline_of(mesh.origin, voxel_size, extent_)),
      placement_(placement_of(outline_)),
      inside_out_(are_inside_out(mesh, placement_)) {}

std::vector<std::uint32_t> ClosedPolygons::triangles_near(const SampleBox& box) const {
  const double margin = kPartBand + kWholeBins;
  const Eigen::Vector3d wider = Eigen::Vector3d::Constant(margin);
  const Bounds near{(box.lower.cast<double>() - wider) * voxel_size_,
                    (box.upper.cast<double>() + wider) * voxel_size_};
  std::vector<std::uint32_t> found;
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    Bounds own;
    for (const std::uint32_t p : triangles_[t]) own.add(mesh_.points[p].cast<double>());
    if (own.overlaps(near)) found.push_back(t);
  }
  return found;
}

FloatHermite ClosedPolygons::hermite(const SampleBox& box, RunContext& context) const {
  FloatHermite result;
  result.placement = placement_;
  const PolygonMesh part = part_of(mesh_, triangles_, triangles_near(box));
  if (part.triangles.empty()) return result;
  const BandWork work{.reach = kPartBand, .voxel_size = voxel_size_};
  const IndexSoup soup(part, voxel_size_);
  TriangleBins bins(soup, work.reach, context,
                    {box.lower / 8, box.upper / 8 - Eigen::Vector3i::Ones()});  // both multiples of 8
  // A block's distances, and as much again for its signs and crossings.
  check_fits_memory(2.0 * 2048.0 * double(bins.blocks().size()), "A tile");
  Band band;
  {
    const Stage stage(context, "distances");
    band = compute_band(soup, bins, work, context);
  }
  {
    const Stage stage(context, "signs");
    const Regions regions = find_regions(bins.blocks(), band.crossed, context);
    const Signs signs =
        winding_signs(winding_.number(), bins.blocks(), band, regions, false, work.reach, context);
    leave_out_interior_faces(soup, bins, signs, work, band, context, &winding_.number());
    BandCrossings(band, bins.blocks(), signs).fill(result, context);
  }
  take_polygons(result, part, inside_out_, context, nullptr);
  return result;
}

}  // namespace hermesh
