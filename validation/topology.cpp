#include "validation/topology.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "algorithms/core/disjoint_sets.h"
#include "validation/geometry/exact_predicates.h"
#include "validation/geometry/sum_ranges.h"

namespace hermesh::validation {
namespace {

// All corners of all polygons in one numbering: 3 for each triangle, then 4 for each quad.
class CornerIndex {
 public:
  explicit CornerIndex(const MeshFile& mesh) : mesh_(mesh), triangle_corners_(3 * mesh.triangles.size()) {}

  std::size_t size() const { return triangle_corners_ + 4 * mesh_.quads.size(); }
  std::uint32_t point(std::size_t corner) const {
    if (corner < triangle_corners_) return mesh_.triangles[corner / 3][corner % 3];
    return mesh_.quads[(corner - triangle_corners_) / 4][(corner - triangle_corners_) % 4];
  }
  std::int64_t polygon(std::size_t corner) const {
    if (corner < triangle_corners_) return std::int64_t(corner / 3);
    return std::int64_t(mesh_.triangles.size() + (corner - triangle_corners_) / 4);
  }
  // The points before and after a corner, going around its polygon.
  std::array<std::uint32_t, 2> neighbours(std::size_t corner) const {
    if (corner < triangle_corners_) {
      const Triangle& t = mesh_.triangles[corner / 3];
      const std::size_t k = corner % 3;
      return {t[(k + 2) % 3], t[(k + 1) % 3]};
    }
    const Quad& q = mesh_.quads[(corner - triangle_corners_) / 4];
    const std::size_t k = (corner - triangle_corners_) % 4;
    return {q[(k + 3) % 4], q[(k + 1) % 4]};
  }
  // The polygon's corner points in increasing order; a triangle's fourth is kNone.
  std::array<std::uint32_t, 4> sorted_points(std::size_t corner) const {
    std::array<std::uint32_t, 4> p{kNone, kNone, kNone, kNone};
    const std::size_t i = std::size_t(polygon(corner));
    if (corner < triangle_corners_)
      std::copy_n(mesh_.triangles[i].begin(), 3, p.begin());
    else
      p = mesh_.quads[i - mesh_.triangles.size()];
    std::sort(p.begin(), p.end());
    return p;
  }

  static constexpr std::uint32_t kNone = ~std::uint32_t(0);

 private:
  const MeshFile& mesh_;
  std::size_t triangle_corners_;
};

// The corners at each point, in increasing order: those of point v begin at corner[first[v]].
struct Incidence {
  std::vector<std::uint32_t> first, corner;

  Incidence(const CornerIndex& corners, std::size_t points) : first(points + 1, 0), corner(corners.size()) {
    for (std::size_t c = 0; c < corners.size(); ++c) ++first[corners.point(c) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    for (std::size_t c = 0; c < corners.size(); ++c) corner[next[corners.point(c)]++] = std::uint32_t(c);
  }
};

// The counts of a range of points.
struct Tally {
  std::int64_t edges = 0, boundary = 0, non_manifold = 0, inconsistent = 0, singular = 0, duplicates = 0,
               isolated = 0;
  Places boundary_places, non_manifold_places, inconsistent_places, singular_places, duplicate_places;

  void append(const Tally& later) {
    edges += later.edges;
    boundary += later.boundary;
    non_manifold += later.non_manifold;
    inconsistent += later.inconsistent;
    singular += later.singular;
    duplicates += later.duplicates;
    isolated += later.isolated;
    boundary_places.append(later.boundary_places);
    non_manifold_places.append(later.non_manifold_places);
    inconsistent_places.append(later.inconsistent_places);
    singular_places.append(later.singular_places);
    duplicate_places.append(later.duplicate_places);
  }
};

// Counts the defects at one point after another, reusing its scratch memory.
class PointCounter {
 public:
  PointCounter(const MeshFile& mesh, const CornerIndex& corners, const Incidence& incidence, Tally& tally)
      : mesh_(mesh), corners_(corners), incidence_(incidence), tally_(tally) {}

  void count(std::uint32_t v) {
    begin_ = incidence_.first[v];
    count_ = incidence_.first[v + 1] - begin_;
    if (count_ == 0) {
      ++tally_.isolated;
      return;
    }
    collect_sides(v);
    count_edges(v);
    count_fans(v);
    count_duplicates(v);
  }

 private:
  // A side at the point, to or from another point, of the polygon of the point's corner number `local`.
  struct Side {
    std::uint32_t other, local;
    bool outgoing;
    auto operator<=>(const Side&) const = default;
  };

  std::int64_t polygon(std::uint32_t local) const {
    return corners_.polygon(incidence_.corner[begin_ + local]);
  }

  void collect_sides(std::uint32_t v) {
    sides_.clear();
    fan_.assign(count_, kSidesOfOnePoint);
    for (std::uint32_t i = 0; i < count_; ++i) {
      const auto [before, after] = corners_.neighbours(incidence_.corner[begin_ + i]);
      if (before != v) sides_.push_back({before, i, false});
      if (after != v) sides_.push_back({after, i, true});
      if (before != v || after != v) fan_[i] = i;
    }
    std::sort(sides_.begin(), sides_.end());
  }

  std::uint32_t root(std::uint32_t i) {
    while (fan_[i] != i) i = fan_[i] = fan_[fan_[i]];
    return i;
  }

  // The sides with one other end are an edge, which is counted at its lower end and joins fans at both.
  void count_edges(std::uint32_t v) {
    for (std::size_t i = 0, end; i < sides_.size(); i = end) {
      int outgoing = 0;
      for (end = i; end < sides_.size() && sides_[end].other == sides_[i].other; ++end) {
        outgoing += sides_[end].outgoing;
        const std::uint32_t a = root(sides_[i].local), b = root(sides_[end].local);
        fan_[std::max(a, b)] = std::min(a, b);
      }
      if (v < sides_[i].other) count_edge(v, i, end, outgoing);
    }
  }

  void count_edge(std::uint32_t v, std::size_t first, std::size_t end, int outgoing) {
    ++tally_.edges;
    const std::size_t sides = end - first;
    if (sides == 2 && outgoing == 1) return;
    const Eigen::Vector3d middle = 0.5 * mesh_.points[v] + 0.5 * mesh_.points[sides_[first].other];
    const std::int64_t one = polygon(sides_[first].local);
    if (sides == 1) {
      ++tally_.boundary;
      tally_.boundary_places.add(middle, one);
    } else if (sides > 2) {
      ++tally_.non_manifold;
      tally_.non_manifold_places.add(middle, one, polygon(sides_[first + 1].local));
    } else {
      ++tally_.inconsistent;
      tally_.inconsistent_places.add(middle, one, polygon(sides_[first + 1].local));
    }
  }

  void count_fans(std::uint32_t v) {
    std::array<std::uint32_t, 2> roots{};
    int fans = 0;
    for (std::uint32_t i = 0; i < count_ && fans < 2; ++i)
      if (fan_[i] == i) roots[fans++] = i;
    if (fans < 2) return;
    ++tally_.singular;
    tally_.singular_places.add(mesh_.points[v], polygon(roots[0]), polygon(roots[1]));
  }

  // Tests each polygon in the list of its lowest point only.
  void count_duplicates(std::uint32_t v) {
    if (count_ < 2) return;
    keys_.clear();
    for (std::uint32_t i = 0; i < count_; ++i) {
      const std::uint32_t corner = incidence_.corner[begin_ + i];
      const auto points = corners_.sorted_points(corner);
      if (points[0] == v) keys_.emplace_back(points, corners_.polygon(corner));
    }
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());  // one that repeats its lowest corner
    std::size_t first = 0;
    for (std::size_t i = 1; i < keys_.size(); ++i) {
      if (keys_[i].first != keys_[first].first) {
        first = i;
        continue;
      }
      ++tally_.duplicates;
      const auto& p = keys_[i].first;
      const Eigen::Vector3d centre = (mesh_.points[p[0]] + mesh_.points[p[1]] + mesh_.points[p[2]]) / 3.0;
      tally_.duplicate_places.add(centre, keys_[first].second, keys_[i].second);
    }
  }

  static constexpr std::uint32_t kSidesOfOnePoint = ~std::uint32_t(0);  // such a corner is in no fan

  const MeshFile& mesh_;
  const CornerIndex& corners_;
  const Incidence& incidence_;
  Tally& tally_;
  std::uint32_t begin_ = 0, count_ = 0;
  std::vector<Side> sides_;
  std::vector<std::uint32_t> fan_;
  std::vector<std::pair<std::array<std::uint32_t, 4>, std::int64_t>> keys_;
};

std::int64_t count_components(const MeshFile& mesh) {
  DisjointSets sets(mesh.points.size());
  for (const Triangle& t : mesh.triangles) sets.join(t[0], t[1]), sets.join(t[0], t[2]);
  for (const Quad& q : mesh.quads) sets.join(q[0], q[1]), sets.join(q[0], q[2]), sets.join(q[0], q[3]);
  std::int64_t components = 0;  // including one for each isolated point
  for (std::uint32_t p = 0; p < sets.size(); ++p) components += sets.find(p) == p;
  return components;
}

struct MeasureSums {
  double volume = 0.0, area = 0.0;
  double smallest_angle = 180.0, worst_aspect = 0.0;
  std::int64_t degenerate = 0;
  std::int64_t last_degenerate = -1;  // its polygon, so that a quad counts once
  Places places;

  void add(const Corners& c, const Eigen::Vector3d& centre, std::int64_t polygon) {
    const Eigen::Vector3d ab = c[1] - c[0], bc = c[2] - c[1], ca = c[0] - c[2];
    const double twice_area = ab.cross(-ca).norm();
    area += 0.5 * twice_area;
    volume += (c[0] - centre).dot((c[1] - centre).cross(c[2] - centre)) / 6.0;
    if (collinear(c)) {
      if (polygon != last_degenerate) {
        ++degenerate;
        places.add((c[0] + c[1] + c[2]) / 3.0, polygon);
      }
      last_degenerate = polygon;
      smallest_angle = 0.0;
      worst_aspect = std::numeric_limits<double>::infinity();
      return;
    }
    std::array<double, 3> side{ab.norm(), bc.norm(), ca.norm()};
    std::sort(side.begin(), side.end());
    // The smallest angle is opposite to the shortest side; its sine is twice the area over the other two.
    const double cosine = (side[1] * side[1] + side[2] * side[2] - side[0] * side[0]) / 2.0;
    smallest_angle = std::min(smallest_angle, std::atan2(twice_area, cosine) * 180.0 / std::numbers::pi);
    const double perimeter = side[0] + side[1] + side[2];
    worst_aspect = std::max(worst_aspect, side[2] * perimeter / (2.0 * std::numbers::sqrt3 * twice_area));
  }

  void append(const MeasureSums& later) {
    volume += later.volume;
    area += later.area;
    smallest_angle = std::min(smallest_angle, later.smallest_angle);
    worst_aspect = std::max(worst_aspect, later.worst_aspect);
    degenerate += later.degenerate;
    places.append(later.places);
  }
};

}  // namespace

bool repeats_corner(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

bool repeats_corner(const Quad& q) {
  return q[0] == q[1] || q[0] == q[2] || q[0] == q[3] || q[1] == q[2] || q[1] == q[3] || q[2] == q[3];
}

void count_topology(const MeshFile& mesh, MeshReport& report, RunContext& context) {
  const CornerIndex corners(mesh);
  if (corners.size() >= CornerIndex::kNone)
    throw Error("the mesh has more polygon corners than can be counted (" + std::to_string(corners.size()) +
                ")");
  const Incidence incidence(corners, mesh.points.size());
  const Tally tally = sum_ranges<Tally>(mesh.points.size(), 8192, context,
                                        [&](std::size_t begin, std::size_t end, Tally& sum) {
                                          PointCounter counter(mesh, corners, incidence, sum);
                                          for (std::size_t v = begin; v < end; ++v)
                                            counter.count(std::uint32_t(v));
                                        });
  report.points = std::int64_t(mesh.points.size());
  report.triangles = std::int64_t(mesh.triangles.size());
  report.quads = std::int64_t(mesh.quads.size());
  report.boundary_edges = tally.boundary;
  report.non_manifold_edges = tally.non_manifold;
  report.inconsistent_edges = tally.inconsistent;
  report.non_manifold_vertices = tally.singular;
  report.duplicate_polygons = tally.duplicates;
  report.isolated_points = tally.isolated;
  report.boundary_places = tally.boundary_places;
  report.non_manifold_edge_places = tally.non_manifold_places;
  report.inconsistent_places = tally.inconsistent_places;
  report.non_manifold_vertex_places = tally.singular_places;
  report.duplicate_places = tally.duplicate_places;
  report.components = count_components(mesh) - tally.isolated;
  report.euler_characteristic =
      report.points - tally.isolated - tally.edges + report.triangles + report.quads;
  const auto repeats = [](const auto& polygon) { return repeats_corner(polygon); };
  if (report.closed() && report.manifold() && report.oriented() && report.components > 0 &&
      std::ranges::none_of(mesh.triangles, repeats) && std::ranges::none_of(mesh.quads, repeats))
    report.genus = double(report.components) - 0.5 * double(report.euler_characteristic);
}

void measure_triangles(const MeshFile& mesh, const TriangleSoup& soup, MeshReport& report,
                       RunContext& context) {
  const Eigen::Vector3d centre = box_of(mesh).centre();
  // Ranges are of polygons, so that none separates the two halves of a quad.
  const std::size_t undivided = soup.undivided, polygons = undivided + mesh.quads.size();
  const auto sums = sum_ranges<MeasureSums>(
      polygons, 4096, context, [&](std::size_t begin, std::size_t end, MeasureSums& sum) {
        for (std::size_t p = begin; p < end; ++p) {
          const std::size_t first = p < undivided ? p : undivided + 2 * (p - undivided);
          for (std::size_t t = first; t < first + (p < undivided ? 1 : 2); ++t)
            sum.add(soup.corners(t), centre, std::int64_t(p));
        }
      });
  report.volume = sums.volume;
  report.area = sums.area;
  report.smallest_angle = polygons > 0 ? sums.smallest_angle : 0.0;
  report.worst_aspect = sums.worst_aspect;
  report.degenerate_polygons = sums.degenerate;
  report.degenerate_places = sums.places;
}

}  // namespace hermesh::validation
