#include "algorithms/extraction/manifold_dual_contouring/regions.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <memory>
#include <utility>

#include "algorithms/extraction/manifold_dual_contouring/quadric.h"
#include "algorithms/extraction/manifold_dual_contouring/widened_mask.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// A cube's place may be farther from the planes than this share of the tolerance, root mean square.
constexpr double kShare = 0.3;
/// Length of the mean of a cube's unit normals: what bends more than this, the proof would split.
constexpr double kLeastAgreement = 0.93;
/// How strongly the place is drawn to the mean of the crossings, against the planes: it should lie in the middle of
/// what it stands for, but on the surface.
constexpr double kPullToMean = 0.02;
/// Steps from a cell whose polygons the rule of envelopes does not cover (uniform_mesh.h) to the nearest cell that may
/// become part of a cube. Its polygons lie within the cells next to it, and those of a cube, if they are not loose, within the
/// cube and the cells next to that.
constexpr int kAway = 3;

/// Level at which a plane of the lattice comes to lie within a cube, by its coordinate in the block; beyond kLevels if never.
int level_within(int coordinate) { return coordinate == 0 ? Regions::kLevels + 1 : std::countr_zero(unsigned(coordinate)) + 1; }

/// By face the corners of a cell, as bits.
constexpr std::array<int, 6> kFaceCorners = [] {
  std::array<int, 6> result{};
  for (int face = 0; face < 6; ++face)
    for (const int corner : face_corners(face)) result[face] |= 1 << corner;
  return result;
}();

}  // namespace

/// Of one block.
class Regions::Proposals {
 public:
  Proposals(const CellBlocks& cells, std::span<const float> tolerance, const FilePoints& file)
      : cells_(cells), tolerance_(tolerance), file_(file) {}

  void run(std::int32_t block, const BlockMask& fixed, BlockRegions& result, std::vector<Cube>& cubes) {
    block_ = block;
    corner_ = cells_.corner(block, 0);
    std::uint64_t used = 0;
    std::uint32_t number = cells_.cell_number(block, 0), point = cells_[block].first_point;
    cells_.grid().crossings(block, crossings_.data());
    for (std::size_t axis = 0; axis < 3; ++axis)
      next_[axis] = crossings_.data() + cells_.source(block).before[axis][0];
    for_each_bit(cells_[block].active, [&](int cell) {
      const int cube = cube_of(cell, 1);
      if (!((used >> cube) & 1)) sums_[1][cube] = Sum();
      used |= std::uint64_t{1} << cube;
      start(cell, number++, point++, test(fixed, cell));
    });
    propose(1, used, result, cubes);
    for (int level = 2; level <= kLevels; ++level) {
      std::uint64_t of_parts = std::exchange(used, 0);
      for (; of_parts != 0; of_parts &= of_parts - 1) {
        const int part = std::countr_zero(of_parts), first = first_cell(part, level - 1), cube = cube_of(first, level);
        if (!((used >> cube) & 1)) sums_[level][cube] = Sum();
        used |= std::uint64_t{1} << cube;
        const int at[3] = {first >> 6, (first >> 3) & 7, first & 7};
        sums_[level][cube].add(sums_[level - 1][part], octant(at, level));
      }
      for (const Link& link : links_[level]) link_octants(sums_[level][link.cube], link);
      links_[level].clear();
      propose(level, used, result, cubes);
    }
    result.alive = result.proposed;
  }

 private:
  struct Sum {
    int cells = 0, crossings = 0;
    int euler = 0;  ///< points − edges + polygons of the mesh of its cells
    bool is_disc = true;
    unsigned there = 0;       ///< octants with a cell
    std::uint64_t links = 0;  ///< which of them hang together, eight bits for each
    float tolerance = std::numeric_limits<float>::max();
    Vector3d mean = Vector3d::Zero(), normal = Vector3d::Zero();
    WideQuadric quadric;  ///< about the block's corner

    void add(const Sum& part, int octant) {
      there |= 1u << octant;
      cells += part.cells;
      crossings += part.crossings;
      euler += part.euler;
      is_disc = is_disc && part.is_disc;
      tolerance = std::min(tolerance, part.tolerance);
      mean += part.mean;
      normal += part.normal;
      quadric.a += part.quadric.a;
      quadric.b += part.quadric.b;
      quadric.c += part.quadric.c;
    }
    bool hangs_together() const {
      unsigned reached = there & -there, before = 0;
      while (reached != before) {
        before = reached;
        for (int i = 0; i < 8; ++i)
          if ((reached >> i) & 1) reached |= static_cast<unsigned>(links >> (8 * i)) & 0xffu;
      }
      return reached == there;
    }
  };
  /// A face between two octants that the surface passes through, or an edge with cells in several.
  struct Link {
    int cube, octant, other;  ///< the same octant for an edge
  };

  static void link_octants(Sum& sum, const Link& link) {
    if (link.octant == link.other) {
      ++sum.euler;
      return;
    }
    --sum.euler;
    sum.links |= std::uint64_t{1} << (8 * link.octant + link.other) | std::uint64_t{1} << (8 * link.other + link.octant);
  }
  void link(int cell, int level, const Link& link) {
    if (level == 1) link_octants(sums_[1][cube_of(cell, 1)], link);
    else if (level <= kLevels) links_[static_cast<std::size_t>(level)].push_back(link);
  }

  void start(int cell, std::uint32_t number, std::uint32_t point, bool fixed) {
    const int at[3] = {cell >> 6, (cell >> 3) & 7, cell & 7};
    Sum& sum = sums_[1][cube_of(cell, 1)];
    sum.there |= 1u << octant(at, 1);
    ++sum.cells;
    ++sum.euler;
    const float tolerance = tolerance_[point];
    sum.tolerance = std::min(sum.tolerance, tolerance);
    sum.is_disc = sum.is_disc && !fixed && tolerance > 0;
    const int signs = cells_.corner_signs(number);
    for (int a = 0; a < 3; ++a) {
      const int face = signs & kFaceCorners[2 * a];
      if (face == 0 || face == kFaceCorners[2 * a]) continue;
      const int level = level_within(at[a]);
      if (level > kLevels) continue;
      int below[3] = {at[0], at[1], at[2]};
      --below[a];
      link(cell, level, {cube_of(cell, level), octant(at, level), octant(below, level)});
    }
    for (int a = 0; a < 3; ++a) {
      const bool inside = signs & 1, beyond = (signs >> (1 << a)) & 1;
      if (inside == beyond) continue;
      const int level = std::max(level_within(at[(a + 1) % 3]), level_within(at[(a + 2) % 3]));
      if (level <= kLevels) link(cell, level, {cube_of(cell, level), 0, 0});
      const EdgeCrossing& crossing = *next_[static_cast<std::size_t>(a)]++;
      Vector3d p(at[0], at[1], at[2]);
      p[a] += double(crossing.offset);
      const Vector3d n(crossing.normal[0], crossing.normal[1], crossing.normal[2]);
      const double d = -n.dot(p);
      sum.quadric.a += n * n.transpose();
      sum.quadric.b += d * n;
      sum.quadric.c += d * d;
      sum.mean += p;
      sum.normal += n;
      ++sum.crossings;
    }
  }

  void propose(int level, std::uint64_t used, BlockRegions& result, std::vector<Cube>& cubes) {
    for (; used != 0; used &= used - 1) {
      const int cube = std::countr_zero(used);
      Sum& sum = sums_[level][cube];
      sum.is_disc = sum.is_disc && sum.euler == 1 && sum.hangs_together();
      Vector3d place;
      const bool agree = sum.normal.norm() >= kLeastAgreement * sum.crossings;
      if (sum.cells < 2 || !sum.is_disc || !agree || !crosses_an_edge(cube, level) || !find_place(sum, cube, level, place))
        continue;
      result.proposed[level - 1] |= std::uint64_t{1} << cube;
      cubes.push_back({place, sum.normal.normalized().cast<float>(), sum.tolerance});
    }
  }

  static int octant(const int at[3], int level) {
    const int bit = level - 1;
    return ((at[0] >> bit) & 1) << 2 | ((at[1] >> bit) & 1) << 1 | ((at[2] >> bit) & 1);
  }

  /// Else the border lies within one face, and beyond it is perhaps one other cube: with no third region around any edge there
  /// would be no polygon at all.
  bool crosses_an_edge(int cube, int level) const {
    const int first = first_cell(cube, level), side = 1 << level;
    const int lower[3] = {first >> 6, (first >> 3) & 7, first & 7};
    for (int axis = 0; axis < 3; ++axis)
      for (int corner = 0; corner < 4; ++corner)
        for (int k = 0; k < side; ++k) {
          int at[3] = {lower[0], lower[1], lower[2]};
          at[axis] += k;
          at[(axis + 1) % 3] += corner & 1 ? side : 0;
          at[(axis + 2) % 3] += corner & 2 ? side : 0;
          const CellBlocks::Cell sample = cells_.locate(block_, at[0], at[1], at[2]);
          if (cells_.is_crossed({sample.block, sample.cell, axis})) return true;
        }
    return false;
  }

  bool find_place(const Sum& sum, int cube, int level, Vector3d& place) const {
    if (sum.crossings == 0) return false;
    const Vector3d mean = sum.mean / sum.crossings;
    WideQuadric q = sum.quadric;  // about the mean
    q.c = q(mean);
    q.b += q.a * mean;
    const double weight = kPullToMean * q.a.trace() + 1e-12;
    Vector3d x = mean + (q.a + weight * Eigen::Matrix3d::Identity()).ldlt().solve(-q.b);
    const int first = first_cell(cube, level);
    const double margin = cells_.margin();
    const int at[3] = {first >> 6, (first >> 3) & 7, first & 7};
    for (int a = 0; a < 3; ++a) x[a] = std::clamp(x[a], at[a] + margin, at[a] + (1 << level) - margin);
    const double most = kShare * double(sum.tolerance);
    if (!(q(x - mean) <= most * most * sum.crossings)) return false;
    place = file_.rounded(corner_ + x);
    return true;
  }

  const CellBlocks& cells_;
  const std::span<const float> tolerance_;
  const FilePoints& file_;
  std::int32_t block_ = 0;
  Vector3d corner_;
  std::array<EdgeCrossing, 3 * 512> crossings_;         ///< of the block
  std::array<const EdgeCrossing*, 3> next_;             ///< by axis: that of the next cell's edge
  std::array<std::array<Sum, 64>, kLevels + 1> sums_;   ///< by level and cube
  std::array<std::vector<Link>, kLevels + 1> links_;    ///< by level
};

Regions::Regions(const CellBlocks& cells, const std::vector<Vector3d>& points, std::span<const float> tolerance,
                 const FilePoints& file, RunContext& context)
    : cells_(cells), points_(points), tolerance_(tolerance), file_(file), blocks_(cells.size()) {
  Stage stage(context, "propose regions");
  const std::size_t n = cells.size();
  std::vector<BlockMask> special(n);
  std::vector<std::uint8_t> any_special(n);
  parallel_blocks(n, context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    for_each_bit(cells[block].active, [&](int cell) {
      const CellSheets& sheets = cells.sheets(block, cell);
      if (sheets.sheets != 1 || sheets.ambiguous_faces != 0 || cells.is_joint(block, cell))
        special[b][cell >> 6] |= std::uint64_t{1} << (cell & 63);
    });
    any_special[b] = any(special[b]);
  });
  std::vector<std::vector<Cube>> cubes(n);
  tbb::enumerable_thread_specific<std::unique_ptr<Proposals>> proposals(
      [&] { return std::make_unique<Proposals>(cells, tolerance, file); });
  parallel_blocks(n, context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    if (!any(cells[block].active)) return;
    const auto& neighbours = cells.grid().blocks()[b].neighbours;
    const bool near_special = std::ranges::any_of(neighbours, [&](std::int32_t there) {
      return there >= 0 && any_special[static_cast<std::size_t>(there)];
    });
    BlockMask fixed{};
    if (near_special)
      fixed = widened<kAway>([&](int ax, int ay, int az) -> const BlockMask* {
        const std::int32_t there = neighbours[static_cast<std::size_t>(neighbour_slot(ax, ay, az))];
        return there < 0 ? nullptr : &special[static_cast<std::size_t>(there)];
      });
    proposals.local()->run(block, fixed, blocks_[b], cubes[b]);
  });
  std::vector<std::uint64_t> first(n);
  for (std::size_t b = 0; b < n; ++b) first[b] = cubes[b].size();
  cubes_.resize(exclusive_scan(first, "regions"));
  parallel_blocks(n, context, [&](std::size_t b) {
    auto next = static_cast<std::uint32_t>(first[b]);
    for (std::size_t level = 0; level < kLevels; ++level) {
      blocks_[b].first_cube[level] = next;
      next += static_cast<std::uint32_t>(bits_in(blocks_[b].proposed[level]));
    }
    std::copy(cubes[b].begin(), cubes[b].end(), cubes_.begin() + static_cast<std::ptrdiff_t>(first[b]));
  });
}

std::array<BlockMask, 3> Regions::outer_edges(std::int32_t block) const {
  std::array<BlockMask, 3> result = cells_.source(block).crossing;
  for_each(
      block,
      [&](const Region& cube) {
        const int lower[3] = {cube.cell >> 6, (cube.cell >> 3) & 7, cube.cell & 7};
        for (int axis = 0; axis < 3; ++axis) {
          const auto from = [&](int a) { return lower[a] + (a != axis); };
          std::uint64_t rows = 0;
          const std::uint64_t row = ((1u << (lower[2] + cube.side())) - 1) & ~((1u << from(2)) - 1);
          for (int y = from(1); y < lower[1] + cube.side(); ++y) rows |= row << (8 * y);
          for (int x = from(0); x < lower[0] + cube.side(); ++x) result[axis][x] &= ~rows;
        }
      },
      [](int) {});
  return result;
}

Vector3d Regions::normal(const Region& region) const {
  if (region.merged()) return cubes_[number(region)].normal.cast<double>();
  Vector3d sum = Vector3d::Zero();
  const int signs = cells_.corner_signs(cells_.cell_number(region.block, region.cell));  // Hermite data have no joints
  for (unsigned edges = kCrossedEdges[static_cast<std::size_t>(signs)]; edges != 0; edges &= edges - 1) {
    const CellBlocks::Edge at = cells_.edge_of_cell(region.block, region.cell, std::countr_zero(edges));
    const auto n = cells_.grid().crossing(at.block, at.sample, at.axis).normal;
    sum += Vector3d(n[0], n[1], n[2]);
  }
  return sum.normalized();
}

}  // namespace hermesh
