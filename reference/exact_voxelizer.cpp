#include "reference/exact_voxelizer.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <bitset>
#include <cmath>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/memory_estimate.h"

namespace hermesh {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<
    Kernel, CGAL::AABB_triangle_primitive<Kernel, std::vector<Kernel::Triangle_3>::const_iterator>>>;
using Primitive = Tree::AABB_traits::Primitive;
using Node = CGAL::AABB_node<Tree::AABB_traits>;
using Leaf = openvdb::FloatTree::LeafNodeType;
using openvdb::Coord;

// ---- Distance. The arithmetic is our own because CGAL's projection loses accuracy on slivers; the traversal
// is CGAL's.

double square(double x) { return x * x; }

double squared_distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double length = ab.squaredNorm();
  const double t = length > 0.0 ? std::clamp((p - a).dot(ab) / length, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).squaredNorm();
}

/// The plane's distance where the foot of the perpendicular lies in the triangle, else that of the nearest
/// edge.
double squared_distance_to_triangle(const Eigen::Vector3d& p, const Kernel::Triangle_3& triangle) {
  const auto corner = [&](int i) {
    return Eigen::Vector3d(triangle[i].x(), triangle[i].y(), triangle[i].z());
  };
  const Eigen::Vector3d a = corner(0), b = corner(1), c = corner(2);
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const auto left_of = [&](const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    return (v - u).cross(p - u).dot(normal) >= 0.0;
  };
  const double size = normal.squaredNorm();
  if (size > 0.0 && left_of(a, b) && left_of(b, c) && left_of(c, a))
    return square((p - a).dot(normal)) / size;
  return std::min({squared_distance_to_segment(p, a, b), squared_distance_to_segment(p, b, c),
                   squared_distance_to_segment(p, c, a)});
}

/// Visits every triangle whose box could hold something nearer than what was found so far.
struct Nearest {
  Eigen::Vector3d point;
  double squared;             ///< to begin with, an upper bound
  double good_enough = -1.0;  ///< the search may end at this squared distance

  bool go_further() const { return squared > good_enough; }
  bool do_intersect(const Point&, const Node& node) const {
    const auto& box = node.bbox();
    double distance = 0.0;
    for (int axis = 0; axis < 3; ++axis)
      distance += square(std::max({0.0, box.min(axis) - point[axis], point[axis] - box.max(axis)}));
    return distance < squared;
  }
  void intersection(const Point&, const Primitive& primitive) {
    squared = std::min(squared, squared_distance_to_triangle(point, primitive.datum()));
  }
};

double distance(const Tree& tree, const Eigen::Vector3d& point, double upper_bound) {
  Nearest nearest{point, square(upper_bound)};
  tree.traversal(Point(point.x(), point.y(), point.z()), nearest);
  return std::sqrt(nearest.squared);
}

bool any_within(const Tree& tree, const Eigen::Vector3d& point, double radius) {
  const double limit = square(radius);
  Nearest nearest{point, std::nextafter(limit, 2.0 * limit), limit};
  tree.traversal(Point(point.x(), point.y(), point.z()), nearest);
  return nearest.squared <= limit;
}

// ---- Sign.

/// A ray in general position meets no edge, and its parity is right. The directions are irrational multiples
/// of one another; should a ray graze an edge even so, the others outvote it.
bool inside(const Tree& tree, const Eigen::Vector3d& point) {
  static const std::array<Kernel::Vector_3, 9> kDirections = {{{0.80178373, 0.53452248, 0.26726124},
                                                               {-0.41702200, 0.72032449, 0.55411438},
                                                               {0.14675589, -0.69232260, 0.70649111},
                                                               {-0.53881673, -0.41919451, -0.73072109},
                                                               {0.20445225, 0.87811744, -0.43259230},
                                                               {-0.96826158, 0.13134242, -0.21270031},
                                                               {0.69232262, -0.58389110, -0.42407300},
                                                               {-0.23608798, -0.11474592, 0.96493250},
                                                               {0.35091123, 0.21718290, -0.91087770}}};
  const Point source(point.x(), point.y(), point.z());
  int odd = 0, cast = 0;
  for (const Kernel::Vector_3& direction : kDirections) {
    odd += int(tree.number_of_intersected_primitives(Kernel::Ray_3(source, direction)) % 2);
    ++cast;
    if (cast >= 3 && (odd == 0 || odd == cast)) break;
  }
  return 2 * odd > cast;
}

// ---- One leaf.

constexpr int kVoxels = Leaf::SIZE;
constexpr std::array<int, 3> kStrides = {64, 8, 1};  // of Leaf's x, y and z

struct Band {
  double exterior, interior;  // voxels
  double widest() const { return std::max(exterior, interior); }
};

Eigen::Vector3d position(const Coord& xyz) { return {double(xyz.x()), double(xyz.y()), double(xyz.z())}; }

std::array<double, kVoxels> distances(const Tree& tree, const Coord& origin, double centre_bound) {
  std::array<double, kVoxels> result;
  for (int i = 0; i < kVoxels; ++i) {
    // The voxel before this one in x, y or z is a step away, and the distance changes by no more than the
    // step.
    double bound = centre_bound;
    for (const int stride : kStrides)
      if ((i / stride) % 8 > 0) bound = std::min(bound, result[i - stride] + 1.0);
    result[i] = distance(tree, position(origin + Leaf::offsetToLocalCoord(i)), bound * (1.0 + 1e-12) + 1e-12);
  }
  return result;
}

/// Gives every voxel that provably lies on the same side as `seed` the seed's sign.
void spread(const std::array<double, kVoxels>& distance, int seed, bool sign, std::bitset<kVoxels>& known,
            std::bitset<kVoxels>& negative) {
  std::vector<int> stack{seed};
  known.set(seed);
  while (!stack.empty()) {
    const int i = stack.back();
    stack.pop_back();
    negative.set(i, sign);
    for (const int stride : kStrides)
      for (const int step : {-1, 1}) {
        const int along = (i / stride) % 8 + step;
        const int j = i + step * stride;
        // Two balls free of surface that overlap cover the edge between their centres.
        if (along < 0 || along > 7 || known[j] || distance[i] + distance[j] <= 1.0 + 1e-9) continue;
        known.set(j);
        stack.push_back(j);
      }
  }
}

std::bitset<kVoxels> negative_voxels(const Tree& tree, const Coord& origin,
                                     const std::array<double, kVoxels>& distance) {
  // Farthest first: the farther from the surface, the less a ray's start matters.
  std::array<int, kVoxels> order;
  for (int i = 0; i < kVoxels; ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return distance[a] > distance[b]; });
  std::bitset<kVoxels> known, negative;
  for (const int i : order)
    if (!known[i])
      spread(distance, i, inside(tree, position(origin + Leaf::offsetToLocalCoord(i))), known, negative);
  return negative;
}

/// Null when no voxel of the leaf is in the band.
std::unique_ptr<Leaf> make_leaf(const Tree& tree, const Coord& origin, const Band& band, double voxel_size) {
  // A leaf was chosen because its centre is within the band and half a diagonal; its voxels are half a
  // diagonal off.
  const double reach = band.widest() + 2.0 * 3.5 * std::sqrt(3.0) + 1.0;
  const std::array<double, kVoxels> distance = distances(tree, origin, reach);
  if (*std::min_element(distance.begin(), distance.end()) >= band.widest()) return nullptr;

  const std::bitset<kVoxels> negative = negative_voxels(tree, origin, distance);
  auto leaf = std::make_unique<Leaf>(origin);
  for (int i = 0; i < kVoxels; ++i) {
    const double limit = negative[i] ? band.interior : band.exterior;
    const double value = std::min(distance[i], limit) * voxel_size;
    leaf->setValueOnly(i, float(negative[i] ? -value : value));
    leaf->setActiveState(i, distance[i] < limit);
  }
  if (leaf->isEmpty()) return nullptr;
  return leaf;
}

// ---- The grid.

std::vector<Kernel::Triangle_3> triangles_in_voxels(const PolygonMesh& mesh, double voxel_size) {
  std::vector<Kernel::Triangle_3> result;
  result.reserve(mesh.triangle_count());
  const auto point = [&](std::uint32_t i) {
    const Eigen::Vector3d p = mesh.points[i].cast<double>() / voxel_size;
    return Point(p.x(), p.y(), p.z());
  };
  for (const Triangle& t : triangulated(mesh)) {
    const Kernel::Triangle_3 triangle(point(t[0]), point(t[1]), point(t[2]));
    if (!triangle.is_degenerate()) result.push_back(triangle);
  }
  return result;
}

struct Block {
  Coord origin;
  bool near = false;
};

/// Origins of the leaves whose centre is within the band and half a diagonal of the surface: an octree of
/// blocks, refined a level at a time.
std::vector<Coord> candidate_leaves(const Tree& tree, double band, const RunContext& context) {
  const CGAL::Bbox_3 box = tree.bbox();
  const auto low = [&](int axis) { return int(std::floor(box.min(axis) - band)); };
  const auto high = [&](int axis) { return int(std::ceil(box.max(axis) + band)); };
  int log2 = 3;
  for (int axis = 0; axis < 3; ++axis)
    while ((std::int64_t(1) << log2) < std::int64_t(high(axis)) - low(axis) + 1) ++log2;

  const auto start = [&](int axis) { return low(axis) >> log2 << log2; };
  std::vector<Block> blocks;
  for (int i = 0; i < 8; ++i) {
    const Coord step((i >> 2 & 1) << log2, (i >> 1 & 1) << log2, (i & 1) << log2);
    blocks.push_back({Coord(start(0), start(1), start(2)) + step});
  }
  while (true) {
    const double half = 0.5 * ((1 << log2) - 1);
    tbb::parallel_for(std::size_t(0), blocks.size(), [&](std::size_t i) {
      context.check();
      const Eigen::Vector3d centre = position(blocks[i].origin) + Eigen::Vector3d::Constant(half);
      blocks[i].near = any_within(tree, centre, band + half * std::sqrt(3.0));
    });
    std::erase_if(blocks, [](const Block& block) { return !block.near; });
    if (log2 == 3) break;
    --log2;
    std::vector<Block> children;
    children.reserve(8 * blocks.size());
    for (const Block& block : blocks)
      for (int i = 0; i < 8; ++i)
        children.push_back(
            {block.origin + Coord((i >> 2 & 1) << log2, (i >> 1 & 1) << log2, (i & 1) << log2)});
    blocks = std::move(children);
  }
  std::vector<Coord> origins;
  for (const Block& block : blocks) origins.push_back(block.origin);
  return origins;
}

/// Leaves are made in parallel, a batch at a time so that this thread can report, and inserted in their
/// order.
void fill(openvdb::FloatTree& grid, const Tree& tree, const std::vector<Coord>& origins, const Band& band,
          double voxel_size, const RunContext& context) {
  constexpr std::size_t kBatch = 512;
  for (std::size_t first = 0; first < origins.size(); first += kBatch) {
    context.progress("voxelization", double(first) / double(origins.size()));
    std::vector<std::unique_ptr<Leaf>> leaves(std::min(kBatch, origins.size() - first));
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t i) {
      context.check();
      leaves[i] = make_leaf(tree, origins[first + i], band, voxel_size);
    });
    for (std::unique_ptr<Leaf>& leaf : leaves)
      if (leaf) grid.addLeaf(leaf.release());
  }
}

}  // namespace

LevelSet exact_voxelizer(const VoxelizationInput& input) {
  check_voxelization_fits(input.mesh, input.voxel_size, input.exterior_band, input.interior_band);
  const Stage stage(input.context, "voxelization");
  initialize_openvdb();
  const std::vector<Kernel::Triangle_3> triangles = triangles_in_voxels(input.mesh, input.voxel_size);
  if (triangles.empty())
    throw Error("All triangles of the mesh have no area: there is no surface to voxelize.");
  Tree tree(triangles.begin(), triangles.end());
  tree.build();

  const Band band{input.exterior_band, input.interior_band};
  const auto outside = float(band.exterior * input.voxel_size),
             within = float(-band.interior * input.voxel_size);
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(outside);
  fill(grid->tree(), tree, candidate_leaves(tree, band.widest(), input.context), band, input.voxel_size,
       input.context);
  // From level 1 on: the leaves know the signs of their inactive voxels already.
  openvdb::tools::signedFloodFillWithValues(grid->tree(), outside, within, true, 1, 1);

  const auto transform = openvdb::math::Transform::createLinearTransform(input.voxel_size);
  const Eigen::Vector3d& origin = input.mesh.origin;
  transform->postTranslate(openvdb::Vec3d(origin.x(), origin.y(), origin.z()));
  grid->setTransform(transform);
  grid->setName("sdf");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return make_level_set(grid);
}

}  // namespace hermesh
