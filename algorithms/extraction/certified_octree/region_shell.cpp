#include "algorithms/extraction/certified_octree/region_shell.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_octree/kernels/shell_kernels.h"
#include "algorithms/extraction/certified_octree/shell_prism.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using shell_kernels::Planes;

/// Heights of prisms in voxels, in addition to the tolerance. Low prisms contain less to examine, and small
/// triangles admit no high ones. Adjacent prisms may differ in height: each line of their wall intersects S
/// once in either.
constexpr double kFirst = 0.5, kLow = 0.125;

/// The cosine of slightly less than 45 degrees: directions that near to a common one are within 90 degrees of
/// each other.
constexpr double kUpright = 0.7072;
static_assert(2 * kUpright * kUpright - 1 > 0, "the cosine of twice the angle is positive");

/// Far more than the rounding of single precision for positions a few blocks away from the base, in voxels.
constexpr float kSingleRounding = 1e-4f;

/// Returns the planes of a prism for the kernels, relative to `base`. A wall is ruled between two pillars
/// that may lean differently: its plane leans as their mean, and `spread` is the largest distance of the wall
/// from it.
Planes planes_of(const ShellPrism& prism, const Vector3d& base) {
  Planes planes;
  const auto set = [&](int plane, const Vector3d& normal, double offset) {
    for (int a = 0; a < 3; ++a) planes.normals[plane][a] = static_cast<float>(normal[a]);
    planes.offsets[plane] = static_cast<float>(offset - normal.dot(base));
  };
  const auto& [axes, origin, offsets] = prism.over().frame();
  for (int side = 0; side < 3; ++side) {
    const auto& [first, second] = prism.leans()[side];
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

/// Memory that a thread reuses for all polygons.
struct RegionShell::Buffers {
  std::vector<shell_kernels::Window> windows;  ///< parts of blocks that may reach into the prisms
  std::vector<Triangle> fans;                  ///< triangles of fanned edges in the windows
  std::vector<ShellPrism> prisms;
  std::vector<shell_kernels::Candidate> candidates;
  std::vector<std::uint16_t> certain;  ///< one per vertex of S
};

/// The proof of one polygon.
class RegionShell::Search {
 public:
  Search(const RegionShell& shell, const RegionPolygon& polygon, Buffers& buffers);
  bool run();

 private:
  using Found = shell_kernels::Found;
  static constexpr std::size_t kMostTriangles = shell_kernels::kMostPrisms;  ///< one or two a polygon
  /// Result for the open triangles of the polygon.
  struct Answer {
    unsigned shown;  ///< one bit each; valid only if S is there
    bool is_there;   ///< S was found in the prism of one of them
    bool never;      ///< the polygon cannot be proved
  };

  bool starts_at_borders() const;
  void gather();
  void gather(std::int32_t block, const std::array<int, 3>& corner, const int (&from)[3], const int (&to)[3]);
  Answer look(bool is_there);
  bool stand_prisms();
  void note_what_faces_up(bool tolerated);
  Found scan();
  unsigned find_bad(const Found& found, bool tolerated) const;
  bool has_witness(unsigned shown);
  bool is_witness(const Triangle& t, const ShellPrism& prism) const;
  bool is_own(const Corners& points) const;

  Corners corners_of(const Triangle& t) const {
    return {shell_.points_[t[0]], shell_.points_[t[1]], shell_.points_[t[2]]};
  }
  Vector3d normal_of(const Triangle& t) const {
    return (shell_.points_[t[1]] - shell_.points_[t[0]]).cross(shell_.points_[t[2]] - shell_.points_[t[0]]);
  }
  double tolerance_of(const Triangle& t) const {
    return double(std::min({shell_.tolerance_[t[0]], shell_.tolerance_[t[1]], shell_.tolerance_[t[2]]}));
  }
  /// Calls f(Triangle) for the triangles of S at the polygon's crossed edge.
  template <class F>
  void for_each_triangle_of_edge(F&& f) const;
  /// Calls f(triangle, prism, between) for the triangles of S not proved by the kernels.
  template <class F>
  void for_each_near(const Found& found, F&& f) const;

  const RegionShell& shell_;
  const RegionPolygon& polygon_;
  Buffers& buffers_;
  Vector3d base_;                                        ///< near the polygon: the origin of single precision
  std::array<Vector3d, 4> pillars_;                      ///< one for each of the polygon's corners
  std::array<shell_kernels::Box, 4> cubes_;              ///< the polygon's regions
  double highest_;                                       ///< height of the highest prism
  std::array<std::array<int, 3>, kMostTriangles> open_;  ///< triangles not yet proved, by their corners
  std::size_t open_count_ = 0;
  // Of the current prisms, over some of these triangles:
  double height_ = 0;
  bool is_lowest_ = false;
  std::array<std::size_t, kMostTriangles> triangle_of_;
  std::array<Planes, kMostTriangles> planes_;
};

RegionShell::RegionShell(const CellRegions& regions, const EdgePolygons& polygons,
                         const UniformPoints& points, std::span<const float> tolerance, RunContext& context)
    : regions_(regions),
      cells_(regions.cells()),
      polygons_(polygons),
      points_(points),
      tolerance_(tolerance),
      least_tolerance_(tolerance.empty() ? 0.0f : *std::ranges::min_element(tolerance)),
      blocks_(cells_.size()),
      up_(cells_.size()),
      buffers_([&polygons] {
        auto buffers = std::make_unique<Buffers>();
        // One entry per vertex of S. A search writes those of its windows; it ignores the outdated values of
        // others (find_candidates()).
        buffers->certain.resize(polygons.point_count() + shell_kernels::kLargestVector);
        return buffers;
      }) {
  // Count, scan, fill: S in single precision and by blocks, for the kernels.
  std::vector<std::uint64_t> first(cells_.size());
  for (std::size_t b = 0; b < first.size(); ++b)
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t x = 0; x < 8; ++x) first[b] += std::popcount(quads_in(b, axis, x));
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
  described.cells = &own;
  const std::uint32_t points = cells_.points_in(block), cells = cells_.cells_in(block);
  described.first_later = own.first_point + cells;
  described.later_points = points - cells;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    described.crossing[axis] = cells_.source(block).crossing[axis].data();
    described.without_quad[axis] = polygons_.fanned(block, static_cast<int>(axis)).data();
  }
  described.first_quad = first_quad;
  // Relative to the block's corner, so that single precision suffices anywhere in the lattice.
  const Vector3d corner = cells_.corner(block, 0);
  for (std::uint32_t point = own.first_point; point < own.first_point + points; ++point)
    for (std::size_t a = 0; a < 3; ++a)
      in_blocks_[a][point] = static_cast<float>(points_[point][a] - corner[a]);

  PlainPoints near;
  near.read(cells_, block);
  std::uint32_t number = first_quad;
  for (std::size_t x = 0; x < 8; ++x) {
    described.quads_before[x] = static_cast<std::uint16_t>(number - first_quad);
    const std::uint64_t of_axis[3] = {quads_in(b, 0, x), quads_in(b, 1, x), quads_in(b, 2, x)};
    // By sample and then by axis, so that the quads of a row of samples are consecutive.
    for (std::uint64_t bits = of_axis[0] | of_axis[1] | of_axis[2]; bits != 0; bits &= bits - 1)
      for (int axis = 0; axis < 3; ++axis)
        if (of_axis[axis] & bits & -bits)
          polygons_.polygons_of(
              {block, static_cast<int>(64 * x) + std::countr_zero(bits), axis},
              [&](const Quad& q) { quads_[number++] = q; }, [](const Triangle&) {}, &near);
  }
  find_upright(b, first_quad, number);
}

/// Marks the quads whose triangles lie within kUpright of their block's mean normal. If a prism's pillars do,
/// too, such a quad certainly faces up in the prism.
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

bool RegionShell::holds(const RegionPolygon& polygon) const {
  return Search(*this, polygon, *buffers_.local()).run();
}

RegionShell::Search::Search(const RegionShell& shell, const RegionPolygon& polygon, Buffers& buffers)
    : shell_(shell),
      polygon_(polygon),
      buffers_(buffers),
      base_(shell.cells_.corner(polygon.regions[0].block, 0)),
      highest_(kFarthest) {
  for (int i = 0; i < polygon.corners; ++i) {
    const Region& region = polygon.regions[i];
    // A prism higher than the least tolerance of the polygon's regions would prove too little.
    highest_ = std::min(highest_, double(shell_.regions_.tolerance(region)));
    pillars_[i] = shell_.regions_.normal(region);
    const Vector3d lower = shell_.cells_.corner(region.block, region.cell) - base_;
    shell_kernels::Box& cube = cubes_[i];
    for (int a = 0; a < 3; ++a) {
      cube.lower[a] = static_cast<float>(lower[a]);
      cube.upper[a] = static_cast<float>(lower[a] + region.side());
    }
  }
  polygon.for_each_triangle([&](int a, int b, int c) { open_[open_count_++] = {a, b, c}; });
}

/// Tries prisms of a medium height, of the largest one, and then the lowest, each over the triangles not yet
/// proved. Low prisms contain only nearby parts of S, and high ones reach S where it is far.
bool RegionShell::Search::run() {
  if (!starts_at_borders()) return false;
  // If S is in a prism, it is also in that of the other triangle, through their common wall, if that is no
  // lower.
  double found_at = std::numeric_limits<double>::infinity(), before = 0;
  const double lowest = std::min(kLow, highest_);
  for (const double height : {std::min(kFirst, highest_), highest_, lowest}) {
    // With a small tolerance, two of the heights are equal.
    if (std::exchange(before, height) == height) continue;
    height_ = height;
    is_lowest_ = height == lowest;
    gather();
    const Answer answer = look(found_at <= height);
    if (answer.never) return false;
    if (!answer.is_there) continue;
    found_at = std::min(found_at, height);
    std::size_t still_open = 0;
    for (std::size_t i = 0; i < open_count_; ++i)
      if (!((answer.shown >> i) & 1)) open_[still_open++] = open_[i];
    open_count_ = still_open;
    if (open_count_ == 0) return true;
  }
  return false;
}

/// Returns true if S continues into the prisms at sides between two single cells (the last condition of the
/// header): the triangles of S at these sides and at the polygon's crossed edge face up along the pillars at
/// their ends, so they are on the polygon's side of the wall there.
bool RegionShell::Search::starts_at_borders() const {
  for (int i = 0; i < polygon_.corners; ++i) {
    const int j = polygon_.next(i);
    const Region &a = polygon_.regions[i], &b = polygon_.regions[j];
    if (a.merged() || b.merged()) continue;
    const std::uint32_t p = shell_.cells_.point(a.block, a.cell, 0),
                        q = shell_.cells_.point(b.block, b.cell, 0);
    bool starts = false;
    for_each_triangle_of_edge([&](const Triangle& t) {
      if (std::ranges::count(t, p) + std::ranges::count(t, q) < 2) return;
      const Vector3d normal = normal_of(t);
      starts = normal.dot(pillars_[i]) > 0 && normal.dot(pillars_[j]) > 0;
    });
    if (!starts) return false;
  }
  return true;
}

template <class F>
void RegionShell::Search::for_each_triangle_of_edge(F&& f) const {
  const auto halves = [&](const Quad& q) {
    f(Triangle{q[0], q[1], q[2]});
    f(Triangle{q[0], q[2], q[3]});
  };
  shell_.polygons_.polygons_of(polygon_.crossing, halves, f);
}

/// Collects the parts of blocks that the prisms may extend into. Vertices of S lie in their cells, so a
/// triangle that extends into a cell belongs to an edge of it.
void RegionShell::Search::gather() {
  buffers_.windows.clear();
  buffers_.fans.clear();
  Eigen::AlignedBox3d box;
  polygon_.for_each_triangle([&](int a, int b, int c) {
    for (const int corner : {a, b, c})
      for (const double up : {height_, -height_}) box.extend(polygon_.points[corner] + up * pillars_[corner]);
  });
  const Vector3d lower = box.min() - base_, upper = box.max() - base_;
  // Edges of cells that the prisms may extend into, and all cells around these; from the base.
  int from[3], to[3], first_step[3], last_step[3];  // steps in blocks
  for (int a = 0; a < 3; ++a) {
    from[a] = static_cast<int>(std::floor(lower[a] - ShellPrism::kRounding));
    to[a] = static_cast<int>(std::floor(upper[a] + ShellPrism::kRounding)) + 1;
    first_step[a] = (from[a] - 1) >> 3;
    last_step[a] = to[a] >> 3;
  }
  const auto source_of = [&](int region) -> const auto& {
    return shell_.cells_.source(polygon_.regions[region].block);
  };
  for (int x = first_step[0]; x <= last_step[0]; ++x)
    for (int y = first_step[1]; y <= last_step[1]; ++y)
      for (int z = first_step[2]; z <= last_step[2]; ++z) {
        // The regions' blocks are all those around the polygon's edge, so the block is next to one of them.
        const int steps[3] = {x, y, z};
        for (int i = 0; i < polygon_.corners; ++i) {
          int step[3];
          for (std::size_t a = 0; a < 3; ++a)
            step[a] = steps[a] - (source_of(i).lower[a] - source_of(0).lower[a]) / 8;
          if (std::ranges::any_of(step, [](int by) { return by < -1 || by > 1; })) continue;
          const std::int32_t block = source_of(i).neighbours[neighbour_slot(step[0], step[1], step[2])];
          if (block >= 0) gather(block, {8 * x, 8 * y, 8 * z}, from, to);
          break;
        }
      }
  // The kernels require ascending windows (tell_points()).
  std::ranges::sort(buffers_.windows, {},
                    [](const shell_kernels::Window& window) { return window.block->cells->first_point; });
}

/// Adds the part of a block with its corner at `corner` from the base, and its fans, which the kernels do not
/// cover.
void RegionShell::Search::gather(std::int32_t block, const std::array<int, 3>& corner, const int (&from)[3],
                                 const int (&to)[3]) {
  const auto part_from = [&](int below) {
    int first[3], end[3];
    for (std::size_t a = 0; a < 3; ++a) {
      first[a] = std::max(0, from[a] - below - corner[a]);
      end[a] = std::min(8, to[a] + 1 - corner[a]);
      if (first[a] >= end[a]) return shell_kernels::Window::Part{};
    }
    const std::uint64_t row = (1u << end[2]) - (1u << first[2]);
    // A row for each y, by a product with bits 0, 8, 16 and so on.
    const std::uint64_t rows = row * (0x0101010101010101u >> (8 * (8 - (end[1] - first[1]))))
                               << (8 * first[1]);
    return shell_kernels::Window::Part{rows, first[0], end[0]};
  };
  const shell_kernels::Block& described = shell_.blocks_[block];
  const shell_kernels::Window window{
      &described, {float(corner[0]), float(corner[1]), float(corner[2])}, part_from(1), part_from(0), 0};
  buffers_.windows.push_back(window);
  for (int axis = 0; axis < 3; ++axis)
    for (int x = window.samples.first; x < window.samples.end; ++x)
      for (std::uint64_t bits = described.without_quad[axis][x] & window.samples.rows; bits != 0;
           bits &= bits - 1)
        shell_.polygons_.polygons_of(
            {block, 64 * x + std::countr_zero(bits), axis}, [](const Quad&) {},
            [&](const Triangle& t) { buffers_.fans.push_back(t); });
}

/// Builds prisms over the open triangles and examines S in them. `is_there`: S is known to be in one of them.
RegionShell::Search::Answer RegionShell::Search::look(bool is_there) {
  constexpr Answer kNever{.shown = 0, .is_there = false, .never = true};
  if (!stand_prisms()) return kNever;
  const std::size_t prisms = buffers_.prisms.size();
  if (prisms == 0) return {.shown = 0, .is_there = is_there, .never = false};
  // If so, the tolerances of single triangles of S need no test.
  const bool tolerated = double(shell_.least_tolerance_) >= height_;
  note_what_faces_up(tolerated);
  const Found found = scan();
  // A point farther than the tolerance is not nearer in a lower prism.
  if (found.beyond && height_ == highest_) return kNever;
  const unsigned bad = find_bad(found, tolerated);
  if (bad != 0 && is_lowest_) return kNever;
  Answer answer{.shown = 0, .is_there = is_there, .never = false};
  unsigned good = 0;
  for (std::size_t p = 0; p < prisms; ++p) {
    if ((bad >> p) & 1) continue;
    good |= 1u << p;
    answer.shown |= 1u << triangle_of_[p];
    answer.is_there = answer.is_there || ((found.inside >> p) & 1);
  }
  if (!answer.is_there && good != 0) answer.is_there = has_witness(good);
  return answer;
}

/// Builds prisms over the open triangles. Returns false if one is invalid at the lowest height, and so at
/// any.
bool RegionShell::Search::stand_prisms() {
  std::vector<ShellPrism>& prisms = buffers_.prisms;
  prisms.clear();
  for (std::size_t i = 0; i < open_count_; ++i) {
    const auto& [a, b, c] = open_[i];
    const auto pillar = [&](int corner) { return pillars_[corner]; };
    prisms.emplace_back(Corners{polygon_.points[a], polygon_.points[b], polygon_.points[c]},
                        std::array{pillar(a), pillar(b), pillar(c)}, height_);
    if (!prisms.back().stands()) {
      if (is_lowest_) return false;
      prisms.pop_back();
      continue;
    }
    planes_[prisms.size() - 1] = planes_of(prisms.back(), base_);
    triangle_of_[prisms.size() - 1] = i;
  }
  return true;
}

/// Records for each window in which prisms its upright quads face up. `tolerated`: every triangle of S may be
/// as far away as the height of the prisms; if false, none is recorded.
void RegionShell::Search::note_what_faces_up(bool tolerated) {
  for (shell_kernels::Window& window : buffers_.windows) {
    const Vector3d& up = shell_.up_[window.block - shell_.blocks_.data()];
    window.facing = 0;
    for (std::size_t p = 0; p < buffers_.prisms.size() && tolerated; ++p)
      if (std::ranges::all_of(buffers_.prisms[p].pillars(),
                              [&](const Vector3d& pillar) { return pillar.dot(up) > kUpright; }))
        window.facing |= 1u << p;
  }
}

/// Finds the triangles of S that may be in a prism, by the kernels. Single precision suffices for vertices
/// off the prisms' planes; uncertain ones are tested in double precision.
shell_kernels::Found RegionShell::Search::scan() {
  buffers_.candidates.resize(std::max(buffers_.candidates.size(), 3 * 512 * buffers_.windows.size()));
  const shell_kernels::Surface surface{
      shell_.in_blocks_[0].data(), shell_.in_blocks_[1].data(),
      shell_.in_blocks_[2].data(), reinterpret_cast<const std::uint32_t(*)[4]>(shell_.quads_.data()),
      shell_.upright_.data(),      buffers_.certain.data()};
  return shell_.kernels_.look(
      {&surface, buffers_.windows.data(), static_cast<int>(buffers_.windows.size()), planes_.data(),
       static_cast<int>(buffers_.prisms.size()), cubes_.data(), polygon_.corners},
      buffers_.candidates.data());
}

template <class F>
void RegionShell::Search::for_each_near(const Found& found, F&& f) const {
  const auto in_each = [&](const Triangle& t, unsigned near, unsigned between) {
    for (unsigned left = near; left != 0; left &= left - 1) {
      const int p = std::countr_zero(left);
      f(t, static_cast<std::size_t>(p), ((between >> p) & 1) != 0);
    }
  };
  for (int i = 0; i < found.candidates; ++i) {
    const shell_kernels::Candidate& candidate = buffers_.candidates[i];
    const Quad& q = shell_.quads_[candidate.quad];
    in_each({q[0], q[1], q[2]}, candidate.near[0], candidate.between[0]);
    in_each({q[0], q[2], q[3]}, candidate.near[1], candidate.between[1]);
  }
  for (const Triangle& t : buffers_.fans) in_each(t, (1u << buffers_.prisms.size()) - 1, 0);
}

/// Returns the prisms, one bit each, that S does not pass through as required; of the lowest ones, at least
/// one.
unsigned RegionShell::Search::find_bad(const Found& found, bool tolerated) const {
  const auto is_good = [&](const Triangle& t, const ShellPrism& prism, bool between) {
    // A triangle between lid and bottom that faces up along all pillars is good anywhere; meet() would be
    // slower.
    if (between && (tolerated || tolerance_of(t) >= height_)) {
      const Vector3d normal = normal_of(t);
      if (std::ranges::all_of(prism.pillars(), [&](const Vector3d& up) { return normal.dot(up) > 0; }))
        return true;
    }
    return meet(prism, corners_of(t), tolerance_of(t)) != Meeting::bad;
  };
  unsigned bad = 0;
  for_each_near(found, [&](const Triangle& t, std::size_t p, bool between) {
    // One of the lowest prisms is sufficient, because a failure there is final.
    const bool is_known = ((bad >> p) & 1) || (bad != 0 && is_lowest_);
    if (!is_known && !is_good(t, buffers_.prisms[p], between)) bad |= 1u << p;
  });
  return bad;
}

/// Returns true if a triangle of S is in one of these prisms, one bit each, although no vertex of it
/// certainly is.
bool RegionShell::Search::has_witness(unsigned prisms) {
  bool found_one = false;
  const auto look_at = [&](const Triangle& t, std::size_t p) {
    found_one = found_one || (((prisms >> p) & 1) && is_witness(t, buffers_.prisms[p]));
  };
  for_each_triangle_of_edge([&](const Triangle& t) {
    for (std::size_t p = 0; p < buffers_.prisms.size(); ++p) look_at(t, p);
  });
  if (found_one) return true;
  // Including the good triangles that the kernels have omitted.
  note_what_faces_up(false);
  const Found found = scan();
  for_each_near(found, [&](const Triangle& t, std::size_t p, bool) { look_at(t, p); });
  return found_one;
}

bool RegionShell::Search::is_witness(const Triangle& t, const ShellPrism& prism) const {
  return is_own(corners_of(t)) && meet(prism, corners_of(t), tolerance_of(t)) == Meeting::good &&
         reaches_into(prism, corners_of(t));
}

/// Returns true if one of the vertices belongs to a cell of the polygon's regions: vertices lie in their
/// cells.
bool RegionShell::Search::is_own(const Corners& points) const {
  return std::ranges::any_of(points, [&](const Vector3d& p) {
    const Vector3d place = p - base_;
    for (int i = 0; i < polygon_.corners; ++i) {
      const auto& [lower, upper] = cubes_[i];
      if (place[0] > lower[0] && place[0] < upper[0] && place[1] > lower[1] && place[1] < upper[1] &&
          place[2] > lower[2] && place[2] < upper[2])
        return true;
    }
    return false;
  });
}

}  // namespace hermesh
