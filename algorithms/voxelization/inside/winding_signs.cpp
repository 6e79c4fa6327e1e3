#include "algorithms/voxelization/inside/winding_signs.h"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <map>
#include <memory>

#include "algorithms/core/parallel.h"
#include "algorithms/lattice/sample_side.h"

namespace hermesh {
namespace {

/// Components whose winding number is this near ½ have every voxel asked. The number of a component beside a
/// closed surface is whole but for 0.01, so that only holes are within.
constexpr float kDoubt = 0.25f;
/// Voxels whose number is this near ½, twice its error, are asked once more.
constexpr float kError = 0.02f;

/// Samples this near to a triangle, in voxels, are asked about one by one.
constexpr double kOnSurface = 1e-4;
/// All places of a block, 0 to 511.
constexpr std::array<unsigned, 512> kAllPlaces = [] {
  std::array<unsigned, 512> places{};
  for (unsigned i = 0; i < 512; ++i) places[i] = i;
  return places;
}();

using Samples = std::array<float, 512>;  ///< winding numbers of a block, in OpenVDB's order

unsigned first_voxel(const BlockMask& bits) {
  for (unsigned x = 0; x < 8; ++x)
    if (bits[x]) return x << 6 | unsigned(__builtin_ctzll(bits[x]));
  return 0;
}

/// The place whose side a voxel has, in voxels.
Eigen::Vector3d voxel_at(const BlockAt& block, unsigned place) {
  return side_place(block[0] * 8.0 + double(place >> 6), block[1] * 8.0 + double(place >> 3 & 7),
                    block[2] * 8.0 + double(place & 7));
}

/// A block every voxel of which was asked, with its winding numbers and the sides that they give.
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
    // From the rims of holes the surface of ½ is followed block by block, until it ends at triangles. All
    // blocks of a round are known before the next, so that the threads' order changes nothing.
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
  /// Finds the voxel of a component that is farthest from the triangles, where the number is least in doubt.
  unsigned representative(std::size_t block, const BlockMask& voxels) const {
    unsigned best = first_voxel(voxels);
    if (!band_.leaves[block]) return best;
    const float* distance = band_.leaves[block]->buffer().data();
    for (unsigned place = 0; place < 512; ++place)
      if (test(voxels, int(place)) && distance[place] > distance[best]) best = place;
    return best;
  }

  /// Asks once for each component: without a triangle between, all its voxels have nearly the same number.
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

  /// Whether a component of a block is on both sides of a triangle, as it is around the rim of a hole: the
  /// number changes within the component, which is in doubt whatever its one voxel says.
  bool goes_round(std::uint32_t block, std::uint32_t component) const {
    const BlockMask& voxels = regions_.components[component].voxels;
    const auto& crossed = band_.crossed[block].word;
    for (std::size_t x = 0; x < 8; ++x) {
      const std::uint64_t v = voxels[x];
      if ((crossed[0][x] & v & (x < 7 ? voxels[x + 1] : 0)) || (crossed[1][x] & v & v >> 8 & kBelowTopY) ||
          (crossed[2][x] & v & v >> 1 & kBelowTopZ))
        return true;
    }
    return false;
  }

  /// Lists the blocks with a component in doubt, or next to one on the other side although no triangle is
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

  /// Whether components of two neighbouring blocks are on different sides and connected across the face
  /// between.
  bool disagree(std::uint32_t lower, std::uint32_t upper, int axis) const {
    BlockMask crossed;
    for (std::size_t x = 0; x < 8; ++x) crossed[x] = band_.crossed[lower].word[axis][x];
    const std::uint64_t open = ~face(crossed, axis, 1);
    for (std::uint32_t a = regions_.first[lower]; a < regions_.first[lower + 1]; ++a)
      for (std::uint32_t b = regions_.first[upper]; b < regions_.first[upper + 1]; ++b)
        if (side(a) != side(b) && (open & face(regions_.components[a].voxels, axis, 1) &
                                   face(regions_.components[b].voxels, axis, 0)))
          return true;
    return false;
  }

  /// Asks once more about each sample that is so close to a triangle that the single precision of many points
  /// together does not tell its side.
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

  /// Asks more finely about the voxels whose side the error of the first answer could have turned.
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

  /// Asks for every voxel of the blocks. Threads write to `found`, and one thread fills the map.
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

  /// Finds the neighbours, not asked yet, that the surface of ½ leads to from the blocks asked last: across a
  /// side of the block on which the sign changes without a triangle, or where the neighbour is believed to be
  /// on the other side. The map gives them in ascending order.
  std::vector<BlockAt> next_blocks(const std::vector<BlockAt>& from) const {
    std::map<BlockAt, int> next;
    for (const BlockAt& block : from) {
      context_.check();
      const BlockMask& inside = asked_.at(block).inside;
      for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
          BlockAt at = block;
          at[std::size_t(axis)] += side ? 1 : -1;
          if (asked_.count(at)) continue;
          const std::uint64_t ours = face(inside, axis, side);
          if (table_.find(at) == BlockTable::kNone ? ours != 0 && ours != ~0ull
                                                   : leads_to(block, at, axis, side))
            next.emplace(at, 0);
        }
    }
    std::vector<BlockAt> result;
    for (const auto& entry : next) result.push_back(entry.first);
    return result;
  }

  /// Whether two samples on either side of a face differ without a triangle between.
  bool leads_to(const BlockAt& block, const BlockAt& at, int axis, int side) const {
    const BlockAt& lower = side ? block : at;
    const BlockMask crossed = crossed_along(lower, axis);
    const BlockMask a = inside_of(lower), b = inside_of(side ? at : block);
    return ((face(a, axis, 1) ^ face(b, axis, 0)) & ~face(crossed, axis, 1)) != 0;
  }

  BlockMask crossed_along(const BlockAt& block, int axis) const {
    BlockMask bits{};
    const std::uint32_t i = table_.find(block);
    if (i != BlockTable::kNone)
      for (std::size_t x = 0; x < 8; ++x) bits[x] = band_.crossed[i].word[axis][x];
    return bits;
  }

  /// What is known of a block's sides so far: voxel by voxel if it was asked, else by its components.
  BlockMask inside_of(const BlockAt& block) const {
    if (const auto asked = asked_.find(block); asked != asked_.end()) return asked->second.inside;
    BlockMask bits{};
    const std::uint32_t i = table_.find(block);
    if (i == BlockTable::kNone) return bits;
    for (std::uint32_t c = regions_.first[i]; c < regions_.first[i + 1]; ++c)
      if (side(c))
        for (std::size_t x = 0; x < 8; ++x) bits[x] |= regions_.components[c].voxels[x];
    return bits;
  }

  // ---- Caps: the dual of the grid edges on which the number passes ½ and no triangle is, a quad an edge,
  // its corners the means of what crosses the cells around it (surface nets, Gibson 1998).

  /// The crossings of a cell's edges, whose mean is the cap's vertex there.
  struct Cell {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
  };
  /// An edge that passes ½, by its lower sample.
  struct CapEdge {
    std::array<std::int32_t, 3> lower;
    int axis;
  };
  using Cells = std::map<std::array<std::int32_t, 3>, Cell>;

  /// Whether a voxel lies on a triangle, whose border a hole may begin at.
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
      BlockMask changes =
          differs_from_upper(asked.inside, upper == asked_.end() ? BlockMask{} : upper->second.inside, axis);
      const BlockMask crossed = crossed_along(block, axis);
      for (unsigned place = 0; place < 512; ++place) {
        if (!test(changes, int(place)) || test(crossed, int(place))) continue;
        const unsigned stride = axis == 0 ? 64 : axis == 1 ? 8 : 1;
        const bool last = (place / stride) % 8 == 7;
        // Beyond what was asked nothing changes but at triangles.
        if (last && upper == asked_.end()) continue;
        // The number jumps at a triangle by 1, and passes ½ there without being a cap.
        if (on_surface(block, place) ||
            on_surface(last ? above : block, last ? place - 7 * stride : place + stride))
          continue;
        const float from = (*asked.winding)[place];
        const float to =
            last ? (*upper->second.winding)[place - 7 * stride] : (*asked.winding)[place + stride];
        Eigen::Vector3d crossing = voxel_at(block, place);
        CapEdge edge{{}, axis};
        // Windings are taken a few millionths of a voxel beside the samples (SampleSide), on either side of
        // whole numbers.
        for (int a = 0; a < 3; ++a) edge.lower[std::size_t(a)] = std::int32_t(std::lround(crossing[a]));
        // Linear between the two numbers, as a level set's crossing is.
        crossing[axis] += std::clamp((0.5 - double(from)) / (double(to) - double(from)), 0.0, 1.0);
        edges.push_back(edge);
        for_each_cell(edge, [&](const std::array<std::int32_t, 3>& cell) {
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
      std::array<std::int32_t, 3> cell = edge.lower;
      cell[u] += du;
      cell[v] += dv;
      f(cell);
    }
  }

  static void add_quad(const CapEdge& edge, const Cells& cells, std::vector<TriangleCorners>& caps) {
    std::array<Eigen::Vector3d, 4> corner;
    std::size_t n = 0;
    for_each_cell(edge, [&](const std::array<std::int32_t, 3>& cell) {
      const Cell& c = cells.at(cell);
      corner[n++] = c.sum / c.count;
    });
    for (const auto& triangle : {std::array<std::size_t, 3>{0, 1, 2}, std::array<std::size_t, 3>{0, 2, 3}}) {
      TriangleCorners corners;
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t a = 0; a < 3; ++a) corners[3 * i + a] = corner[triangle[i]][Eigen::Index(a)];
      caps.push_back(corners);
    }
  }

  /// Signs the blocks around those that were asked, which distances to caps reach: each is on one side of the
  /// surface as a whole unless it was asked itself, so that one of its voxels speaks for all.
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
