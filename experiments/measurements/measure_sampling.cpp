// Voxels that the thesis's rasterisation by samples misses (§5.2, trap T8), and the angle that its rule of
// signs needs (§5.3, trap T12).
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "algorithms/core/parallel.h"
#include "algorithms/search/triangle_tree.h"
#include "algorithms/thesis/thesis_voxelizer.h"
#include "experiments/measurements/measurements.h"
#include "reference/level_set_judge.h"
#include "validation/features.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Models with and without creases, all closed, so that rays distinguish inside from outside.
constexpr std::array<const char*, 6> kModels = {"bunny-closed", "armadillo", "fandisk",
                                                "joint",        "cheese",    "turned-cube"};
constexpr std::array<double, 12> kAngles = {15, 30, 45, 60, 75, 85, 90, 95, 105, 120, 150, 180};
/// Upper ends of the classes of distances, voxels; the last class has none.
constexpr std::array<double, 6> kClasses = {0.5, 1, 2, 4, 8, std::numeric_limits<double>::infinity()};

// ---- The oracle: the voxels that a triangle intersects.

enum class Meeting { kNone, kTouching, kCertain };

/// Tests the separating axes of a triangle and an axis-parallel box. Within kSlack voxels of either answer,
/// far more than rounding errors, they count as touching, so that the other two results are certain.
Meeting meet(const GridTriangle& triangle, const Vector3d& centre, const Vector3d& half) {
  constexpr double kSlack = 1e-7, kNoAxis = 1e-9;
  const Vector3d p[3] = {triangle[0] - centre, triangle[1] - centre, triangle[2] - centre};
  const Vector3d edges[3] = {p[1] - p[0], p[2] - p[1], p[0] - p[2]};
  Meeting result = Meeting::kCertain;
  const auto separates = [&](const Vector3d& axis) {
    const double length = axis.norm();
    if (length < kNoAxis) return false;
    const double d[3] = {axis.dot(p[0]), axis.dot(p[1]), axis.dot(p[2])};
    const double reach = half.dot(axis.cwiseAbs());
    const double gap =
        std::max(std::min({d[0], d[1], d[2]}) - reach, -reach - std::max({d[0], d[1], d[2]})) / length;
    if (gap > kSlack) return true;
    if (gap > -kSlack) result = Meeting::kTouching;
    return false;
  };
  if (separates(edges[0].cross(edges[1]))) return Meeting::kNone;
  for (int axis = 0; axis < 3; ++axis) {
    if (separates(Vector3d::Unit(axis))) return Meeting::kNone;
    for (const Vector3d& edge : edges)
      if (separates(edge.cross(Vector3d::Unit(axis)))) return Meeting::kNone;
  }
  return result;
}

/// Voxels that the triangle certainly intersects, and those that it may touch.
struct MetVoxels {
  std::vector<Voxel> certain, touching;
};
/// Halves boxes of voxels.
void find_met(const GridTriangle& triangle, const Voxel& lower, const Voxel& upper, MetVoxels& found) {
  Vector3d centre, half;
  int longest = 0;
  for (int a = 0; a < 3; ++a) {
    centre[a] = 0.5 * (double(lower[a]) + upper[a]);
    half[a] = 0.5 * (double(upper[a]) - lower[a] + 1.0);
    if (half[a] > half[longest]) longest = a;
  }
  const Meeting meeting = meet(triangle, centre, half);
  if (meeting == Meeting::kNone) return;
  if (lower == upper) {
    (meeting == Meeting::kCertain ? found.certain : found.touching).push_back(lower);
    return;
  }
  Voxel middle = upper, next = lower;
  middle[longest] = lower[longest] + (upper[longest] - lower[longest]) / 2;
  next[longest] = middle[longest] + 1;
  find_met(triangle, lower, middle, found);
  find_met(triangle, next, upper, found);
}
MetVoxels met_by(const GridTriangle& triangle) {
  Voxel lower, upper;
  for (int a = 0; a < 3; ++a) {
    lower[a] = std::int32_t(std::floor(std::min({triangle[0][a], triangle[1][a], triangle[2][a]})));
    upper[a] = std::int32_t(std::ceil(std::max({triangle[0][a], triangle[1][a], triangle[2][a]})));
  }
  MetVoxels found;
  find_met(triangle, lower, upper, found);
  std::ranges::sort(found.certain);
  std::ranges::sort(found.touching);
  return found;
}

void append_unique(std::vector<Voxel>& all, std::vector<std::vector<Voxel>>& parts) {
  for (std::vector<Voxel>& part : parts) all.insert(all.end(), part.begin(), part.end()), part = {};
  std::ranges::sort(all);
  all.erase(std::ranges::unique(all).begin(), all.end());
}

/// Boundary voxels of a model by the oracle and by samples.
struct Boundary {
  std::vector<Voxel> met, touching, sampled;  ///< of the whole model, sorted, each once
  std::size_t pairs = 0;                      ///< of triangles and voxels that they intersect
  std::size_t missed_pairs = 0;               ///< those of them without a sample
  std::size_t invented = 0;                   ///< samples in a voxel that their triangle does not intersect
};
Boundary rasterize(const std::vector<Vector3d>& points, const std::vector<Triangle>& triangles,
                   const RunContext& context) {
  constexpr std::size_t kRun = 256;
  const std::size_t runs = (triangles.size() + kRun - 1) / kRun;
  std::vector<std::vector<Voxel>> met(runs), touching(runs), sampled(runs);
  std::vector<std::array<std::size_t, 3>> counts(runs, {0, 0, 0});
  parallel_blocks(runs, context, [&](std::size_t run) {
    for (std::size_t i = run * kRun; i < std::min(triangles.size(), (run + 1) * kRun); ++i) {
      const auto& [a, b, c] = triangles[i];
      const GridTriangle triangle = {points[a], points[b], points[c]};
      const MetVoxels oracle = met_by(triangle);
      const std::vector<Voxel> samples = rasterize_by_samples(triangle);
      for (const Voxel& voxel : oracle.certain) counts[run][1] += !std::ranges::binary_search(samples, voxel);
      for (const Voxel& voxel : samples)
        counts[run][2] += !std::ranges::binary_search(oracle.certain, voxel) &&
                          !std::ranges::binary_search(oracle.touching, voxel);
      counts[run][0] += oracle.certain.size();
      met[run].insert(met[run].end(), oracle.certain.begin(), oracle.certain.end());
      touching[run].insert(touching[run].end(), oracle.touching.begin(), oracle.touching.end());
      sampled[run].insert(sampled[run].end(), samples.begin(), samples.end());
    }
  });
  Boundary boundary;
  append_unique(boundary.met, met);
  append_unique(boundary.touching, touching);
  append_unique(boundary.sampled, sampled);
  for (const auto& [pairs, missed, invented] : counts) {
    boundary.pairs += pairs;
    boundary.missed_pairs += missed;
    boundary.invented += invented;
  }
  return boundary;
}

// ---- Positions of the misses.

/// Distances to the creases of a model, voxels.
class Creases {
 public:
  Creases(const std::vector<Vector3d>& points, const std::vector<Triangle>& triangles, double degrees) {
    MeshFile file;
    file.points = points;
    file.triangles = triangles;
    const validation::TriangleSoup soup(file);
    for (const auto& [a, b] : validation::find_sharp_features(soup, degrees).edges) {
      const auto first = std::uint32_t(ends_.size());
      ends_.push_back(a.cast<float>());
      ends_.push_back(b.cast<float>());
      segments_.push_back({first, first + 1, first + 1});
    }
    if (!segments_.empty()) tree_ = std::make_unique<TriangleTree>(ends_, segments_, 1.0);
  }
  std::size_t count() const { return segments_.size(); }
  /// Infinite if the model has no crease.
  double distance(const Voxel& voxel) const {
    if (!tree_) return std::numeric_limits<double>::infinity();
    return std::sqrt(tree_->nearest({double(voxel[0]), double(voxel[1]), double(voxel[2])}).squared);
  }

 private:
  std::vector<Eigen::Vector3f> ends_;
  std::vector<Triangle> segments_;
  std::unique_ptr<TriangleTree> tree_;
};

class SamplingMeasurer {
 public:
  explicit SamplingMeasurer(const MeasurementInput& input) : input_(input) {}

  std::vector<MeasuredRow> run() {
    std::size_t swept = 0;
    for (const char* name : kModels) {
      const bool misses = input_.wants("missed", name) || input_.wants("where", name);
      const bool signs = input_.wants("sign-angle", name);
      if (!misses && !signs) continue;
      input_.context.progress(name, 0.0);
      const LoadedCase model = input_.tables.load(name, input_.context);
      const double voxel = bounds(model.mesh).size().maxCoeff() / input_.parameters.number("resolution");
      if (misses) find_misses(name, model, voxel);
      if (signs) sweep_angles(name, model, voxel);
      swept += signs;
    }
    if (swept == kModels.size())
      for (std::size_t i = 0; i < kAngles.size(); ++i) add_angle_row(kAll, kAngles[i], sums_[i]);
    return std::move(rows_);
  }

 private:
  void find_misses(const std::string& name, const LoadedCase& model, double voxel) {
    std::vector<Vector3d> points;
    for (const Eigen::Vector3f& point : model.mesh.points) points.push_back(point.cast<double>() / voxel);
    const std::vector<Triangle> triangles = triangulated(model.mesh);
    const Boundary boundary = rasterize(points, triangles, input_.context);
    const Creases creases(points, triangles, input_.parameters.number("dihedral"));
    std::vector<double> distances(boundary.met.size());
    parallel_blocks(distances.size(), input_.context,
                    [&](std::size_t i) { distances[i] = creases.distance(boundary.met[i]); });
    std::array<std::size_t, kClasses.size()> all{}, missed{};
    std::size_t lost = 0, near = 0, lost_near = 0;
    for (std::size_t i = 0; i < boundary.met.size(); ++i) {
      const bool lacks = !std::ranges::binary_search(boundary.sampled, boundary.met[i]);
      const auto at = std::size_t(std::ranges::upper_bound(kClasses, distances[i]) - kClasses.begin());
      const std::size_t number = std::min(at, kClasses.size() - 1);
      ++all[number];
      missed[number] += lacks;
      lost += lacks;
      near += distances[i] < 1.0;
      lost_near += lacks && distances[i] < 1.0;
    }
    MeasuredRow row{"missed", name};
    row.values = {{"origin", model.origin},
                  {"triangles", triangles.size()},
                  {"pairs", boundary.pairs},
                  {"missed_pairs_share", double(boundary.missed_pairs) / double(boundary.pairs)},
                  {"boundary", boundary.met.size()},
                  {"missed", lost},
                  {"missed_share", double(lost) / double(boundary.met.size())},
                  {"touching", boundary.touching.size()},
                  {"invented", boundary.invented},
                  {"creases", creases.count()}};
    if (creases.count() > 0) {
      row.values["near_share"] = double(near) / double(boundary.met.size());
      if (lost > 0) row.values["missed_near_share"] = double(lost_near) / double(lost);
    }
    if (boundary.invented > 0)
      row.broken.push_back("a sample lies in a voxel that its triangle does not meet");
    rows_.push_back(std::move(row));
    if (creases.count() == 0) return;
    for (std::size_t number = 0; number < kClasses.size(); ++number) {
      if (all[number] == 0) continue;
      MeasuredRow place{"where", name};
      const double from = number == 0 ? 0.0 : kClasses[number - 1];
      place.values = {{"from", from},
                      {"voxels", all[number]},
                      {"missed", missed[number]},
                      {"missed_share", double(missed[number]) / double(all[number])}};
      if (std::isfinite(kClasses[number])) place.values["middle"] = 0.5 * (from + kClasses[number]);
      rows_.push_back(std::move(place));
    }
  }

  void sweep_angles(const std::string& name, const LoadedCase& model, double voxel) {
    const DistanceOracle surface(triangles_in_voxels(model.mesh, voxel));
    const WindingOracle winding(surface);
    const VoxelSelection selection{3.0, std::int64_t(input_.parameters.number("samples")), input_.seed};
    const SignTruth truth(surface, winding, SignOracle::kParity, selection, input_.context);
    for (std::size_t i = 0; i < kAngles.size(); ++i) {
      input_.context.check();
      RunContext child = child_context(input_.context, false);
      const VoxelizeRecipe recipe{
          .chosen = choose(input_.tables.voxelizers, "thesis", {{"sign_angle", readable(kAngles[i])}}),
          .voxel_size = voxel};
      const SignReport report = truth.judge(voxelize(model.mesh, recipe, child));
      add_angle_row(name, kAngles[i], report);
      sums_[i].inside += report.inside;
      sums_[i].outside += report.outside;
      sums_[i].wrong_inside += report.wrong_inside;
      sums_[i].wrong_outside += report.wrong_outside;
    }
  }

  void add_angle_row(const std::string& label, double angle, const SignReport& report) {
    MeasuredRow row{"sign-angle", label};
    row.values = {{"angle", angle},
                  {"judged", report.inside + report.outside},
                  {"wrong_inside", report.wrong_inside},
                  {"wrong_outside", report.wrong_outside},
                  {"wrong", report.wrong()},
                  {"wrong_share", report.wrong_share()}};
    rows_.push_back(std::move(row));
  }

  static constexpr const char* kAll = "all models";
  const MeasurementInput& input_;
  std::array<SignReport, kAngles.size()> sums_;  ///< over the models
  std::vector<MeasuredRow> rows_;
};

}  // namespace

std::vector<MeasuredRow> measure_sampling(const MeasurementInput& input) {
  return SamplingMeasurer(input).run();
}

}  // namespace hermesh
