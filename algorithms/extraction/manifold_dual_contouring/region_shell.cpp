#include "algorithms/extraction/manifold_dual_contouring/region_shell.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/kernels/shell_kernels.h"
#include "algorithms/extraction/manifold_dual_contouring/shell_prism.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using shell_kernels::Planes;

/// Heights of prisms in voxels, but for the tolerance itself. Where prisms are low there is less to look at,
/// and small triangles have no high ones. Neighbours may have prisms of different heights: on the wall
/// between them each line meets S once in either.
constexpr double kFirst = 0.5, kLow = 0.125;

/// What keeps within this cosine of one direction keeps within a right angle of each other.
constexpr double kUpright = 0.7072;

/// Of places a few blocks away from the one that they are relative to, far above what single precision makes
/// of them.
constexpr float kSingleRounding = 1e-4f;

/// Relative to a place.
Planes planes_of(const ShellPrism& prism, const Vector3d& base) {
  Planes planes;
  const auto set = [&](int plane, const Vector3d& normal, double offset) {
    for (int a = 0; a < 3; ++a) planes.normals[plane][a] = static_cast<float>(normal[a]);
    planes.offsets[plane] = static_cast<float>(offset - normal.dot(base));
  };
  const auto& [axes, origin, offsets] = prism.over().frame();
  for (int side = 0; side < 3; ++side) {
    const auto& [first, second] = prism.leans()[static_cast<std::size_t>(side)];
    const double lean = (first + second) / 2, length = std::sqrt(1 + lean * lean);
    const Vector3d normal = (axes.row(side) - lean * axes.row(3)).transpose() / length;
    set(side, normal, normal.dot(origin) + (offsets[side] - lean * offsets[3]) / length);
    planes.spread[side] = static_cast<float>(std::abs(first - second) / 2 * prism.height() / length);
  }
  set(Planes::kLid, prism.lid().normal(), -prism.lid().offset());
  set(Planes::kBottom, prism.bottom().normal(), -prism.bottom().offset());
  planes.rounding = kSingleRounding;
  return planes;
}

}  // namespace

struct RegionShell::Scratch {
  std::array<Vector3d, 4> pillars;          ///< by the polygon's corners
  Vector3d base;                            ///< near the polygon: what single precision is relative to
  std::array<shell_kernels::Box, 4> cubes;  ///< the polygon's regions
  int regions;
  double height, highest;  ///< of these prisms, of any
  bool is_lowest;
  std::vector<std::array<int, 3>>
      open;  ///< triangles of the polygon, by their corners, that are not shown yet
  std::vector<shell_kernels::Window> windows;  ///< with what of S may reach into their prisms,
  std::vector<Triangle> fans;                  ///< and its fans there
  std::vector<ShellPrism> prisms;
  std::vector<shell_kernels::Candidate> candidates;
  std::vector<std::uint16_t> certain;

  /// Whether one of the points is that of a cell of the polygon's regions: points lie in their cells.
  bool is_own(const Corners& points) const {
    return std::ranges::any_of(points, [&](const Vector3d& p) {
      const Vector3d place = p - base;
      return std::any_of(cubes.begin(), cubes.begin() + regions, [&](const shell_kernels::Box& cube) {
        for (int a = 0; a < 3; ++a)
          if (!(place[a] > cube.lower[a] && place[a] < cube.upper[a])) return false;
        return true;
      });
    });
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
      blocks_(cells_.size()),
      up_(cells_.size()),
      scratch_([&points] {
        auto scratch = std::make_unique<Scratch>();
        scratch->certain.resize(points.size() + shell_kernels::kLargestVector);
        return scratch;
      }) {
  std::vector<std::uint64_t> first(cells_.size());
  for (std::size_t b = 0; b < first.size(); ++b)
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t x = 0; x < 8; ++x)
        first[b] += static_cast<std::uint64_t>(bits_in(quads_in(b, axis, x)));
  quads_.resize(exclusive_scan(first, "edge crossings"));
  upright_.resize(quads_.size());
  for (LargeArray<float>& coordinates : in_blocks_)
    coordinates.resize(cells_.point_count() + shell_kernels::kLargestVector);
  parallel_blocks(cells_.size(), context,
                  [&](std::size_t b) { describe(b, static_cast<std::uint32_t>(first[b])); });
}

RegionShell::~RegionShell() = default;

std::uint64_t RegionShell::quads_in(std::size_t block, std::size_t axis, std::size_t layer) const {
  const auto b = static_cast<std::int32_t>(block);
  return cells_.source(b).crossing[axis][layer] & ~polygons_.fanned(b, static_cast<int>(axis))[layer];
}

void RegionShell::describe(std::size_t b, std::uint32_t first_quad) {
  const auto block = static_cast<std::int32_t>(b);
  const CellBlocks::Block& own = cells_[block];
  shell_kernels::Block& described = blocks_[b];
  described.active = own.active.data();
  described.points_before = own.rank.data();
  described.first_point = own.first_point;
  const std::uint32_t points = cells_.points_in(block),
                      cells = own.several.empty() ? points : static_cast<std::uint32_t>(count(own.active));
  described.first_later = own.first_point + cells;
  described.later_points = points - cells;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    described.crossing[axis] = cells_.source(block).crossing[axis].data();
    described.without_quad[axis] = polygons_.fanned(block, static_cast<int>(axis)).data();
  }
  described.first_quad = first_quad;
  const Vector3d corner = cells_.corner(block, 0);
  for (std::uint32_t point = own.first_point; point < own.first_point + points; ++point)
    for (std::size_t a = 0; a < 3; ++a)
      in_blocks_[a][point] =
          static_cast<float>(points_[point][static_cast<int>(a)] - corner[static_cast<int>(a)]);

  PlainPoints near;
  near.read(cells_, block);
  std::uint32_t number = first_quad;
  for (std::size_t x = 0; x < 8; ++x) {
    described.quads_before[x] = static_cast<std::uint16_t>(number - first_quad);
    const std::uint64_t of_axis[3] = {quads_in(b, 0, x), quads_in(b, 1, x), quads_in(b, 2, x)};
    for (std::uint64_t bits = of_axis[0] | of_axis[1] | of_axis[2]; bits != 0; bits &= bits - 1)
      for (int axis = 0; axis < 3; ++axis)
        if (of_axis[axis] & bits & -bits)
          polygons_.polygons_of(
              {block, static_cast<int>(64 * x) + std::countr_zero(bits), axis},
              [&](const Quad& q) { quads_[number++] = q; }, [](const Triangle&) {}, &near);
  }
  find_upright(b, first_quad, number);
}

void RegionShell::find_upright(std::size_t block, std::uint32_t first, std::uint32_t end) {
  std::vector<Vector3d> normals;  // of both triangles of each
  normals.reserve(2 * (end - first));
  Vector3d up = Vector3d::Zero();
  for (std::uint32_t i = first; i < end; ++i) {
    const Quad& q = quads_[i];
    const Vector3d middle = points_[q[2]] - points_[q[0]];
    normals.push_back((points_[q[1]] - points_[q[0]]).cross(middle));
    normals.push_back(middle.cross(points_[q[3]] - points_[q[0]]));
    up += normals.end()[-2] + normals.back();
  }
  up_[block] = up = up.normalized();
  const auto is_upright = [&](const Vector3d& normal) {
    const double along = normal.dot(up);
    return along > 0 && along * along > kUpright * kUpright * normal.squaredNorm();
  };
  for (std::uint32_t i = first; i < end; ++i)
    upright_[i] = is_upright(normals[2 * (i - first)]) && is_upright(normals[2 * (i - first) + 1]);
}

void RegionShell::gather(const RegionPolygon& polygon, Scratch& scratch) const {
  scratch.windows.clear();
  scratch.fans.clear();
  Eigen::AlignedBox3d box;
  polygon.for_each_triangle([&](int a, int b, int c) {
    for (const int corner : {a, b, c})
      for (const double up : {scratch.height, -scratch.height})
        box.extend(polygon.points[static_cast<std::size_t>(corner)] +
                   up * scratch.pillars[static_cast<std::size_t>(corner)]);
  });
  const Vector3d lower = box.min() - scratch.base, upper = box.max() - scratch.base;
  // Edges that touch a cell that the prisms may reach into, and all cells that touch these; from the base.
  int from[3], to[3], first_step[3], last_step[3];  // steps in blocks
  for (int a = 0; a < 3; ++a) {
    from[a] = static_cast<int>(std::floor(lower[a] - ShellPrism::kRounding));
    to[a] = static_cast<int>(std::floor(upper[a] + ShellPrism::kRounding)) + 1;
    first_step[a] = (from[a] - 1) >> 3;
    last_step[a] = to[a] >> 3;
  }
  const auto lower_of = [&](int region) -> const std::array<std::int32_t, 3>& {
    return cells_.source(polygon.regions[region].block).lower;
  };
  for (int x = first_step[0]; x <= last_step[0]; ++x)
    for (int y = first_step[1]; y <= last_step[1]; ++y)
      for (int z = first_step[2]; z <= last_step[2]; ++z) {
        // The regions' blocks are all those around the polygon's edge, so one of them is next to it.
        const int steps[3] = {x, y, z};
        for (int i = 0; i < polygon.corners; ++i) {
          int step[3];
          for (std::size_t a = 0; a < 3; ++a) step[a] = steps[a] - (lower_of(i)[a] - lower_of(0)[a]) / 8;
          if (std::ranges::any_of(step, [](int by) { return by < -1 || by > 1; })) continue;
          const std::int32_t block =
              cells_.source(polygon.regions[i].block)
                  .neighbours[static_cast<std::size_t>(neighbour_slot(step[0], step[1], step[2]))];
          if (block >= 0) gather(block, {8 * x, 8 * y, 8 * z}, from, to, scratch);
          break;
        }
      }
  std::ranges::sort(scratch.windows, {},
                    [](const shell_kernels::Window& window) { return window.block->first_point; });
}

void RegionShell::gather(std::int32_t block, const std::array<int, 3>& corner, const int (&from)[3],
                         const int (&to)[3], Scratch& scratch) const {
  const auto part_from = [&](int below) {
    int first[3], end[3];
    for (std::size_t a = 0; a < 3; ++a) {
      first[a] = std::max(0, from[a] - below - corner[a]);
      end[a] = std::min(8, to[a] + 1 - corner[a]);
      if (first[a] >= end[a]) return shell_kernels::Window::Part{};
    }
    const std::uint64_t row = (1u << end[2]) - (1u << first[2]);
    // A row for each y, by a product: bits 0, 8, 16 and so on, as many as there are.
    const std::uint64_t rows = row * (0x0101010101010101u >> (8 * (8 - (end[1] - first[1]))))
                               << (8 * first[1]);
    return shell_kernels::Window::Part{rows, first[0], end[0]};
  };
  const shell_kernels::Block& described = blocks_[static_cast<std::size_t>(block)];
  const shell_kernels::Window window{
      &described, {float(corner[0]), float(corner[1]), float(corner[2])}, part_from(1), part_from(0), 0};
  scratch.windows.push_back(window);
  for (int axis = 0; axis < 3; ++axis)
    for (int x = window.samples.first; x < window.samples.end; ++x)
      for (std::uint64_t bits = described.without_quad[axis][x] & window.samples.rows; bits != 0;
           bits &= bits - 1)
        polygons_.polygons_of(
            {block, 64 * x + std::countr_zero(bits), axis}, [](const Quad&) {},
            [&](const Triangle& t) { scratch.fans.push_back(t); });
}

/// The triangles of S beside these sides, at the polygon's own crossing edge, face up along the pillars at
/// their ends; so they are on the polygon's side of the wall there.
bool RegionShell::starts_at_borders(const RegionPolygon& polygon, const Scratch& scratch) const {
  for (int i = 0; i < polygon.corners; ++i) {
    const int j = polygon.next(i);
    const Region &a = polygon.regions[i], &b = polygon.regions[j];
    if (a.merged() || b.merged()) continue;
    const std::uint32_t p = cells_.point(a.block, a.cell, 0), q = cells_.point(b.block, b.cell, 0);
    bool starts = false;
    for_each_triangle_of(polygon.crossing, [&](const Triangle& t) {
      if (std::ranges::count(t, p) + std::ranges::count(t, q) < 2) return;
      const Vector3d normal = normal_of(t);
      starts = normal.dot(scratch.pillars[static_cast<std::size_t>(i)]) > 0 &&
               normal.dot(scratch.pillars[static_cast<std::size_t>(j)]) > 0;
    });
    if (!starts) return false;
  }
  return true;
}

bool RegionShell::holds(const RegionPolygon& polygon) const {
  Scratch& scratch = *scratch_.local();
  scratch.regions = polygon.corners;
  scratch.base = cells_.corner(polygon.regions[0].block, 0);
  double most = kFarthest;
  for (int i = 0; i < polygon.corners; ++i) {
    const Region& region = polygon.regions[i];
    most = std::min(most, double(regions_.tolerance(region)));
    scratch.pillars[static_cast<std::size_t>(i)] = regions_.normal(region);
    const Vector3d lower = cells_.corner(region.block, region.cell) - scratch.base;
    for (int a = 0; a < 3; ++a) {
      scratch.cubes[static_cast<std::size_t>(i)].lower[a] = static_cast<float>(lower[a]);
      scratch.cubes[static_cast<std::size_t>(i)].upper[a] = static_cast<float>(lower[a] + region.side());
    }
  }
  if (!starts_at_borders(polygon, scratch)) return false;
  scratch.open.clear();
  polygon.for_each_triangle([&](int a, int b, int c) { scratch.open.push_back({a, b, c}); });
  scratch.highest = most;
  // S is in a prism, and by their common wall in the other triangle's, if that is no lower.
  double found_at = std::numeric_limits<double>::infinity(), before = 0;
  const double lowest = std::min(kLow, most);
  for (const double height : {std::min(kFirst, most), most, lowest}) {
    if (std::exchange(before, height) == height) continue;
    scratch.height = height;
    scratch.is_lowest = height == lowest;
    gather(polygon, scratch);
    const Answer answer = look(polygon, found_at <= height, scratch);
    if (answer.never) return false;
    if (!answer.is_there) continue;
    found_at = std::min(found_at, height);
    std::size_t still_open = 0;
    for (std::size_t i = 0; i < scratch.open.size(); ++i)
      if (!((answer.shown >> i) & 1)) scratch.open[still_open++] = scratch.open[i];
    scratch.open.resize(still_open);
    if (still_open == 0) return true;
  }
  return false;
}

/// No exact number is needed where points keep off the prisms' planes: then they are told by kernels.
RegionShell::Answer RegionShell::look(const RegionPolygon& polygon, bool is_there, Scratch& scratch) const {
  constexpr Answer kNever{.shown = 0, .is_there = false, .never = true};
  std::array<std::size_t, shell_kernels::kMostPrisms> triangle_of;
  std::array<Planes, shell_kernels::kMostPrisms> planes;
  std::vector<ShellPrism>& prisms = scratch.prisms;
  prisms.clear();
  for (std::size_t i = 0; i < scratch.open.size(); ++i) {
    const auto& [a, b, c] = scratch.open[i];
    const auto pillar = [&](int corner) { return scratch.pillars[static_cast<std::size_t>(corner)]; };
    prisms.emplace_back(Corners{polygon.points[a], polygon.points[b], polygon.points[c]},
                        std::array{pillar(a), pillar(b), pillar(c)}, scratch.height);
    if (!prisms.back().stands()) {
      if (scratch.is_lowest) return kNever;
      prisms.pop_back();
      continue;
    }
    planes[prisms.size() - 1] = planes_of(prisms.back(), scratch.base);
    triangle_of[prisms.size() - 1] = i;
  }
  if (prisms.empty()) return {.shown = 0, .is_there = is_there, .never = false};

  const bool tolerated = double(least_tolerance_) >= scratch.height;
  for (shell_kernels::Window& window : scratch.windows) {
    const Vector3d& up = up_[static_cast<std::size_t>(window.block - blocks_.data())];
    window.facing = 0;
    for (std::size_t p = 0; p < prisms.size() && tolerated; ++p)
      if (std::ranges::all_of(prisms[p].pillars(),
                              [&](const Vector3d& pillar) { return pillar.dot(up) > kUpright; }))
        window.facing |= 1u << p;
  }
  scratch.candidates.resize(std::max(scratch.candidates.size(), 3 * 512 * scratch.windows.size()));
  const auto find = [&] {
    const shell_kernels::Surface surface{
        in_blocks_[0].data(), in_blocks_[1].data(),
        in_blocks_[2].data(), reinterpret_cast<const std::uint32_t(*)[4]>(quads_.data()),
        upright_.data(),      scratch.certain.data()};
    return look_({&surface, scratch.windows.data(), static_cast<int>(scratch.windows.size()), planes.data(),
                  static_cast<int>(prisms.size()), scratch.cubes.data(), scratch.regions},
                 scratch.candidates.data());
  };
  shell_kernels::Found found = find();
  // What is farther than the tolerance here is not nearer in a lower prism.
  if (found.beyond && scratch.height == scratch.highest) return kNever;

  const auto tolerance_of = [&](const Triangle& t) {
    return double(std::min({tolerance_[t[0]], tolerance_[t[1]], tolerance_[t[2]]}));
  };
  const auto faces = [&](const ShellPrism& prism, const Triangle& t) {
    const Vector3d normal = normal_of(t);
    return std::ranges::all_of(prism.pillars(), [&](const Vector3d& up) { return normal.dot(up) > 0; });
  };
  const auto meeting_of = [&](const Triangle& t, std::size_t p, unsigned between) {
    const ShellPrism& prism = prisms[p];
    return ((between >> p) & 1) && (tolerated || tolerance_of(t) >= prism.height()) && faces(prism, t)
               ? Meeting::good
               : meet(prism, corners_of(t), tolerance_of(t));
  };
  // Calls f(triangle, prism, between) for those that the kernels do not show to be good.
  const auto for_each_near = [&](auto&& f) {
    const auto in_each = [&](const Triangle& t, unsigned near, unsigned between) {
      for (unsigned left = near; left != 0; left &= left - 1)
        f(t, static_cast<std::size_t>(std::countr_zero(left)), between);
    };
    for (int i = 0; i < found.candidates; ++i) {
      const shell_kernels::Candidate& candidate = scratch.candidates[static_cast<std::size_t>(i)];
      const Quad& q = quads_[candidate.quad];
      in_each({q[0], q[1], q[2]}, candidate.near[0], candidate.between[0]);
      in_each({q[0], q[2], q[3]}, candidate.near[1], candidate.between[1]);
    }
    for (const Triangle& t : scratch.fans) in_each(t, (1u << prisms.size()) - 1, 0);
  };
  unsigned bad = 0;
  for_each_near([&](const Triangle& t, std::size_t p, unsigned between) {
    const bool is_known = ((bad >> p) & 1) || (bad != 0 && scratch.is_lowest);
    if (!is_known && meeting_of(t, p, between) == Meeting::bad) bad |= 1u << p;
  });
  if (bad != 0 && scratch.is_lowest) return kNever;

  Answer answer{.shown = 0, .is_there = is_there, .never = false};
  for (std::size_t p = 0; p < prisms.size(); ++p) {
    if ((bad >> p) & 1) continue;
    answer.shown |= 1u << triangle_of[p];
    answer.is_there = answer.is_there || ((found.inside >> p) & 1);
  }
  if (answer.is_there || answer.shown == 0) return answer;
  // No point is certainly in a prism; perhaps a triangle is. First those that the polygon's own edge has in
  // S.
  const auto is_witness = [&](const Triangle& t, std::size_t p) {
    return ((answer.shown >> triangle_of[p]) & 1) && scratch.is_own(corners_of(t)) &&
           meet(prisms[p], corners_of(t), tolerance_of(t)) == Meeting::good &&
           reaches_into(prisms[p], corners_of(t));
  };
  for_each_triangle_of(polygon.crossing, [&](const Triangle& t) {
    for (std::size_t p = 0; p < prisms.size(); ++p) answer.is_there = answer.is_there || is_witness(t, p);
  });
  if (answer.is_there) return answer;
  for (shell_kernels::Window& window : scratch.windows) window.facing = 0;
  found = find();
  for_each_near([&](const Triangle& t, std::size_t p, unsigned) {
    answer.is_there = answer.is_there || is_witness(t, p);
  });
  return answer;
}

}  // namespace hermesh
