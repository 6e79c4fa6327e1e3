#include "validation/visible_loss.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "validation/geometry/distance.h"
#include "validation/geometry/triangle_tree.h"

namespace hermesh::validation {
namespace {

using Eigen::Vector3d;

constexpr int kEscapes = 16;
constexpr double kHalf = 0.5, kWhole = 1.0;  // voxels
constexpr double kSlack = 1.02;  // of these lengths, because samples include the points of greatest distance
constexpr double kOff = 1e-6;    // of the model's diagonal: distance of a ray's start from the surface
constexpr double kFacing = 0.2;  // least cosine between normals that face the same side

/// Returns direction i of a Fibonacci lattice on the sphere. Consecutive directions are far apart.
Vector3d direction(int i) {
  constexpr double kGolden = 2.399963229728653;
  const double z = 1.0 - (2.0 * ((i * 13) % kEscapes) + 1.0) / kEscapes, r = std::sqrt(1.0 - z * z);
  return {r * std::cos(kGolden * i), r * std::sin(kGolden * i), z};
}

bool meets(const Vector3d& from, const Vector3d& along, const Corners& c) {
  // Möller & Trumbore 1997.
  const Vector3d u = c[1] - c[0], v = c[2] - c[0], p = along.cross(v);
  const double slope = u.dot(p);
  if (slope == 0.0) return false;
  const Vector3d s = from - c[0], q = s.cross(u);
  const double x = s.dot(p) / slope, y = along.dot(q) / slope;
  return x >= 0.0 && y >= 0.0 && x + y <= 1.0 && v.dot(q) / slope > 0.0;
}

/// Returns a share with Wilson's interval at 95 %.
Estimate share(std::int64_t hits, std::int64_t of) {
  if (of == 0) return {};
  constexpr double kZ = 1.959963984540054;
  const double n = double(of), p = double(hits) / n, square = kZ * kZ / n;
  const double middle = (p + 0.5 * square) / (1.0 + square),
               half = kZ * std::sqrt(p * (1.0 - p) / n + 0.25 * square / n) / (1.0 + square);
  return {p, hits == 0 ? 0.0 : middle - half, hits == of ? 1.0 : middle + half};
}

enum class Seen : std::uint8_t { hidden, shown, filled, vanished };

class Measurement {
 public:
  Measurement(const TriangleSoup& model, const TriangleSoup& mesh, double voxel_size)
      : model_(model), mesh_(mesh), voxel_size_(voxel_size), model_tree_(model) {
    if (!mesh.triangles.empty()) mesh_tree_.emplace(mesh);
  }

  /// Classifies a point of the model on a triangle.
  Seen look(const Vector3d& at, std::size_t triangle) const {
    const Corners c = model_.corners(triangle);
    const Vector3d normal = area_vector(c).stableNormalized();
    Seen result = Seen::hidden;
    for (const double side : {1.0, -1.0}) {
      // The worse result of the visible sides counts.
      if (result != Seen::vanished && is_visible(at, side * normal))
        result = std::max(result, seen_from(at, side * normal));
    }
    return result;
  }

  bool is_invented(const Vector3d& at) const {
    const double limit = kWhole * kSlack * voxel_size_;
    Box box;
    box.add(at);
    return model_tree_.for_each_near(box, limit, [&](std::uint32_t slot) {
      return (closest_point(model_tree_.corners(slot), at) - at).squaredNorm() > limit * limit;
    });
  }

 private:
  bool is_visible(const Vector3d& at, const Vector3d& side) const {
    const double diagonal = model_tree_.bounds().diagonal();
    int escaped = 0;
    for (int i = 0; i < kEscapes; ++i) {
      Vector3d along = direction(i);
      const double slope = along.dot(side);
      if (std::abs(slope) < 0.05) continue;
      if (slope < 0.0) along = -along;
      const Vector3d from = at + kOff * diagonal * side;
      const bool escapes = model_tree_.for_each_on_segment(
          from, from + 2.0 * diagonal * along,
          [&](std::uint32_t slot) { return !meets(from, along, model_tree_.corners(slot)); });
      // One ray may slip through between two triangles.
      if (escapes && ++escaped == 2) return true;
    }
    return false;
  }

  Seen seen_from(const Vector3d& at, const Vector3d& side) const {
    if (!mesh_tree_) return Seen::vanished;
    const double half = kHalf * kSlack * voxel_size_, whole = kWhole * kSlack * voxel_size_;
    Box box;
    box.add(at);
    const bool none = mesh_tree_->for_each_near(box, whole, [&](std::uint32_t slot) {
      const Corners& c = mesh_tree_->corners(slot);
      const Vector3d facing = area_vector(c);
      if (facing.dot(side) < kFacing * facing.norm()) return true;
      const Vector3d away = closest_point(c, at) - at;
      const double squared = away.squaredNorm();
      const bool in_front = facing.dot(away) >= 0.0;
      return squared > half * half && !(in_front && squared <= whole * whole);
    });
    if (!none) return Seen::shown;
    // The point is within the mesh if the nearest surface faces away.
    const ClosestHit nearest = mesh_tree_->closest(at);
    const Corners& c = mesh_tree_->corners(nearest.slot);
    return area_vector(c).dot(nearest.point - at) > 0.0 ? Seen::filled : Seen::vanished;
  }

  const TriangleSoup& model_;
  const TriangleSoup& mesh_;
  double voxel_size_;
  TriangleTree model_tree_;
  std::optional<TriangleTree> mesh_tree_;
};

}  // namespace

VisibleLoss measure_visible_loss(const TriangleSoup& model, const TriangleSoup& mesh, double voxel_size,
                                 std::int64_t samples, RunContext& context) {
  const Stage stage(context, "visible loss");
  const Measurement measurement(model, mesh, voxel_size);
  const SurfaceSamples of_model(model, samples);
  std::vector<Seen> seen(std::size_t(of_model.size()));
  tbb::parallel_for(std::int64_t(0), of_model.size(), [&](std::int64_t i) {
    context.check();
    seen[std::size_t(i)] = measurement.look(of_model[i], of_model.triangle(i));
  });
  VisibleLoss result;
  result.samples = of_model.size();
  const auto count = [&](Seen what) { return std::int64_t(std::count(seen.begin(), seen.end(), what)); };
  const std::int64_t filled = count(Seen::filled), vanished = count(Seen::vanished),
                     visible = of_model.size() - count(Seen::hidden);
  result.visible_area = model.area() * double(visible) / double(std::max<std::int64_t>(1, of_model.size()));
  result.lost = share(filled + vanished, visible);
  result.vanished = share(vanished, visible);
  result.filled = share(filled, visible);
  const auto first = std::find_if(seen.begin(), seen.end(), [](Seen s) { return s == Seen::vanished; });
  if (first != seen.end()) result.place = of_model[first - seen.begin()];
  if (mesh.triangles.empty()) return result;
  const SurfaceSamples of_mesh(mesh, samples);
  std::vector<std::uint8_t> invented(std::size_t(of_mesh.size()));
  tbb::parallel_for(std::int64_t(0), of_mesh.size(), [&](std::int64_t i) {
    context.check();
    invented[std::size_t(i)] = measurement.is_invented(of_mesh[i]);
  });
  result.invented = share(std::count(invented.begin(), invented.end(), 1), of_mesh.size());
  result.invented_area = result.invented.value * mesh.area();
  const auto cap = std::find(invented.begin(), invented.end(), 1);
  if (cap != invented.end()) result.invented_place = of_mesh[cap - invented.begin()];
  return result;
}

}  // namespace hermesh::validation
