#include "reference/distance_oracle.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <cmath>

#include "algorithms/core/error.h"

namespace hermesh {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<
    Kernel, CGAL::AABB_triangle_primitive<Kernel, std::vector<Kernel::Triangle_3>::const_iterator>>>;
using Primitive = Tree::AABB_traits::Primitive;
using Node = CGAL::AABB_node<Tree::AABB_traits>;
using Eigen::Vector3d;

Point to_cgal(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// ---- Distance. The arithmetic is our own because CGAL's projection loses accuracy on slivers; the traversal
// is CGAL's.

double square(double x) { return x * x; }

Vector3d nearest_on_segment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d ab = b - a;
  const double length = ab.squaredNorm();
  const double t = length > 0.0 ? std::clamp((p - a).dot(ab) / length, 0.0, 1.0) : 0.0;
  return a + t * ab;
}

struct Foot {
  Vector3d point;
  double squared;  ///< squared distance to the point that was asked about
};

/// The point of a triangle nearest to p: the foot of the perpendicular if it lies in the triangle, else the
/// nearest point of an edge.
Foot foot_on_triangle(const Vector3d& p, const Corners& triangle) {
  const auto& [a, b, c] = triangle;
  const Vector3d normal = (b - a).cross(c - a);
  const auto left_of = [&](const Vector3d& u, const Vector3d& v) {
    return (v - u).cross(p - u).dot(normal) >= 0.0;
  };
  const double size = normal.squaredNorm();
  if (size > 0.0 && left_of(a, b) && left_of(b, c) && left_of(c, a)) {
    const double height = (p - a).dot(normal);
    return {p - height / size * normal, square(height) / size};
  }
  Foot best{a, std::numeric_limits<double>::infinity()};
  for (const Vector3d& q :
       {nearest_on_segment(p, a, b), nearest_on_segment(p, b, c), nearest_on_segment(p, c, a)})
    if (const double squared = (p - q).squaredNorm(); squared < best.squared) best = {q, squared};
  return best;
}

/// A traversal that finds the nearest triangle: it enters every box that could contain a point nearer than
/// the nearest point found so far.
struct Nearest {
  const DistanceOracle* oracle;
  const std::vector<Kernel::Triangle_3>* cgal;
  Vector3d point;
  double squared;             ///< least squared distance so far; at first an upper bound
  double good_enough = -1.0;  ///< the search may end at this squared distance
  Vector3d foot = point;

  std::uint32_t number(const Primitive& primitive) const {
    return static_cast<std::uint32_t>(primitive.id() - cgal->begin());
  }
  bool go_further() const { return squared > good_enough; }
  bool do_intersect(const Point&, const Node& node) const {
    const auto& box = node.bbox();
    double distance = 0.0;
    for (int axis = 0; axis < 3; ++axis)
      distance += square(std::max({0.0, box.min(axis) - point[axis], point[axis] - box.max(axis)}));
    return distance < squared;
  }
  void intersection(const Point&, const Primitive& primitive) {
    const Foot found = foot_on_triangle(point, oracle->triangles()[number(primitive)]);
    if (found.squared >= squared) return;
    squared = found.squared;
    foot = found.point;
  }
};

/// A traversal that gathers all triangles within a radius; it never narrows the search.
struct Within : Nearest {
  std::vector<std::uint32_t> found;
  void intersection(const Point&, const Primitive& primitive) {
    const std::uint32_t i = number(primitive);
    if (foot_on_triangle(point, oracle->triangles()[i]).squared < squared) found.push_back(i);
  }
};

const std::array<Kernel::Vector_3, 9> kDirections = {{{0.80178373, 0.53452248, 0.26726124},
                                                      {-0.41702200, 0.72032449, 0.55411438},
                                                      {0.14675589, -0.69232260, 0.70649111},
                                                      {-0.53881673, -0.41919451, -0.73072109},
                                                      {0.20445225, 0.87811744, -0.43259230},
                                                      {-0.96826158, 0.13134242, -0.21270031},
                                                      {0.69232262, -0.58389110, -0.42407300},
                                                      {-0.23608798, -0.11474592, 0.96493250},
                                                      {0.35091123, 0.21718290, -0.91087770}}};

}  // namespace

std::vector<Corners> triangles_in_voxels(const PolygonMesh& mesh, double voxel_size) {
  std::vector<Corners> result;
  result.reserve(mesh.triangle_count());
  const auto point = [&](std::uint32_t i) -> Vector3d { return mesh.points[i].cast<double>() / voxel_size; };
  for (const Triangle& t : triangulated(mesh)) {
    const Corners corners = {point(t[0]), point(t[1]), point(t[2])};
    if (!CGAL::collinear(to_cgal(corners[0]), to_cgal(corners[1]), to_cgal(corners[2])))
      result.push_back(corners);
  }
  return result;
}

struct DistanceOracle::Machinery {
  std::vector<Corners> triangles;
  std::vector<Kernel::Triangle_3> cgal;
  Tree tree;
};

DistanceOracle::DistanceOracle(std::vector<Corners> triangles) : machinery_(std::make_unique<Machinery>()) {
  if (triangles.empty())
    throw Error("All triangles of the mesh have no area: there is no surface to voxelize.");
  Machinery& m = *machinery_;
  m.triangles = std::move(triangles);
  m.cgal.reserve(m.triangles.size());
  for (const Corners& t : m.triangles) m.cgal.emplace_back(to_cgal(t[0]), to_cgal(t[1]), to_cgal(t[2]));
  m.tree.insert(m.cgal.cbegin(), m.cgal.cend());
  m.tree.build();
}

DistanceOracle::~DistanceOracle() = default;

const std::vector<Corners>& DistanceOracle::triangles() const { return machinery_->triangles; }

double DistanceOracle::distance(const Vector3d& point, double upper_bound) const {
  Nearest nearest{this, &machinery_->cgal, point, square(upper_bound)};
  machinery_->tree.traversal(to_cgal(point), nearest);
  return std::sqrt(nearest.squared);
}

bool DistanceOracle::any_within(const Vector3d& point, double radius) const {
  const double limit = square(radius);
  Nearest nearest{this, &machinery_->cgal, point, std::nextafter(limit, 2.0 * limit), limit};
  machinery_->tree.traversal(to_cgal(point), nearest);
  return nearest.squared <= limit;
}

Vector3d DistanceOracle::nearest_point(const Vector3d& point) const {
  Nearest nearest{this, &machinery_->cgal, point, std::numeric_limits<double>::infinity()};
  machinery_->tree.traversal(to_cgal(point), nearest);
  return nearest.foot;
}

std::vector<std::uint32_t> DistanceOracle::triangles_within(const Vector3d& point, double radius) const {
  Within within{{this, &machinery_->cgal, point, square(radius)}, {}};
  machinery_->tree.traversal(to_cgal(point), within);
  return within.found;
}

DistanceOracle::Vote DistanceOracle::parity(const Vector3d& point) const {
  Vote vote;
  for (const Kernel::Vector_3& direction : kDirections) {
    const Kernel::Ray_3 ray(to_cgal(point), direction);
    vote.odd += int(machinery_->tree.number_of_intersected_primitives(ray) % 2);
    ++vote.cast;
    if (vote.cast >= 3 && vote.unanimous()) break;
  }
  return vote;
}

int DistanceOracle::signed_crossings(const Vector3d& point, int number) const {
  std::vector<Primitive::Id> crossed;
  machinery_->tree.all_intersected_primitives(Kernel::Ray_3(to_cgal(point), kDirections[std::size_t(number)]),
                                              std::back_inserter(crossed));
  const Vector3d along = direction(number);
  int sum = 0;
  for (const auto& id : crossed) {
    const auto& [a, b, c] = machinery_->triangles[std::size_t(id - machinery_->cgal.cbegin())];
    sum += (b - a).cross(c - a).dot(along) > 0.0 ? 1 : -1;
  }
  return sum;
}

Vector3d DistanceOracle::direction(int number) {
  const Kernel::Vector_3& d = kDirections[std::size_t(number)];
  return {d.x(), d.y(), d.z()};
}

namespace {

struct Block {
  std::array<int, 3> origin;
  bool near = false;
};

std::array<int, 3> corner_of(const std::array<int, 3>& origin, int i, int step) {
  return {origin[0] + (i >> 2 & 1) * step, origin[1] + (i >> 1 & 1) * step, origin[2] + (i & 1) * step};
}

}  // namespace

/// An octree of blocks, refined a level at a time.
std::vector<std::array<int, 3>> DistanceOracle::blocks_within(double band, const RunContext& context) const {
  const CGAL::Bbox_3 box = machinery_->tree.bbox();
  const auto low = [&](int axis) { return int(std::floor(box.min(axis) - band)); };
  const auto high = [&](int axis) { return int(std::ceil(box.max(axis) + band)); };
  int log2 = 3;
  for (int axis = 0; axis < 3; ++axis)
    while ((std::int64_t(1) << log2) < std::int64_t(high(axis)) - low(axis) + 1) ++log2;

  const auto start = [&](int axis) { return low(axis) >> log2 << log2; };
  std::vector<Block> blocks;
  for (int i = 0; i < 8; ++i) blocks.push_back({corner_of({start(0), start(1), start(2)}, i, 1 << log2)});
  while (true) {
    const double half = 0.5 * ((1 << log2) - 1);
    tbb::parallel_for(std::size_t(0), blocks.size(), [&](std::size_t i) {
      context.check();
      const Vector3d centre = block_position(blocks[i].origin, 0) + Vector3d::Constant(half);
      blocks[i].near = any_within(centre, band + half * std::sqrt(3.0));
    });
    std::erase_if(blocks, [](const Block& block) { return !block.near; });
    if (log2 == 3) break;
    --log2;
    std::vector<Block> children;
    children.reserve(8 * blocks.size());
    for (const Block& block : blocks)
      for (int i = 0; i < 8; ++i) children.push_back({corner_of(block.origin, i, 1 << log2)});
    blocks = std::move(children);
  }
  std::vector<std::array<int, 3>> origins;
  for (const Block& block : blocks) origins.push_back(block.origin);
  return origins;
}

// ---- A block.

namespace {

constexpr std::array<int, 3> kStrides = {64, 8, 1};  // of x, y and z
constexpr double kSure = 1e-5;                       // more than twice block_side_place()'s step, in voxels

/// Gives every sample that provably lies on the same side as `seed` the seed's sign.
void spread(const std::array<double, kBlockVoxels>& distance, int seed, bool sign,
            std::bitset<kBlockVoxels>& known, std::bitset<kBlockVoxels>& inside) {
  std::vector<int> stack{seed};
  known.set(std::size_t(seed));
  while (!stack.empty()) {
    const int i = stack.back();
    stack.pop_back();
    inside.set(std::size_t(i), sign);
    for (const int stride : kStrides)
      for (const int step : {-1, 1}) {
        const int along = (i / stride) % 8 + step;
        const int j = i + step * stride;
        // Two overlapping balls that contain no surface cover the edge between their centres, and the edge
        // between the points that define their sides.
        if (along < 0 || along > 7 || known[std::size_t(j)] ||
            distance[std::size_t(i)] + distance[std::size_t(j)] <= 1.0 + kSure)
          continue;
        known.set(std::size_t(j));
        stack.push_back(j);
      }
  }
}

}  // namespace

std::array<double, kBlockVoxels> block_distances(const DistanceOracle& oracle,
                                                 const std::array<int, 3>& origin, double reach) {
  std::array<double, kBlockVoxels> result;
  for (int i = 0; i < kBlockVoxels; ++i) {
    // The sample before this one in x, y or z is a step away, and the distance changes by no more than the
    // step.
    double bound = reach;
    for (const int stride : kStrides)
      if ((i / stride) % 8 > 0) bound = std::min(bound, result[std::size_t(i - stride)] + 1.0);
    result[std::size_t(i)] = oracle.distance(block_position(origin, i), bound * (1.0 + 1e-12) + 1e-12);
  }
  return result;
}

Vector3d block_side_place(const std::array<int, 3>& origin, int i) {
  return block_position(origin, i) + Vector3d(3.3e-6, 2.1e-6, 1.1e-6);
}

std::bitset<kBlockVoxels> block_inside(const std::array<int, 3>& origin,
                                       const std::array<double, kBlockVoxels>& distances,
                                       const std::function<bool(const Vector3d&)>& is_inside) {
  // Farthest first: the farther from the surface, the less a ray's start matters.
  std::array<int, kBlockVoxels> order;
  for (int i = 0; i < kBlockVoxels; ++i) order[std::size_t(i)] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return distances[std::size_t(a)] > distances[std::size_t(b)]; });
  std::bitset<kBlockVoxels> known, inside;
  for (const int i : order)
    if (!known[std::size_t(i)]) spread(distances, i, is_inside(block_side_place(origin, i)), known, inside);
  return inside;
}

}  // namespace hermesh
