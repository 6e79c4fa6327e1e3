#include "algorithms/voxelization/inner_sheets.h"

#include <tbb/enumerable_thread_specific.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "algorithms/core/parallel.h"
#include "algorithms/voxelization/segment.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// How far off a side the way to a voxel starts, in voxels: beyond rounding and beyond doubled faces.
constexpr double kOff = 1e-3;
/// Sizes of pieces, in voxels: along a seam, next to places of which nothing is certain, and of those that
/// four places can stand for.
constexpr double kFine = 0.1, kMiddle = 0.5, kCoarse = 2.0;
constexpr std::size_t kKept = 4;  ///< neighbourhoods that a thread keeps

struct Piece : Facet {
  using Facet::Facet;
  Vector3d centroid() const { return (corner[0] + corner[1] + corner[2]) / 3.0; }
  double size() const {
    return std::max(
        {(corner[1] - corner[0]).norm(), (corner[2] - corner[1]).norm(), (corner[0] - corner[2]).norm()});
  }
  /// Halves of the longest side.
  std::array<Piece, 2> halves() const {
    int longest = 0;
    const auto length = [&](int i) { return (corner[(i + 1) % 3] - corner[i]).squaredNorm(); };
    for (int i = 1; i < 3; ++i)
      if (length(i) > length(longest)) longest = i;
    const Vector3d &a = corner[longest], &b = corner[(longest + 1) % 3], &c = corner[(longest + 2) % 3];
    const Vector3d middle = 0.5 * (a + b);
    return {Piece(a, middle, c), Piece(middle, b, c)};
  }
};

VoxelBits spread(VoxelBits bits) {
  VoxelBits wide;
  for (std::size_t x = 0; x < 8; ++x)
    wide[x] = bits[x] | (x > 0 ? bits[x - 1] : 0) | (x < 7 ? bits[x + 1] : 0);
  for (std::uint64_t& w : wide) w |= (w & kBelowTopY) << 8 | w >> 8;
  for (std::uint64_t& w : wide) w |= (w & kBelowTopZ) << 1 | (w >> 1 & kBelowTopZ);
  return wide;
}

using Voxel = std::array<std::int32_t, 3>;

/// The triangles of one block of cells, by cell.
struct Neighbourhood {
  std::vector<Piece> pieces;
  struct Hull {
    Vector3d low, high;  ///< box
    Vector3d normal;     ///< not of unit length
    double offset, slack;
  };
  std::vector<Hull> hulls;
  std::array<std::vector<std::uint32_t>, 512>
      cells;  ///< numbers of those that touch the cell up from each voxel

  Neighbourhood(const IndexSoup& soup, const TriangleBins& bins, const BlockAt& block) {
    bins.for_each_cluster(block, [&](const TriangleBins::Cluster& cluster) {
      for (std::size_t a = 0; a < 3; ++a)
        if (cluster.box.low[a] > block[a] * 8.0 + 8.1 || cluster.box.high[a] < block[a] * 8.0 - 0.1) return;
      for (const std::uint32_t t : cluster.triangles) add(Piece(soup.corners(t)), block);
    });
    if (const std::uint32_t i = bins.blocks().find(block); i != BlockTable::kNone)
      for (const std::uint32_t t : bins.large(i)) add(Piece(soup.corners(t)), block);
  }

  /// Whether a triangle of the cell is in the way.
  bool blocked(const Vector3d& from, const Vector3d& to, unsigned cell) const {
    const Vector3d low = from.cwiseMin(to), high = from.cwiseMax(to);
    for (const std::uint32_t i : cells[cell]) {
      const Hull& hull = hulls[i];
      if ((low.array() > hull.high.array()).any() || (high.array() < hull.low.array()).any()) continue;
      const double a = hull.normal.dot(from) - hull.offset, b = hull.normal.dot(to) - hull.offset;
      if (std::min(a, b) > hull.slack || std::max(a, b) < -hull.slack) continue;
      if (meeting(from, to, pieces[i]) >= 0) return true;
    }
    return false;
  }

 private:
  void add(const Piece& piece, const BlockAt& block) {
    int from[3], to[3];
    for (int a = 0; a < 3; ++a) {
      const double origin = block[std::size_t(a)] * 8.0;
      const auto [low, high] = std::minmax({piece.corner[0][a], piece.corner[1][a], piece.corner[2][a]});
      from[a] = int(std::clamp(std::floor(low - origin - 1e-6), 0.0, 8.0));
      to[a] = int(std::clamp(std::floor(high - origin + 1e-6), -1.0, 7.0));
      if (from[a] > to[a]) return;
    }
    const std::uint32_t number = std::uint32_t(pieces.size());
    pieces.push_back(piece);
    const Vector3d margin = Vector3d::Constant(1e-6);
    const Vector3d normal = piece.normal();
    hulls.push_back({piece.low() - margin, piece.high() + margin, normal, normal.dot(piece.corner[0]),
                     1e-6 * normal.norm()});
    for (int x = from[0]; x <= to[0]; ++x)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int z = from[2]; z <= to[2]; ++z) cells[std::size_t(x * 64 + y * 8 + z)].push_back(number);
  }
};

/// What is certain about a place of the surface, or just off it: the outside is next to it, only the inside
/// is, or neither can be told, as in a crevice narrower than a voxel.
enum class Side { outer, inner, unknown };

/// Asks what is where; each thread has its own.
class Prober {
 public:
  Prober(const IndexSoup& soup, const TriangleBins& bins, const std::vector<VoxelBits>& inside,
         const std::vector<VoxelBits>& suspicious)
      : soup_(soup), bins_(bins), inside_(inside), suspicious_(suspicious), finder_(bins.blocks()) {}

  /// Whether the solid is on both sides of the surface at q with this unit normal.
  Side side(const Vector3d& q, const Vector3d& normal) {
    const Side above = seen_from(q + kOff * normal);
    if (above == Side::outer) return above;
    const Side below = seen_from(q - kOff * normal);
    return below == Side::inner ? above : below;
  }

  /// Whether a suspicious voxel is in or next to the piece's box.
  bool suspicious(const Piece& piece) {
    Voxel from, to;
    for (int a = 0; a < 3; ++a) {
      const auto [low, high] = std::minmax({piece.corner[0][a], piece.corner[1][a], piece.corner[2][a]});
      from[std::size_t(a)] = std::int32_t(std::floor(low));
      to[std::size_t(a)] = std::int32_t(std::floor(high));
    }
    for (std::int32_t x = from[0]; x <= to[0]; ++x)
      for (std::int32_t y = from[1]; y <= to[1]; ++y)
        for (std::int32_t z = from[2]; z <= to[2]; ++z)
          if (bit_of(suspicious_, {x, y, z}) == 1) return true;
    return false;
  }

 private:
  /// A few blocks are kept, since places next to each other are asked for one after another.
  const Neighbourhood& around(const Voxel& voxel) {
    const BlockAt block = tile_of(voxel);
    if (last_ && block == last_block_) return *last_;
    auto known = blocks_.find(block);
    if (known == blocks_.end()) {
      if (blocks_.size() >= kKept) blocks_.clear();
      known = blocks_.emplace(block, std::make_unique<Neighbourhood>(soup_, bins_, block)).first;
    }
    last_block_ = block;
    last_ = known->second.get();
    return *last_;
  }

  /// 0 or 1, or 2 where there is no block.
  int bit_of(const std::vector<VoxelBits>& bits, const Voxel& voxel) {
    const std::uint32_t block = finder_.find(tile_of(voxel));
    if (block == BlockTable::kNone) return 2;
    const unsigned place = place_in_tile(voxel);
    return int(bits[block][place >> 6] >> (place & 63) & 1);
  }

  Side seen_from(const Vector3d& p) {
    Voxel lower;
    for (int a = 0; a < 3; ++a) lower[std::size_t(a)] = std::int32_t(std::floor(p[a]));
    const Neighbourhood& triangles = around(lower);
    bool inside_seen = false;
    for (int i = 0; i < 8; ++i) {
      const Voxel voxel{lower[0] + (i >> 2), lower[1] + (i >> 1 & 1), lower[2] + (i & 1)};
      const int inside = bit_of(inside_, voxel);
      if (inside == 2 || (inside == 1 && inside_seen)) continue;
      const Vector3d to(voxel[0], voxel[1], voxel[2]);
      if (triangles.blocked(p, to, place_in_tile(lower))) continue;
      if (inside == 0) return Side::outer;
      inside_seen = true;
    }
    return inside_seen ? Side::inner : Side::unknown;
  }

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  const std::vector<VoxelBits>& inside_;
  const std::vector<VoxelBits>& suspicious_;
  BlockFinder finder_;
  std::map<BlockAt, std::unique_ptr<Neighbourhood>> blocks_;
  const Neighbourhood* last_ = nullptr;
  BlockAt last_block_{};
};

/// What of a triangle is left.
struct Remains {
  bool some_inner = false;
  std::vector<Piece> outer;
};

/// Cuts a piece up until each part is inner or outer as a whole, as far as four places tell.
void cut(const Piece& piece, const Vector3d& normal, Prober& prober, Remains& remains) {
  const double size = piece.size();
  const Vector3d centroid = piece.centroid();
  if (!prober.suspicious(piece)) {
    remains.outer.push_back(piece);
    return;
  }
  if (size > kCoarse) {
    for (const Piece& half : piece.halves()) cut(half, normal, prober, remains);
    return;
  }
  std::array<int, 3> places{};  // by Side
  ++places[std::size_t(prober.side(centroid, normal))];
  if (size > kFine)
    for (const Vector3d& corner : piece.corner)
      ++places[std::size_t(prober.side(0.98 * corner + 0.02 * centroid, normal))];
  const auto [outer, inner, unknown] = places;
  const bool seam = inner > 0 && (outer > 0 || (unknown > 0 && size > kMiddle));
  if (seam && size > kFine)
    for (const Piece& half : piece.halves()) cut(half, normal, prober, remains);
  else if (inner > unknown)
    remains.some_inner = true;
  else
    remains.outer.push_back(piece);
}

class Finder {
 public:
  Finder(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
         const std::vector<VoxelBits>& inside, const RunContext& context)
      : soup_(soup), bins_(bins), band_(band), inside_(inside), context_(context) {}

  InnerSheets run(double reach, double voxel_size) {
    find_suspects();
    InnerSheets sheets;
    std::vector<std::uint32_t> triangles;
    for (const std::uint32_t block : suspects_) add_triangles(block, triangles);
    std::sort(triangles.begin(), triangles.end());
    triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
    const std::vector<Remains> remains = cut_all(triangles);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      if (!remains[i].some_inner) continue;
      sheets.triangles.push_back(triangles[i]);
      for (const Piece& piece : remains[i].outer) add_piece(piece, voxel_size, triangles[i], sheets);
    }
    find_blocks(reach, sheets);
    return sheets;
  }

 private:
  /// Blocks with an edge between two voxels inside that an odd number of sheets cross, and the voxels around
  /// such edges. An even number is most often a gap narrower than a voxel, whose walls do bound the solid.
  void find_suspects() {
    suspicious_.assign(band_.blocks.size(), VoxelBits{});
    std::vector<char> found(band_.blocks.size(), 0);
    parallel_blocks(found.size(), context_, [&](std::size_t i) {
      std::vector<InnerEdge> edges = inner_edges(std::uint32_t(i));
      if (edges.empty()) return;
      find_hits(std::uint32_t(i), edges);
      VoxelBits voxels{};
      for (InnerEdge& edge : edges) {
        if (edge.sheets() % 2 == 0) continue;
        const unsigned place = place_in_tile(edge.voxel);
        voxels[place >> 6] |= std::uint64_t(1) << (place & 63);
        found[i] = 1;
      }
      if (found[i]) suspicious_[i] = spread(spread(voxels));
    });
    for (std::uint32_t i = 0; i < found.size(); ++i)
      if (found[i]) suspects_.push_back(i);
  }

  /// A grid edge up from a voxel, both of its ends inside, that some triangle crosses.
  struct InnerEdge {
    Voxel voxel;
    int axis;
    std::vector<double> hits;

    /// How many sheets cross it; doubled faces, and those that share the side that is hit, count once.
    int sheets() {
      std::sort(hits.begin(), hits.end());
      int count = 0;
      for (std::size_t i = 0; i < hits.size(); ++i) count += i == 0 || hits[i] - hits[i - 1] > 1e-6 ? 1 : 0;
      return count;
    }
    void meet(const Piece& piece) {
      for (int a = 0; a < 3; ++a) {
        const auto [low, high] = std::minmax({piece.corner[0][a], piece.corner[1][a], piece.corner[2][a]});
        const double from = voxel[std::size_t(a)];
        if (low > from + (a == axis ? 1.0 : 0.0) + 1e-6 || high < from - 1e-6) return;
      }
      const Vector3d from(voxel[0], voxel[1], voxel[2]);
      const double along = meeting(from, from + Vector3d::Unit(axis), piece);
      // At an end the surface goes through the voxel, as faces along the grid do, and is beside the edge, not across.
      if (along > 1e-6 && along < 1.0 - 1e-6) hits.push_back(along);
    }
  };

  void find_hits(std::uint32_t block, std::vector<InnerEdge>& edges) const {
    VoxelBox box;
    for (std::size_t a = 0; a < 3; ++a) {
      box.low[a] = box.high[a] = edges[0].voxel[a];
      for (const InnerEdge& edge : edges) {
        box.low[a] = std::min(box.low[a], double(edge.voxel[a]));
        box.high[a] = std::max(box.high[a], double(edge.voxel[a]) + (edge.axis == int(a) ? 1.0 : 0.0));
      }
    }
    const auto meet = [&](std::uint32_t t) {
      const Piece piece = Piece(soup_.corners(t));
      for (InnerEdge& edge : edges) edge.meet(piece);
    };
    bins_.for_each_cluster(band_.blocks[block], [&](const TriangleBins::Cluster& cluster) {
      for (std::size_t a = 0; a < 3; ++a)
        if (cluster.box.low[a] > box.high[a] + 1e-6 || cluster.box.high[a] < box.low[a] - 1e-6) return;
      for (const std::uint32_t t : cluster.triangles) meet(t);
    });
    for (const std::uint32_t t : bins_.large(block)) meet(t);
  }

  std::vector<InnerEdge> inner_edges(std::uint32_t block) const {
    std::vector<InnerEdge> edges;
    BlockFinder finder(bins_.blocks());
    const BlockAt& at = band_.blocks[block];
    for (int axis = 0; axis < 3; ++axis) {
      const VoxelBits lower = inner_edges(block, axis, finder);
      for (std::size_t x = 0; x < 8; ++x)
        for (std::uint64_t bits = lower[x]; bits; bits &= bits - 1) {
          const int place = __builtin_ctzll(bits);
          edges.push_back(
              {{at[0] * 8 + std::int32_t(x), at[1] * 8 + place / 8, at[2] * 8 + place % 8}, axis, {}});
        }
    }
    return edges;
  }

  /// Voxels inside whose upper neighbour on the axis is inside, too, with a triangle between.
  VoxelBits inner_edges(std::uint32_t block, int axis, BlockFinder& finder) const {
    VoxelBits edges{};
    std::uint64_t any = 0;
    for (std::size_t x = 0; x < 8; ++x)
      any |= edges[x] = band_.crossed[block].word[axis][x] & inside_[block][x];
    if (!any) return edges;
    BlockAt above = band_.blocks[block];
    ++above[std::size_t(axis)];
    const std::uint32_t upper = finder.find(above);
    const VoxelBits differs =
        differs_from_upper(inside_[block], upper == BlockTable::kNone ? VoxelBits{} : inside_[upper], axis);
    for (std::size_t x = 0; x < 8; ++x) edges[x] &= ~differs[x];
    return edges;
  }

  void add_triangles(std::uint32_t block, std::vector<std::uint32_t>& triangles) const {
    context_.check();
    const BlockAt& at = band_.blocks[block];
    bins_.for_each_cluster(at, [&](const TriangleBins::Cluster& cluster) {
      for (std::size_t a = 0; a < 3; ++a)
        if (cluster.box.low[a] > at[a] * 8.0 + 9.0 || cluster.box.high[a] < at[a] * 8.0 - 1.0) return;
      triangles.insert(triangles.end(), cluster.triangles.begin(), cluster.triangles.end());
    });
    const std::span<const std::uint32_t> large = bins_.large(block);
    triangles.insert(triangles.end(), large.begin(), large.end());
  }

  std::vector<Remains> cut_all(const std::vector<std::uint32_t>& triangles) const {
    // Block by block, so that a neighbourhood is looked up once.
    std::vector<std::pair<BlockAt, std::uint32_t>> order(triangles.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) {
      const Vector3d centre = Piece(soup_.corners(triangles[i])).centroid();
      for (int a = 0; a < 3; ++a) order[i].first[std::size_t(a)] = std::int32_t(std::floor(centre[a])) >> 3;
      order[i].second = i;
    }
    std::sort(order.begin(), order.end());
    std::vector<Remains> remains(triangles.size());
    tbb::enumerable_thread_specific<Prober> probers(
        [&] { return Prober(soup_, bins_, inside_, suspicious_); });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, order.size(), 64), [&](const auto& range) {
      Prober& prober = probers.local();
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        context_.check();
        const Piece piece = Piece(soup_.corners(triangles[order[i].second]));
        const Vector3d normal = piece.normal();
        if (normal.norm() > 0) cut(piece, normal.normalized(), prober, remains[order[i].second]);
      }
    });
    return remains;
  }

  static void add_piece(const Piece& piece, double voxel_size, std::uint32_t parent, InnerSheets& sheets) {
    const std::uint32_t n = std::uint32_t(sheets.pieces.points.size());
    for (const Vector3d& corner : piece.corner)
      sheets.pieces.points.push_back((corner * voxel_size).cast<float>());
    sheets.pieces.triangles.push_back({n, n + 1, n + 2});
    sheets.parents.push_back(parent);
  }

  void find_blocks(double reach, InnerSheets& sheets) const {
    std::vector<char> near(band_.blocks.size(), 0);
    BlockFinder finder(bins_.blocks());
    for (const std::uint32_t t : sheets.triangles) {
      const Piece piece = Piece(soup_.corners(t));
      std::int32_t from[3], to[3];
      for (int a = 0; a < 3; ++a) {
        const auto [low, high] = std::minmax({piece.corner[0][a], piece.corner[1][a], piece.corner[2][a]});
        from[a] = std::int32_t(std::floor(low - reach)) >> 3;
        to[a] = std::int32_t(std::floor(high + reach)) >> 3;
      }
      for (std::int32_t x = from[0]; x <= to[0]; ++x)
        for (std::int32_t y = from[1]; y <= to[1]; ++y)
          for (std::int32_t z = from[2]; z <= to[2]; ++z)
            if (const std::uint32_t i = finder.find({x, y, z}); i != BlockTable::kNone) near[i] = 1;
    }
    for (std::uint32_t i = 0; i < near.size(); ++i)
      if (near[i]) sheets.blocks.push_back(i);
  }

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  const Band& band_;
  const std::vector<VoxelBits>& inside_;
  const RunContext& context_;
  std::vector<VoxelBits> suspicious_;
  std::vector<std::uint32_t> suspects_;
};

}  // namespace

InnerSheets find_inner_sheets(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
                              const std::vector<VoxelBits>& inside, double reach, double voxel_size,
                              RunContext& context) {
  return Finder(soup, bins, band, inside, context).run(reach, voxel_size);
}

}  // namespace hermesh
