#include "algorithms/extraction/volume_ends.h"

#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/lattice/leaf_table.h"

namespace hermesh {
namespace {

using openvdb::Coord;

// Signs or states of a whole tile.
constexpr BlockMask kNoSamples{};
constexpr BlockMask kAllSamples{~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull};

/// An edge of the grid from a sample inside to the sample beyond the data.
struct EndEdge {
  Coord beyond;
  float value;  ///< value of the sample inside
  int axis;
  int side;  ///< 0: the sample beyond lies below, 1: above

  /// The order by samples beyond puts all edges side by side that lead to one sample.
  bool operator<(const EndEdge& other) const {
    return std::tie(beyond, axis, side) < std::tie(other.beyond, other.axis, other.side);
  }
};

/// What makes an edge with a change of sign an end of the data.
struct EndRule {
  bool level_set = false;
  openvdb::CoordBBox box;  ///< box of the data, where it is no level set
  std::array<float, 3>
      largest_rise{};  ///< most that distances can rise from one sample to the next along each axis

  bool operator()(const Coord& inside, float value, float beyond, int axis, int side) const {
    if (level_set) return std::fabs(double(beyond) - double(value)) > largest_rise[axis];
    return inside[axis] == (side ? box.max() : box.min())[axis];
  }
};

/// Fills in the rule for a volume; false where the volume has no ends.
bool find_rule(const openvdb::FloatGrid& grid, double isovalue, EndRule& rule) {
  rule.level_set = grid.getGridClass() == openvdb::GRID_LEVEL_SET;
  if (rule.level_set) {
    // Distances that were stored in half precision, or advected, rise a little more than they should.
    constexpr double kTolerance = 1.01;
    // A distance rises by no more than the length of the step, in world units a column of the map.
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

  /// All edges that cross an end of the data, in the order of the samples beyond.
  std::vector<EndEdge> find(const RunContext& context) const {
    std::vector<std::vector<EndEdge>> found(table_.size());
    parallel_blocks(table_.size(), context, [&](std::size_t i) {
      for (int axis = 0; axis < 3; ++axis) search(i, axis, found[i]);
    });
    // Each leaf has had a list of its own; sorted, they are the same for any number of threads.
    std::vector<EndEdge> all;
    for (const auto& list : found) all.insert(all.end(), list.begin(), list.end());
    std::sort(all.begin(), all.end());
    return all;
  }

 private:
  BlockMask inside_of(std::size_t leaf, int dx, int dy, int dz) const {
    const std::int32_t there = table_.neighbour(leaf, dx, dy, dz);
    if (there >= 0) return table_.inside(static_cast<std::size_t>(there));
    return there == kUniformInside ? kAllSamples : kNoSamples;
  }
  // The table knows the signs of tiles, but not whether they are active: that takes a look at the tree.
  BlockMask active_of(std::size_t leaf, int dx, int dy, int dz) const {
    const std::int32_t there = table_.neighbour(leaf, dx, dy, dz);
    if (there >= 0) return table_.active(static_cast<std::size_t>(there));
    return table_.is_active_at(leaf, 8 * dx, 8 * dy, 8 * dz) ? kAllSamples : kNoSamples;
  }

  void search(std::size_t leaf, int axis, std::vector<EndEdge>& found) const {
    // The two signs of every edge along the axis that starts in the leaf, as bits. All edges with a change of
    // sign start in a leaf, as the table promises.
    const int dx = axis == 0, dy = axis == 1, dz = axis == 2;
    const BlockMask own[2] = {table_.inside(leaf), inside_of(leaf, dx, dy, dz)};
    const auto shifted = [&](const BlockMask& here, const BlockMask& next) {
      return shifted_mask(dx, dy, dz,
                          [&](int ax, int ay, int az) { return ax + ay + az == 0 ? here : next; });
    };
    const BlockMask next = shifted(own[0], own[1]);
    BlockMask crossing;
    for (int x = 0; x < 8; ++x) crossing[x] = own[0][x] ^ next[x];
    // The states of samples cost a look at the leaves themselves, which is spared where nothing crosses.
    if (!::hermesh::any(crossing)) return;
    const BlockMask active = table_.active(leaf);
    const BlockMask next_active = shifted(active, active_of(leaf, dx, dy, dz));
    for (int x = 0; x < 8; ++x)  // of those the outer end must be inactive
      crossing[x] &= (own[0][x] & ~next_active[x]) | (next[x] & ~active[x]);
    for_each_bit(crossing, [&](int sample) { add(leaf, sample, axis, test(own[0], sample) ? 1 : 0, found); });
  }

  void add(std::size_t leaf, int sample, int axis, int side, std::vector<EndEdge>& found) const {
    const auto [x, y, z] = table_.lower(leaf);
    const Coord first(x + (sample >> 6), y + ((sample >> 3) & 7), z + (sample & 7));
    Coord second = first;
    ++second[axis];
    // An end above has its sample inside first, along the axis, and one below has it second.
    const Coord inside = side ? first : second, beyond = side ? second : first;
    const float value = table_.tree().getValue(inside);
    if (rule_(inside, value, table_.tree().getValue(beyond), axis, side))
      found.push_back({beyond, value, axis, side});
  }

  const LeafTable& table_;
  const EndRule& rule_;
};

/// Returns whether an edge along the axis changes sign that starts at `first` to `last` along the axis.
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

/// The ends that the edges cross. They are in a box if each lies at the side of the active box.
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
  constexpr int kFarthest = std::numeric_limits<int>::max();
  for (int axis = 0; axis < 3; ++axis) {
    // The edges of an end cross its cap. A sample inside beyond the data has another edge farther on.
    const int below = active.min()[axis] - 1 - ends.reached[axis][0],
              above = active.max()[axis] + ends.reached[axis][1];
    // A sample stands for the voxel around it, which ends half a voxel farther on.
    if (!any_crossing(table, axis, -kFarthest, below)) ends.caps.lower[axis] = active.min()[axis] - 0.5;
    if (!any_crossing(table, axis, above, kFarthest)) ends.caps.upper[axis] = active.max()[axis] + 0.5;
  }
  return ends;
}

/// The value mirrored at the isovalue, which is outside for one inside.
float mirrored(float value, const InsideRule& rule) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  const double wanted = 2.0 * double(rule.isovalue) - double(value);
  const float result = static_cast<float>(std::clamp(wanted, -kLargest, kLargest));
  // Rounding may put it onto the isovalue, and the surface onto the sample.
  if (rule.signed_value(result) > 0.0f) return result;
  return std::nextafter(rule.isovalue, rule.scale * std::numeric_limits<float>::infinity());
}

/// A copy of the grid in which the samples beyond the ends are active and mirror those inside; a level set no
/// longer.
openvdb::FloatGrid::Ptr with_mirrored_samples(const openvdb::FloatGrid& grid,
                                              const std::vector<EndEdge>& edges, const InsideRule& rule) {
  const openvdb::FloatGrid::Ptr copy = grid.deepCopy();
  if (copy->getGridClass() == openvdb::GRID_LEVEL_SET) copy->setGridClass(openvdb::GRID_UNKNOWN);
  auto access = copy->getAccessor();
  for (std::size_t i = 0; i < edges.size();) {
    // A sample beyond may have several neighbours inside, where the data were clipped by a mask: it gets
    // their mean.
    std::size_t end = i;
    double sum = 0.0;
    for (; end < edges.size() && edges[end].beyond == edges[i].beyond; ++end)
      sum += mirrored(edges[end].value, rule);
    access.setValueOn(edges[i].beyond, static_cast<float>(sum / static_cast<double>(end - i)));
    i = end;
  }
  return copy;
}

/// A copy of the grid whose inactive samples have the signs of the active ones beside them.
/// The background must be above 0.
LevelSet with_flooded_signs(const openvdb::FloatGrid& grid) {
  const openvdb::FloatGrid::Ptr copy = grid.deepCopy();
  openvdb::tools::signedFloodFill(copy->tree());
  return make_level_set(copy);
}

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
  // Without a sample in a leaf there is no band to flood from: OpenVDB would take the sign of a node's first
  // tile for all.
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
    flatten_ends(result.mesh, closed.volume,
                 closed.ends);  // moves points without a look at what they might meet
  return result;
}

}  // namespace hermesh
