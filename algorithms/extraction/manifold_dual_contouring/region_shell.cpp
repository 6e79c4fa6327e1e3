#include "algorithms/extraction/manifold_dual_contouring/region_shell.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/shell_prism.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using shell_kernels::Planes;

/// Heights of prisms in voxels, but for the tolerance itself. Where prisms are low there is less to look at,
/// and small triangles have no high ones. Neighbours may have prisms of different heights: on the wall
/// between them each line meets S once in either.
constexpr double kFirst = 0.5, kLow = 0.125;

/// Of distances within a block from planes a few blocks away, far above what single precision makes of them.
constexpr float kSingleRounding = 1e-4f;

/// Relative to the triangle's first corner.
class ShellPlanes {
 public:
  explicit ShellPlanes(const ShellPrism& prism) : origin_(prism.over().frame().origin) {
    const auto& [axes, origin, offsets] = prism.over().frame();
    for (int side = 0; side < 3; ++side)
      for (int end = 0; end < 2; ++end) {
        const double lean = prism.leans()[static_cast<std::size_t>(side)][static_cast<std::size_t>(end)];
        const double length = std::sqrt(1 + lean * lean);  // divided by it, so that rounding weighs alike
        set(2 * side + end, (axes.row(side) - lean * axes.row(3)).transpose() / length,
            (offsets[side] - lean * offsets[3]) / length);
      }
    set(Planes::kLid, prism.lid().normal(), -prism.lid().signedDistance(origin));
    set(Planes::kBottom, prism.bottom().normal(), -prism.bottom().signedDistance(origin));
    planes_.rounding = kSingleRounding;
  }
  /// For points relative to `corner`.
  const Planes& relative_to(const Vector3d& corner) {
    const Vector3d step = corner - origin_;
    for (std::size_t p = 0; p < Planes::kAll; ++p)
      planes_.offsets[p] = static_cast<float>(offsets_[p] - normals_[p].dot(step));
    return planes_;
  }

 private:
  void set(int plane, const Vector3d& normal, double offset) {
    normals_[static_cast<std::size_t>(plane)] = normal;
    offsets_[static_cast<std::size_t>(plane)] = offset;
    for (int a = 0; a < 3; ++a) planes_.normals[plane][a] = static_cast<float>(normal[a]);
  }
  Vector3d origin_;
  std::array<Vector3d, Planes::kAll> normals_;
  std::array<double, Planes::kAll> offsets_;
  Planes planes_;
};

}  // namespace

/// What of S may reach into the prisms of a polygon.
struct RegionShell::Nearby {
  /// Points that follow one another, of one block.
  struct Run {
    std::uint32_t first;
    int count;
    Vector3d corner;
  };
  std::vector<Run> runs;  ///< with all corners of the quads
  std::vector<std::uint32_t> quads;
  std::vector<Triangle> fans;

  void clear() {
    runs.clear();
    quads.clear();
    fans.clear();
  }
};

struct RegionShell::Scratch {
  Nearby nearby;
  std::array<Vector3d, RegionPolygon::kFirstSide + 4> pillars;
  std::array<std::pair<Vector3d, Vector3d>, 4> cubes;  ///< of the polygon's regions
  double height, highest;                              ///< of this prism, of any
  bool is_there;                                       ///< S has been found in a prism
  std::vector<std::uint8_t> certain;                   ///< by point, of this prism; only those in runs
  std::vector<Triangle> good;                          ///< of S, whatever of them is in this prism

  /// Whether the cell of this point belongs to one of the regions: points lie in their cells.
  bool is_own(const Vector3d& p, int regions) const {
    for (std::size_t i = 0; i < static_cast<std::size_t>(regions); ++i)
      if ((p.array() > cubes[i].first.array()).all() && (p.array() < cubes[i].second.array()).all())
        return true;
    return false;
  }
  bool is_own(const Corners& points, int regions) const {
    return std::ranges::any_of(points, [&](const Vector3d& p) { return is_own(p, regions); });
  }
};

RegionShell::RegionShell(const Regions& regions, const EdgePolygons& polygons,
                         const std::vector<Vector3d>& points, std::span<const float> tolerance,
                         RunContext& context)
    : regions_(regions),
      cells_(regions.cells()),
      polygons_(polygons),
      points_(points),
      tolerance_(tolerance),
      least_tolerance_(tolerance.empty() ? 0.0f : *std::ranges::min_element(tolerance)),
      first_quad_(cells_.size()),
      scratch_([&points] {
        auto scratch = std::make_unique<Scratch>();
        scratch->certain.resize(points.size());
        return scratch;
      }) {
  std::vector<std::uint64_t> first(cells_.size());
  for (std::size_t b = 0; b < first.size(); ++b)
    for (const BlockMask& crossing : cells_.source(static_cast<std::int32_t>(b)).crossing)
      first[b] += static_cast<std::uint64_t>(count(crossing));
  quads_.resize(exclusive_scan(first, "edge crossings"));
  for (LargeArray<float>& coordinates : in_blocks_)
    coordinates.resize(cells_.point_count() + shell_kernels::kLargestVector);
  parallel_blocks(cells_.size(), context,
                  [&](std::size_t b) { describe(static_cast<std::int32_t>(b), first[b]); });
}

RegionShell::~RegionShell() = default;

void RegionShell::describe(std::int32_t block, std::uint64_t first_quad) {
  first_quad_[static_cast<std::size_t>(block)] = static_cast<std::uint32_t>(first_quad);
  PlainPoints near;
  near.read(cells_, block);
  cells_.for_each_crossing_edge(block, [&](const CellBlocks::Edge& edge) {
    Quad& quad = quads_[first_quad++];
    if (!polygons_.is_fanned(edge))
      polygons_.polygons_of(
          edge, [&](const Quad& q) { quad = q; }, [](const Triangle&) {}, &near);
  });
  const Vector3d corner = cells_.corner(block, 0);
  const std::uint32_t first = cells_[block].first_point, count = cells_.points_in(block);
  for (std::uint32_t point = first; point < first + count; ++point)
    for (std::size_t a = 0; a < 3; ++a)
      in_blocks_[a][point] =
          static_cast<float>(points_[point][static_cast<int>(a)] - corner[static_cast<int>(a)]);
}

void RegionShell::gather(const RegionPolygon& polygon, double height, Nearby& nearby) const {
  nearby.clear();
  Vector3d lower = polygon.points[0], upper = lower;
  polygon.for_each_triangle([&](int a, int b, int c) {
    for (const int corner : {a, b, c}) {
      const Vector3d place = polygon.place(corner);
      lower = lower.cwiseMin(place);
      upper = upper.cwiseMax(place);
    }
  });
  // Edges that touch a cell that the prisms may reach into, and all cells that touch these.
  int from[3], to[3];
  for (int a = 0; a < 3; ++a) {
    from[a] = static_cast<int>(std::floor(lower[a] - height));
    to[a] = static_cast<int>(std::floor(upper[a] + height)) + 1;
  }
  std::array<Vector3d, 4> corners;
  for (int i = 0; i < polygon.corners; ++i)
    corners[static_cast<std::size_t>(i)] = cells_.corner(polygon.regions[i].block, 0);
  int first_step[3], last_step[3];  // in blocks, from the first region's
  for (int a = 0; a < 3; ++a) {
    first_step[a] = (from[a] - 1 - int(corners[0][a])) >> 3;
    last_step[a] = (to[a] - int(corners[0][a])) >> 3;
  }
  for (int x = first_step[0]; x <= last_step[0]; ++x)
    for (int y = first_step[1]; y <= last_step[1]; ++y)
      for (int z = first_step[2]; z <= last_step[2]; ++z) {
        const Vector3d corner = corners[0] + 8 * Vector3d(x, y, z);
        // The regions' blocks are all those around the polygon's edge, so one of them is next to it.
        for (int i = 0; i < polygon.corners; ++i) {
          const Vector3d step = (corner - corners[static_cast<std::size_t>(i)]) / 8;
          if (step.cwiseAbs().maxCoeff() > 1) continue;
          const int slot = neighbour_slot(int(step[0]), int(step[1]), int(step[2]));
          const std::int32_t block =
              cells_.source(polygon.regions[i].block).neighbours[static_cast<std::size_t>(slot)];
          if (block >= 0) gather(block, corner, from, to, nearby);
          break;
        }
      }
}

void RegionShell::gather(std::int32_t block, const Vector3d& corner, const int (&from)[3], const int (&to)[3],
                         Nearby& nearby) const {
  int begin[3], end[3];
  for (int a = 0; a < 3; ++a) {
    begin[a] = std::max(0, from[a] - int(corner[a]));
    end[a] = std::min(8, to[a] + 1 - int(corner[a]));
  }
  const CellBlocks::Block& own = cells_[block];
  const int first_row = std::max(0, from[1] - 1 - int(corner[1]));
  const std::uint64_t before = (std::uint64_t{1} << (8 * first_row)) - 1;
  const std::uint64_t until = end[1] == 8 ? ~std::uint64_t{0} : (std::uint64_t{1} << (8 * end[1])) - 1;
  for (int x = std::max(0, from[0] - 1 - int(corner[0])); x < end[0]; ++x) {
    const std::uint64_t word = own.active[static_cast<std::size_t>(x)];
    if (const int points = bits_in(word & until & ~before))
      nearby.runs.push_back({own.first_point + own.rank[static_cast<std::size_t>(x)] +
                                 static_cast<std::uint32_t>(bits_in(word & before)),
                             points, corner});
  }
  if (!own.several.empty()) {
    const std::uint32_t end_of_points = own.first_point + cells_.points_in(block);
    for (std::uint32_t first = own.first_point + static_cast<std::uint32_t>(count(own.active));
         first < end_of_points; first += shell_kernels::kMost)
      nearby.runs.push_back({first, std::min(shell_kernels::kMost, int(end_of_points - first)), corner});
  }
  if (begin[0] >= end[0] || begin[1] >= end[1] || begin[2] >= end[2]) return;
  const std::uint64_t row = ((1u << end[2]) - 1) & ~((1u << begin[2]) - 1);
  std::uint64_t rows = 0;
  for (int y = begin[1]; y < end[1]; ++y) rows |= row << (8 * y);
  const std::uint64_t below = (rows & -rows) - 1;
  const HermiteView::Block& source = cells_.source(block);
  for (int axis = 0; axis < 3; ++axis)
    for (int x = begin[0]; x < end[0]; ++x) {
      const std::uint64_t all = source.crossing[axis][x];
      if ((all & rows) == 0) continue;
      std::uint32_t number = first_quad_[static_cast<std::size_t>(block)] + source.before[axis][x] +
                             static_cast<std::uint32_t>(bits_in(all & below));
      const std::uint64_t fanned = polygons_.fanned(block, axis)[x];
      for (std::uint64_t word = all & ~below & until; word != 0; word &= word - 1, ++number) {
        const std::uint64_t bit = word & -word;
        if ((bit & rows) == 0) continue;
        if ((bit & fanned) == 0)
          nearby.quads.push_back(number);
        else
          polygons_.polygons_of(
              {block, 64 * x + std::countr_zero(bit), axis}, [](const Quad&) {},
              [&](const Triangle& t) { nearby.fans.push_back(t); });
      }
    }
}

bool RegionShell::holds(const RegionPolygon& polygon) const {
  Scratch& scratch = *scratch_.local();
  double most = kFarthest;
  for (int i = 0; i < polygon.corners; ++i) {
    const Region& region = polygon.regions[i];
    most = std::min(most, double(regions_.tolerance(region)));
    scratch.pillars[static_cast<std::size_t>(i)] = regions_.normal(region);
    const Vector3d lower = cells_.corner(region.block, region.cell);
    scratch.cubes[static_cast<std::size_t>(i)] = {lower, lower + Vector3d::Constant(region.side())};
  }
  if (polygon.cut.fanned) {
    const CellBlocks::Edge& edge = polygon.crossing;
    const auto& n = cells_.grid().crossing(edge.block, edge.sample, edge.axis).normal;
    scratch.pillars[RegionPolygon::kMiddle] = Vector3d(n[0], n[1], n[2]).normalized();
    for (int i = 0; i < polygon.corners; ++i)
      scratch.pillars[static_cast<std::size_t>(RegionPolygon::kFirstSide + i)] =
          (scratch.pillars[static_cast<std::size_t>(i)] +
           scratch.pillars[static_cast<std::size_t>(polygon.next(i))])
              .normalized();
  }
  scratch.is_there = false;
  scratch.highest = most;
  unsigned open = ~0u;
  double before = 0;
  const double lowest = std::min(kLow, most);
  for (const double height : {std::min(kFirst, most), most, lowest}) {
    if (std::exchange(before, height) == height) continue;
    scratch.height = height;
    gather(polygon, height, scratch.nearby);
    unsigned number = 0, still_open = 0;
    bool fails = false;
    polygon.for_each_triangle([&](int a, int b, int c) {
      const unsigned bit = 1u << number++;
      if (fails || !(open & bit)) return;
      const Answer answer = look(polygon, {a, b, c}, scratch);
      fails = answer == Answer::no || (answer == Answer::perhaps && height == lowest);
      if (answer != Answer::yes) still_open |= bit;
    });
    if (fails) return false;
    open = still_open;
    if (open == 0) break;
  }
  return open == 0 && scratch.is_there;
}

/// No exact number is needed where points keep off the prism's planes: then they are told by kernels.
RegionShell::Answer RegionShell::look(const RegionPolygon& polygon, const std::array<int, 3>& corners,
                                      Scratch& scratch) const {
  const auto pillar = [&](std::size_t i) { return scratch.pillars[static_cast<std::size_t>(corners[i])]; };
  const ShellPrism prism({polygon.place(corners[0]), polygon.place(corners[1]), polygon.place(corners[2])},
                         {pillar(0), pillar(1), pillar(2)}, scratch.height);
  if (!prism.stands()) return Answer::perhaps;
  const auto is_own = [&](const auto& place) { return scratch.is_own(place, polygon.corners); };

  bool is_there = scratch.is_there;
  ShellPlanes planes(prism);
  Vector3d corner = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Planes* relative = nullptr;
  std::array<std::uint8_t, shell_kernels::kMost + shell_kernels::kLargestVector> certain;
  for (const Nearby::Run& run : scratch.nearby.runs) {
    if (corner != run.corner) relative = &planes.relative_to(corner = run.corner);
    const shell_kernels::Found found = classify_(
        {&in_blocks_[0][run.first], &in_blocks_[1][run.first], &in_blocks_[2][run.first], run.count},
        *relative, certain.data());
    std::memcpy(&scratch.certain[run.first], certain.data(), static_cast<std::size_t>(run.count));
    const auto any_own = [&](std::uint64_t bits) {
      for (; bits != 0; bits &= bits - 1)
        if (is_own(points_[run.first + static_cast<std::uint32_t>(std::countr_zero(bits))])) return true;
      return false;
    };
    // What is farther than the tolerance here is not nearer in a lower prism.
    if (found.beyond && scratch.height == scratch.highest && any_own(found.beyond)) return Answer::no;
    if (!is_there && found.inside) is_there = any_own(found.inside);
  }

  const auto tolerance_of = [&](const Triangle& t) {
    return double(std::min({tolerance_[t[0]], tolerance_[t[1]], tolerance_[t[2]]}));
  };
  const auto faces = [&](const Triangle& t) {
    const Vector3d normal = (points_[t[1]] - points_[t[0]]).cross(points_[t[2]] - points_[t[0]]);
    return std::ranges::all_of(prism.pillars(), [&](const Vector3d& up) { return normal.dot(up) > 0; });
  };
  std::vector<Triangle>& good = scratch.good;
  good.clear();
  const auto holds = [&](const Triangle& t) {
    const Meeting meeting = meet(prism, corners_of(t), tolerance_of(t));
    if (meeting == Meeting::good && !is_there) good.push_back(t);
    return meeting != Meeting::bad;
  };
  const bool tolerated = double(least_tolerance_) >= prism.height();
  for (const std::uint32_t number : scratch.nearby.quads) {
    const Quad& q = quads_[number];
    const unsigned a = scratch.certain[q[0]], b = scratch.certain[q[1]], c = scratch.certain[q[2]],
                   d = scratch.certain[q[3]];
    const unsigned ac = a & c;
    if (ac & b & d & shell_kernels::kOut) continue;
    for (const auto& [all, t] :
         {std::pair{ac & b, Triangle{q[0], q[1], q[2]}}, {ac & d, Triangle{q[0], q[2], q[3]}}}) {
      if (all & shell_kernels::kOut) continue;
      if ((all & shell_kernels::kBetweenLids) && (tolerated || tolerance_of(t) >= prism.height()) &&
          faces(t)) {
        if (!is_there) good.push_back(t);
      } else if (!holds(t)) {
        return Answer::perhaps;
      }
    }
  }
  for (const Triangle& t : scratch.nearby.fans)
    if (!holds(t)) return Answer::perhaps;
  scratch.is_there = is_there || std::ranges::any_of(good, [&](const Triangle& t) {
                       return is_own(corners_of(t)) && reaches_into(prism, corners_of(t));
                     });
  return Answer::yes;
}

}  // namespace hermesh
