#include "validation/solid.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "algorithms/core/disjoint_sets.h"
#include "validation/geometry/exact_predicates.h"

namespace hermesh::validation {
namespace {

constexpr double kFewEdges = 0.01;
constexpr int kRays = 24, kFirstRays = 8, kPaths = 8;
constexpr int kCells = 128;

// Returns the parameter at which a segment hits a slightly enlarged triangle; infinity if it misses.
double hit_along(const Corners& t, const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
  constexpr double kWide = 1e-9;
  const Eigen::Vector3d u = t[1] - t[0], v = t[2] - t[0], p = along.cross(v);
  const double determinant = u.dot(p);
  const Eigen::Vector3d s = from - t[0], q = s.cross(u);
  const double a = s.dot(p) / determinant, b = along.dot(q) / determinant, c = v.dot(q) / determinant;
  const bool hit = a >= -kWide && b >= -kWide && a + b <= 1.0 + kWide && c >= 0.0;
  return hit ? c : std::numeric_limits<double>::infinity();
}

// Returns vectors of that length on a Fibonacci spiral over the sphere, rotated away from the axes and planes
// that are frequent in models. Any first few of them are spread, too.
std::vector<Eigen::Vector3d> ray_directions(double length) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7391, Eigen::Vector3d(0.3113, 0.5417, 0.7807).normalized()).toRotationMatrix();
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < kRays; ++i) {
    const int k = 5 * i % kRays;
    const double z = 1.0 - (2.0 * k + 1.0) / kRays, r = std::sqrt(1.0 - z * z);
    const double angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * k;
    directions.push_back(length * (turn * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z)));
  }
  return directions;
}

// Returns how a segment crosses a triangle: 1 if it leaves through the front, −1 if it enters through it, 0
// if it misses, and nothing if it intersects an edge or ends in the triangle's plane. Exact.
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

// Returns true if the other components wind around a component, so it is a cavity if it faces inwards. Rays
// start at its vertices, one after another, until one of them intersects no edge.
bool is_enclosed(const TriangleSoup& soup, const TriangleTree& tree,
                 const std::vector<std::uint32_t>& component, const std::vector<std::uint32_t>& triangles) {
  const std::uint32_t own = component[soup.triangles[triangles[0]][0]];
  const std::vector<Eigen::Vector3d> directions = ray_directions(2.0 * tree.bounds().diagonal());
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Eigen::Vector3d from = soup.corners(triangles[i % triangles.size()])[0], to = from + directions[i];
    int sum = 0;
    bool sure = true;
    tree.for_each_on_segment(from, to, [&](std::uint32_t slot) {
      if (component[soup.triangles[tree.triangle(slot)][0]] == own) return true;
      const std::optional<int> crossing = crossing_of(tree.corners(slot), from, to);
      sure = crossing.has_value();
      sum += crossing.value_or(0);
      return sure;
    });
    if (sure) return sum > 0;
  }
  return false;
}

}  // namespace

void count_inside_out(const TriangleSoup& soup, const TriangleTree& tree, MeshReport& report,
                      const RunContext& context) {
  if (!report.closed() || !report.oriented()) return;
  DisjointSets sets(soup.points.size());
  for (const Triangle& t : soup.triangles) sets.join(t[0], t[1]), sets.join(t[0], t[2]);
  std::vector<std::uint32_t> component(soup.points.size());
  for (std::uint32_t p = 0; p < component.size(); ++p) component[p] = sets.find(p);
  // Components are named by their lowest point, from which their volumes are measured.
  std::vector<double> volume(soup.points.size());
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    const std::uint32_t of = component[soup.triangles[t][0]];
    const Corners c = soup.corners(t);
    const Eigen::Vector3d& apex = soup.points[of];
    volume[of] += (c[0] - apex).dot((c[1] - apex).cross(c[2] - apex));
  }
  std::map<std::uint32_t, std::vector<std::uint32_t>> triangles;  // of those with negative volume
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t)
    if (const std::uint32_t of = component[soup.triangles[t][0]]; volume[of] < 0.0)
      triangles[of].push_back(t);
  report.inside_out_components = 0;
  for (const auto& [of, of_one] : triangles) {
    context.check();
    if (is_enclosed(soup, tree, component, of_one)) continue;
    ++*report.inside_out_components;
    const Corners c = soup.corners(of_one[0]);
    report.inside_out_places.add((c[0] + c[1] + c[2]) / 3.0, soup.polygon(of_one[0]));
  }
}

FreeCells::FreeCells(const TriangleTree& tree) {
  const Box& box = tree.bounds();
  const Eigen::Vector3d size = box.upper - box.lower;
  cell_ = size.maxCoeff() / kCells;
  // Two layers of cells about the box: triangles in its sides block the first; the flood begins in the
  // second.
  lower_ = box.lower - Eigen::Vector3d::Constant(2.0 * cell_);
  for (int axis = 0; axis < 3; ++axis) size_[axis] = 5 + int(size[axis] / cell_);
  state_.assign(std::size_t(size_.x()) * std::size_t(size_.y()) * std::size_t(size_.z()), kUnseen);
  for (std::size_t slot = 0; slot < tree.size(); ++slot) block(tree.corners(slot));
  flood();
}

Eigen::Vector3i FreeCells::cell_of(const Eigen::Vector3d& point) const {
  Eigen::Vector3i at;
  for (int axis = 0; axis < 3; ++axis)
    at[axis] = std::clamp(int(std::floor((point[axis] - lower_[axis]) / cell_)), 0, size_[axis] - 1);
  return at;
}

void FreeCells::block(const Corners& t) {
  const Box box = box_of(t);
  // Keeps the triangle within the cells of its box despite rounding.
  const Eigen::Vector3d slack = Eigen::Vector3d::Constant(1e-6 * cell_);
  const Eigen::Vector3i first = cell_of(box.lower - slack), last = cell_of(box.upper + slack);
  if ((last - first).maxCoeff() <= 1) {
    for (int x = first.x(); x <= last.x(); ++x)
      for (int y = first.y(); y <= last.y(); ++y)
        for (int z = first.z(); z <= last.z(); ++z) state_[index({x, y, z})] = kBlocked;
    return;
  }
  int longest = 0;
  for (int k = 1; k < 3; ++k)
    if ((t[(k + 1) % 3] - t[k]).squaredNorm() > (t[(longest + 1) % 3] - t[longest]).squaredNorm())
      longest = k;
  const Eigen::Vector3d &a = t[longest], &b = t[(longest + 1) % 3], &c = t[(longest + 2) % 3];
  const Eigen::Vector3d middle = 0.5 * (a + b);
  block({a, middle, c});
  block({middle, b, c});
}

void FreeCells::flood() {
  std::vector<Eigen::Vector3i> stack{Eigen::Vector3i::Zero()};
  state_[0] = kFree;
  while (!stack.empty()) {
    const Eigen::Vector3i at = stack.back();
    stack.pop_back();
    for (int axis = 0; axis < 3; ++axis)
      for (int step : {-1, 1}) {
        Eigen::Vector3i next = at;
        next[axis] += step;
        if (next[axis] < 0 || next[axis] >= size_[axis] || state_[index(next)] != kUnseen) continue;
        state_[index(next)] = kFree;
        stack.push_back(next);
      }
  }
}

Solid::Solid(const TriangleSoup& soup, const TriangleTree& tree, Reading reading, const RunContext& context)
    : soup_(soup), tree_(tree), reading_(reading) {
  directions_ = ray_directions(2.0 * tree.bounds().diagonal());
  classify_edges();
  context.check();
  if (balanced_ || oriented_) turn_outwards();
  if (reading_ == Reading::by_any_rule) free_cells_ = FreeCells(tree);
  context.check();
}

void Solid::classify_edges() {
  double two_sided = 0.0, against = 0.0;
  for_each_edge(sorted_sides(soup_.triangles), [&](std::span<const TriangleSide> sides) {
    int sum = 0;
    for (const TriangleSide& side : sides) sum += side.direction;
    if (sides.size() % 2) closed_ = false;
    if (sum != 0) balanced_ = false;
    two_sided += sides.size() == 2;
    against += sides.size() == 2 && sum != 0;
  });
  oriented_ = against <= kFewEdges * two_sided;
}

void Solid::turn_outwards() {
  // The volume of an open mesh depends linearly on the point that it is measured from, so it is negative from
  // everywhere in the box if it is from the box's corners.
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
  // Next to an inner wall without a second side counts differ, but no rule finds an outside.
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
  if (!(step > 0.0)) return false;  // there are no cells
  for (int path = 0; path < kPaths; ++path) {
    const Eigen::Vector3d& direction = directions_[std::size_t(path)];
    double hit = 1.0;
    tree_.for_each_on_segment(point, point + direction, [&](std::uint32_t slot) {
      hit = std::min(hit, hit_along(tree_.corners(slot), point, direction));
      return true;
    });
    const double length = hit * direction.norm();
    const Eigen::Vector3d along = direction.normalized();
    // Up to the cell before the hit: the middle of a cell is within a step of a tested point.
    for (double at = step; at < length && tree_.bounds().squared_distance(point + at * along) <= 0.0;
         at += step)
      if ((free_cells_.*kind)(point + at * along)) return true;
    if (hit >= 1.0 && (free_cells_.*kind)(point + direction)) return true;
  }
  return false;
}

}  // namespace hermesh::validation
