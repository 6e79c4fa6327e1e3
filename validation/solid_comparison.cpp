#include "validation/solid_comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "algorithms/core/disjoint_sets.h"
#include "validation/geometry/distance.h"
#include "validation/geometry/sum_ranges.h"
#include "validation/outer_boundary.h"
#include "validation/solid.h"

namespace hermesh::validation {
namespace {

constexpr double kDeviations = 3.0;
constexpr double kFalseShare = 0.001, kLostShare = 0.01, kVolumeShare = 0.005;
constexpr double kTimesDistance = 3.0, kLongestShare = 1.0 / 16;

/// Returns a number in [0, 1) that depends only on the counter (Steele, Lea and Flood, Fast Splittable
/// Pseudorandom Number Generators, 2014), so that points do not depend on threads.
double random_fraction(std::uint64_t counter) {
  std::uint64_t z = (counter + 1) * 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

/// Returns the share of hits among the samples, with Wilson's interval, times `whole`.
Estimate estimate(std::int64_t hits, std::int64_t samples, double whole) {
  if (samples == 0) return {};
  const double n = double(samples), p = double(hits) / n, z = kDeviations;
  const double centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
  const double half = z / (1.0 + z * z / n) * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n));
  // The ends for no hits and for all hits are exact, without rounding errors.
  return {whole * p, hits == 0 ? 0.0 : whole * std::max(0.0, centre - half),
          hits == samples ? whole : whole * std::min(1.0, centre + half)};
}

struct Hits {
  std::int64_t hits = 0, samples = 0;
  std::optional<Eigen::Vector3d> place;

  void add(bool hit, const Eigen::Vector3d& point) {
    ++samples;
    hits += hit;
    if (hit && !place) place = point;
  }
  void append(const Hits& later) {
    hits += later.hits;
    samples += later.samples;
    if (!place) place = later.place;
  }
};

struct InSpace {
  Hits mesh, reference, difference, unknown, unexplained;
  void append(const InSpace& later) {
    mesh.append(later.mesh);
    reference.append(later.reference);
    difference.append(later.difference);
    unknown.append(later.unknown);
    unexplained.append(later.unexplained);
  }
};

/// Sums add(i, sum) over i < count.
template <class Sum, class Add>
Sum sum_over(std::int64_t count, const Add& add, const RunContext& context) {
  return sum_ranges<Sum>(std::size_t(count), 256, context, [&](std::size_t begin, std::size_t end, Sum& sum) {
    for (std::size_t i = begin; i < end; ++i) add(std::int64_t(i), sum);
  });
}

/// A mesh with its soup, tree and solid, which refer to one another.
struct Body {
  MeshFile mesh;
  TriangleSoup soup;
  TriangleTree tree;
  Solid solid;

  Body(MeshFile welded, Solid::Reading reading, const RunContext& context)
      : mesh(std::move(welded)), soup(mesh), tree(soup), solid(soup, tree, reading, context) {}
  Body(const Body&) = delete;
};

/// A surface for distance queries; it may have no triangles.
struct Surface {
  TriangleSoup soup;
  std::optional<TriangleTree> tree;

  explicit Surface(const MeshFile& mesh) : soup(mesh) {
    if (!soup.triangles.empty()) tree.emplace(soup);
  }
  bool beyond(const Eigen::Vector3d& point, double limit) const {
    return !tree || tree->closest(point).squared > limit * limit;
  }
};

std::int64_t components_of_triangles(const TriangleSoup& soup) {
  DisjointSets sets(soup.points.size());
  for (const Triangle& t : soup.triangles) sets.join(sets.join(t[0], t[1]), t[2]);
  std::vector<std::uint8_t> counted(soup.points.size(), 0);
  std::int64_t components = 0;
  for (const Triangle& t : soup.triangles) components += !std::exchange(counted[sets.find(t[0])], 1);
  return components;
}

}  // namespace

/// The reference's solid and boundary, which do not depend on the compared mesh.
struct SolidReference::Parts {
  Body body;
  OuterBoundary boundary;
  Surface bounding, possible;

  Parts(MeshFile welded, const RunContext& context)
      : body(std::move(welded), Solid::Reading::by_any_rule, context),
        boundary(outer_boundary(body.soup, body.tree, body.solid, context)),
        bounding(boundary.bounding),
        possible(boundary.possible) {}
};

class SolidReference::Comparison {
 public:
  Comparison(const Body& mesh, const Parts& reference, const SolidOptions& options, const RunContext& context)
      : mesh_(mesh),
        reference_(reference.body),
        boundary_(reference.boundary),
        bounding_(reference.bounding),
        possible_(reference.possible),
        options_(options),
        context_(context),
        pieces_(options.pieces ? outer_boundary(mesh.soup, mesh.tree, mesh.solid, context).bounding
                               : MeshFile{}),
        ours_(options.pieces ? pieces_ : mesh.mesh) {}

  SolidComparison run(const SolidComparison& known) {
    result_ = known;
    result_.reference_closed = reference_.solid.closed();
    result_.reference_oriented = reference_.solid.oriented();
    result_.reference_area = boundary_.area;
    result_.possible_area = boundary_.possible_area;
    result_.reference_components = boundary_.components;
    if (options_.pieces) result_.mesh_area = ours_.soup.area();
    result_.explained = explained_distance();
    compare_surfaces();
    compare_space();
    result_.verdict = verdict();
    return result_;
  }

 private:
  double explained_distance() const {
    const Box& box = reference_.tree.bounds();
    const double least = 1.5 * boundary_.finest;
    if (options_.voxel_size > 0.0) return std::max(least, std::sqrt(3.0) * options_.voxel_size);
    const SurfaceSamples samples(ours_.soup, options_.samples);
    struct Farthest {
      double squared = 0.0;
      void append(const Farthest& o) { squared = std::max(squared, o.squared); }
    };
    const auto farthest = sum_over<Farthest>(
        samples.size(),
        [&](std::int64_t i, Farthest& f) { f.append({reference_.tree.closest(samples[i]).squared}); },
        context_);
    const double longest = (box.upper - box.lower).maxCoeff();
    return std::max(least, std::min(kTimesDistance * std::sqrt(farthest.squared), kLongestShare * longest));
  }

  /// Returns true if the two points at the distance `explained` in front of and behind a point of a triangle
  /// are both inside or both outside of the other solid.
  bool alike_about(const Eigen::Vector3d& point, const Corners& on, const Solid& solid) const {
    const Eigen::Vector3d step = result_.explained * area_vector(on).stableNormalized();
    const Side front = solid.side(point + step), back = solid.side(point - step);
    return front == back && front != Side::unknown;
  }

  void compare_surfaces() {
    const double limit = result_.explained;
    const SurfaceSamples ours(ours_.soup, options_.samples), theirs(bounding_.soup, options_.samples);
    const Hits false_ones = sum_over<Hits>(
        ours.size(),
        [&](std::int64_t i, Hits& hits) {
          const Eigen::Vector3d p = ours[i];
          hits.add(bounding_.beyond(p, limit) && possible_.beyond(p, limit) &&
                       alike_about(p, ours_.soup.corners(ours.triangle(i)), reference_.solid),
                   p);
        },
        context_);
    const Hits lost_ones = sum_over<Hits>(
        theirs.size(),
        [&](std::int64_t i, Hits& hits) {
          const Eigen::Vector3d p = theirs[i];
          hits.add(ours_.beyond(p, limit) &&
                       alike_about(p, bounding_.soup.corners(theirs.triangle(i)), mesh_.solid),
                   p);
        },
        context_);
    result_.false_area = estimate(false_ones.hits, false_ones.samples, result_.mesh_area);
    result_.lost_area = estimate(lost_ones.hits, lost_ones.samples, result_.reference_area);
    result_.false_place = false_ones.place;
    result_.lost_place = lost_ones.place;
  }

  void compare_space() {
    Box box = reference_.tree.bounds();
    box.add(mesh_.tree.bounds());
    const Eigen::Vector3d size = box.upper - box.lower;
    const double whole = size.prod();
    const Eigen::Vector3d strata = strata_along(size);
    const std::int64_t ny = std::int64_t(strata.y()), nz = std::int64_t(strata.z());
    const std::int64_t count = std::int64_t(strata.prod());
    const InSpace found = sum_over<InSpace>(
        count,
        [&](std::int64_t i, InSpace& sum) {
          const Eigen::Vector3d at(double(i / (ny * nz)), double(i / nz % ny), double(i % nz));
          const std::uint64_t counter = 3 * std::uint64_t(i);
          const Eigen::Vector3d within(random_fraction(counter), random_fraction(counter + 1),
                                       random_fraction(counter + 2));
          add(box.lower + (at + within).cwiseQuotient(strata).cwiseProduct(size), sum);
        },
        context_);
    const auto volume = [&](const Hits& hits) { return estimate(hits.hits, hits.samples, whole); };
    result_.mesh_volume = volume(found.mesh);
    result_.reference_volume = volume(found.reference);
    result_.difference = volume(found.difference);
    result_.unknown_volume = volume(found.unknown);
    result_.unexplained = volume(found.unexplained);
    result_.unexplained_place = found.unexplained.place;
    Hits at_most = found.difference;
    at_most.hits += found.unknown.hits;
    result_.difference.upper = volume(at_most).upper;
  }

  /// Returns the number of strata along each side of the box, so that they are nearly cubes and about as many
  /// as samples; 1 along a side in which the box is thin.
  Eigen::Vector3d strata_along(const Eigen::Vector3d& size) const {
    Eigen::Vector3d strata = Eigen::Vector3d::Ones();
    std::array<bool, 3> thin{size.x() <= 0.0, size.y() <= 0.0, size.z() <= 0.0};
    for (int round = 0; round < 3; ++round) {
      double product = 1.0;
      int thick = 0;
      for (int axis = 0; axis < 3; ++axis)
        if (!thin[axis]) product *= size[axis], ++thick;
      const double side = std::pow(product / double(options_.samples), 1.0 / std::max(1, thick));
      for (int axis = 0; axis < 3; ++axis) {
        strata[axis] = thin[axis] ? 1.0 : std::max(1.0, std::round(size[axis] / side));
        thin[axis] = thin[axis] || size[axis] < side;
      }
    }
    return strata;
  }

  void add(const Eigen::Vector3d& point, InSpace& sum) const {
    const Side ours = mesh_.solid.side(point), theirs = reference_.solid.side(point);
    const bool unknown = ours == Side::unknown || theirs == Side::unknown;
    const bool differs = !unknown && ours != theirs;
    sum.mesh.add(ours == Side::inside, point);
    sum.reference.add(theirs == Side::inside, point);
    sum.unknown.add(unknown, point);
    sum.difference.add(differs, point);
    const double limit = result_.explained;
    const auto far = [&] {
      return ours_.beyond(point, limit) || (bounding_.beyond(point, limit) && possible_.beyond(point, limit));
    };
    sum.unexplained.add(differs && far(), point);
  }

  SolidComparison::Verdict verdict() const {
    using Verdict = SolidComparison::Verdict;
    const SolidComparison& r = result_;
    if (r.reference_area <= 0.0) return Verdict::unknown;
    // No sample is in a reference that is much smaller than the mesh.
    const double volume =
        r.reference_volume.value > 0.0 ? r.reference_volume.value : r.reference_volume.upper;
    if (r.false_area.lower > kFalseShare * r.mesh_area || r.lost_area.lower > kLostShare * r.reference_area ||
        r.unexplained.lower > kVolumeShare * volume)
      return Verdict::differs;
    const bool known =
        r.reference_area > r.possible_area && r.reference_volume.value > r.unknown_volume.value;
    return known ? Verdict::same : Verdict::unknown;
  }

  const Body &mesh_, &reference_;
  const OuterBoundary& boundary_;
  const Surface &bounding_, &possible_;
  const SolidOptions& options_;
  const RunContext& context_;
  MeshFile pieces_;  ///< the mesh without its seams if it is all pieces of a fracture; else empty
  Surface ours_;
  SolidComparison result_;
};

SolidReference::SolidReference(const MeshFile& reference, RunContext& context) {
  const Stage stage(context, "reference's solid");
  MeshFile welded = welded_triangles(TriangleSoup(reference, QuadRule::better));
  if (!welded.triangles.empty()) parts_ = std::make_unique<const Parts>(std::move(welded), context);
}

SolidReference::~SolidReference() = default;

SolidComparison SolidReference::compare(const MeshFile& mesh, const SolidOptions& options,
                                        RunContext& context) const {
  const Stage stage(context, "solids");
  SolidComparison result;
  result.samples = options.samples;
  const TriangleSoup soup(mesh);
  result.mesh_components = components_of_triangles(soup);
  result.mesh_area = soup.area();
  MeshFile welded = welded_triangles(soup);
  if (!parts_ || welded.triangles.empty()) return result;
  const Body body(std::move(welded), Solid::Reading::by_orientation, context);
  return Comparison(body, *parts_, options, context).run(result);
}

SolidComparison compare_solids(const MeshFile& mesh, const MeshFile& reference, const SolidOptions& options,
                               RunContext& context) {
  return SolidReference(reference, context).compare(mesh, options, context);
}

}  // namespace hermesh::validation
