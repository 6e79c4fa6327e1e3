#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <unordered_map>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/hermite/polygon_parts.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/lattice/block_table.h"
#include "algorithms/lattice/sample_side.h"

namespace hermesh {
namespace {

/// Distance in voxels within which a point counts as on a triangle's border or at an edge's end, so that no
/// line passes between two triangles and no hit between two edges.
constexpr double kTolerance = 1e-7;
/// Distance from grid lines within which triangles are tested, in voxels: more than the shift of sides.
constexpr double kReach = 1e-5;

struct IndexTriangle {
  Eigen::Vector3d corner[3];  ///< index coordinates relative to the placement's base
  Eigen::Vector3d normal;     ///< unit length
};

/// Returns true if the triangles, whose normals here have twice their areas as lengths, are wound inside out:
/// their signed volume is negative. The volume of an open mesh is that of the cone from an apex, and must be
/// negative for every apex in the mesh's box. (It is linear in the apex.) The volume of a flat sheet is
/// rounding.
bool is_inside_out(const std::vector<IndexTriangle>& triangles) {
  if (triangles.empty()) return false;
  Eigen::AlignedBox3d box;
  for (const IndexTriangle& t : triangles)
    for (const Eigen::Vector3d& p : t.corner) box.extend(p);
  const Eigen::Vector3d apex = box.center();
  double volume = 0.0, area = 0.0;  // six times, about the apex; twice
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const IndexTriangle& t : triangles) {
    volume += (t.corner[0] - apex).dot(t.normal);
    sum += t.normal;
    area += t.normal.norm();
  }
  constexpr double kNoVolume = 1e-6;  // of the area to the power of 1.5
  return volume + 0.5 * sum.cwiseAbs().dot(box.sizes()) < -kNoVolume * std::pow(area, 1.5);
}

/// An order of points and directions by their coordinates.
bool before(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::ranges::lexicographical_compare(a, b);
}

std::vector<IndexTriangle> to_index_space(const PolygonMesh& mesh, const IndexToWorld& placement) {
  const Eigen::Matrix3d inverse = placement.linear.inverse();
  const Eigen::Vector3d shift = mesh.origin - placement.origin - placement.offset;
  const std::vector<Triangle> triangles = triangulated(mesh);
  std::vector<IndexTriangle> result(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    IndexTriangle& t = result[i];
    // In double precision, relative to the base of the placement.
    for (int c = 0; c < 3; ++c) t.corner[c] = inverse * (mesh.points[triangles[i][c]].cast<double>() + shift);
    // From the first corner by coordinates, so that rounding does not depend on the order in the file.
    std::ranges::rotate(t.corner, std::ranges::min_element(t.corner, before));
    t.normal = (t.corner[1] - t.corner[0]).cross(t.corner[2] - t.corner[0]);
  }
  return result;
}

/// Makes the normals unit vectors that point outwards, which distinguishes an entry from an exit.
void direct_normals(std::vector<IndexTriangle>& triangles, bool inside_out) {
  const double turn = inside_out ? -1.0 : 1.0;
  for (IndexTriangle& t : triangles) {
    const double length = t.normal.norm();
    // A triangle without an area has a normal of 0 and is hit by no line.
    if (length > 0) t.normal /= turn * length;
  }
}

/// Distance around a block within which its triangles are gathered, in voxels: a crossing edge that no
/// polygon hits has one at about this distance, due to a sample of the wrong sign next to the surface.
constexpr double kNearby = 1.0;

/// Returns the point of a triangle nearest to p (Ericson, Real-Time Collision Detection, §5.1.5).
Eigen::Vector3d nearest_point(const IndexTriangle& triangle, const Eigen::Vector3d& p) {
  const Eigen::Vector3d &a = triangle.corner[0], &b = triangle.corner[1], &c = triangle.corner[2];
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp),
               d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  return a + ab * (vb / (va + vb + vc)) + ac * (vc / (va + vb + vc));
}

/// For each block the triangles whose box is near the edges that it owns: those of block b start at
/// list[first[b]].
struct TriangleBins {
  std::vector<std::uint64_t> first;
  std::vector<std::uint32_t> list;
};

TriangleBins bin_triangles(const std::vector<IndexTriangle>& triangles, const FloatHermite& hermite,
                           RunContext& context) {
  const auto& blocks = hermite.leaves;
  const auto& base = hermite.placement.base;
  // Blocks of crossing edges by position. The order of the map does not matter.
  std::unordered_map<BlockAt, std::uint32_t, BlockHash> index;
  index.reserve(blocks.size());
  BlockAt lowest{}, highest{};
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    BlockAt key;
    for (int a = 0; a < 3; ++a) {
      key[a] = (blocks[b].lower[a] - base[a]) >> 3;
      lowest[a] = b == 0 ? key[a] : std::min(lowest[a], key[a]);
      highest[a] = b == 0 ? key[a] : std::max(highest[a], key[a]);
    }
    index.emplace(key, static_cast<std::uint32_t>(b));
  }
  constexpr std::size_t kChunk = 4096;
  const std::size_t chunks = (triangles.size() + kChunk - 1) / kChunk;
  std::vector<std::vector<std::array<std::uint32_t, 2>>> found(chunks);
  parallel_blocks(chunks, context, [&](std::size_t chunk) {
    const std::size_t end = std::min(triangles.size(), (chunk + 1) * kChunk);
    for (std::size_t t = chunk * kChunk; t < end; ++t) {
      const auto& c = triangles[t].corner;
      BlockAt from, to;
      for (int a = 0; a < 3; ++a) {
        const double lower = std::min({c[0][a], c[1][a], c[2][a]}) - kNearby;
        const double upper = std::max({c[0][a], c[1][a], c[2][a]}) + kNearby;
        from[a] = static_cast<std::int32_t>(std::clamp(std::floor(lower / 8 - 1), -1e9, 1e9));
        to[a] = static_cast<std::int32_t>(std::clamp(std::floor(upper / 8), -1e9, 1e9));
        from[a] = std::max(from[a], lowest[a]);
        to[a] = std::min(to[a], highest[a]);
      }
      // The box of a large slanting triangle holds many blocks far from its plane: half the block and kNearby
      // along the normal.
      const double extent = triangles[t].normal.cwiseAbs().sum() * (4.0 + kNearby);
      for (int x = from[0]; x <= to[0]; ++x)
        for (int y = from[1]; y <= to[1]; ++y)
          for (int z = from[2]; z <= to[2]; ++z) {
            const Eigen::Vector3d centre = Eigen::Vector3d(x, y, z) * 8.0 + Eigen::Vector3d::Constant(4.0);
            if (std::abs(triangles[t].normal.dot(centre - c[0])) > extent) continue;
            const auto at = index.find({x, y, z});
            if (at != index.end()) found[chunk].push_back({at->second, static_cast<std::uint32_t>(t)});
          }
    }
  });
  // Count, scan, fill, by chunks in order, so that each block lists its triangles in ascending order.
  TriangleBins bins;
  bins.first.assign(blocks.size() + 1, 0);
  for (const auto& pairs : found)
    for (const auto& pair : pairs) ++bins.first[pair[0]];
  std::uint64_t total = 0;
  for (std::uint64_t& count : bins.first) total += std::exchange(count, total);
  bins.list.resize(total);
  std::vector<std::uint64_t> next = bins.first;
  for (const auto& pairs : found)
    for (const auto& pair : pairs) bins.list[next[pair[0]]++] = pair[1];
  return bins;
}

/// Selects among the hits of one leaf's crossing edges.
class LeafHits {
 public:
  /// `crossings` are the leaf's, by rank, from the level set.
  LeafHits(const SignLeaf& leaf, std::span<EdgeCrossing> crossings, const std::array<std::int32_t, 3>& base)
      : leaf_(leaf), edges_(crossing_edges(leaf)) {
    for (int a = 0; a < 3; ++a) lower_[a] = leaf.lower[a] - base[a];
    EdgeCrossing* next = crossings.data();
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(edges_[axis], [&](int sample) { crossing_[axis][sample] = next++; });
  }

  /// The edge that is intersected: between the points that define the sides of its ends, which no polygon
  /// through a sample contains; or between the samples themselves, if the signs are those of a voxelizer that
  /// does not use such points.
  enum class EdgePlace { of_sides, of_samples };

  /// Intersects one triangle with the block's edges along one axis.
  void add(const IndexTriangle& triangle, int axis, EdgePlace place) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto& c = triangle.corner;
    const auto range = [&](int a, int limit) {
      const double low = std::min({c[0][a], c[1][a], c[2][a]}) - lower_[a] - kReach;
      const double high = std::max({c[0][a], c[1][a], c[2][a]}) - lower_[a] + kReach;
      return std::array<int, 2>{static_cast<int>(std::ceil(std::clamp(low, 0.0, 100.0))),
                                static_cast<int>(std::floor(std::clamp(high, -1.0, double(limit))))};
    };
    // Lattice lines along the axis that pass through the box of the triangle.
    const auto [u0, u1] = range(u, 7);
    const auto [v0, v1] = range(v, 7);
    const double shift = place == EdgePlace::of_sides ? 1.0 : 0.0;
    const auto weights = [&](double x, double y) {
      const auto side = [&](int i, int j) {
        return (c[i][u] - x) * (c[j][v] - y) - (c[i][v] - y) * (c[j][u] - x);
      };
      return Eigen::Vector3d(side(1, 2), side(2, 0), side(0, 1));
    };
    const Eigen::Vector3d along(c[0][axis], c[1][axis], c[2][axis]);
    for (int pu = u0; pu <= u1; ++pu)
      for (int pv = v0; pv <= v1; ++pv) {
        const double x = lower_[u] + pu, y = lower_[v] + pv;
        // Barycentric weights of the line in the projection of the triangle along the axis: all of one sign
        // if it is hit.
        const Eigen::Vector3d w =
            weights(x + shift * kSideShift[std::size_t(u)], y + shift * kSideShift[std::size_t(v)]);
        const double area = w.sum();
        if (area == 0 || (w / area).minCoeff() < -kTolerance) continue;
        // The hit is tested between the points that define the sides, and located between the samples.
        const double met = w.dot(along) / area - lower_[axis] - shift * kSideShift[std::size_t(axis)];
        const double hit = weights(x, y).dot(along) / area - lower_[axis];
        offer(axis, u, v, pu, pv, met, hit, triangle.normal, place);
      }
  }

  /// Returns true if a crossing edge was hit by no polygon.
  bool misses_some() const {
    for (int axis = 0; axis < 3; ++axis) {
      bool missed = false;
      for_each_bit(edges_[axis], [&](int sample) { missed = missed || best_[axis][sample].hits == 0; });
      if (missed) return true;
    }
    return false;
  }

  /// Writes the selected hits; `nearby` are the numbers of the triangles near the block.
  void write(const std::vector<IndexTriangle>& triangles, std::span<const std::uint32_t> nearby,
             PolygonSampling& sampling) const {
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(edges_[axis], [&](int sample) {
        const Best& best = best_[axis][sample];
        if (best.hits == 0) {
          take_nearest(axis, sample, triangles, nearby) ? ++sampling.nearest : ++sampling.fallback;
          return;
        }
        ++sampling.exact;
        if (best.hits > 1) ++sampling.ambiguous;
        EdgeCrossing& crossing = *crossing_[axis][sample];
        const double turn = best.consistent ? 1.0 : -1.0;
        crossing.offset = static_cast<float>(best.offset);
        for (int a = 0; a < 3; ++a) crossing.normal[a] = static_cast<float>(turn * best.normal[a]);
      });
  }

 private:
  struct Best {
    double offset = 0.0, away = 0.0;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    bool consistent = false;
    bool of_samples = false;
    int hits = 0;  ///< at different positions
  };

  /// Sets the crossing of an edge that no polygon hits: the plane of the polygon nearest to the level set's
  /// crossing that faces the way given by the signs, intersected as near to the edge as the edge's ends
  /// allow.
  bool take_nearest(int axis, int sample, const std::vector<IndexTriangle>& triangles,
                    std::span<const std::uint32_t> nearby) const {
    EdgeCrossing& found = *crossing_[axis][sample];
    const Eigen::Vector3d start(lower_[0] + (sample >> 6), lower_[1] + ((sample >> 3) & 7),
                                lower_[2] + (sample & 7));
    Eigen::Vector3d crossing = start;
    crossing[axis] += found.offset;
    const double outwards = test(leaf_.inside, sample) ? 1.0 : -1.0;
    const IndexTriangle* nearest = nullptr;
    double least = kNearby * kNearby;
    for (const std::uint32_t t : nearby) {
      if (!(outwards * triangles[t].normal[axis] > 0)) continue;
      const double squared = (nearest_point(triangles[t], crossing) - crossing).squaredNorm();
      if (squared < least || (squared == least && nearest && before(triangles[t].normal, nearest->normal)))
        least = squared, nearest = &triangles[t];
    }
    if (!nearest) return false;
    const double met = nearest->normal.dot(nearest->corner[0] - start) / nearest->normal[axis];
    found.offset = static_cast<float>(std::clamp(met, 0.0, 1.0));
    for (int a = 0; a < 3; ++a) found.normal[a] = static_cast<float>(nearest->normal[a]);
    return true;
  }

  /// `met` is the hit for `place`, measured from the leaf's lower end; `hit` is the hit between the samples.
  void offer(int axis, int u, int v, int pu, int pv, double met, double hit, const Eigen::Vector3d& normal,
             EdgePlace place) {
    if (!(met >= -kTolerance && met <= 8.0 + kTolerance)) return;
    // A hit within the tolerance of a sample is offered to the edges on both sides.
    const int middle = static_cast<int>(std::floor(met));
    for (int k = std::max(0, middle - 1); k <= std::min(7, middle + 1); ++k) {
      if (met - k < -kTolerance || met - k > 1.0 + kTolerance) continue;
      const double offset = std::clamp(hit - k, 0.0, 1.0);
      int local[3];
      local[axis] = k, local[u] = pu, local[v] = pv;
      const int sample = sample_index(local[0], local[1], local[2]);
      if (!test(edges_[axis], sample)) continue;
      Best& best = best_[axis][sample];
      // Hits between the points that define the sides take precedence: the second pass is for edges without
      // any.
      if (place == EdgePlace::of_samples && best.hits > 0 && !best.of_samples) continue;
      const bool consistent = (normal[axis] > 0) == test(leaf_.inside, sample);
      const double away = std::abs(offset - crossing_[axis][sample]->offset);
      const bool first = best.hits == 0;
      if (first || std::abs(best.offset - offset) > kTolerance) ++best.hits;
      // A hit in the direction of the signs beats one against it; among equals the one nearer to the level
      // set's own crossing wins, and of those the first by its normal, whatever the triangles' order.
      const bool better = consistent != best.consistent ? consistent
                          : away != best.away           ? away < best.away
                                                        : before(normal, best.normal);
      if (first || better)
        best = {offset, away, normal, consistent, place == EdgePlace::of_samples, best.hits};
    }
  }

  const SignLeaf& leaf_;
  const std::array<BlockMask, 3> edges_;
  std::array<double, 3> lower_{};
  std::array<std::array<EdgeCrossing*, 512>, 3> crossing_;  ///< records of the crossing edges
  std::array<std::array<Best, 512>, 3> best_{};
};

}  // namespace

FloatHermite sample_polygons(const LevelSet& level_set, double isovalue, const PolygonMesh& mesh,
                             RunContext& context, PolygonSampling* sampling) {
  FloatHermite result = sample_level_set(level_set, isovalue, context);
  take_polygons(result, mesh, are_inside_out(mesh, result.placement), context, sampling);
  return result;
}

bool are_inside_out(const PolygonMesh& mesh, const IndexToWorld& placement) {
  return is_inside_out(to_index_space(mesh, placement));
}

void take_polygons(FloatHermite& result, const PolygonMesh& mesh, bool inside_out, RunContext& context,
                   PolygonSampling* sampling) {
  Stage stage(context, "Hermite data from the polygons");
  std::vector<IndexTriangle> triangles = to_index_space(mesh, result.placement);
  direct_normals(triangles, inside_out);
  const TriangleBins bins = bin_triangles(triangles, result, context);
  std::vector<PolygonSampling> counts(result.leaves.size());
  parallel_blocks(result.leaves.size(), context, [&](std::size_t b) {
    const std::size_t size = result.crossings_of(b).size();
    const auto hits = std::make_unique<LeafHits>(
        result.leaves[b], std::span(result.crossings).subspan(result.leaves[b].first, size),
        result.placement.base);
    const std::span<const std::uint32_t> nearby(bins.list.data() + bins.first[b],
                                                bins.first[b + 1] - bins.first[b]);
    const auto add_all = [&](LeafHits::EdgePlace place) {
      for (const std::uint32_t t : nearby)
        for (int axis = 0; axis < 3; ++axis) hits->add(triangles[t], axis, place);
    };
    add_all(LeafHits::EdgePlace::of_sides);
    if (hits->misses_some()) add_all(LeafHits::EdgePlace::of_samples);
    hits->write(triangles, nearby, counts[b]);
  });
  if (sampling) {
    *sampling = {};
    for (const PolygonSampling& c : counts) {
      sampling->exact += c.exact;
      sampling->nearest += c.nearest;
      sampling->fallback += c.fallback;
      sampling->ambiguous += c.ambiguous;
    }
  }
}

}  // namespace hermesh
