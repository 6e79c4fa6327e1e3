#include "algorithms/voxelization/inside/interior_faces.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <span>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/lattice/sample_side.h"
#include "algorithms/search/triangle_tree.h"
#include "algorithms/voxelization/inside/cell_obstacles.h"
#include "algorithms/voxelization/inside/triangle_faces.h"
#include "algorithms/voxelization/inside/winding_number.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// How far off an edge between samples its triangles are searched, in voxels: farther than the side_place()s
/// are.
constexpr double kNearby = 1e-5;
/// The most faces that all triangles may be cut into: a constant, some per sample, and some per triangle.
/// Each takes some microseconds.
constexpr std::size_t kMostFaces = 1 << 17, kFacesPerSample = 1, kFacesPerTriangle = 16;
/// How far off a face the segments to voxels start, in voxels: beyond rounding and beyond doubled faces, but
/// in a narrow face nearer than its boundary.
constexpr double kMostOff = 1e-3, kLeastOff = 1e-5;
/// A face of this size, in voxels, is searched from one point only.
constexpr double kSmallFace = 0.5;

/// The voxels around which faces may be inner.
struct Suspects {
  std::vector<BlockMask> voxels;      ///< by block
  std::vector<std::uint32_t> blocks;  ///< those with some
};

/// Finds the suspicious voxels near pieces; each thread has its own, since it keeps the block of the last
/// query.
class Suspicion {
 public:
  Suspicion(const Suspects& suspects, const Band& band, const BlockTable& blocks)
      : suspects_(suspects), band_(band), finder_(blocks) {}

  /// Returns true if a suspicious voxel is in or next to the box of these corners.
  bool touches(std::span<const Vector3d> corners) {
    Bounds box;
    for (const Vector3d& corner : corners) box.add(corner);
    const Voxel from = cell_of(box.lower), to = cell_of(box.upper);
    const auto has = [&](std::uint32_t block, const BlockAt& at) {
      return any(suspects_.voxels[block] & box_bits(at, from, to));
    };
    double blocks = 1;
    for (std::size_t a = 0; a < 3; ++a) blocks *= (to[a] >> 3) - (from[a] >> 3) + 1;
    // The box of a large triangle has more blocks than there are with suspicious voxels.
    if (blocks > static_cast<double>(suspects_.blocks.size()))
      return std::ranges::any_of(suspects_.blocks, [&](std::uint32_t b) { return has(b, band_.blocks[b]); });
    bool found = false;
    for_each_block_in(from, to, [&](const BlockAt& at) {
      if (found) return;
      const std::uint32_t block = finder_.find(at);
      found = block != BlockTable::kNone && has(block, at);
    });
    return found;
  }

 private:
  const Suspects& suspects_;
  const Band& band_;
  BlockFinder finder_;
};

/// The space next to a side of a face: the outside, only the inside, or unknown, as in a crevice too narrow
/// for a voxel.
enum class Space { outer, inner, unknown };

/// A face of a triangle.
struct Sheet {
  std::uint32_t triangle = 0;  ///< index in the list of suspicious ones
  std::uint32_t face = 0;
  Space space = Space::unknown;
  std::array<Space, 2> sides{Space::unknown, Space::unknown};  ///< along the normal, against it

  /// A face is outer if one of its sides is, and inner if both are inner.
  void conclude() {
    if (sides[0] == Space::outer || sides[1] == Space::outer)
      space = Space::outer;
    else if (sides[0] == Space::inner && sides[1] == Space::inner)
      space = Space::inner;
  }
};

/// Returns points off a point of a face on both of its sides.
std::array<Vector3d, 2> points_beside(const TriangleFace& face, const Vector3d& point,
                                      const Vector3d& normal) {
  const double off = std::clamp(0.05 * face.room_at(face.middle()), kLeastOff, kMostOff);
  return {point + off * normal, point - off * normal};
}

/// Searches the voxels that are seen from faces; each thread has its own, since it keeps the blocks of the
/// last queries.
class Prober {
 public:
  Prober(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
         const std::vector<BlockMask>& inside, const Suspects& suspects)
      : inside_(inside),
        finder_(bins.blocks()),
        obstacles_(soup, bins),
        suspicion_(suspects, band, bins.blocks()) {}

  /// Finds the spaces on the two sides of a face. All points of a whole face have the same spaces next to
  /// them, so one that sees a voxel is enough. All points of a face that is not whole have to agree that it
  /// is inner.
  void look(const TriangleFace& face, const Vector3d& normal, Sheet& sheet) {
    if (!suspicion_.touches(face.corners)) {
      sheet.space = Space::outer;
      return;
    }
    const Vector3d middle = face.middle();
    bool agree = look_from(middle, face, normal, sheet);
    if (face.whole ? face.size() > kSmallFace : agree)
      for (const Vector3d& corner : face.corners) {
        if (sheet.space == Space::outer || (!face.whole && !agree)) break;
        agree &= look_from(0.8 * corner + 0.2 * middle, face, normal, sheet);
      }
    if (!face.whole && !agree && sheet.space == Space::inner) sheet.space = Space::unknown;
  }

 private:
  /// Looks from a point of a face to both sides; returns true if the face is inner there for certain.
  bool look_from(const Vector3d& point, const TriangleFace& face, const Vector3d& normal, Sheet& sheet) {
    bool inner = true;
    const std::array<Vector3d, 2> points = points_beside(face, point, normal);
    for (std::size_t i = 0; i < 2; ++i) {
      const Space seen = seen_from(points[i]);
      if (seen != Space::unknown) sheet.sides[i] = seen;
      inner &= seen == Space::inner;
      if (seen == Space::outer) break;
    }
    sheet.conclude();
    return inner;
  }

  /// Returns the space around a point by free segments to the corners of its cell.
  Space seen_from(const Vector3d& point) {
    const Voxel cell = cell_of(point);
    Space seen = Space::unknown;
    for (int i = 0; i < 8; ++i) {
      const Voxel corner{cell[0] + (i >> 2), cell[1] + (i >> 1 & 1), cell[2] + (i & 1)};
      const std::uint32_t block = finder_.find(tile_of(corner));
      if (block == BlockTable::kNone) continue;
      const bool inside = test(inside_[block], int(place_in_tile(corner)));
      if ((inside && seen == Space::inner) || !obstacles_.is_free_in(cell, point, side_place(corner)))
        continue;
      if (!inside) return Space::outer;
      seen = Space::inner;
    }
    return seen;
  }

  const std::vector<BlockMask>& inside_;
  BlockFinder finder_;
  CellObstacles obstacles_;
  Suspicion suspicion_;
};

/// A grid edge up from a voxel, both of its ends inside, that some triangle may cross.
struct InnerEdge {
  Voxel voxel;
  int axis;
  std::vector<double> hits = {};

  /// Returns the number of sheets that cross the edge; doubled faces, and those that share the side that is
  /// hit, count once.
  int sheets() {
    std::sort(hits.begin(), hits.end());
    int count = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) count += i == 0 || hits[i] - hits[i - 1] > 1e-6 ? 1 : 0;
    return count;
  }
  Bounds box() const {
    const Vector3d low(voxel[0], voxel[1], voxel[2]);
    return {low, low + Vector3d::Unit(axis)};
  }
  /// Appends the point where a triangle intersects the edge, if it does.
  void meet(const Facet& facet) {
    const Bounds edge = box();
    if (((facet.low() - edge.upper).array() > kNearby).any() ||
        ((edge.lower - facet.high()).array() > kNearby).any())
      return;
    const Vector3d from = side_place(voxel);
    const double along = meeting(from, from + Vector3d::Unit(axis), facet);
    if (along >= 0.0) hits.push_back(along);
  }
};

/// One run of find_interior_faces(): suspicious voxels, triangles near them, their faces, and the spaces on
/// both sides of these.
class Finder {
 public:
  Finder(const IndexSoup& soup, const TriangleBins& bins, const Band& band, const Signs& signs,
         RunContext& context, const WindingNumber* winding)
      : soup_(soup),
        bins_(bins),
        band_(band),
        inside_(signs.inside),
        caps_(signs.caps),
        context_(context),
        winding_(winding) {}

  InteriorFaces run(double reach, double voxel_size) {
    find_suspects();
    triangles_ = find_triangles();
    cut_triangles();
    find_sides();
    settle_doubts();
    InteriorFaces found;
    // `sheets_` is in the order of `triangles_`. A triangle with an inner face goes out as a whole, and its
    // other faces come back as pieces.
    for (std::size_t first = 0, next; first < sheets_.size(); first = next) {
      const std::uint32_t triangle = sheets_[first].triangle;
      bool some_inner = false;
      for (next = first; next < sheets_.size() && sheets_[next].triangle == triangle; ++next)
        some_inner |= sheets_[next].space == Space::inner;
      if (!some_inner) continue;
      found.triangles.push_back(triangles_[triangle]);
      for (std::size_t k = first; k < next; ++k)
        if (sheets_[k].space != Space::inner)
          add_pieces(face(sheets_[k]), voxel_size, triangles_[triangle], found);
    }
    find_blocks(reach, found);
    return found;
  }

 private:
  // ---- Suspicious voxels.

  /// Finds the voxels near an edge between two voxels inside that sheets cross, and the blocks that have
  /// some. Two sheets are most often the walls of a gap narrower than a voxel, which do bound the solid; but
  /// interior faces near a seam look the same, so they count where a chain of such voxels leads to one with
  /// an odd number.
  void find_suspects() {
    std::vector<BlockMask> marked(band_.blocks.size(), BlockMask{}), counts = marked;
    parallel_blocks(marked.size(), context_, [&](std::size_t i) {
      std::vector<InnerEdge> edges = inner_edges(std::uint32_t(i));
      if (edges.empty()) return;
      find_hits(std::uint32_t(i), edges);
      for (InnerEdge& edge : edges) {
        const int sheets = edge.sheets();
        if (sheets > 0) set_bit(marked[i], place_in_tile(edge.voxel));
        // An odd number of sheets with the solid at both ends: one of them at least bounds nothing.
        if (sheets % 2 == 1) set_bit(counts[i], place_in_tile(edge.voxel));
      }
    });
    spread_over_neighbours(marked, counts);
    suspects_.voxels.assign(band_.blocks.size(), BlockMask{});
    constexpr std::int32_t kAway = 2;  // on every axis
    for_each_voxel(counts, [&](const Voxel& v) {
      const Voxel from{v[0] - kAway, v[1] - kAway, v[2] - kAway},
          to{v[0] + kAway, v[1] + kAway, v[2] + kAway};
      for_each_block_in(from, to, [&](const BlockAt& at) {
        const std::uint32_t block = bins_.blocks().find(at);
        if (block != BlockTable::kNone) suspects_.voxels[block] |= box_bits(at, from, to);
      });
    });
    for (std::uint32_t i = 0; i < marked.size(); ++i)
      if (any(suspects_.voxels[i])) suspects_.blocks.push_back(i);
  }

  /// Calls f(voxel) for the bits of all blocks.
  template <class F>
  void for_each_voxel(const std::vector<BlockMask>& bits, F&& f) const {
    for (std::size_t i = 0; i < bits.size(); ++i)
      for_each_bit(bits[i], [&](int v) { f(voxel_in(band_.blocks[i], v)); });
  }

  /// Sets in `counts` all marked voxels that a chain of marked neighbours joins to one that is set. The
  /// result does not depend on the order.
  void spread_over_neighbours(const std::vector<BlockMask>& marked, std::vector<BlockMask>& counts) const {
    std::vector<Voxel> stack;
    for_each_voxel(counts, [&](const Voxel& voxel) { stack.push_back(voxel); });
    BlockFinder finder(bins_.blocks());
    while (!stack.empty()) {
      const Voxel at = stack.back();
      stack.pop_back();
      for (int i = 0; i < 27; ++i) {
        const Voxel there{at[0] + i / 9 - 1, at[1] + i / 3 % 3 - 1, at[2] + i % 3 - 1};
        const std::uint32_t block = finder.find(tile_of(there));
        const unsigned place = place_in_tile(there);
        if (block == BlockTable::kNone || !test(marked[block], int(place)) || test(counts[block], int(place)))
          continue;
        set_bit(counts[block], place);
        stack.push_back(there);
      }
    }
  }

  /// Returns the block's edges between two voxels inside that the band's kernels found crossed.
  std::vector<InnerEdge> inner_edges(std::uint32_t block) const {
    std::vector<InnerEdge> edges;
    for (int axis = 0; axis < 3; ++axis) {
      const BlockMask crossed = std::to_array(band_.crossed[block].word[axis]) & inside_[block];
      if (!any(crossed)) continue;
      BlockAt above = band_.blocks[block];
      ++above[std::size_t(axis)];
      const std::uint32_t upper = bins_.blocks().find(above);
      const BlockMask inside =
          crossed &
          upper_neighbours(inside_[block], upper == BlockTable::kNone ? kAllOutside : inside_[upper], axis);
      for_each_bit(inside, [&](int v) { edges.push_back({voxel_in(band_.blocks[block], v), axis}); });
    }
    return edges;
  }

  /// Meets the edges of a block with the triangles near them.
  void find_hits(std::uint32_t block, std::vector<InnerEdge>& edges) const {
    Bounds box, near;
    for (const InnerEdge& edge : edges) box.add(edge.box());
    near = {box.lower.array() - kNearby, box.upper.array() + kNearby};
    const auto meet = [&](std::uint32_t t) {
      const Facet facet(soup_.corners(t));
      for (InnerEdge& edge : edges) edge.meet(facet);
    };
    bins_.for_each_cluster(band_.blocks[block], box, [&](const TriangleBins::Cluster& cluster) {
      if (cluster.box.overlaps(near)) std::ranges::for_each(cluster.triangles, meet);
    });
    std::ranges::for_each(bins_.large(block), meet);
  }

  // ---- Triangles and their faces.

  /// Returns all triangles that touch a suspicious voxel, ascending.
  std::vector<std::uint32_t> find_triangles() const {
    const auto keep_those_that_touch = [&](std::vector<std::uint32_t>& triangles) {
      Suspicion suspicion(suspects_, band_, bins_.blocks());
      std::erase_if(triangles,
                    [&](std::uint32_t t) { return !suspicion.touches(Facet(soup_.corners(t)).corner); });
    };
    std::vector<std::vector<std::uint32_t>> small(suspects_.blocks.size());
    parallel_blocks(small.size(), context_, [&](std::size_t i) {
      const BlockAt& at = band_.blocks[suspects_.blocks[i]];
      bins_.for_each_cluster(at, around(at, 2.0), [&](const TriangleBins::Cluster& cluster) {
        if (!cluster.box.overlaps(cells_around(at, 1.0))) return;
        small[i].insert(small[i].end(), cluster.triangles.begin(), cluster.triangles.end());
      });
      keep_those_that_touch(small[i]);
    });
    // A large triangle is listed in many blocks.
    std::vector<std::uint32_t> triangles;
    const auto sort = [&] {
      std::sort(triangles.begin(), triangles.end());
      triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
    };
    for (const std::uint32_t block : suspects_.blocks) {
      const std::span<const std::uint32_t> large = bins_.large(block);
      triangles.insert(triangles.end(), large.begin(), large.end());
    }
    sort();
    keep_those_that_touch(triangles);
    for (const auto& list : small) triangles.insert(triangles.end(), list.begin(), list.end());
    sort();
    return triangles;
  }

  /// Calls f(i) for each i below n, in parallel, and reports in between that the signs are from `done` to
  /// `to` complete.
  template <class F>
  void in_parts(std::size_t n, double done, double to, F&& f) const {
    constexpr std::size_t kParts = 16;
    for (std::size_t part = 0; part < kParts; ++part) {
      context_.progress("signs", done + (to - done) * double(part) / kParts);
      const tbb::blocked_range<std::size_t> range(n * part / kParts, n * (part + 1) / kParts);
      tbb::parallel_for(range, [&](const auto& some) {
        context_.check();
        for (std::size_t i = some.begin(); i != some.end(); ++i) f(i);
      });
    }
  }

  Facet facet(std::size_t i) const { return Facet(soup_.corners(triangles_[i])); }

  /// Cuts the triangles into faces. All triangles that cross one of them near a suspicious voxel are among
  /// them, or are caps.
  void cut_triangles() {
    std::vector<Triangle> corners;
    for (const std::uint32_t t : triangles_) corners.push_back(soup_.triangle(t));
    const TriangleTree tree(soup_.mesh().points, corners, soup_.scale());
    PolygonMesh caps;
    for (const TriangleCorners& cap : caps_) {
      const auto n = std::uint32_t(caps.points.size());
      for (const Vector3d& corner : Facet(cap).corner) caps.points.push_back(corner.cast<float>());
      caps.triangles.push_back({n, n + 1, n + 2});
    }
    const TriangleTree cap_tree(caps.points, caps.triangles, 1.0);
    double area = 0;
    for (std::size_t i = 0; i < triangles_.size(); ++i) area += facet(i).normal().norm();
    // The budget of all triangles together; it grows with the blocks that have suspicious samples.
    const double most = double(kMostFaces + kFacesPerSample * 512 * suspects_.blocks.size());
    faces_.assign(triangles_.size(), {});
    tbb::enumerable_thread_specific<Suspicion> suspicions(
        [&] { return Suspicion(suspects_, band_, bins_.blocks()); });
    in_parts(triangles_.size(), 0.4, 0.6, [&](std::size_t i) {
      const Facet own = facet(i);
      const double own_area = own.normal().norm();
      // A triangle without area bounds nothing, and has no sides; it stays.
      if (!(own_area > 0)) return;
      constexpr double kMargin = 0.01;  // more than cut_triangle()'s tolerance
      const Vector3d low = own.low().array() - kMargin, high = own.high().array() + kMargin;
      std::vector<Facet> others;
      tree.for_each_near(low, high, [&](std::uint32_t other) {
        if (other != i) others.push_back(facet(other));
      });
      cap_tree.for_each_near(low, high, [&](std::uint32_t cap) { others.emplace_back(caps_[cap]); });
      Suspicion& suspicion = suspicions.local();
      // One half to all alike, the other by area.
      const double share = 0.5 / double(triangles_.size()) + 0.5 * own_area / area;
      faces_[i] = cut_triangle(own, others, kFacesPerTriangle + std::size_t(most * share),
                               [&](const TriangleFace& face) { return suspicion.touches(face.corners); });
    });
    for (std::uint32_t i = 0; i < triangles_.size(); ++i)
      if (facet(i).normal().norm() > 0)
        for (std::uint32_t k = 0; k < std::max<std::size_t>(1, faces_[i].size()); ++k)
          sheets_.push_back({i, k});
  }

  /// Returns the face of a sheet; the whole triangle if no other crosses it.
  TriangleFace face(const Sheet& sheet) const {
    if (!faces_[sheet.triangle].empty()) return faces_[sheet.triangle][sheet.face];
    const Facet whole = facet(sheet.triangle);
    return {{whole.corner[0], whole.corner[1], whole.corner[2]}, true};
  }
  /// Returns the unit normal of the sheet's triangle, which has an area.
  Vector3d unit_normal(const Sheet& sheet) const { return facet(sheet.triangle).normal().normalized(); }

  // ---- Spaces on both sides of the faces.

  /// Orders some of the sheets, given by number, block by block, so that each neighbourhood is looked up
  /// once.
  std::vector<std::pair<BlockAt, std::uint32_t>> by_block(const std::vector<std::uint32_t>& some) const {
    std::vector<std::pair<BlockAt, std::uint32_t>> order(some.size());
    parallel_blocks(some.size(), context_, [&](std::size_t i) {
      order[i] = {tile_of(cell_of(face(sheets_[some[i]]).middle())), some[i]};
    });
    std::sort(order.begin(), order.end());
    return order;
  }

  /// Looks from every face, and notes the faces that were not cut completely.
  void find_sides() {
    std::vector<std::uint32_t> all(sheets_.size());
    std::iota(all.begin(), all.end(), 0u);
    const std::vector<std::pair<BlockAt, std::uint32_t>> order = by_block(all);
    tbb::enumerable_thread_specific<Prober> probers(
        [&] { return Prober(soup_, bins_, band_, inside_, suspects_); });
    // A call writes to its own sheet only.
    in_parts(order.size(), 0.6, 0.8, [&](std::size_t i) {
      Sheet& sheet = sheets_[order[i].second];
      probers.local().look(face(sheet), unit_normal(sheet), sheet);
    });
    std::size_t crowded = 0;
    double largest = 0;
    for (const Sheet& sheet : sheets_) {
      if (faces_[sheet.triangle].empty() || sheet.space == Space::outer) continue;
      const TriangleFace& of = faces_[sheet.triangle][sheet.face];
      if (of.whole) continue;
      ++crowded;
      largest = std::max(largest, of.size());
    }
    if (crowded == 0) return;
    char size[32];
    std::snprintf(size, sizeof size, "%.2g", largest);
    context_.note(
        "The polygons cross one another more often than there are samples to show it: " +
        std::to_string(crowded) + " parts of them, of up to " + size +
        " voxels, were not cut to the end, and distances inside are uncertain by as much near them.");
  }

  /// Decides by winding numbers about faces that see no voxel. Sheets that cross one another within a voxel
  /// enclose spaces without voxels, and only winding numbers distinguish an overlap from a gap. They are
  /// computed if interior faces are the rule and doubtful ones are the seams between them: parts of a model
  /// that overlap. If as much is doubtful as is inner, these are the folds and crevices of a scan, whose
  /// walls stay. For winding numbers take longer than all the rest of the signs; they are computed for a
  /// small model even if only a little is doubtful.
  void settle_doubts() {
    std::vector<std::uint32_t> doubtful;
    std::size_t doubtful_triangles = 0, inner_triangles = 0;
    double inner_area = 0, doubtful_area = 0;
    std::uint32_t last_doubtful = BlockTable::kNone, last_inner = BlockTable::kNone;
    for (std::uint32_t i = 0; i < sheets_.size(); ++i) {
      const Sheet& sheet = sheets_[i];
      if (sheet.space == Space::outer) continue;
      const bool inner = sheet.space == Space::inner;
      (inner ? inner_area : doubtful_area) += face(sheet).area();
      if (std::exchange(inner ? last_inner : last_doubtful, sheet.triangle) != sheet.triangle)
        ++(inner ? inner_triangles : doubtful_triangles);
      if (!inner) doubtful.push_back(i);
    }
    if (doubtful.empty() || inner_triangles == 0) return;
    constexpr std::size_t kTheRule = 4;  // inner triangles to a doubtful one, or inner area to doubtful area
    constexpr std::size_t kFew = 5000, kSmallModel = 50'000;  // a few tenths of a second
    // Nearly all large triangles have doubtful parts along the edges of parts, however little these are.
    const bool little_doubt = doubtful.size() <= kFew || inner_area >= double(kTheRule) * doubtful_area;
    const bool quick = little_doubt && soup_.size() <= kSmallModel;
    if (!quick && inner_triangles < kTheRule * doubtful_triangles) return;
    if (winding_) wind(doubtful, *winding_);
    // Faces that agree on no side have no meaningful numbers.
    else if (const OrientedWinding winding(soup_); winding.usable())
      wind(doubtful, winding.number());
  }

  /// Decides about unknown sides by winding numbers. Outside of all closed parts the number is 0, whatever
  /// their orientation.
  void wind(const std::vector<std::uint32_t>& doubtful, const WindingNumber& winding) {
    const std::vector<std::pair<BlockAt, std::uint32_t>> order = by_block(doubtful);
    constexpr std::size_t kTogether = 256;  // two points each
    std::vector<std::size_t> first;         // of those that are evaluated together, of one block
    for (std::size_t i = 0; i < order.size(); ++i)
      if (i == 0 || order[i].first != order[i - 1].first || i - first.back() == kTogether) first.push_back(i);
    first.push_back(order.size());
    in_parts(first.size() - 1, 0.8, 1.0, [&](std::size_t k) {
      std::vector<Vector3d> points;
      for (std::size_t i = first[k]; i < first[k + 1]; ++i) {
        const Sheet& sheet = sheets_[order[i].second];
        const TriangleFace of = face(sheet);
        for (const Vector3d& point : points_beside(of, of.middle(), unit_normal(sheet)))
          points.push_back(point);
      }
      // A batch is a block's share in a fixed order, so that its rounding is the same on any
      // run.
      std::vector<float> numbers(points.size());
      winding.at(points, numbers);
      for (std::size_t i = 0; i < points.size(); ++i) {
        Space& side = sheets_[order[first[k] + i / 2].second].sides[i % 2];
        if (side == Space::unknown) side = std::abs(numbers[i]) > 0.5f ? Space::inner : Space::outer;
      }
      for (std::size_t i = first[k]; i < first[k + 1]; ++i) sheets_[order[i].second].conclude();
    });
  }

  // ---- The result.

  /// Appends a face as a fan of triangles in world units.
  static void add_pieces(const TriangleFace& face, double voxel_size, std::uint32_t parent,
                         InteriorFaces& found) {
    const std::uint32_t n = std::uint32_t(found.pieces.points.size());
    for (const Vector3d& corner : face.corners)
      found.pieces.points.push_back((corner * voxel_size).cast<float>());
    for (std::uint32_t i = 2; i < face.corners.size(); ++i) {
      found.pieces.triangles.push_back({n, n + i - 1, n + i});
      found.parents.push_back(parent);
    }
  }

  /// Finds the blocks in the box of a removed triangle, grown by the reach.
  void find_blocks(double reach, InteriorFaces& found) const {
    std::vector<char> near(band_.blocks.size(), 0);
    BlockFinder finder(bins_.blocks());
    for (const std::uint32_t t : found.triangles) {
      const Facet removed(soup_.corners(t));
      for_each_block_in(cell_of(removed.low().array() - reach), cell_of(removed.high().array() + reach),
                        [&](const BlockAt& at) {
                          if (const std::uint32_t i = finder.find(at); i != BlockTable::kNone) near[i] = 1;
                        });
    }
    for (std::uint32_t i = 0; i < near.size(); ++i)
      if (near[i]) found.blocks.push_back(i);
  }

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  const Band& band_;
  const std::vector<BlockMask>& inside_;
  const std::vector<TriangleCorners>& caps_;
  RunContext& context_;
  const WindingNumber* const winding_;
  Suspects suspects_;
  std::vector<std::uint32_t> triangles_;          ///< those that touch suspicious voxels, by number
  std::vector<std::vector<TriangleFace>> faces_;  ///< of each; none if no other crosses it
  std::vector<Sheet> sheets_;                     ///< triangle by triangle
};

}  // namespace

InteriorFaces find_interior_faces(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
                                  const Signs& signs, double reach, double voxel_size, RunContext& context,
                                  const WindingNumber* winding) {
  return Finder(soup, bins, band, signs, context, winding).run(reach, voxel_size);
}

}  // namespace hermesh
