#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <set>

#include "algorithms/core/parallel.h"
#include "algorithms/lattice/sample_side.h"
#include "algorithms/voxelization/inside/signs.h"
#include "algorithms/voxelization/inside/winding_number.h"

namespace hermesh {
namespace {

/// All voxels of a component are evaluated if its winding number is this near ½. The number of a component
/// next to a closed surface is whole except for 0.01, so only holes are within.
constexpr float kDoubt = 0.25f;
/// Voxels whose number is this near ½, twice its error, are evaluated more finely.
constexpr float kError = 0.02f;

/// Samples this near to a triangle, in voxels, are evaluated one by one.
constexpr double kOnSurface = 1e-4;
/// All indices of a block, 0 to 511.
constexpr std::array<unsigned, 512> kAllPlaces = [] {
  std::array<unsigned, 512> places{};
  std::iota(places.begin(), places.end(), 0u);
  return places;
}();

using Samples = std::array<float, 512>;  ///< winding numbers of a block, in OpenVDB's order

/// Returns the point whose side a voxel has, in voxels.
Eigen::Vector3d voxel_at(const BlockAt& block, unsigned place) {
  return side_place(voxel_in(block, int(place)));
}

/// A block all voxels of which were evaluated, with its winding numbers and their sides.
struct Asked {
  std::unique_ptr<Samples> winding;
  BlockMask inside;
};

/// One run of winding_signs().
class WindingSigns {
 public:
  WindingSigns(const WindingNumber& winding, const BlockTable& table, const Band& band,
               const Regions& regions, bool open, const RunContext& context)
      : winding_(winding), table_(table), band_(band), regions_(regions), open_(open), context_(context) {}

  /// `rings`: how many blocks away from a cap its distance matters.
  Signs run(int rings) {
    ask_components();
    // From the boundaries of holes the surface of ½ is followed block by block, until it ends at triangles.
    // All blocks of a round are known before the next, so that the result does not depend on the thread
    // schedule.
    std::vector<BlockAt> doubtful = doubtful_blocks();
    while (!doubtful.empty()) {
      ask(doubtful);
      doubtful = next_blocks(doubtful);
    }
    Signs signs;
    signs.inside.resize(band_.blocks.size());
    for (std::size_t i = 0; i < signs.inside.size(); ++i) signs.inside[i] = inside_of(band_.blocks[i]);
    build_caps(signs.caps);
    sign_beyond(rings, signs.beyond);
    return signs;
  }

 private:
  /// Returns the voxel of a component that is farthest from the triangles, where the number is most certain.
  unsigned representative(std::size_t block, const BlockMask& voxels) const {
    const float* distance = distances_of(std::uint32_t(block));
    int best = -1;
    for_each_bit(voxels, [&](int v) {
      if (best < 0 || (distance && distance[v] > distance[best])) best = v;
    });
    return unsigned(best);
  }

  /// Evaluates each component once: without a triangle between, all its voxels have nearly the same number.
  void ask_components() {
    value_.resize(regions_.components.size());
    parallel_blocks(band_.blocks.size(), context_, [&](std::size_t i) {
      std::vector<Eigen::Vector3d> points;
      std::vector<unsigned> places;
      for (std::uint32_t c = regions_.first[i]; c < regions_.first[i + 1]; ++c) {
        places.push_back(representative(i, regions_.components[c].voxels));
        points.push_back(voxel_at(band_.blocks[i], places.back()));
      }
      // A block's components are consecutive, so each block writes to a range for itself.
      const std::span<float> values(value_.data() + regions_.first[i], points.size());
      winding_.at(points, values);
      ask_singly(distances_of(std::uint32_t(i)), places, points, values);
    });
  }

  bool sure(std::uint32_t component) const { return std::abs(value_[component] - 0.5f) > kDoubt; }
  bool side(std::uint32_t component) const { return value_[component] > 0.5f; }

  /// Returns true if a component of a block is on both sides of a triangle, as around the boundary of a hole:
  /// the number changes within the component, so one voxel does not represent it.
  bool goes_round(std::uint32_t block, std::uint32_t component) const {
    const BlockMask& voxels = regions_.components[component].voxels;
    for (int axis = 0; axis < 3; ++axis)
      if (any(crossed_along(block, axis) & voxels & upper_neighbours(voxels, kAllOutside, axis))) return true;
    return false;
  }

  /// Returns the blocks with a component in doubt, or next to one on the other side without a triangle
  /// between.
  std::vector<BlockAt> doubtful_blocks() const {
    std::vector<char> doubtful(band_.blocks.size(), 0);
    BlockFinder finder(table_);
    for (std::uint32_t i = 0; i < doubtful.size(); ++i) {
      for (std::uint32_t c = regions_.first[i]; c < regions_.first[i + 1]; ++c)
        if (!sure(c) || (open_ && goes_round(i, c))) doubtful[i] = 1;
      for (int axis = 0; axis < 3; ++axis) {
        BlockAt at = band_.blocks[i];
        ++at[std::size_t(axis)];
        const std::uint32_t j = finder.find(at);
        if (j != BlockTable::kNone && disagree(i, j, axis)) doubtful[i] = doubtful[j] = 1;
      }
    }
    std::vector<BlockAt> result;
    for (std::size_t i = 0; i < doubtful.size(); ++i)
      if (doubtful[i]) result.push_back(band_.blocks[i]);
    return result;
  }

  /// Returns true if components of two neighbouring blocks are on different sides and connected across the
  /// face between.
  bool disagree(std::uint32_t lower, std::uint32_t upper, int axis) const {
    const std::uint64_t open = ~face(crossed_along(lower, axis), axis, 1);
    for (std::uint32_t a = regions_.first[lower]; a < regions_.first[lower + 1]; ++a)
      for (std::uint32_t b = regions_.first[upper]; b < regions_.first[upper + 1]; ++b)
        if (side(a) != side(b) && (open & face(regions_.components[a].voxels, axis, 1) &
                                   face(regions_.components[b].voxels, axis, 0)))
          return true;
    return false;
  }

  /// Evaluates again each sample so close to a triangle that the single precision of a batch cannot decide
  /// its side.
  void ask_singly(const float* distances, std::span<const unsigned> places,
                  std::span<const Eigen::Vector3d> points, std::span<float> values) const {
    if (!distances) return;
    const float near = float(kOnSurface * band_.voxel_size);
    for (std::size_t i = 0; i < places.size(); ++i)
      if (distances[places[i]] < near) values[i] = float(winding_.at(points[i]));
  }

  /// The distances of a block's samples, or null where none is near the surface.
  const float* distances_of(std::uint32_t block) const {
    return block != BlockTable::kNone && band_.leaves[block] ? band_.leaves[block]->buffer().data() : nullptr;
  }

  /// Evaluates more finely the voxels whose side may be wrong by the error of the first result.
  void ask_again(const BlockAt& block, Samples& values) const {
    std::vector<Eigen::Vector3d> points;
    std::vector<unsigned> places;
    for (unsigned place = 0; place < 512; ++place)
      if (std::abs(values[place] - 0.5f) < kError) {
        points.push_back(voxel_at(block, place));
        places.push_back(place);
      }
    std::vector<float> again(points.size());
    winding_.at_finely(points, again);
    for (std::size_t i = 0; i < places.size(); ++i) values[places[i]] = again[i];
  }

  /// Evaluates every voxel of the blocks. Threads write to `found`, and one thread fills the map.
  void ask(const std::vector<BlockAt>& blocks) {
    std::vector<Asked> found(blocks.size());
    tbb::parallel_for(std::size_t(0), blocks.size(), [&](std::size_t i) {
      context_.check();
      std::array<Eigen::Vector3d, 512> points;
      for (unsigned place = 0; place < 512; ++place) points[place] = voxel_at(blocks[i], place);
      found[i].winding = std::make_unique<Samples>();
      winding_.at(points, *found[i].winding);
      ask_singly(distances_of(table_.find(blocks[i])), kAllPlaces, points, *found[i].winding);
      ask_again(blocks[i], *found[i].winding);
      for (unsigned place = 0; place < 512; ++place)
        found[i].inside[place >> 6] |= std::uint64_t((*found[i].winding)[place] > 0.5f) << (place & 63);
    });
    for (std::size_t i = 0; i < blocks.size(); ++i) asked_.emplace(blocks[i], std::move(found[i]));
  }

  /// Returns the neighbours, not evaluated yet, that the surface of ½ leads to from the last blocks: across a
  /// side of the block on which the sign changes without a triangle, or if the neighbour has been on the
  /// other side so far. In ascending order.
  std::vector<BlockAt> next_blocks(const std::vector<BlockAt>& from) const {
    std::set<BlockAt> next;
    for (const BlockAt& block : from) {
      context_.check();
      const BlockMask& inside = asked_.at(block).inside;
      for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
          BlockAt at = block;
          at[std::size_t(axis)] += side ? 1 : -1;
          if (asked_.count(at)) continue;
          const std::uint64_t ours = face(inside, axis, side);
          // A closed surface leaves the blocks only at the ends of a part of space.
          if (table_.find(at) == BlockTable::kNone ? open_ && ours != 0 && ours != ~0ull
                                                   : leads_to(block, at, axis, side))
            next.insert(at);
        }
    }
    return {next.begin(), next.end()};
  }

  /// Returns true if two samples on either side of a face differ without a triangle between.
  bool leads_to(const BlockAt& block, const BlockAt& at, int axis, int side) const {
    const BlockAt& lower = side ? block : at;
    const BlockMask a = inside_of(lower), b = inside_of(side ? at : block);
    return ((face(a, axis, 1) ^ face(b, axis, 0)) &
            ~face(crossed_along(table_.find(lower), axis), axis, 1)) != 0;
  }

  /// Returns the crossed edges of a block; none for kNone.
  BlockMask crossed_along(std::uint32_t block, int axis) const {
    return block == BlockTable::kNone ? kAllOutside : std::to_array(band_.crossed[block].word[axis]);
  }

  /// Returns the current sides of a block: by voxel if these were evaluated, else by its components.
  BlockMask inside_of(const BlockAt& block) const {
    if (const auto asked = asked_.find(block); asked != asked_.end()) return asked->second.inside;
    BlockMask bits{};
    const std::uint32_t i = table_.find(block);
    if (i == BlockTable::kNone) return bits;
    for (std::uint32_t c = regions_.first[i]; c < regions_.first[i + 1]; ++c)
      if (side(c)) bits |= regions_.components[c].voxels;
    return bits;
  }

  // ---- Caps: the dual of the grid edges on which the number passes ½ and no triangle is, a quad an edge,
  // its corners the means of the crossings of the cells around it (surface nets, Gibson 1998).

  /// The crossings of a cell's edges, whose mean is the cap's vertex there.
  struct Cell {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
  };
  /// An edge that passes ½, by its lower sample.
  struct CapEdge {
    Voxel lower;
    int axis;
  };
  using Cells = std::map<Voxel, Cell>;

  /// Returns true if a voxel lies on a triangle.
  bool on_surface(const BlockAt& block, unsigned place) const {
    constexpr double kOn = 1e-3;
    const float* distances = distances_of(table_.find(block));
    return distances && distances[place] < kOn * band_.voxel_size;
  }

  void build_caps(std::vector<TriangleCorners>& caps) const {
    std::vector<CapEdge> edges;
    Cells cells;
    for (const auto& [block, asked] : asked_) collect_edges(block, asked, edges, cells);
    for (const CapEdge& edge : edges) add_quad(edge, cells, caps);
  }

  void collect_edges(const BlockAt& block, const Asked& asked, std::vector<CapEdge>& edges,
                     Cells& cells) const {
    for (int axis = 0; axis < 3; ++axis) {
      BlockAt above = block;
      ++above[std::size_t(axis)];
      const auto upper = asked_.find(above);
      const BlockMask above_it =
          upper_neighbours(asked.inside, upper == asked_.end() ? kAllOutside : upper->second.inside, axis);
      const BlockMask crossed = crossed_along(table_.find(block), axis);
      for (unsigned place = 0; place < 512; ++place) {
        if (test(asked.inside, int(place)) == test(above_it, int(place)) || test(crossed, int(place)))
          continue;
        const unsigned stride = axis == 0 ? 64 : axis == 1 ? 8 : 1;
        const bool last = (place / stride) % 8 == 7;
        // Beyond the evaluated blocks the number changes only at triangles.
        if (last && upper == asked_.end()) continue;
        // The number jumps at a triangle by 1, and passes ½ there without being a cap.
        if (on_surface(block, place) ||
            on_surface(last ? above : block, last ? place - 7 * stride : place + stride))
          continue;
        const float from = (*asked.winding)[place];
        const float to =
            last ? (*upper->second.winding)[place - 7 * stride] : (*asked.winding)[place + stride];
        Eigen::Vector3d crossing = voxel_at(block, place);
        const CapEdge edge{voxel_in(block, int(place)), axis};
        // Linear between the two numbers, as a level set's crossing is.
        crossing[axis] += std::clamp((0.5 - double(from)) / (double(to) - double(from)), 0.0, 1.0);
        edges.push_back(edge);
        for_each_cell(edge, [&](const Voxel& cell) {
          Cell& c = cells[cell];
          c.sum += crossing;
          ++c.count;
        });
      }
    }
  }

  /// The four cells around an edge, by their lower corners, in turn.
  template <class F>
  static void for_each_cell(const CapEdge& edge, F&& f) {
    const std::size_t u = std::size_t(edge.axis + 1) % 3, v = std::size_t(edge.axis + 2) % 3;
    for (const auto& [du, dv] : {std::pair(-1, -1), std::pair(0, -1), std::pair(0, 0), std::pair(-1, 0)}) {
      Voxel cell = edge.lower;
      cell[u] += du;
      cell[v] += dv;
      f(cell);
    }
  }

  static void add_quad(const CapEdge& edge, const Cells& cells, std::vector<TriangleCorners>& caps) {
    std::array<Eigen::Vector3d, 4> corner;
    std::size_t n = 0;
    for_each_cell(edge, [&](const Voxel& cell) {
      const Cell& c = cells.at(cell);
      corner[n++] = c.sum / c.count;
    });
    for (const auto& triangle : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
      TriangleCorners& corners = caps.emplace_back();
      for (int i = 0; i < 3; ++i) Eigen::Vector3d::Map(&corners[3 * i]) = corner[triangle[i]];
    }
  }

  /// Signs the blocks around the evaluated ones, which distances to caps reach: each that was not evaluated
  /// itself is on one side of the surface, so one of its voxels represents all.
  void sign_beyond(int rings, std::map<BlockAt, BlockMask>& beyond) const {
    for (const auto& [block, asked] : asked_) {
      context_.check();
      for (int x = -rings; x <= rings; ++x)
        for (int y = -rings; y <= rings; ++y)
          for (int z = -rings; z <= rings; ++z) {
            const BlockAt at{block[0] + x, block[1] + y, block[2] + z};
            if (beyond.count(at) || table_.find(at) != BlockTable::kNone) continue;
            if (const auto known = asked_.find(at); known != asked_.end()) {
              beyond[at] = known->second.inside;
              continue;
            }
            BlockMask bits;
            bits.fill(winding_.at(voxel_at(at, 0)) > 0.5 ? ~0ull : 0);
            beyond[at] = bits;
          }
    }
  }

  const WindingNumber& winding_;
  const BlockTable& table_;
  const Band& band_;
  const Regions& regions_;
  bool open_;
  const RunContext& context_;
  std::vector<float> value_;  ///< of each component
  std::map<BlockAt, Asked> asked_;
};

}  // namespace

Signs winding_signs(const WindingNumber& winding, const BlockTable& table, const Band& band,
                    const Regions& regions, bool open, double reach, const RunContext& context) {
  return WindingSigns(winding, table, band, regions, open, context).run(int(std::ceil(reach / 8.0)));
}

}  // namespace hermesh
