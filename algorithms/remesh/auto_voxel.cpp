#include "algorithms/remesh/auto_voxel.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "algorithms/core/parallel.h"
#include "algorithms/remesh/shell.h"
#include "algorithms/search/triangle_tree.h"
#include "algorithms/voxelization/distance/index_soup.h"
#include "algorithms/voxelization/inside/orientation.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kSamples = 10'000, kSamplesOfOpen = 625;
/// Vertices of the uniform mesh per area of a voxel's face: a surface intersects about one and a half cells.
constexpr double kPointsOfFace = 1.5;
/// Memory and time for such a vertex, and the factor of the time at open surfaces, which get a shell.
constexpr double kBytes = 700.0, kSeconds = 1e-5, kOpenFactor = 6.0;
constexpr int kEscapes = 16;
constexpr double kRounding = 1e-6;  ///< of the diagonal: start of rays, and distances that are rounding
constexpr double kParallel = 0.9;   ///< cosine from which on the sides of a wall count as parallel
/// Voxel size at wide walls and gaps.
constexpr double kWide = std::numeric_limits<double>::infinity();

struct Sample {
  std::uint32_t triangle;
  double u, v;  ///< of the triangle's second and third corner
};

/// Points that are evenly distributed over the area of triangles.
class Samples {
 public:
  Samples(const PolygonMesh& mesh, const std::vector<Triangle>& triangles) {
    area_before_.push_back(0.0);
    for (const Triangle& t : triangles) {
      const Facet facet(mesh.points[t[0]].cast<double>(), mesh.points[t[1]].cast<double>(),
                        mesh.points[t[2]].cast<double>());
      area_before_.push_back(area_before_.back() + 0.5 * facet.normal().norm());
    }
  }
  double area() const { return area_before_.back(); }

  /// Returns sample i of n. Requires an area above 0.
  Sample at(std::size_t i, std::size_t n) const {
    const double before = area() * (double(i) + 0.5) / double(n);
    const auto next = std::upper_bound(area_before_.begin(), area_before_.end() - 1, before);
    // Additive recurrences by the plastic number, folded over the diagonal of a square.
    const double u = std::fmod(0.7548776662466927 * double(i), 1.0),
                 v = std::fmod(0.5698402909980532 * double(i), 1.0);
    const bool is_beyond = u + v > 1.0;
    return {std::uint32_t(next - area_before_.begin() - 1), is_beyond ? 1.0 - u : u, is_beyond ? 1.0 - v : v};
  }

 private:
  std::vector<double> area_before_;  ///< the sum over the triangles before each one, and over all
};

/// Measures walls and gaps at points of polygons; lengths in units of the largest voxels.
class WidthMeter {
 public:
  WidthMeter(const PolygonMesh& mesh, const std::vector<Triangle>& triangles, double unit)
      : tree_(mesh.points, triangles, 1.0 / unit),
        turns_(orient_faces(mesh.points, triangles).turns),
        diagonal_(bounds(mesh).size().norm() / unit) {}

  /// Returns the largest voxels that show the wall and the gap at a point of a triangle; infinity if they are
  /// wide, and 0 if the point is not visible.
  double voxel_at(const Sample& sample) const {
    const auto [at, normal] = place_of(sample);
    if (!is_visible(at, normal) && !is_visible(at, -normal)) return 0.0;
    // The wall is behind a polygon with its outside in front; a wrong orientation exchanges wall and gap.
    return std::min(width(at, -normal, 1.0) / (2.0 * kShellRadius), width(at, normal, -1.0));
  }

  /// Returns true if a point is visible from both sides.
  bool is_open_at(const Sample& sample) const {
    const auto [at, normal] = place_of(sample);
    return is_visible(at, normal) && is_visible(at, -normal);
  }

 private:
  std::pair<Vector3d, Vector3d> place_of(const Sample& sample) const {
    const Facet facet = facet_of(sample.triangle);
    return {facet.corner[0] + sample.u * (facet.corner[1] - facet.corner[0]) +
                sample.v * (facet.corner[2] - facet.corner[0]),
            turn(sample.triangle) * facet.normal().stableNormalized()};
  }
  Facet facet_of(std::uint32_t t) const {
    return {tree_.corner(t, 0), tree_.corner(t, 1), tree_.corner(t, 2)};
  }
  double turn(std::uint32_t triangle) const { return turns_[triangle] < 0 ? -1.0 : 1.0; }

  /// Returns the distance of the next polygon along a direction if it is roughly perpendicular to it, and its
  /// outside faces along the direction (`facing` is 1) or against it (−1); otherwise infinity.
  double width(const Vector3d& at, const Vector3d& along, double facing) const {
    const double off = kRounding * diagonal_, reach = 2.0 * kShellRadius;
    double nearest = 2.0, slope = 0.0;
    tree_.for_each_on_segment(at, at + reach * along, [&](std::uint32_t t) {
      const Facet facet = facet_of(t);
      const double there = meeting(at + off * along, at + reach * along, facet);
      if (there < 0.0 || there >= nearest) return;
      nearest = there;
      slope = turn(t) * facet.normal().stableNormalized().dot(along);
    });
    return nearest <= 1.0 && facing * slope >= kParallel ? off + nearest * (reach - off) : kWide;
  }

  /// Returns true if two of a set of rays from one side of a point leave the polygons; one may slip through
  /// between two triangles.
  bool is_visible(const Vector3d& at, const Vector3d& side) const {
    int escaped = 0;
    for (int i = 0; i < kEscapes; ++i) {
      // A Fibonacci lattice on the sphere, in an order in which consecutive directions are far apart.
      const double z = 1.0 - (2.0 * ((i * 13) % kEscapes) + 1.0) / kEscapes, r = std::sqrt(1.0 - z * z),
                   angle = 2.399963229728653 * i;
      Vector3d along(r * std::cos(angle), r * std::sin(angle), z);
      const double slope = along.dot(side);
      if (std::abs(slope) < 0.05) continue;
      if (slope < 0.0) along = -along;
      const Vector3d from = at + kRounding * diagonal_ * side, to = from + 2.0 * diagonal_ * along;
      bool escapes = true;
      tree_.for_each_on_segment(
          from, to, [&](std::uint32_t t) { escapes = escapes && meeting(from, to, facet_of(t)) < 0.0; });
      if (escapes && ++escaped == 2) return true;
    }
    return false;
  }

  const TriangleTree tree_;
  const std::vector<std::int8_t> turns_;
  const double diagonal_;
};

}  // namespace

AutoVoxel auto_voxel(const PolygonMesh& mesh, const AutoVoxelLimits& limits, RunContext& context) {
  const Stage stage(context, "measure walls");
  AutoVoxel result;
  const std::vector<Triangle> triangles = triangulated(mesh);
  const Samples samples(mesh, triangles);
  const double longest = bounds(mesh).size().maxCoeff(), largest = longest / limits.fewest_voxels,
               area = samples.area();
  if (!(longest > 0.0) || !std::isfinite(longest) || !std::isfinite(area)) return result;

  std::vector<double> voxels(area > 0.0 ? kSamples : 0);
  std::vector<std::uint8_t> is_open(area > 0.0 ? kSamplesOfOpen : 0);
  if (area > 0.0) {
    const WidthMeter meter(mesh, triangles, largest);
    parallel_blocks(voxels.size(), context, [&](std::size_t i) {
      voxels[i] = largest * meter.voxel_at(samples.at(i, voxels.size()));
    });
    parallel_blocks(is_open.size(), context,
                    [&](std::size_t i) { is_open[i] = meter.is_open_at(samples.at(i, is_open.size())); });
  }
  std::erase(voxels, 0.0);  // points that are not visible
  std::sort(voxels.begin(), voxels.end());
  const auto may_be_thin = std::size_t(limits.share * double(voxels.size()));
  result.wanted = may_be_thin < voxels.size() ? std::min(largest, voxels[may_be_thin]) : largest;

  const double open_share =
      double(std::accumulate(is_open.begin(), is_open.end(), 0)) / double(kSamplesOfOpen);
  const double seconds = kSeconds * (1.0 + (kOpenFactor - 1.0) * open_share), surface = kPointsOfFace * area;
  result.voxel_size =
      std::max({result.wanted, longest / limits.most_voxels, std::sqrt(surface * kBytes / limits.most_bytes),
                std::sqrt(surface * seconds / limits.most_seconds)});
  const double points = surface / (result.voxel_size * result.voxel_size);
  result.bytes = kBytes * points;
  result.seconds = seconds * points;
  const auto thin = std::lower_bound(voxels.begin(), voxels.end(), result.voxel_size) - voxels.begin();
  if (!voxels.empty()) result.thin_share = double(thin) / double(voxels.size());
  return result;
}

}  // namespace hermesh
