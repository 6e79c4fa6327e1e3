#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_collapse/merge_proposals.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

constexpr int kLevels = 4;  ///< blocks of 2^kLevels voxels are the largest
/// Largest root mean square distance of a node's vertex from the planes that it represents, in tolerances.
/// (With 0.45 the proof undoes about a tenth of the merged vertices, on CAD three quarters; with 0.1
/// unverified collapses take three times as long.)
constexpr double kShare = 0.3;
/// Largest cost of a node's planes, as a share of the largest cost of a collapse if there is one. (Without
/// this limit blocks leave a mesh twice as far away as collapses would; a tenth costs 2 % of the distance, a
/// fiftieth nothing, and saves half of the time.)
constexpr double kMomentShare = 0.05;

/// Builds the trees of sets in one block of the largest size after another. One object for each thread.
class BlockTrees {
 public:
  explicit BlockTrees(const DecimationInput& input) : in_(input), fine_(input.fine) {}

  /// Builds the sets of the block whose vertices are in `order` from `begin` to `end`. `position` has the
  /// index in `order` of each vertex. Writes node_of of these vertices, counted from 0, and appends to
  /// `nodes`, children first.
  void run(std::span<const std::uint32_t> order, std::span<const std::uint32_t> position, std::uint32_t begin,
           std::uint32_t end, std::vector<std::uint32_t>& node_of, std::vector<MergeForest::Node>& nodes) {
    points_ = order.subspan(begin, end - begin);
    sums_.assign(points_.size(), Sum());
    sets_ = DisjointSets(points_.size());
    node_at_.assign(points_.size(), MergeForest::kNone);
    cells_.resize(points_.size());
    anchor_ = fine_.points()[points_[0]];
    for (std::uint32_t i = 0; i < points_.size(); ++i) start(i);
    gather(position, begin, end);
    for (int level = 1; level <= kLevels; ++level) merge(level, node_of, nodes);
  }

 private:
  /// Sums over the vertices of a set.
  struct Sum {
    std::uint32_t points = 1, first = 0;
    std::int32_t euler = 1;  ///< vertices - edges + triangles
    float tolerance = 0;
    Vector3d places = Vector3d::Zero();
    WideQuadric quadric;
    void add(const Sum& other) {
      points += other.points;
      first = std::min(first, other.first);
      euler += other.euler;
      tolerance = std::min(tolerance, other.tolerance);
      places += other.places;
      quadric.a += other.quadric.a;
      quadric.b += other.quadric.b;
      quadric.c += other.quadric.c;
    }
  };

  void start(std::uint32_t i) {
    const std::uint32_t p = points_[i];
    Sum& sum = sums_[i];
    sum.first = p;
    sum.tolerance = in_.tolerance[p];
    sum.places = fine_.points()[p];
    // In double precision: the vertices of a polyhedron's creases and corners must remain on its planes.
    const Vector3d from_anchor = sum.places - anchor_;
    for_each_plane_at(fine_, p, [&](const Vector3d& n, double weight) {
      sum.quadric.add_plane(n, -n.dot(from_anchor), weight);
    });
    for (int a = 0; a < 3; ++a) cells_[i][a] = static_cast<std::int32_t>(std::floor(sum.places[a]));
  }

  /// Returns the level of the smallest block that contains two vertices: the highest bit in which their cells
  /// differ. In two's complement blocks at negative coordinates have the same width.
  int level(std::uint32_t i, std::uint32_t j) const {
    std::uint32_t differ = 1;
    for (int a = 0; a < 3; ++a) differ |= static_cast<std::uint32_t>(cells_[i][a] ^ cells_[j][a]);
    return std::bit_width(differ);
  }

  /// Lists the edges and triangles whose vertices are all in the block and not pinned, by the level of the
  /// smallest block that contains them. So an edge of a level connects different smaller blocks, never
  /// vertices of one set.
  void gather(std::span<const std::uint32_t> position, std::uint32_t begin, std::uint32_t end) {
    for (auto& edges : edges_) edges.clear();
    for (auto& triangles : triangles_) triangles.clear();
    const auto joins = [&](std::uint32_t p) {
      return position[p] >= begin && position[p] < end && !in_.pinned[p];
    };
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
      const std::uint32_t p = points_[i];
      if (in_.pinned[p]) continue;
      for (const std::uint32_t t : fine_.around(p)) {
        const Triangle& corners = fine_.triangles()[t];
        const std::uint32_t q = fine_.next(t, p);
        if (!joins(q)) continue;
        const std::uint32_t j = position[q] - begin;
        const int of_edge = level(i, j);
        // In a closed and oriented mesh an edge occurs once in each direction.
        if (p < q) edges_[of_edge - 1].push_back({i, j});
        if (corners[0] != p || !joins(corners[2])) continue;
        // The smallest block that contains the first corner and each of the others contains all three.
        triangles_[std::max(of_edge, level(i, position[corners[2]] - begin)) - 1].push_back(i);
      }
    }
  }

  /// Joins the sets that the edges of a level connect, and makes a node for each result.
  void merge(int level, std::vector<std::uint32_t>& node_of, std::vector<MergeForest::Node>& nodes) {
    merged_.clear();
    const auto first_new = static_cast<std::uint32_t>(nodes.size());
    // Each set or single vertex that becomes part of a new set is listed once, with its node so far.
    for (const auto& [i, j] : edges_[level - 1]) {
      const std::uint32_t a = sets_.find(i), b = sets_.find(j);
      if (a == b) continue;
      for (const std::uint32_t root : {a, b})
        if (node_at_[root] == MergeForest::kNone || node_at_[root] < first_new)
          merged_.push_back({root, node_at_[root]});
      const std::uint32_t joined = sets_.join(a, b);
      sums_[joined].add(sums_[joined == a ? b : a]);
      node_at_[joined] = first_new;  // marks a new set
    }
    // Only now are the sets of this level known; an edge or a triangle is in the set of any of its vertices.
    for (const auto& [i, j] : edges_[level - 1]) --sums_[sets_.find(i)].euler;
    for (const std::uint32_t i : triangles_[level - 1]) ++sums_[sets_.find(i)].euler;
    // One new node for each set; the former sets and single vertices become its children. A set that does not
    // merge gets a node as well, because a larger one around it may merge.
    for (const auto& [root, node] : merged_) node_at_[sets_.find(root)] = MergeForest::kNone;
    for (const auto& [root, node] : merged_) {
      std::uint32_t& at = node_at_[sets_.find(root)];
      if (at == MergeForest::kNone) {
        at = static_cast<std::uint32_t>(nodes.size());
        nodes.push_back(node_of_sum(sums_[sets_.find(root)], level));
      }
      if (node == MergeForest::kNone)
        node_of[points_[root]] = at;
      else
        nodes[node].parent = at;
    }
  }

  MergeForest::Node node_of_sum(const Sum& sum, int level) const {
    MergeForest::Node node;
    node.first = sum.first;
    // Connected with Euler characteristic 1: a disc or a tree, which shrinks to a point without a change of
    // topology.
    if (sum.euler != 1) return node;
    const Vector3d middle = sum.places / double(sum.points);
    WideQuadric q = sum.quadric;  // about the middle
    const Vector3d shift = middle - anchor_;
    q.c = q(shift);
    q.b += q.a * shift;
    Vector3d x = q.minimiser();
    const double reach = double(1 << level);
    // Nearly parallel planes meet far away: limited to the width of the block.
    if (x.squaredNorm() > reach * reach) x *= reach / x.norm();
    const double off = q(x);
    node.merges = off <= kShare * kShare * double(sum.tolerance) * double(sum.tolerance) * q.a.trace() &&
                  (in_.moment <= 0 || off <= kMomentShare * in_.moment);
    if (!node.merges) return node;
    node.place = in_.file.rounded(middle + x);
    node.merges = in_.admits(node.place);
    node.quadric = q.about(node.place - middle);
    return node;
  }

  const DecimationInput& in_;
  const FineMesh& fine_;
  std::span<const std::uint32_t> points_;
  Vector3d anchor_;
  std::vector<std::array<std::int32_t, 3>> cells_;
  std::vector<Sum> sums_;  ///< by vertex; of a root that of its set
  DisjointSets sets_;
  std::vector<std::uint32_t> node_at_;  ///< node of each root, or kNone
  std::array<std::vector<std::pair<std::uint32_t, std::uint32_t>>, kLevels> edges_;
  std::array<std::vector<std::uint32_t>, kLevels> triangles_;  ///< one corner of each, by level
  std::vector<std::pair<std::uint32_t, std::uint32_t>> merged_;
};

/// Returns the number of the largest block that contains a position: 21 bits an axis.
std::uint64_t block_key(const Vector3d& p) {
  std::uint64_t key = 0;
  for (int a = 0; a < 3; ++a)
    key = key << 21 |
          ((static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(p[a]))) >> kLevels) & 0x1fffff);
  return key;
}

}  // namespace

MergeForest block_forest(const DecimationInput& input, const RunContext& context) {
  const std::vector<Vector3d>& points = input.fine.points();
  // Vertices by block, then by index, so that the order does not depend on the thread schedule.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(points.size());
  parallel_blocks(points.size(), context, [&](std::size_t p) {
    keys[p] = {block_key(points[p]), static_cast<std::uint32_t>(p)};
  });
  tbb::parallel_sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(points.size()), position(points.size()), first;
  for (std::uint32_t i = 0; i < keys.size(); ++i) {
    order[i] = keys[i].second;
    position[order[i]] = i;
    if (i == 0 || keys[i].first != keys[i - 1].first) first.push_back(i);
  }
  first.push_back(static_cast<std::uint32_t>(points.size()));
  std::vector<std::pair<std::uint64_t, std::uint32_t>>().swap(keys);

  // Blocks share no vertices, and edges between them do not count, so blocks are independent.
  std::vector<std::uint32_t> node_of(points.size(), MergeForest::kNone);
  const std::size_t n = first.size() - 1;
  std::vector<std::vector<MergeForest::Node>> nodes(n);
  tbb::enumerable_thread_specific<BlockTrees> trees([&] { return BlockTrees(input); });
  parallel_blocks(n, context, [&](std::size_t b) {
    trees.local().run(order, position, first[b], first[b + 1], node_of, nodes[b]);
  });
  // Nodes are numbered block by block: children stay before their parents.
  std::vector<std::uint64_t> start(n);
  for (std::size_t b = 0; b < n; ++b) start[b] = nodes[b].size();
  std::vector<MergeForest::Node> all(exclusive_scan(start, "blocks"));
  parallel_blocks(n, context, [&](std::size_t b) {
    const auto shift = static_cast<std::uint32_t>(start[b]);
    const auto moved = [&](std::uint32_t node) { return node == MergeForest::kNone ? node : node + shift; };
    for (std::size_t i = 0; i < nodes[b].size(); ++i) {
      nodes[b][i].parent = moved(nodes[b][i].parent);
      all[shift + i] = nodes[b][i];
    }
    for (std::uint32_t i = first[b]; i < first[b + 1]; ++i) node_of[order[i]] = moved(node_of[order[i]]);
  });
  return MergeForest(std::move(all), std::move(node_of));
}

}  // namespace hermesh
