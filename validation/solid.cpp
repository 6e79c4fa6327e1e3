#include "validation/solid.h"

#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "validation/geometry/exact_predicates.h"

namespace hermesh::validation {
namespace {

constexpr double kFewEdges = 0.01;
constexpr int kRays = 24, kFirstRays = 8, kWays = 8;

bool comes_before(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

struct Side3 {
  std::uint32_t low, high;
  int way;
  bool operator<(const Side3& o) const { return low != o.low ? low < o.low : high < o.high; }
};

// How far along the segment a triangle is hit, a little widened; infinite where it is missed.
double hit_along(const Corners& t, const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
  constexpr double kWide = 1e-9;
  const Eigen::Vector3d u = t[1] - t[0], v = t[2] - t[0], p = along.cross(v);
  const double determinant = u.dot(p);
  const Eigen::Vector3d s = from - t[0], q = s.cross(u);
  const double a = s.dot(p) / determinant, b = along.dot(q) / determinant, c = v.dot(q) / determinant;
  const bool hit = a >= -kWide && b >= -kWide && a + b <= 1.0 + kWide && c >= 0.0;
  return hit ? c : std::numeric_limits<double>::infinity();
}

}  // namespace

// On Fibonacci's spiral.
std::vector<Eigen::Vector3d> ray_directions(double length) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7391, Eigen::Vector3d(0.3113, 0.5417, 0.7807).normalized()).toRotationMatrix();
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < kRays; ++i) {
    // Every fifth point after another, so that the first few are spread, too.
    const int k = 5 * i % kRays;
    const double z = 1.0 - (2.0 * k + 1.0) / kRays, r = std::sqrt(1.0 - z * z);
    const double angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * k;
    directions.push_back(length * (turn * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z)));
  }
  return directions;
}

std::optional<int> crossing_of(const Corners& t, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const int start = orientation(t[0], t[1], t[2], from), end = orientation(t[0], t[1], t[2], to);
  if (start == end && start != 0) return 0;
  bool positive = false, negative = false, zero = false;
  for (int k = 0; k < 3; ++k) {
    const int turn = orientation(from, to, t[k], t[(k + 1) % 3]);
    positive |= turn > 0, negative |= turn < 0, zero |= turn == 0;
  }
  if (positive && negative) return 0;
  if (zero || start == 0 || end == 0) return std::nullopt;
  return -start;
}

MeshFile welded_triangles(const MeshFile& mesh, QuadRule rule) {
  const TriangleSoup soup(mesh, rule);
  std::vector<std::uint32_t> order(mesh.points.size()), number(mesh.points.size());
  std::iota(order.begin(), order.end(), 0u);
  tbb::parallel_sort(order.begin(), order.end(), [&mesh](std::uint32_t a, std::uint32_t b) {
    const Eigen::Vector3d &p = mesh.points[a], &q = mesh.points[b];
    return p == q ? a < b : comes_before(p, q);
  });
  MeshFile result;
  for (std::uint32_t p : order) {
    if (result.points.empty() || result.points.back() != mesh.points[p])
      result.points.push_back(mesh.points[p]);
    number[p] = std::uint32_t(result.points.size() - 1);
  }
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    if (collinear(soup.corners(t))) continue;
    const Triangle& c = soup.triangles[t];
    result.triangles.push_back({number[c[0]], number[c[1]], number[c[2]]});
  }
  return result;
}

Solid::Solid(const TriangleSoup& soup, const TriangleTree& tree, Reading reading, const RunContext& context)
    : soup_(soup), tree_(tree), reading_(reading) {
  directions_ = ray_directions(2.0 * tree.bounds().diagonal());
  look_at_edges();
  context.check();
  if (balanced_ || oriented_) turn_outwards();
  if (reading_ == Reading::by_any_rule) free_cells_ = FreeCells(tree);
  context.check();
}

void Solid::look_at_edges() {
  std::vector<Side3> sides;
  sides.reserve(3 * soup_.triangles.size());
  for (const Triangle& t : soup_.triangles)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
    }
  tbb::parallel_sort(sides.begin(), sides.end());
  double two_sided = 0.0, against = 0.0;
  for (std::size_t i = 0, end; i < sides.size(); i = end) {
    int sum = 0;
    for (end = i; end < sides.size() && !(sides[i] < sides[end]); ++end) sum += sides[end].way;
    if ((end - i) % 2) closed_ = false;
    if (sum != 0) balanced_ = false;
    two_sided += end - i == 2;
    against += end - i == 2 && sum != 0;
  }
  oriented_ = against <= kFewEdges * two_sided;
}

void Solid::turn_outwards() {
  // Of an open mesh the volume depends on the point that it is measured from. It is linear in it, so that the
  // box's corners tell whether it is negative from everywhere.
  const Box& box = tree_.bounds();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d from((corner & 1 ? box.upper : box.lower).x(),
                               (corner & 2 ? box.upper : box.lower).y(),
                               (corner & 4 ? box.upper : box.lower).z());
    double volume = 0.0;
    for (std::size_t t = 0; t < soup_.triangles.size(); ++t) {
      const Corners c = soup_.corners(t);
      volume += (c[0] - from).dot((c[1] - from).cross(c[2] - from));
    }
    if (volume >= 0.0) return;
  }
  turn_ = -1;
}

Solid::Crossings Solid::crossings(const Eigen::Vector3d& from, int direction) const {
  const Eigen::Vector3d to = from + directions_[std::size_t(direction)];
  Crossings result;
  tree_.for_each_on_segment(from, to, [&](std::uint32_t slot) {
    const std::optional<int> crossing = crossing_of(tree_.corners(slot), from, to);
    result.sure = crossing.has_value();
    if (crossing.value_or(0) == 0) return result.sure;
    result.sum += *crossing;
    ++result.count;
    return true;
  });
  result.sum *= turn_;
  return result;
}

Side Solid::side(const Eigen::Vector3d& point) const {
  const Box& box = tree_.bounds();
  if (box.squared_distance(point) > 0.0) return Side::outside;
  return closed_ ? side_of_closed(point) : side_of_open(point);
}

Side Solid::side_of_closed(const Eigen::Vector3d& point) const {
  for (int direction = 0; direction < kRays; ++direction) {
    const Crossings found = crossings(point, direction);
    if (!found.sure) continue;
    const bool odd = found.count % 2 != 0;
    if (reading_ == Reading::by_orientation)
      return (balanced_ ? found.sum > 0 : odd) ? Side::inside : Side::outside;
    if (odd || (balanced_ && found.sum > 0)) return Side::inside;
    return outside_if_reachable(point);
  }
  return Side::unknown;
}

Side Solid::side_of_open(const Eigen::Vector3d& point) const {
  int rays = 0, over_zero = 0, odd = 0, sum = 0;
  for (int direction = 0; direction < kRays; ++direction) {
    const Crossings found = crossings(point, direction);
    if (!found.sure) continue;
    ++rays;
    sum += found.sum;
    over_zero += found.sum > 0;
    odd += found.count % 2 != 0;
    if (rays == kFirstRays && (over_zero == 0 || over_zero == rays) && (odd == 0 || odd == rays)) break;
  }
  if (rays < kFirstRays) return Side::unknown;
  const auto most = [rays](int votes) { return 4 * votes >= 3 * rays; };
  if (most(oriented_ ? over_zero : odd)) return Side::inside;
  // An inner wall without a second side to it makes counts differ, but neither rule sees an outside there.
  if (oriented_ && 8 * sum >= 3 * rays && leads_to(point, &FreeCells::enclosed)) return Side::inside;
  if (!most(rays - odd) || (oriented_ && !most(rays - over_zero))) return Side::unknown;
  return reading_ == Reading::by_orientation ? Side::outside : outside_if_reachable(point);
}

Side Solid::outside_if_reachable(const Eigen::Vector3d& point) const {
  return leads_to(point, &FreeCells::free) ? Side::outside : Side::unknown;
}

bool Solid::leads_to(const Eigen::Vector3d& point,
                     bool (FreeCells::*kind)(const Eigen::Vector3d&) const) const {
  if ((free_cells_.*kind)(point)) return true;
  const double step = 0.5 * free_cells_.cell();
  if (!(step > 0.0)) return false;  // there are no cells, of which a way could meet one
  for (int way = 0; way < kWays; ++way) {
    const Eigen::Vector3d& direction = directions_[std::size_t(way)];
    double hit = 1.0;
    tree_.for_each_on_segment(point, point + direction, [&](std::uint32_t slot) {
      hit = std::min(hit, hit_along(tree_.corners(slot), point, direction));
      return true;
    });
    const double length = hit * direction.norm();
    const Eigen::Vector3d along = direction.normalized();
    // Up to the cell before the hit: a cell's middle lies within a step of what was looked at.
    for (double at = step; at < length && tree_.bounds().squared_distance(point + at * along) <= 0.0;
         at += step)
      if ((free_cells_.*kind)(point + at * along)) return true;
    if (hit >= 1.0 && (free_cells_.*kind)(point + direction)) return true;
  }
  return false;
}

}  // namespace hermesh::validation
