#include "algorithms/extraction/manifold_dual_contouring/region_shell.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_overlay.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Of the angle between a pillar and the normal of a triangle at its foot.
constexpr double kLeastCosine = 0.3;
/// What prisms are tried with first, in voxels.
constexpr double kLow = 0.25;
/// Of coordinates, in voxels, far above what doubles make of it.
constexpr double kRounding = 1e-6;

using Plane = Eigen::Hyperplane<double, 3>;

/// What stands over a triangle of T. Part of space beside or above it is known by linear functions: a triangle is there if its
/// corners are.
struct Prism {
  OverTriangle over;
  std::array<Vector3d, 3> pillars;
  double height;                                 ///< as long as the pillars are
  std::array<std::array<double, 2>, 3> leans{};  ///< by side and end: how far a pillar leans out with each voxel of height
  Plane lid, bottom;                             ///< both positive outside
  double least_lid = 1;                          ///< how far these are from the triangle's plane, as a share of the height

  Prism(const Corners& corners, const std::array<Vector3d, 3>& directions, double pillar_height)
      : over(corners), pillars(directions), height(pillar_height) {
    if (over.degenerate()) return;
    for (const Vector3d& pillar : pillars)
      if (!(pillar.dot(over.normal()) >= kLeastCosine)) return;
    for (std::size_t side = 0; side < 3; ++side)
      for (std::size_t end = 0; end < 2; ++end) leans[side][end] = lean(pillars[(side + end) % 3], side);
    lid = through(corners, height);
    bottom = through(corners, -height);
    bottom.coeffs() = -bottom.coeffs();
    for (const Vector3d& pillar : pillars) least_lid = std::min(least_lid, pillar.dot(over.normal()));
    stands_ = is_unfolded(corners) && keeps_its_corners(corners);
  }
  /// Whether all pillars rise over the triangle, and do not meet or cross. Nothing else may be asked if not.
  bool stands() const { return stands_; }
  /// How far beyond a side's wall, wherever between its two pillars that is.
  double beyond_wall(const OverTriangle::Place& place, std::size_t side) const {
    return place[static_cast<int>(side)] - std::max(leans[side][0] * place[3], leans[side][1] * place[3]);
  }

 private:
  double lean(const Vector3d& pillar, std::size_t side) const {
    return over.frame().axes.row(static_cast<int>(side)).dot(pillar) / pillar.dot(over.normal());
  }
  /// The map from a point of the triangle and a height to a place turns nothing over: the triangle that the pillars make at
  /// any height faces up along each of them. A quadratic function of the height, bounded by its coefficients.
  bool is_unfolded(const Corners& corners) const {
    const Vector3d e = corners[1] - corners[0], f = corners[2] - corners[0];
    const Vector3d de = pillars[1] - pillars[0], df = pillars[2] - pillars[0];
    const Vector3d constant = e.cross(f), linear = e.cross(df) + de.cross(f), square = de.cross(df);
    return std::ranges::all_of(pillars, [&](const Vector3d& pillar) {
      return constant.dot(pillar) - height * std::abs(linear.dot(pillar)) - height * height * std::abs(square.dot(pillar)) >
             kRounding * (e.squaredNorm() + f.squaredNorm());
    });
  }
  /// No pillar leans over the wall opposite.
  bool keeps_its_corners(const Corners& corners) const {
    for (std::size_t i = 0; i < 3; ++i)
      for (const double up : {height, -height})
        if (!(beyond_wall(over(corners[i] + up * pillars[i]), (i + 1) % 3) < -kRounding)) return false;
    return true;
  }
  Plane through(const Corners& corners, double up) const {
    // Eigen's planes face those that see the points clockwise.
    return Plane::Through(corners[0] + up * pillars[0], corners[2] + up * pillars[2], corners[1] + up * pillars[1]);
  }

  bool stands_ = false;
};

struct FineTriangle {
  Corners corners;
  std::array<OverTriangle::Place, 3> places;
  double tolerance;  ///< least of its corners

  FineTriangle(const Prism& prism, const Corners& at, double least_tolerance)
      : corners(at), places{prism.over(at[0]), prism.over(at[1]), prism.over(at[2])}, tolerance(least_tolerance) {}
  std::pair<double, double> heights() const { return std::minmax({places[0][3], places[1][3], places[2][3]}); }
  /// Least and greatest distance of a corner.
  std::pair<double, double> beyond(const Plane& plane) const {
    return std::minmax({plane.signedDistance(corners[0]), plane.signedDistance(corners[1]), plane.signedDistance(corners[2])});
  }
};

enum class Meeting { none, good, bad };
enum class Walls { outer, inner };

/// Between which heights a triangle lies in a prism; nowhere if the first is the greater one.
struct Extent {
  double lowest = 1, highest = -1;
  bool empty() const { return lowest > highest; }
};

/// Of the prism that is as wide, or as narrow, as the leans of a side's two pillars allow at each height: above the triangle's
/// plane that is one plane, below it another. What reaches less than kRounding into it is not there.
Extent extent_in(const Prism& prism, const FineTriangle& fine, Walls walls) {
  Extent extent;
  for (const double up : {1.0, -1.0}) {
    auto places = fine.places;
    for (std::size_t side = 0; side < 3; ++side) {
      const auto [least, most] = std::minmax(prism.leans[side][0], prism.leans[side][1]);
      const double lean = (walls == Walls::outer) == (up > 0) ? most : least;
      for (auto& place : places) place[static_cast<int>(side)] += kRounding - lean * place[3];
    }
    const ClippedTriangle part(places);
    double nearest = prism.height, farthest = -1;
    for (std::size_t i = 0; i < static_cast<std::size_t>(part.size); ++i) {
      nearest = std::min(nearest, std::max(0.0, up * part.corners[i][3]));
      farthest = std::max(farthest, up * part.corners[i][3]);
    }
    if (farthest < 0 || nearest >= prism.height) continue;
    const Extent there = up > 0 ? Extent{nearest, farthest} : Extent{-farthest, -nearest};
    extent = extent.empty() ? there : Extent{std::min(extent.lowest, there.lowest), std::max(extent.highest, there.highest)};
  }
  return extent;
}

Meeting meet(const Prism& prism, const FineTriangle& fine) {
  for (std::size_t side = 0; side < 3; ++side)
    if (std::ranges::all_of(fine.places, [&](const auto& place) { return prism.beyond_wall(place, side) > -kRounding; }))
      return Meeting::none;
  const auto above = fine.beyond(prism.lid), below = fine.beyond(prism.bottom);
  if (above.first > kRounding || below.first > kRounding) return Meeting::none;
  const Vector3d normal = (fine.corners[1] - fine.corners[0]).cross(fine.corners[2] - fine.corners[0]);
  const bool faces = std::ranges::all_of(prism.pillars, [&](const Vector3d& pillar) { return normal.dot(pillar) > 0; });
  if (faces && fine.tolerance >= prism.height && above.second < -kRounding && below.second < -kRounding) return Meeting::good;
  const Extent extent = extent_in(prism, fine, Walls::outer);
  if (extent.empty()) return Meeting::none;
  const double most = prism.least_lid * std::min(prism.height, fine.tolerance) - kRounding;
  return faces && extent.lowest >= -most && extent.highest <= most ? Meeting::good : Meeting::bad;
}

/// Four numbers in single precision, for most triangles can be told without more of it.
using Floats = float __attribute__((vector_size(16)));

Floats load(const std::array<float, 4>& numbers) {
  Floats result;
  std::memcpy(&result, numbers.data(), sizeof(result));
  return result;
}
Floats least(Floats a, Floats b) { return a < b ? a : b; }
Floats greatest(Floats a, Floats b) { return a > b ? a : b; }

/// What is certain of a prism, given how far single precision may be off.
class QuickPrism {
 public:
  /// How far a point is beyond the three walls, taken by one of their pillars each, and above the lid; by the other pillars, and
  /// below the bottom.
  struct Place {
    Floats first, second;
    Place least_with(const Place& other) const { return {least(first, other.first), least(second, other.second)}; }
    Place greatest_with(const Place& other) const { return {greatest(first, other.first), greatest(second, other.second)}; }
  };

  QuickPrism(const Prism& prism, double rounding) : rounding_(static_cast<float>(rounding + kRounding)) {
    const auto& [axes, origin, offsets] = prism.over.frame();
    for (int side = 0; side < 3; ++side)
      for (std::size_t end = 0; end < 2; ++end) {
        const double lean = prism.leans[static_cast<std::size_t>(side)][end];
        const double length = std::sqrt(1 + lean * lean);  // divided by it, so that rounding weighs alike
        (end == 0 ? first_ : second_)
            .set(side, (axes.row(side) - lean * axes.row(3)).transpose() / length, (offsets[side] - lean * offsets[3]) / length);
      }
    first_.set(3, prism.lid.normal(), -prism.lid.signedDistance(origin));
    second_.set(3, prism.bottom.normal(), -prism.bottom.signedDistance(origin));
    for (int i = 0; i < 3; ++i) {
      origin_[i] = static_cast<float>(origin[i]);
      for (std::size_t a = 0; a < 3; ++a) pillars_[a][i] = static_cast<float>(prism.pillars[a][i]);
    }
  }
  Place place(Floats point) const {
    const Floats d = point - origin_;
    return {first_(d), second_(d)};
  }
  /// Of the least of some points; by so much at least.
  bool is_beyond(const Place& lowest, float by = 0) const {
    const float most = rounding_ + by;
    const Floats both = least(lowest.first, lowest.second);
    return both[0] > most || both[1] > most || both[2] > most || lowest.first[3] > most || lowest.second[3] > most;
  }
  /// Of the greatest.
  bool is_between_lids(const Place& highest) const {
    return highest.first[3] < -rounding_ && highest.second[3] < -rounding_;
  }
  static float size(float x, float y, float z) { return std::abs(x) + std::abs(y) + std::abs(z); }
  bool faces(Floats a, Floats b, Floats c) const {
    const Floats u = b - a, v = c - a;
    const float n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    constexpr float kCertain = 0.01f;  // of the sizes' sum
    const float least = kCertain * size(n[0], n[1], n[2]) + rounding_ * (size(u[0], u[1], u[2]) + size(v[0], v[1], v[2]));
    bool all = true;
    for (const Floats& pillar : pillars_) all = all && n[0] * pillar[0] + n[1] * pillar[1] + n[2] * pillar[2] > least;
    return all;
  }

 private:
  struct Half {
    std::array<Floats, 3> columns{};
    Floats offsets{};
    void set(int row, const Vector3d& direction, double offset) {
      for (int i = 0; i < 3; ++i) columns[static_cast<std::size_t>(i)][row] = static_cast<float>(direction[i]);
      offsets[row] = static_cast<float>(offset);
    }
    Floats operator()(Floats d) const { return columns[0] * d[0] + columns[1] * d[1] + columns[2] * d[2] - offsets; }
  };
  float rounding_;
  Half first_, second_;
  Floats origin_{};
  std::array<Floats, 3> pillars_{};
};

}  // namespace

struct RegionShell::Scratch {
  std::vector<std::uint32_t> quads;
  std::vector<Triangle> fans;
  std::array<Vector3d, RegionPolygon::kFirstSide + 4> pillars;
  std::array<std::pair<Vector3d, Vector3d>, 4> cubes;  ///< of the polygon's regions
  double height;
  bool is_there;  ///< S has been found in a prism

  /// Whether a cell with one of these points belongs to one of the regions: points lie in their cells.
  bool is_own(const Corners& points, int regions) const {
    for (int i = 0; i < regions; ++i)
      for (const Vector3d& p : points)
        if ((p.array() > cubes[static_cast<std::size_t>(i)].first.array()).all() &&
            (p.array() < cubes[static_cast<std::size_t>(i)].second.array()).all())
          return true;
    return false;
  }
};

RegionShell::RegionShell(const Regions& regions, const EdgePolygons& polygons, const std::vector<Vector3d>& points,
                         std::span<const float> tolerance, RunContext& context)
    : regions_(regions),
      cells_(regions.cells()),
      polygons_(polygons),
      points_(points),
      tolerance_(tolerance),
      first_(cells_.size()) {
  std::vector<std::uint64_t> first(cells_.size());
  for (std::size_t b = 0; b < first.size(); ++b)
    for (const BlockMask& crossing : cells_.source(static_cast<std::int32_t>(b)).crossing) first[b] += static_cast<std::uint64_t>(count(crossing));
  quads_.resize(exclusive_scan(first, "edge crossings"));
  reach_.resize(quads_.size());
  quick_points_.resize(points.size());
  double farthest = 0;
  for (const HermiteView::Block& block : cells_.grid().blocks())
    for (int a = 0; a < 3; ++a)
      farthest = std::max(farthest, std::abs(double(block.lower[a] - cells_.grid().placement().base[a])) + 9);
  rounding_ = 32 * farthest * 0x1p-24;
  parallel_blocks(points.size(), context, [&](std::size_t i) {
    for (int a = 0; a < 3; ++a) quick_points_[i][a] = static_cast<float>(points[i][a]);
    quick_points_[i][3] = 0;
  });
  parallel_blocks(cells_.size(), context, [&](std::size_t b) {
    first_[b] = static_cast<std::uint32_t>(first[b]);
    auto number = static_cast<std::size_t>(first[b]);
    cells_.for_each_crossing_edge(static_cast<std::int32_t>(b), [&](const CellBlocks::Edge& edge) {
      Quad quad{};
      if (!polygons_.is_fanned(edge)) polygons_.polygons_of(edge, [&](const Quad& q) { quad = q; }, [](const Triangle&) {});
      double reach = 0;
      for (const std::uint32_t p : quad) reach = std::max(reach, (points[p] - points[quad[0]]).squaredNorm());
      quads_[number] = quad;
      reach_[number++] = static_cast<float>(std::sqrt(reach) * (1 + kRounding));
    });
  });
}

/// Polygons of S that may come near.
void RegionShell::gather(const RegionPolygon& polygon, double height, Scratch& scratch) const {
  scratch.quads.clear();
  scratch.fans.clear();
  Vector3d lower = polygon.points[0], upper = lower;
  polygon.for_each_triangle([&](int a, int b, int c) {
    for (const int corner : {a, b, c}) {
      const Vector3d place = polygon.place(corner);
      lower = lower.cwiseMin(place);
      upper = upper.cwiseMax(place);
    }
  });
  int from[3], to[3];  // samples whose edges touch a cell that the prisms may reach into
  for (int a = 0; a < 3; ++a) {
    from[a] = static_cast<int>(std::floor(lower[a] - height));
    to[a] = static_cast<int>(std::floor(upper[a] + height)) + 1;
  }
  std::array<std::int32_t, 4 * 27> seen;
  int seen_count = 0;
  for (int i = 0; i < polygon.corners; ++i) {
    const std::int32_t own = polygon.regions[i].block;
    const Vector3d corner = cells_.corner(own, 0);
    for (int slot = 0; slot < 27; ++slot) {
      const int shift[3] = {slot / 9 - 1, slot / 3 % 3 - 1, slot % 3 - 1};
      int begin[3], end[3];
      bool none = false;
      for (int a = 0; a < 3; ++a) {
        begin[a] = std::max(0, from[a] - int(corner[a]) - 8 * shift[a]);
        end[a] = std::min(8, to[a] + 1 - int(corner[a]) - 8 * shift[a]);
        none = none || begin[a] >= end[a];
      }
      if (none) continue;
      const std::int32_t block = cells_.source(own).neighbours[static_cast<std::size_t>(slot)];
      if (block < 0 || std::find(seen.begin(), seen.begin() + seen_count, block) != seen.begin() + seen_count) continue;
      seen[static_cast<std::size_t>(seen_count++)] = block;
      const std::uint64_t row = ((1u << end[2]) - 1) & ~((1u << begin[2]) - 1);
      std::uint64_t rows = 0;
      for (int y = begin[1]; y < end[1]; ++y) rows |= row << (8 * y);
      const HermiteView::Block& source = cells_.source(block);
      const std::uint32_t first = first_[static_cast<std::size_t>(block)];
      for (int axis = 0; axis < 3; ++axis)
        for (int x = begin[0]; x < end[0]; ++x) {
          const std::uint64_t all = source.crossing[axis][x];
          for (std::uint64_t word = all & rows; word != 0; word &= word - 1) {
            const int bit = std::countr_zero(word);
            const CellBlocks::Edge edge{block, 64 * x + bit, axis};
            if (polygons_.is_fanned(edge))
              polygons_.polygons_of(edge, [](const Quad&) {}, [&](const Triangle& t) { scratch.fans.push_back(t); });
            else
              scratch.quads.push_back(first + source.before[axis][x] +
                                      static_cast<std::uint32_t>(bits_in(all & ((std::uint64_t{1} << bit) - 1))));
          }
        }
    }
  }
}

bool RegionShell::holds(const RegionPolygon& polygon) const {
  thread_local Scratch scratch;
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
    scratch.pillars[RegionPolygon::kMiddle] = {n[0], n[1], n[2]};
    for (int i = 0; i < polygon.corners; ++i)
      scratch.pillars[static_cast<std::size_t>(RegionPolygon::kFirstSide + i)] =
          (scratch.pillars[static_cast<std::size_t>(i)] + scratch.pillars[static_cast<std::size_t>(polygon.next(i))]).normalized();
  }
  // Where prisms are low there is less to look at, and small triangles have no high ones. Neighbours may have prisms of
  // different heights: on the wall between them each line meets S once in either.
  scratch.is_there = false;
  unsigned open = ~0u;
  for (const double highest : {std::min(kLow, most), most}) {
    gather(polygon, highest, scratch);
    unsigned number = 0, still_open = 0;
    polygon.for_each_triangle([&](int a, int b, int c) {
      const unsigned bit = 1u << number++;
      if (!(open & bit)) return;
      for (const double share : {1.0, 0.25}) {
        scratch.height = share * highest;
        if (holds(polygon, {a, b, c}, scratch)) return;
      }
      still_open |= bit;
    });
    open = still_open;
    if (open == 0 || highest == most) break;
  }
  return open == 0 && scratch.is_there;
}

bool RegionShell::holds(const RegionPolygon& polygon, const std::array<int, 3>& corners, Scratch& scratch) const {
  const auto pillar = [&](std::size_t i) { return scratch.pillars[static_cast<std::size_t>(corners[i])]; };
  const Prism prism({polygon.place(corners[0]), polygon.place(corners[1]), polygon.place(corners[2])},
                    {pillar(0), pillar(1), pillar(2)}, scratch.height);
  if (!prism.stands()) return false;
  const QuickPrism quick(prism, rounding_);
  const auto tolerance_of = [&](const Triangle& t) { return std::min({tolerance_[t[0]], tolerance_[t[1]], tolerance_[t[2]]}); };
  const auto look_at = [&](const Triangle& t) {
    const FineTriangle fine(prism, {points_[t[0]], points_[t[1]], points_[t[2]]}, double(tolerance_of(t)));
    const Meeting meeting = meet(prism, fine);
    if (meeting == Meeting::good && !scratch.is_there)
      scratch.is_there = scratch.is_own(fine.corners, polygon.corners) && !extent_in(prism, fine, Walls::inner).empty();
    return meeting != Meeting::bad;
  };
  const auto height = static_cast<float>(scratch.height);
  for (const std::uint32_t number : scratch.quads) {
    const Quad& q = quads_[number];
    std::array<Floats, 4> points;
    std::array<QuickPrism::Place, 4> places;
    points[0] = load(quick_points_[q[0]]);
    places[0] = quick.place(points[0]);
    if (quick.is_beyond(places[0], reach_[number])) continue;
    for (std::size_t i = 1; i < 4; ++i) {
      points[i] = load(quick_points_[q[i]]);
      places[i] = quick.place(points[i]);
    }
    for (const auto& [a, b, c] : {std::array<std::size_t, 3>{0, 1, 2}, std::array<std::size_t, 3>{0, 2, 3}}) {
      if (quick.is_beyond(places[a].least_with(places[b]).least_with(places[c]))) continue;
      const Triangle t = {q[a], q[b], q[c]};
      if (scratch.is_there && tolerance_of(t) >= height &&
          quick.is_between_lids(places[a].greatest_with(places[b]).greatest_with(places[c])) &&
          quick.faces(points[a], points[b], points[c]))
        continue;
      if (!look_at(t)) return false;
    }
  }
  for (const Triangle& t : scratch.fans)
    if (!look_at(t)) return false;
  return true;
}

}  // namespace hermesh
