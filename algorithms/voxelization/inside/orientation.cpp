#include "algorithms/voxelization/inside/orientation.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/groups.h"

namespace hermesh {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
/// Share of the area of faces without sides beyond which the whole mesh has no sides.
constexpr double kMostOfArea = 0.5;
/// A flat sheet has no volume except for rounding; below this share of area^1.5 it is not flipped.
constexpr double kNoVolume = 1e-6;

/// Returns the triangles with each point replaced by the lowest number of a point at the same position.
std::vector<Triangle> merge_points(std::span<const Eigen::Vector3f> points,
                                   std::span<const Triangle> triangles) {
  std::vector<std::tuple<float, float, float, std::uint32_t>> places(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    places[i] = {points[i][0], points[i][1], points[i][2], static_cast<std::uint32_t>(i)};
  // With the number the order is unique, and each group begins with its lowest point.
  tbb::parallel_sort(places.begin(), places.end());
  std::vector<std::uint32_t> first(points.size());
  for_groups(
      std::span(std::as_const(places)),
      [](const auto& a, const auto& b) {
        return std::tie(get<0>(a), get<1>(a), get<2>(a)) == std::tie(get<0>(b), get<1>(b), get<2>(b));
      },
      [&](const auto& same) {
        for (const auto& place : same) first[get<3>(place)] = get<3>(same[0]);
      });
  std::vector<Triangle> merged(triangles.begin(), triangles.end());
  for (Triangle& t : merged)
    for (std::uint32_t& point : t) point = first[point];
  return merged;
}

/// Returns true if two of a face's points are one.
bool is_degenerate(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

/// A side of a face, by its points in ascending order, so that the sides at one edge sort next to each other.
struct Edge {
  std::uint32_t low, high;
  std::uint32_t tag;
  bool operator<(const Edge& o) const { return std::tie(low, high, tag) < std::tie(o.low, o.high, o.tag); }
};

/// Returns the sides of all faces that are used and not degenerate, sorted. tag(face, down) gives the tag of
/// a side; `down`: it runs from its high point to its low one.
template <class IsUsed, class Tag>
std::vector<Edge> sorted_edges(std::span<const Triangle> triangles, IsUsed&& is_used, Tag&& tag) {
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (std::uint32_t face = 0; face < triangles.size(); ++face) {
    const Triangle& t = triangles[face];
    if (!is_used(face) || is_degenerate(t)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax({t[k], t[(k + 1) % 3]});
      edges.push_back({low, high, tag(face, t[k] == high)});
    }
  }
  tbb::parallel_sort(edges.begin(), edges.end());
  return edges;
}

/// Calls f(sides) for the sides at each edge.
template <class F>
void for_each_edge(std::span<const Edge> edges, F&& f) {
  for_groups(
      edges, [](const Edge& a, const Edge& b) { return a.low == b.low && a.high == b.high; }, f);
}

/// Faces with the same three points as others, by number.
struct DuplicateFaces {
  std::vector<std::uint32_t> dropped;  ///< faces that another represents
  /// The remaining faces of groups with as many faces of one winding as of the other.
  std::vector<std::uint32_t> cancelling;
};

/// Finds the faces to drop where several have the same three points: all but the first with the winding of
/// most. Degenerate faces stay.
DuplicateFaces find_duplicates(std::span<const Triangle> triangles) {
  struct Face {
    Triangle points;  ///< sorted
    std::uint32_t number;
  };
  std::vector<Face> faces(triangles.size());
  tbb::parallel_for(std::size_t{0}, faces.size(), [&](std::size_t i) {
    faces[i] = {triangles[i], static_cast<std::uint32_t>(i)};
    std::sort(faces[i].points.begin(), faces[i].points.end());
  });
  // With the number the order is unique, and the remaining face is the first of its kind in the file.
  tbb::parallel_sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
    return std::tie(a.points, a.number) < std::tie(b.points, b.number);
  });
  // Returns true if a triangle runs through its points in their ascending order.
  const auto is_forward = [&](const Face& face) {
    const Triangle& t = triangles[face.number];
    const auto start = static_cast<std::size_t>(std::ranges::find(t, face.points[0]) - t.begin());
    return t[(start + 1) % 3] == face.points[1];
  };
  DuplicateFaces result;
  for_groups(
      std::span<const Face>(faces), [](const Face& a, const Face& b) { return a.points == b.points; },
      [&](std::span<const Face> same) {
        if (same.size() == 1 || is_degenerate(same[0].points)) return;
        // A face counts once, in the winding that remains when opposite ones cancel. If none remains, one
        // face still represents the others, and find_double_walls() decides if it bounds anything.
        std::ptrdiff_t net = 0;
        for (const Face& face : same) net += is_forward(face) ? 1 : -1;
        const std::uint32_t left =
            net == 0 ? same[0].number : std::ranges::find(same, net > 0, is_forward)->number;
        if (net == 0) result.cancelling.push_back(left);
        for (const Face& face : same)
          if (face.number != left) result.dropped.push_back(face.number);
      });
  return result;
}

/// Finds the cancelling faces that are double walls and bound nothing: where two parts of a model lie face on
/// face, and sheets of no thickness. Others are single faces of a surface that the file contains twice, wound
/// at random. The faces around them decide, since a surface continues across its edges: connected cancelling
/// faces are a wall if without them fewer edges are left with an odd number of faces.
std::vector<std::uint32_t> find_double_walls(std::span<const Triangle> triangles,
                                             const DuplicateFaces& duplicates) {
  if (duplicates.cancelling.empty()) return {};
  constexpr std::uint32_t kSingle = ~0u;  // tag of a face that does not cancel; the others have their number
  std::vector<std::uint32_t> wall_of(triangles.size(), kSingle);
  for (std::uint32_t i = 0; i < duplicates.cancelling.size(); ++i) wall_of[duplicates.cancelling[i]] = i;
  std::vector<char> dropped(triangles.size(), 0);
  for (const std::uint32_t face : duplicates.dropped) dropped[face] = 1;
  const std::vector<Edge> edges = sorted_edges(
      triangles, [&](std::uint32_t face) { return !dropped[face]; },
      [&](std::uint32_t face, bool) { return wall_of[face]; });
  DisjointSets walls(duplicates.cancelling.size());
  // By wall, later by set: odd edges that exist with the faces and not without, less those that exist without
  // and not with.
  std::vector<std::int64_t> balance(walls.size());
  for_each_edge(edges, [&](std::span<const Edge> same) {
    // kSingle is the largest tag, so that the walls at an edge are its first entries; they are connected.
    std::size_t count = 0;
    while (count < same.size() && same[count].tag != kSingle) walls.join(same[0].tag, same[count++].tag);
    // Only an odd number of walls changes the parity: +1 if the number of others is even, and the edge closed
    // without the walls.
    if (count % 2 == 1) balance[same[0].tag] += (same.size() - count) % 2 == 0 ? 1 : -1;
  });
  for (std::uint32_t i = 0; i < walls.size(); ++i)
    if (walls.find(i) != i) balance[walls.find(i)] += balance[i];
  std::vector<std::uint32_t> result;
  for (std::uint32_t i = 0; i < duplicates.cancelling.size(); ++i)
    if (balance[walls.find(i)] > 0) result.push_back(duplicates.cancelling[i]);
  return result;
}

/// One run of orient_faces(), step by step in the order of its methods.
class Orienter {
 public:
  Orienter(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles)
      : points_(points), triangles_(merge_points(points, triangles)) {
    result_.turns.assign(triangles_.size(), 1);
  }

  Orientation run() {
    drop_duplicates();
    if (area_ > 0) {
      link_neighbours();
      agree();
    }
    for (const std::int8_t turn : result_.turns) result_.flipped += turn < 0;
    if (!(area_ > 0) && !(cancelling_area_ > 0))
      result_.verdict = Orientation::Verdict::no_area;
    else if (cancelling_area_ > kMostOfArea * area_)
      result_.verdict = Orientation::Verdict::cancelling;
    else if (one_sided_area_ > kMostOfArea * area_)
      result_.verdict = Orientation::Verdict::not_orientable;
    return std::move(result_);
  }

 private:
  /// The bit of an entry of `neighbours_` that is set if the two faces are wound against each other.
  static constexpr std::uint32_t kDisagrees = 1;

  /// Faces that are connected over edges of two faces.
  struct Patch {
    std::size_t begin = 0, end = 0;  ///< in queue_
    bool consistent = true, orientable = true, closed = true;
    bool has_boundary = false;         ///< has an edge that no other face has
    double given = 0.0, turned = 0.0;  ///< area that keeps the given winding, and that does not
    double volume = 0.0;               ///< after the turns, about centre_
    Eigen::Vector3d vector = Eigen::Vector3d::Zero();  ///< sum of the area vectors; zero if it is closed
  };

  Eigen::Vector3d corner(std::size_t face, int c) const {
    return points_[triangles_[face][c]].cast<double>();
  }
  /// Returns the face's normal as given, with its area as length.
  Eigen::Vector3d area_vector(std::size_t face) const {
    const Eigen::Vector3d a = corner(face, 0);
    return 0.5 * (corner(face, 1) - a).cross(corner(face, 2) - a);
  }

  /// Drops the duplicates and the double walls. Faces that exist with both windings count for the area, so
  /// that the share that cancels is known; those of double walls do not, unless there are no others.
  void drop_duplicates() {
    const DuplicateFaces duplicates = find_duplicates(triangles_);
    result_.duplicates = duplicates.dropped.size();
    for (const std::uint32_t face : duplicates.dropped) result_.turns[face] = 0;
    for (const std::uint32_t face : find_double_walls(triangles_, duplicates)) result_.turns[face] = 0;
    measure();
    for (const std::uint32_t face : duplicates.cancelling)
      if (result_.turns[face] != 0 || !(area_ > 0)) cancelling_area_ += area_vector(face).norm();
  }

  /// Computes the area, its centre, about which volumes are computed, and its box. One thread adds up face by
  /// face, so that the sums are the same on every machine.
  void measure() {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t face = 0; face < triangles_.size(); ++face) {
      if (result_.turns[face] == 0) continue;
      const double area = area_vector(face).norm();
      area_ += area;
      sum += area / 3 * (corner(face, 0) + corner(face, 1) + corner(face, 2));
      if (area > 0)
        for (int c = 0; c < 3; ++c) box_.add(corner(face, c));
    }
    if (area_ > 0) centre_ = sum / area_;
  }

  /// Finds the neighbours of each face over edges of two faces, and lists the edges of more.
  void link_neighbours() {
    const std::vector<Edge> edges = sorted_edges(
        triangles_, [&](std::uint32_t face) { return result_.turns[face] != 0; },
        [](std::uint32_t face, bool down) { return 2 * face + (down ? 1 : 0); });
    neighbours_.assign(triangles_.size(), {kNone, kNone, kNone});
    at_boundary_.assign(triangles_.size(), 0);
    for_each_edge(edges, [&](std::span<const Edge> same) {
      if (same.size() == 1) {
        ++result_.boundary_edges;
        at_boundary_[same[0].tag >> 1] = 1;
      } else if (same.size() == 2) {
        ++two_face_edges_;
        link(same[0].tag, same[1].tag);
      } else {
        ++result_.non_manifold_edges;
        shared_edges_.insert(shared_edges_.end(), same.begin(), same.end());
      }
    });
    // Faces of which most meet by threes or more form no surface over which a winding could spread.
    if (result_.non_manifold_edges > two_face_edges_)
      neighbours_.assign(triangles_.size(), {kNone, kNone, kNone});
  }

  /// Makes two faces neighbours. They agree if they run along their edge in opposite directions.
  void link(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t disagrees = (a & 1) == (b & 1) ? kDisagrees : 0;
    const auto add = [](std::array<std::uint32_t, 3>& list, std::uint32_t entry) {
      *std::find(list.begin(), list.end(), kNone) = entry;
    };
    add(neighbours_[a >> 1], (b & ~1u) | disagrees);
    add(neighbours_[b >> 1], (a & ~1u) | disagrees);
  }

  /// Orients patch by patch, each from its lowest face on; see orient_faces().
  void agree() {
    std::vector<std::int8_t> turns(triangles_.size(), 0);  // 0: not met yet
    std::vector<Patch> patches;
    double given_volume = 0.0;
    Eigen::Vector3d given_vector = Eigen::Vector3d::Zero();
    queue_.reserve(triangles_.size());
    for (std::size_t face = 0; face < triangles_.size(); ++face) {
      if (turns[face] != 0 || result_.turns[face] == 0 || is_degenerate(triangles_[face])) continue;
      Patch patch = spread(static_cast<std::uint32_t>(face), turns);
      // The winding given to more of the area wins, whatever the first face has.
      if (patch.turned > patch.given) flip(patch, turns);
      // The volume of the mesh as given, before closed patches are flipped by their own.
      given_volume += patch.volume;
      given_vector += patch.vector;
      if (!follows_given(patch) && patch.volume < 0) flip(patch, turns);
      patches.push_back(patch);
    }
    // All patches that follow the file are flipped together or not at all, so that a hole stays a hole.
    const bool inside_out = largest_volume(given_volume, given_vector) < -kNoVolume * std::pow(area_, 1.5);
    for (Patch& patch : patches) {
      if (inside_out && follows_given(patch)) flip(patch, turns);
      result_.non_orientable_patches += !patch.orientable;
      if (!patch.orientable) one_sided_area_ += patch.given + patch.turned;
    }
    result_.patches = patches.size();
    leave_out_walls(patches, turns);
    for (const std::uint32_t face : queue_) result_.turns[face] = turns[face];
    for (const Patch& patch : patches) {
      if (!patch.closed || !patch.consistent || !patch.orientable || patch.volume >= 0) continue;
      result_.inward.resize(triangles_.size());
      for (std::size_t i = patch.begin; i < patch.end; ++i) result_.inward[queue_[i]] = turns[queue_[i]];
    }
  }

  /// How many more faces of a patch run along an edge of more than two faces from its low point to its high
  /// one than in the other direction.
  struct Flow {
    std::uint32_t patch;
    std::size_t edge;
    int own;
  };

  /// Sorts the flows by patch and edge, and adds up those of the same patch and edge.
  static void merge_by_patch(std::vector<Flow>& flows) {
    const auto key = [](const Flow& f) { return std::tie(f.patch, f.edge); };
    tbb::parallel_sort(flows.begin(), flows.end(),
                       [&](const Flow& a, const Flow& b) { return key(a) < key(b); });
    std::size_t count = 0;
    for (const Flow& flow : flows)
      if (count > 0 && key(flows[count - 1]) == key(flow))
        flows[count - 1].own += flow.own;
      else
        flows[count++] = flow;
    flows.resize(count);
  }

  /// Leaves out each patch that the others do not need: at every edge of its boundary two or more others are
  /// incident, and without it these run along the edge as often in one direction as in the other. So it is a
  /// wall within the solid or a fin of no thickness, and bounds nothing. Of a solid that a wall divides,
  /// either side and the wall would make a solid, too; the least area comes first, and no surface within the
  /// wall's border has less than a plane one.
  void leave_out_walls(const std::vector<Patch>& patches, std::vector<std::int8_t>& turns) {
    if (shared_edges_.empty() || result_.non_manifold_edges > two_face_edges_) return;
    std::vector<std::uint32_t> patch_of(triangles_.size(), kNone);
    for (std::uint32_t p = 0; p < patches.size(); ++p)
      for (std::size_t i = patches[p].begin; i < patches[p].end; ++i) patch_of[queue_[i]] = p;
    // `total` has the flow of all patches along each edge; a closed rest is one for which it is 0.
    std::vector<int> total;
    std::vector<Flow> flows;
    for_each_edge(shared_edges_, [&](std::span<const Edge> same) {
      total.push_back(0);
      for (const Edge& edge : same) {
        const std::uint32_t face = edge.tag >> 1;
        flows.push_back({patch_of[face], total.size() - 1, (edge.tag & 1) ? -turns[face] : turns[face]});
        total.back() += flows.back().own;
      }
    });
    merge_by_patch(flows);
    std::vector<std::uint32_t> order(patches.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return patches[a].given + patches[a].turned < patches[b].given + patches[b].turned;
    });
    for (const std::uint32_t p : order) {
      // An edge of one face is the boundary of a hole, and the patch may be the rest of a solid.
      if (patches[p].has_boundary || !patches[p].orientable) continue;
      const auto [begin, end] = std::ranges::equal_range(flows, p, {}, &Flow::patch);
      // The others are closed along the border if the whole flow is the patch's own. A patch without such a
      // border, or whose own faces cancel along all of it, stays.
      const bool others_are_closed =
          std::all_of(begin, end, [&](const Flow& f) { return f.own == total[f.edge]; });
      if (!others_are_closed || std::all_of(begin, end, [](const Flow& f) { return f.own == 0; })) continue;
      for (auto f = begin; f != end; ++f) total[f->edge] -= f->own;
      for (std::size_t i = patches[p].begin; i < patches[p].end; ++i) turns[queue_[i]] = 0;
    }
  }

  /// Returns the largest volume that the surface has about any apex in its box. The volume of an open
  /// surface, that of the cone to it, is linear in the apex, and so the largest in one of the corners of the
  /// box.
  double largest_volume(double about_centre, const Eigen::Vector3d& vector) const {
    double volume = about_centre;
    for (int a = 0; a < 3; ++a)
      volume +=
          std::max(vector[a] * (centre_[a] - box_.lower[a]), vector[a] * (centre_[a] - box_.upper[a])) / 3;
    return volume;
  }

  /// Visits a patch breadth first and orients its faces to agree with its first.
  Patch spread(std::uint32_t seed, std::vector<std::int8_t>& turns) {
    Patch patch;
    patch.begin = queue_.size();
    turns[seed] = 1;
    queue_.push_back(seed);
    for (std::size_t at = patch.begin; at < queue_.size(); ++at) {
      const std::uint32_t face = queue_[at];
      const Eigen::Vector3d n = area_vector(face);
      (turns[face] > 0 ? patch.given : patch.turned) += n.norm();
      patch.volume += turns[face] * n.dot(corner(face, 0) - centre_) / 3;
      patch.vector += turns[face] * n;
      patch.has_boundary |= at_boundary_[face] != 0;
      for (const std::uint32_t entry : neighbours_[face]) {
        if (entry == kNone) {
          patch.closed = false;
          continue;
        }
        const bool disagrees = entry & kDisagrees;
        const auto turn = static_cast<std::int8_t>(disagrees ? -turns[face] : turns[face]);
        if (disagrees) patch.consistent = false;
        std::int8_t& known = turns[entry >> 1];
        if (known == 0) queue_.push_back(entry >> 1);
        // Two paths reach this face with different turns: a Möbius strip closes here.
        if (known == -turn) patch.orientable = false;
        if (known == 0) known = turn;
      }
    }
    patch.end = queue_.size();
    return patch;
  }

  /// Returns true if the patch's winding is that of the file, and not that of its volume.
  static bool follows_given(const Patch& patch) {
    return patch.consistent || !patch.closed || !patch.orientable;
  }
  void flip(Patch& patch, std::vector<std::int8_t>& turns) const {
    std::swap(patch.given, patch.turned);
    patch.volume = -patch.volume;
    patch.vector = -patch.vector;
    for (std::size_t i = patch.begin; i < patch.end; ++i) turns[queue_[i]] = -turns[queue_[i]];
  }

  std::span<const Eigen::Vector3f> points_;
  std::vector<Triangle> triangles_;  ///< of merged points
  /// Neighbours of each face over edges of two faces: twice the number, plus kDisagrees.
  std::vector<std::array<std::uint32_t, 3>> neighbours_;
  std::vector<char> at_boundary_;     ///< faces with an edge that no other has
  std::vector<Edge> shared_edges_;    ///< of more than two faces, one after the other
  std::vector<std::uint32_t> queue_;  ///< faces patch by patch
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  Bounds box_;
  std::size_t two_face_edges_ = 0;
  double area_ = 0.0, cancelling_area_ = 0.0, one_sided_area_ = 0.0;
  Orientation result_;
};

}  // namespace

Orientation orient_faces(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles) {
  return Orienter(points, triangles).run();
}

const char* explanation(Orientation::Verdict verdict) {
  switch (verdict) {
    case Orientation::Verdict::usable:
      break;
    case Orientation::Verdict::no_area:
      return "every polygon is degenerate, so there is no inside";
    case Orientation::Verdict::cancelling:
      return "most polygons are there with both windings and cancel, so there is no inside";
    case Orientation::Verdict::not_orientable:
      return "most of the surface has one side only, like a Möbius strip, so there is no inside";
  }
  return "";
}

}  // namespace hermesh
