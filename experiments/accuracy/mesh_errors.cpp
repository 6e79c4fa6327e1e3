#include "experiments/accuracy/mesh_errors.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "algorithms/core/parallel.h"
#include "experiments/pipeline.h"
#include "validation/geometry/triangle_tree.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Corners = std::array<Vector3d, 3>;

constexpr std::size_t kRun =
    128;  ///< triangles or points that one task works on, whose sums are added in order

struct Sums {
  double outside = 0, area = 0, volume = 0, squares = 0, max = 0, normals = 0;
};

/// The angle between two unit vectors, from their chord: the cosine of a small angle has lost its digits.
double angle(const Vector3d& a, const Vector3d& b) {
  return 2.0 * std::asin(std::min(1.0, 0.5 * (a - b).norm()));
}

/// Radon's rule of seven points on a triangle, which is exact for polynomials of degree 5 (Radon 1948): its
/// middle, and two triples with one barycentric coordinate of 1 − 2a and two of a. The square of the distance
/// between a flat triangle and a curved surface is of degree 4; the rule of corners, middles of sides and the
/// middle, of degree 3, makes it up to three times as large where the mean is 0.
constexpr double kRoot15 = 3.872983346207417;
constexpr double kMiddle = 9.0 / 40.0;
constexpr std::array<std::array<double, 2>, 2> kTriples = {
    {{(6 - kRoot15) / 21, (155 - kRoot15) / 1200}, {(6 + kRoot15) / 21, (155 + kRoot15) / 1200}}};

/// Calls f(point, weight, is_middle) for Radon's rule on each piece of a triangle, where is_middle is true
/// for the piece's middle, and with a weight of 0 for the corners and the middles of the sides, where
/// distances are largest; weights add up to 1.
template <class F>
void for_each_sample(const Corners& corners, double length, const F& f) {
  const double longest = std::max(
      {(corners[1] - corners[0]).norm(), (corners[2] - corners[1]).norm(), (corners[0] - corners[2]).norm()});
  // A uniform mesh's triangles are as long as a voxel's diagonal and stay whole.
  const int n = std::max(1, int(std::ceil(longest / (1.75 * length))));
  const double share = 1.0 / (double(n) * n);
  const Vector3d u = (corners[1] - corners[0]) / n, v = (corners[2] - corners[0]) / n;
  const auto piece = [&](const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    for (const Vector3d& p : {a, b, c}) f(p, 0.0, false);
    for (const Vector3d& p : {Vector3d(0.5 * (a + b)), Vector3d(0.5 * (b + c)), Vector3d(0.5 * (c + a))})
      f(p, 0.0, false);
    for (const auto& [at, weight] : kTriples)
      for (const Vector3d& odd : {a, b, c})
        f(Vector3d(at * (a + b + c) + (1 - 3 * at) * odd), share * weight, false);
    f(Vector3d((a + b + c) / 3.0), share * kMiddle, true);
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; i + j < n; ++j) {
      const Vector3d a = corners[0] + i * u + j * v;
      piece(a, a + u, a + v);
      if (i + j + 1 < n) piece(a + u, a + u + v, a + v);
    }
}

/// The mesh's points in world units, and its triangles where the shape is described.
struct Described {
  std::vector<Vector3d> points;
  std::vector<Triangle> triangles, all;

  Described(const PolygonMesh& mesh, const PlacedShape& shape) : all(triangulated(mesh)) {
    for (std::size_t i = 0; i < mesh.points.size(); ++i) points.push_back(mesh.world(i));
    for (const Triangle& t : all)
      if (std::ranges::all_of(t, [&](std::uint32_t p) { return shape.describes(points[p]); }))
        triangles.push_back(t);
    if (triangles.empty()) throw Error("the mesh has no triangle where the shape is described");
  }
  Corners corners(const Triangle& t) const { return {points[t[0]], points[t[1]], points[t[2]]}; }
};

Sums sum_over(const Described& mesh, const PlacedShape& shape, double length, const RunContext& context) {
  std::vector<Sums> parts((mesh.triangles.size() + kRun - 1) / kRun);
  parallel_blocks(parts.size(), context, [&](std::size_t run) {
    Sums& sums = parts[run];
    for (std::size_t i = run * kRun; i < std::min(mesh.triangles.size(), (run + 1) * kRun); ++i) {
      const Corners corners = mesh.corners(mesh.triangles[i]);
      const Vector3d cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
      const double twice = cross.norm(), area = 0.5 * twice;
      const Vector3d normal = twice > 0 ? Vector3d(cross / twice) : Vector3d(Vector3d::Zero());
      for_each_sample(corners, length, [&](const Vector3d& p, double weight, bool is_middle) {
        const SurfacePlace place = shape.nearest(p);
        const double squared = (p - place.point).squaredNorm();
        sums.max = std::max(sums.max, squared);
        if (twice == 0) return;
        sums.squares += weight * area * squared;
        sums.outside += weight * area * (p - place.point).dot(place.normal);
        // The middle of a piece represents all of it: corners and sides on a preserved crease belong to two
        // faces.
        if (!is_middle) return;
        const double turned = angle(normal, place.normal);
        sums.normals += weight / kMiddle * area * turned * turned;
      });
      sums.area += area;
      sums.volume += corners[0].dot(corners[1].cross(corners[2])) / 6.0;
    }
  });
  Sums all;
  for (const Sums& part : parts) {
    all.area += part.area, all.volume += part.volume;
    all.squares += part.squares, all.outside += part.outside, all.normals += part.normals;
    all.max = std::max(all.max, part.max);
  }
  all.max = std::sqrt(all.max);
  return all;
}

/// Mean over the area of |H by cotangents − H of the surface|, at vertices all of whose triangles lie where
/// the shape is described. A third of each triangle belongs to each of its corners. The summand is the error
/// times the area, which is finite for slivers, whose cotangents are large and whose area is small.
std::optional<double> curvature_error(const Described& mesh, const PlacedShape& shape,
                                      const RunContext& context) {
  std::vector<Vector3d> laplacian(mesh.points.size(), Vector3d::Zero());
  std::vector<double> area(mesh.points.size(), 0.0);
  std::vector<int> missing(mesh.points.size(), 0);
  for (const Triangle& t : mesh.all)
    for (const std::uint32_t p : t) ++missing[p];
  for (const Triangle& t : mesh.triangles) {
    const Corners c = mesh.corners(t);
    const double twice = (c[1] - c[0]).cross(c[2] - c[0]).norm();
    for (int i = 0; i < 3; ++i) --missing[t[i]];
    if (twice == 0) continue;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      // The cotangent at corner i weighs the side opposite to it.
      const double cotangent = (c[j] - c[i]).dot(c[k] - c[i]) / twice;
      laplacian[t[j]] += cotangent * (c[j] - c[k]);
      laplacian[t[k]] += cotangent * (c[k] - c[j]);
      area[t[i]] += twice / 6.0;
    }
  }
  std::vector<std::array<double, 2>> parts((mesh.points.size() + kRun - 1) / kRun, {0.0, 0.0});
  parallel_blocks(parts.size(), context, [&](std::size_t run) {
    for (std::size_t p = run * kRun; p < std::min(mesh.points.size(), (run + 1) * kRun); ++p) {
      if (missing[p] != 0 || area[p] == 0) continue;
      const SurfacePlace place = shape.nearest(mesh.points[p]);
      parts[run][0] += std::abs(0.25 * laplacian[p].dot(place.normal) - area[p] * place.mean_curvature);
      parts[run][1] += area[p];
    }
  });
  double error = 0, all = 0;
  for (const auto& [of_part, area_of_part] : parts) error += of_part, all += area_of_part;
  return all > 0 ? std::optional(error / all) : std::nullopt;
}

struct FarthestAndRms {
  double max = 0, rms = 0;
};
FarthestAndRms distances(const std::vector<Vector3d>& from, const validation::TriangleTree& to,
                         const RunContext& context) {
  std::vector<double> squared(from.size());
  parallel_blocks(from.size(), context, [&](std::size_t i) { squared[i] = to.closest(from[i]).squared; });
  FarthestAndRms result;
  for (const double each : squared) result.max = std::max(result.max, each), result.rms += each;
  return {std::sqrt(result.max), std::sqrt(result.rms / double(from.size()))};
}

}  // namespace

const char* name(Quantity quantity) {
  constexpr std::array kNames = {"rms",       "max",       "normals", "area",   "volume",
                                 "curvature", "hausdorff", "edges",   "corners"};
  return kNames[std::size_t(quantity)];
}

MeshErrors mesh_errors(const PolygonMesh& mesh, const PlacedShape& shape, double length,
                       RunContext& context) {
  const Described described(mesh, shape);
  const Sums sums = sum_over(described, shape, length, context);
  MeshErrors result;
  result.triangles = described.triangles.size();
  const auto set = [&](Quantity quantity, std::optional<double> error) {
    result.signed_errors[std::size_t(quantity)] = error;
  };
  set(Quantity::kRms, std::sqrt(sums.squares / sums.area));
  set(Quantity::kMax, sums.max);
  set(Quantity::kNormals, std::sqrt(sums.normals / sums.area));
  if (const auto truth = shape.shape().area()) set(Quantity::kArea, sums.area / *truth - 1.0);
  if (const auto truth = shape.shape().volume()) set(Quantity::kVolume, sums.volume / *truth - 1.0);
  set(Quantity::kCurvature, curvature_error(described, shape, context));

  const MeshFile file = to_mesh_file(mesh);
  const validation::TriangleSoup soup(file);
  const validation::TriangleTree tree(soup);
  std::vector<Vector3d> surface;
  const PolygonMesh facets = shape.facets(length);
  if (shape.shape().is_flat()) {
    // Flat faces consist of two triangles, whose corners are not a sample of the surface.
    for (const Triangle& t : facets.triangles)
      for_each_sample({facets.world(t[0]), facets.world(t[1]), facets.world(t[2])}, length,
                      [&](const Vector3d& p, double, bool) { surface.push_back(p); });
  } else {
    for (std::size_t i = 0; i < facets.points.size(); ++i) surface.push_back(facets.world(i));
  }
  if (!surface.empty()) set(Quantity::kHausdorff, std::max(sums.max, distances(surface, tree, context).max));
  if (const std::vector<Vector3d> creases = shape.crease_points(0.25 * length); !creases.empty())
    set(Quantity::kEdges, distances(creases, tree, context).rms);
  if (const std::vector<Vector3d> corners = shape.corners(); !corners.empty())
    set(Quantity::kCorners, distances(corners, tree, context).rms);
  return result;
}

DistancesToSurface distances_to_surface(const PolygonMesh& mesh, const PlacedShape& shape, double length,
                                        const RunContext& context) {
  const Sums sums = sum_over(Described(mesh, shape), shape, length, context);
  return {std::sqrt(sums.squares / sums.area), sums.max, sums.outside / sums.area};
}

}  // namespace hermesh
