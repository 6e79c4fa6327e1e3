#include "algorithms/voxelization/inner_sheets.h"

#include <tbb/enumerable_thread_specific.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "algorithms/core/parallel.h"
#include "algorithms/core/sample_side.h"
#include "algorithms/voxelization/oriented_winding.h"
#include "algorithms/voxelization/segment.h"
#include "algorithms/voxelization/surface_probe.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Sizes of pieces, in voxels: along a seam, next to places of which nothing is certain, and of those that
/// four places can stand for.
constexpr double kFine = 0.1, kMiddle = 0.5, kCoarse = 2.0;
/// How far off an edge's samples its triangles are looked for, in voxels: farther than the places of their sides are.
constexpr double kNearby = 1e-5;

struct Piece : Facet {
  using Facet::Facet;
  Vector3d centroid() const { return (corner[0] + corner[1] + corner[2]) / 3.0; }
  double size() const {
    return std::max(
        {(corner[1] - corner[0]).norm(), (corner[2] - corner[1]).norm(), (corner[0] - corner[2]).norm()});
  }
  double area() const { return 0.5 * normal().norm(); }
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

using Voxel = std::array<std::int32_t, 3>;

/// Bits of a layer's voxels from a row and a place in it to others, all included.
std::uint64_t layer_bits(int first_y, int last_y, int first_z, int last_z) {
  const std::uint64_t row = (std::uint64_t(2) << last_z) - (std::uint64_t(1) << first_z);
  std::uint64_t bits = 0;
  for (int y = first_y; y <= last_y; ++y) bits |= row << (8 * y);
  return bits;
}

/// Which voxels are suspicious.
struct Suspects {
  std::vector<VoxelBits> voxels;      ///< by block
  std::vector<std::uint32_t> blocks;  ///< those with some
};

/// Whether pieces are near such voxels; each thread has its own, since it keeps the block that it looked up
/// last.
class Suspicion {
 public:
  Suspicion(const Suspects& suspects, const Band& band, const BlockTable& blocks)
      : suspects_(suspects), band_(band), finder_(blocks) {}

  /// Whether a suspicious voxel is in or next to the piece's box.
  bool touches(const Piece& piece) {
    Voxel from, to;
    BlockAt low, high;
    double blocks = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const int axis = static_cast<int>(a);
      const auto [least, most] =
          std::minmax({piece.corner[0][axis], piece.corner[1][axis], piece.corner[2][axis]});
      from[a] = std::int32_t(std::floor(least)), low[a] = from[a] >> 3;
      to[a] = std::int32_t(std::floor(most)), high[a] = to[a] >> 3;
      blocks *= high[a] - low[a] + 1;
    }
    // A large triangle has more blocks in its box than there are with suspicious voxels.
    if (blocks > static_cast<double>(suspects_.blocks.size()))
      return std::ranges::any_of(suspects_.blocks,
                                 [&](std::uint32_t b) { return has(b, band_.blocks[b], from, to); });
    for (std::int32_t x = low[0]; x <= high[0]; ++x)
      for (std::int32_t y = low[1]; y <= high[1]; ++y)
        for (std::int32_t z = low[2]; z <= high[2]; ++z) {
          const std::uint32_t block = finder_.find({x, y, z});
          if (block != BlockTable::kNone && has(block, {x, y, z}, from, to)) return true;
        }
    return false;
  }

 private:
  /// Whether one of the block's is in the box.
  bool has(std::uint32_t block, const BlockAt& at, const Voxel& from, const Voxel& to) const {
    int first[3], last[3];  // in the block
    for (std::size_t a = 0; a < 3; ++a) {
      first[a] = std::max(from[a] - 8 * at[a], 0);
      last[a] = std::min(to[a] - 8 * at[a], 7);
      if (first[a] > last[a]) return false;
    }
    const std::uint64_t layer = layer_bits(first[1], last[1], first[2], last[2]);
    for (int x = first[0]; x <= last[0]; ++x)
      if (suspects_.voxels[block][std::size_t(x)] & layer) return true;
    return false;
  }

  const Suspects& suspects_;
  const Band& band_;
  BlockFinder finder_;
};

/// What a thread asks about pieces.
class Prober {
 public:
  Prober(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
         const std::vector<VoxelBits>& inside, const Suspects& suspects, bool thorough,
         const WindingNumber* winding)
      : probe_(soup, bins, inside, thorough, winding), suspicion_(suspects, band, bins.blocks()) {}

  Side side(const Vector3d& q, const Vector3d& normal) { return probe_.side(q, normal); }
  bool suspicious(const Piece& piece) { return suspicion_.touches(piece); }

 private:
  SurfaceProbe probe_;
  Suspicion suspicion_;
};

/// What of a triangle is left.
struct Remains {
  bool seen_inner = false, some_inner = false;
  double inner_area = 0, doubtful_area = 0;
  std::vector<Piece> outer;
  std::vector<Piece> doubtful;  ///< of which something is unknown
};

/// Cuts a piece up until each part is inner or outer as a whole, as far as four places tell. `last`: nothing
/// may stay doubtful, and what is unknown stays.
void cut(const Piece& piece, const Vector3d& normal, Prober& prober, bool last, Remains& remains) {
  const double size = piece.size();
  const Vector3d centroid = piece.centroid();
  if (!prober.suspicious(piece)) {
    remains.outer.push_back(piece);
    return;
  }
  if (size > kCoarse) {
    for (const Piece& half : piece.halves()) cut(half, normal, prober, last, remains);
    return;
  }
  std::array<int, 3> places{};  // by Side
  ++places[std::size_t(prober.side(centroid, normal))];
  if (size > kFine)
    for (const Vector3d& corner : piece.corner)
      ++places[std::size_t(prober.side(0.98 * corner + 0.02 * centroid, normal))];
  const auto [outer, inner, unknown] = places;
  remains.seen_inner |= inner > 0;
  const bool seam = inner > 0 && (outer > 0 || (unknown > 0 && size > kMiddle));
  if (seam && size > kFine)
    for (const Piece& half : piece.halves()) cut(half, normal, prober, last, remains);
  else if (unknown > 0 && !last) {
    remains.doubtful.push_back(piece);
    remains.doubtful_area += piece.area();
  } else if (inner > unknown) {
    remains.some_inner = true;
    remains.inner_area += piece.area();
  } else {
    remains.outer.push_back(piece);
  }
}

class Finder {
 public:
  Finder(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
         const std::vector<VoxelBits>& inside, const RunContext& context)
      : soup_(soup), bins_(bins), band_(band), inside_(inside), context_(context) {}

  InnerSheets run(double reach, double voxel_size) {
    find_suspects();
    InnerSheets sheets;
    const std::vector<std::uint32_t> triangles = find_triangles();
    std::vector<Remains> remains = cut_all(triangles);
    settle_doubts(triangles, remains);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      if (!remains[i].some_inner) continue;
      sheets.triangles.push_back(triangles[i]);
      for (const Piece& piece : remains[i].outer) add_piece(piece, voxel_size, triangles[i], sheets);
    }
    find_blocks(reach, sheets);
    return sheets;
  }

 private:
  /// Voxels near an edge between two voxels inside that sheets cross, and the blocks that have some. Where
  /// the sheets are two, they are most often the walls of a gap narrower than a voxel, which do bound the
  /// solid; but inner sheets near a seam look the same, so they count where a chain of such voxels leads to
  /// one with an odd number.
  void find_suspects() {
    std::vector<VoxelBits> marked(band_.blocks.size(), VoxelBits{}), counts = marked;
    parallel_blocks(marked.size(), context_, [&](std::size_t i) {
      std::vector<InnerEdge> edges = inner_edges(std::uint32_t(i));
      if (edges.empty()) return;
      find_hits(std::uint32_t(i), edges);
      for (InnerEdge& edge : edges) {
        const unsigned place = place_in_tile(edge.voxel);
        const int sheets = edge.sheets();
        const std::uint64_t bit = std::uint64_t(1) << (place & 63);
        if (sheets > 0) marked[i][place >> 6] |= bit;
        if (sheets % 2 == 1) counts[i][place >> 6] |= bit;
      }
    });
    spread_over_neighbours(marked, counts);
    suspects_.voxels.assign(band_.blocks.size(), VoxelBits{});
    for (std::uint32_t i = 0; i < marked.size(); ++i)
      for_each_voxel(counts, i, [&](const Voxel& voxel) { suspect_around(voxel); });
    for (std::uint32_t i = 0; i < marked.size(); ++i)
      if (suspects_.voxels[i] != VoxelBits{}) suspects_.blocks.push_back(i);
  }

  /// Calls f(voxel) for the bits of a block.
  template <class F>
  void for_each_voxel(const std::vector<VoxelBits>& bits_of, std::uint32_t block, F&& f) const {
    const BlockAt& at = band_.blocks[block];
    for (std::int32_t x = 0; x < 8; ++x)
      for (std::uint64_t bits = bits_of[block][std::size_t(x)]; bits; bits &= bits - 1) {
        const int place = __builtin_ctzll(bits);
        f(Voxel{at[0] * 8 + x, at[1] * 8 + place / 8, at[2] * 8 + place % 8});
      }
  }

  /// Lets all voxels count that have a mark and that a chain of neighbours with marks joins to one that counts.
  void spread_over_neighbours(const std::vector<VoxelBits>& marked, std::vector<VoxelBits>& counts) const {
    std::vector<Voxel> stack;
    for (std::uint32_t i = 0; i < counts.size(); ++i)
      for_each_voxel(counts, i, [&](const Voxel& voxel) { stack.push_back(voxel); });
    BlockFinder finder(bins_.blocks());
    while (!stack.empty()) {
      const Voxel at = stack.back();
      stack.pop_back();
      for (std::int32_t x = -1; x <= 1; ++x)
        for (std::int32_t y = -1; y <= 1; ++y)
          for (std::int32_t z = -1; z <= 1; ++z) {
            const Voxel there = {at[0] + x, at[1] + y, at[2] + z};
            const std::uint32_t block = finder.find(tile_of(there));
            if (block == BlockTable::kNone) continue;
            const unsigned place = place_in_tile(there);
            const std::uint64_t bit = std::uint64_t(1) << (place & 63);
            if (!(marked[block][place >> 6] & bit) || (counts[block][place >> 6] & bit)) continue;
            counts[block][place >> 6] |= bit;
            stack.push_back(there);
          }
    }
  }

  /// Marks the voxels at most two away on every axis.
  void suspect_around(const Voxel& voxel) {
    constexpr std::int32_t kAway = 2;
    BlockAt low, high;
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = (voxel[a] - kAway) >> 3;
      high[a] = (voxel[a] + kAway) >> 3;
    }
    const auto within = [&](std::size_t axis, std::int32_t block) {
      return std::pair(std::max(voxel[axis] - kAway - 8 * block, 0),
                       std::min(voxel[axis] + kAway - 8 * block, 7));
    };
    for (std::int32_t x = low[0]; x <= high[0]; ++x)
      for (std::int32_t y = low[1]; y <= high[1]; ++y)
        for (std::int32_t z = low[2]; z <= high[2]; ++z) {
          const std::uint32_t block = bins_.blocks().find({x, y, z});
          if (block == BlockTable::kNone) continue;
          const auto [x0, x1] = within(0, x);
          const auto [y0, y1] = within(1, y);
          const auto [z0, z1] = within(2, z);
          const std::uint64_t layer = layer_bits(y0, y1, z0, z1);
          for (int i = x0; i <= x1; ++i) suspects_.voxels[block][std::size_t(i)] |= layer;
        }
  }

  /// A grid edge up from a voxel, both of its ends inside, that some triangle may cross.
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
        if (low > from + (a == axis ? 1.0 : 0.0) + kNearby || high < from - kNearby) return;
      }
      const Vector3d from = side_place(voxel);
      const double along = meeting(from, from + Vector3d::Unit(axis), piece);
      if (along >= 0.0) hits.push_back(along);
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
    bins_.for_each_cluster(band_.blocks[block], box, [&](const TriangleBins::Cluster& cluster) {
      for (std::size_t a = 0; a < 3; ++a)
        if (cluster.box.low[a] > box.high[a] + kNearby || cluster.box.high[a] < box.low[a] - kNearby) return;
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

  /// All that touch a suspicious voxel.
  std::vector<std::uint32_t> find_triangles() const {
    std::vector<std::vector<std::uint32_t>> small(suspects_.blocks.size());
    const auto keep_those_that_touch = [&](std::vector<std::uint32_t>& triangles) {
      Suspicion suspicion(suspects_, band_, bins_.blocks());
      std::erase_if(triangles, [&](std::uint32_t t) { return !suspicion.touches(Piece(soup_.corners(t))); });
    };
    parallel_blocks(small.size(), context_, [&](std::size_t i) {
      add_small_triangles(suspects_.blocks[i], small[i]);
      keep_those_that_touch(small[i]);
    });
    // A large triangle is under many blocks.
    std::vector<std::uint32_t> triangles;
    const auto sort = [&] {
      std::sort(triangles.begin(), triangles.end());
      triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
    };
    for (const std::uint32_t block : suspects_.blocks) {
      const std::span<const std::uint32_t> large = bins_.large(block);
      triangles.insert(triangles.end(), large.begin(), large.end());
    }
    sort();
    keep_those_that_touch(triangles);
    for (const auto& list : small) triangles.insert(triangles.end(), list.begin(), list.end());
    sort();
    return triangles;
  }

  void add_small_triangles(std::uint32_t block, std::vector<std::uint32_t>& triangles) const {
    const BlockAt& at = band_.blocks[block];
    bins_.for_each_cluster(at, around(at, 2.0), [&](const TriangleBins::Cluster& cluster) {
      for (std::size_t a = 0; a < 3; ++a)
        if (cluster.box.low[a] > at[a] * 8.0 + 9.0 || cluster.box.high[a] < at[a] * 8.0 - 1.0) return;
      triangles.insert(triangles.end(), cluster.triangles.begin(), cluster.triangles.end());
    });
  }

  std::vector<Remains> cut_all(const std::vector<std::uint32_t>& triangles) const {
    std::vector<std::uint32_t> all(triangles.size());
    std::iota(all.begin(), all.end(), 0u);
    std::vector<Remains> remains(triangles.size());
    for_each_triangle(triangles, all, false, nullptr,
                      [&](const Piece& piece, const Vector3d& normal, std::uint32_t i, Prober& prober) {
                        cut(piece, normal, prober, false, remains[i]);
                      });
    return remains;
  }

  /// Sheets that cross one another within a voxel enclose spaces that hold none, so that no way leads out of
  /// them, and only winding numbers tell an overlap from a gap. They are asked where inner sheets are the
  /// rule, and what is doubtful are the seams between them: parts of a model that overlap. Where as much is
  /// doubtful as is inner, these are the folds and crevices of a scan, of which nothing goes far; their walls
  /// stay. For winding numbers and the search for ways along a crevice take longer than all the rest of the
  /// signs; of a small model they are asked as well where little is doubtful.
  void settle_doubts(const std::vector<std::uint32_t>& triangles, std::vector<Remains>& remains) const {
    std::vector<std::uint32_t> doubtful;
    std::size_t seen_inner = 0, pieces = 0;
    double inner_area = 0, doubtful_area = 0;
    for (std::uint32_t i = 0; i < remains.size(); ++i) {
      if (!remains[i].doubtful.empty()) doubtful.push_back(i);
      seen_inner += remains[i].seen_inner ? 1 : 0;
      pieces += remains[i].doubtful.size();
      inner_area += remains[i].inner_area;
      doubtful_area += remains[i].doubtful_area;
    }
    if (doubtful.empty() || seen_inner == 0) return leave_doubts(doubtful, remains);
    constexpr std::size_t kTheRule = 4;  // inner triangles to a doubtful one, or inner area to doubtful area
    constexpr std::size_t kFewPieces = 5000, kSmallModel = 50'000;  // some tenths of a second
    // Of large triangles nearly all have doubtful places, along the edges of parts, however little these are.
    const bool little_doubt = pieces <= kFewPieces || inner_area >= double(kTheRule) * doubtful_area;
    const bool quick = little_doubt && soup_.size() <= kSmallModel;
    if (!quick && seen_inner < kTheRule * doubtful.size()) return leave_doubts(doubtful, remains);
    const OrientedWinding winding(soup_);
    if (!winding.usable()) return leave_doubts(doubtful, remains);
    for_each_triangle(triangles, doubtful, true, &winding.number(),
                      [&](const Piece&, const Vector3d& normal, std::uint32_t i, Prober& prober) {
                        for (const Piece& piece : remains[i].doubtful)
                          cut(piece, normal, prober, true, remains[i]);
                      });
  }

  static void leave_doubts(const std::vector<std::uint32_t>& doubtful, std::vector<Remains>& remains) {
    for (const std::uint32_t i : doubtful)
      remains[i].outer.insert(remains[i].outer.end(), remains[i].doubtful.begin(), remains[i].doubtful.end());
  }

  /// Calls f(triangle, its unit normal, number, prober) for some of the triangles, given by number, in
  /// parallel.
  template <class F>
  void for_each_triangle(const std::vector<std::uint32_t>& triangles, const std::vector<std::uint32_t>& some,
                         bool thorough, const WindingNumber* winding, F&& f) const {
    // Block by block, so that a neighbourhood is looked up once.
    std::vector<std::pair<BlockAt, std::uint32_t>> order(some.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) {
      const Vector3d centre = Piece(soup_.corners(triangles[some[i]])).centroid();
      for (int a = 0; a < 3; ++a) order[i].first[std::size_t(a)] = std::int32_t(std::floor(centre[a])) >> 3;
      order[i].second = some[i];
    }
    std::sort(order.begin(), order.end());
    tbb::enumerable_thread_specific<Prober> probers(
        [&] { return Prober(soup_, bins_, band_, inside_, suspects_, thorough, winding); });
    // One at a time where there are few: a large triangle may take as long as thousands of small ones.
    const std::size_t together = std::clamp<std::size_t>(order.size() / 1024, 1, 64);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, order.size(), together), [&](const auto& range) {
      Prober& prober = probers.local();
      for (std::size_t i = range.begin(); i != range.end(); ++i) {
        context_.check();
        const Piece piece = Piece(soup_.corners(triangles[order[i].second]));
        const Vector3d normal = piece.normal();
        if (normal.norm() > 0) f(piece, normal.normalized(), order[i].second, prober);
      }
    });
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
  Suspects suspects_;
};

}  // namespace

InnerSheets find_inner_sheets(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
                              const std::vector<VoxelBits>& inside, double reach, double voxel_size,
                              RunContext& context) {
  return Finder(soup, bins, band, inside, context).run(reach, voxel_size);
}

}  // namespace hermesh
