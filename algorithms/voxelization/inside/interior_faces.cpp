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
#include "algorithms/voxelization/distance/segment.h"
#include "algorithms/voxelization/inside/box_bits.h"
#include "algorithms/voxelization/inside/oriented_winding.h"
#include "algorithms/voxelization/inside/sheet_prober.h"
#include "algorithms/voxelization/inside/triangle_faces.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// How far off an edge between samples its triangles are looked for, in voxels: farther than the places of
/// their sides are.
constexpr double kNearby = 1e-5;
/// The most faces that all triangles may be cut into: a constant, some a sample, and some a triangle. What
/// they take is some microseconds each.
constexpr std::size_t kMostFaces = 1 << 17, kFacesPerSample = 1, kFacesPerTriangle = 16;

/// One run of find_interior_faces(): suspicious places, triangles there, their faces, and what is on both
/// sides of these.
class Finder {
 public:
  Finder(const IndexSoup& soup, const TriangleBins& bins, const Band& band, const Signs& signs,
         RunContext& context)
      : soup_(soup), bins_(bins), band_(band), inside_(signs.inside), caps_(signs.caps), context_(context) {}

  InteriorFaces run(double reach, double voxel_size) {
    find_suspects();
    triangles_ = find_triangles();
    cut_triangles();
    find_sides();
    settle_doubts();
    InteriorFaces sheets;
    // `sheets_` is in the order of `triangles_`. A triangle with one inner face goes out as a whole, and
    // those of its faces that stay come back as pieces.
    std::size_t next = 0;
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      const std::size_t first = next;
      bool some_inner = false;
      for (; next < sheets_.size() && sheets_[next].triangle == i; ++next)
        some_inner |= sheets_[next].side == Side::inner;
      if (!some_inner) continue;
      sheets.triangles.push_back(triangles_[i]);
      for (std::size_t k = first; k < next; ++k)
        if (sheets_[k].side != Side::inner) add_pieces(face(sheets_[k]), voxel_size, triangles_[i], sheets);
    }
    find_blocks(reach, sheets);
    return sheets;
  }

 private:
  /// Finds the voxels near an edge between two voxels inside that sheets cross, and the blocks that have
  /// some. Where the sheets are two, they are most often the walls of a gap narrower than a voxel, which do
  /// bound the solid; but interior faces near a seam look the same, so they count where a chain of such
  /// voxels leads to one with an odd number.
  void find_suspects() {
    std::vector<BlockMask> marked(band_.blocks.size(), BlockMask{}), counts = marked;
    parallel_blocks(marked.size(), context_, [&](std::size_t i) {
      std::vector<InnerEdge> edges = inner_edges(std::uint32_t(i));
      if (edges.empty()) return;
      find_hits(std::uint32_t(i), edges);
      for (InnerEdge& edge : edges) {
        const unsigned place = place_in_tile(edge.voxel);
        const int sheets = edge.sheets();
        const std::uint64_t bit = std::uint64_t(1) << (place & 63);
        if (sheets > 0) marked[i][place >> 6] |= bit;
        // An odd number of sheets with the solid at both ends: one of them at least bounds nothing.
        if (sheets % 2 == 1) counts[i][place >> 6] |= bit;
      }
    });
    spread_over_neighbours(marked, counts);
    suspects_.voxels.assign(band_.blocks.size(), BlockMask{});
    for (std::uint32_t i = 0; i < marked.size(); ++i)
      for_each_voxel(counts, i, [&](const Voxel& voxel) { suspect_around(voxel); });
    for (std::uint32_t i = 0; i < marked.size(); ++i)
      if (suspects_.voxels[i] != BlockMask{}) suspects_.blocks.push_back(i);
  }

  /// Calls f(voxel) for the bits of a block.
  template <class F>
  void for_each_voxel(const std::vector<BlockMask>& bits_of, std::uint32_t block, F&& f) const {
    const BlockAt& at = band_.blocks[block];
    for (std::int32_t x = 0; x < 8; ++x)
      for (std::uint64_t bits = bits_of[block][std::size_t(x)]; bits; bits &= bits - 1) {
        const int place = __builtin_ctzll(bits);
        f(Voxel{at[0] * 8 + x, at[1] * 8 + place / 8, at[2] * 8 + place % 8});
      }
  }

  /// Lets all voxels count that have a mark and that a chain of neighbours with marks joins to one that
  /// counts. What is reached does not depend on the order.
  void spread_over_neighbours(const std::vector<BlockMask>& marked, std::vector<BlockMask>& counts) const {
    std::vector<Voxel> stack;
    for (std::uint32_t i = 0; i < counts.size(); ++i)
      for_each_voxel(counts, i, [&](const Voxel& voxel) { stack.push_back(voxel); });
    BlockFinder finder(bins_.blocks());
    while (!stack.empty()) {
      const Voxel at = stack.back();
      stack.pop_back();
      for (std::int32_t x = -1; x <= 1; ++x)
        for (std::int32_t y = -1; y <= 1; ++y)
          for (std::int32_t z = -1; z <= 1; ++z) {
            const Voxel there = {at[0] + x, at[1] + y, at[2] + z};
            const std::uint32_t block = finder.find(tile_of(there));
            if (block == BlockTable::kNone) continue;
            const unsigned place = place_in_tile(there);
            const std::uint64_t bit = std::uint64_t(1) << (place & 63);
            if (!(marked[block][place >> 6] & bit) || (counts[block][place >> 6] & bit)) continue;
            counts[block][place >> 6] |= bit;
            stack.push_back(there);
          }
    }
  }

  /// Marks the voxels at most two away on every axis.
  void suspect_around(const Voxel& voxel) {
    constexpr std::int32_t kAway = 2;
    Voxel from, to;
    BlockAt low, high;
    for (std::size_t a = 0; a < 3; ++a) {
      from[a] = voxel[a] - kAway, low[a] = from[a] >> 3;
      to[a] = voxel[a] + kAway, high[a] = to[a] >> 3;
    }
    for (std::int32_t x = low[0]; x <= high[0]; ++x)
      for (std::int32_t y = low[1]; y <= high[1]; ++y)
        for (std::int32_t z = low[2]; z <= high[2]; ++z) {
          const std::uint32_t block = bins_.blocks().find({x, y, z});
          if (block == BlockTable::kNone) continue;
          const BlockMask bits = box_bits({x, y, z}, from, to);
          for (std::size_t i = 0; i < 8; ++i) suspects_.voxels[block][i] |= bits[i];
        }
  }

  /// A grid edge up from a voxel, both of its ends inside, that some triangle may cross.
  struct InnerEdge {
    Voxel voxel;
    int axis;
    std::vector<double> hits;

    /// How many sheets cross the edge; doubled faces, and those that share the side that is hit, count once.
    int sheets() {
      std::sort(hits.begin(), hits.end());
      int count = 0;
      for (std::size_t i = 0; i < hits.size(); ++i) count += i == 0 || hits[i] - hits[i - 1] > 1e-6 ? 1 : 0;
      return count;
    }
    /// Notes where a triangle meets the edge, if it does.
    void meet(const Facet& facet) {
      for (int a = 0; a < 3; ++a) {
        const auto [low, high] = std::minmax({facet.corner[0][a], facet.corner[1][a], facet.corner[2][a]});
        const double from = voxel[std::size_t(a)];
        if (low > from + (a == axis ? 1.0 : 0.0) + kNearby || high < from - kNearby) return;
      }
      const Vector3d from = side_place(voxel);
      const double along = meeting(from, from + Vector3d::Unit(axis), facet);
      if (along >= 0.0) hits.push_back(along);
    }
  };

  /// Meets the edges of a block with the triangles near them; the box of the edges keeps most clusters away.
  void find_hits(std::uint32_t block, std::vector<InnerEdge>& edges) const {
    Bounds box;
    for (std::size_t a = 0; a < 3; ++a) {
      box.lower[a] = box.upper[a] = edges[0].voxel[a];
      for (const InnerEdge& edge : edges) {
        box.lower[a] = std::min(box.lower[a], double(edge.voxel[a]));
        box.upper[a] = std::max(box.upper[a], double(edge.voxel[a]) + (edge.axis == int(a) ? 1.0 : 0.0));
      }
    }
    const auto meet = [&](std::uint32_t t) {
      const Facet facet(soup_.corners(t));
      for (InnerEdge& edge : edges) edge.meet(facet);
    };
    bins_.for_each_cluster(band_.blocks[block], box, [&](const TriangleBins::Cluster& cluster) {
      for (std::size_t a = 0; a < 3; ++a)
        if (cluster.box.lower[a] > box.upper[a] + kNearby || cluster.box.upper[a] < box.lower[a] - kNearby)
          return;
      for (const std::uint32_t t : cluster.triangles) meet(t);
    });
    for (const std::uint32_t t : bins_.large(block)) meet(t);
  }

  /// The block's edges between two voxels inside that the band's kernels found crossed.
  std::vector<InnerEdge> inner_edges(std::uint32_t block) const {
    std::vector<InnerEdge> edges;
    BlockFinder finder(bins_.blocks());
    const BlockAt& at = band_.blocks[block];
    for (int axis = 0; axis < 3; ++axis) {
      const BlockMask lower = inner_edges(block, axis, finder);
      for (std::size_t x = 0; x < 8; ++x)
        for (std::uint64_t bits = lower[x]; bits; bits &= bits - 1) {
          const int place = __builtin_ctzll(bits);
          edges.push_back(
              {{at[0] * 8 + std::int32_t(x), at[1] * 8 + place / 8, at[2] * 8 + place % 8}, axis, {}});
        }
    }
    return edges;
  }

  /// Bits of the voxels inside whose upper neighbour on the axis is inside, too, with a triangle between.
  BlockMask inner_edges(std::uint32_t block, int axis, BlockFinder& finder) const {
    BlockMask edges{};
    std::uint64_t any = 0;
    for (std::size_t x = 0; x < 8; ++x)
      any |= edges[x] = band_.crossed[block].word[axis][x] & inside_[block][x];
    if (!any) return edges;
    BlockAt above = band_.blocks[block];
    ++above[std::size_t(axis)];
    const std::uint32_t upper = finder.find(above);
    const BlockMask differs =
        differs_from_upper(inside_[block], upper == BlockTable::kNone ? BlockMask{} : inside_[upper], axis);
    for (std::size_t x = 0; x < 8; ++x) edges[x] &= ~differs[x];
    return edges;
  }

  /// Finds all triangles that touch a suspicious voxel, ascending.
  std::vector<std::uint32_t> find_triangles() const {
    std::vector<std::vector<std::uint32_t>> small(suspects_.blocks.size());
    const auto keep_those_that_touch = [&](std::vector<std::uint32_t>& triangles) {
      Suspicion suspicion(suspects_, band_, bins_.blocks());
      std::erase_if(triangles,
                    [&](std::uint32_t t) { return !suspicion.touches(Facet(soup_.corners(t)).corner); });
    };
    parallel_blocks(small.size(), context_, [&](std::size_t i) {
      add_small_triangles(suspects_.blocks[i], small[i]);
      keep_those_that_touch(small[i]);
    });
    // A large triangle is under many blocks.
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

  /// Adds the small triangles near a block's suspicious voxels: those whose clusters come within a voxel of
  /// it.
  void add_small_triangles(std::uint32_t block, std::vector<std::uint32_t>& triangles) const {
    const BlockAt& at = band_.blocks[block];
    bins_.for_each_cluster(at, around(at, 2.0), [&](const TriangleBins::Cluster& cluster) {
      for (std::size_t a = 0; a < 3; ++a)
        if (cluster.box.lower[a] > at[a] * 8.0 + 9.0 || cluster.box.upper[a] < at[a] * 8.0 - 1.0) return;
      triangles.insert(triangles.end(), cluster.triangles.begin(), cluster.triangles.end());
    });
  }

  /// Calls f(i) for each i below n, in parallel, and reports between parts of them how far from `done` to
  /// `to` the signs are.
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

  /// Cuts the triangles into faces. All that crosses one of them near a suspicious voxel is one of them, or a
  /// cap.
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
    for (const std::uint32_t t : triangles_) area += Facet(soup_.corners(t)).normal().norm();
    // The budget of all triangles together; it grows with the blocks that have suspicious samples.
    const double most = double(kMostFaces + kFacesPerSample * 512 * suspects_.blocks.size());
    faces_.assign(triangles_.size(), {});
    tbb::enumerable_thread_specific<Suspicion> suspicions(
        [&] { return Suspicion(suspects_, band_, bins_.blocks()); });
    in_parts(triangles_.size(), 0.4, 0.6, [&](std::size_t i) {
      const Facet facet(soup_.corners(triangles_[i]));
      const double own_area = facet.normal().norm();
      // A triangle without area bounds nothing, and has no sides to look from; it stays.
      if (!(own_area > 0)) return;
      constexpr double kMargin = 0.01;  // beyond what is near enough to part the space next to it
      TriangleCutter cutter(facet);
      const Vector3d low = facet.low().array() - kMargin, high = facet.high().array() + kMargin;
      tree.for_each_near(low, high, [&](std::uint32_t other) {
        if (other != i) cutter.add(Facet(soup_.corners(triangles_[other])));
      });
      cap_tree.for_each_near(low, high, [&](std::uint32_t cap) { cutter.add(Facet(caps_[cap])); });
      if (!cutter.has_cuts()) return;
      Suspicion& suspicion = suspicions.local();
      // One half to all alike, the other by area.
      const double share = 0.5 / double(triangles_.size()) + 0.5 * own_area / area;
      faces_[i] = cutter.faces(kFacesPerTriangle + std::size_t(most * share),
                               [&](const TriangleFace& face) { return suspicion.touches(face.corners); });
    });
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      if (!(Facet(soup_.corners(triangles_[i])).normal().norm() > 0)) continue;
      const std::size_t n = std::max<std::size_t>(1, faces_[i].size());
      for (std::uint32_t k = 0; k < n; ++k) sheets_.push_back({i, k, Side::unknown});
    }
  }

  /// The face of a sheet; the whole triangle where nothing crosses it.
  TriangleFace face(const TriangleSheet& sheet) const {
    if (!faces_[sheet.triangle].empty()) return faces_[sheet.triangle][sheet.face];
    const Facet facet(soup_.corners(triangles_[sheet.triangle]));
    return {{facet.corner[0], facet.corner[1], facet.corner[2]}, true};
  }
  /// Unit normal of the sheet's triangle, which has an area.
  Vector3d unit_normal(const TriangleSheet& sheet) const {
    return Facet(soup_.corners(triangles_[sheet.triangle])).normal().normalized();
  }

  /// Orders some of the sheets, given by number, block by block, so that a neighbourhood is looked up once.
  std::vector<std::pair<BlockAt, std::uint32_t>> by_block(const std::vector<std::uint32_t>& some) const {
    std::vector<std::pair<BlockAt, std::uint32_t>> order(some.size());
    parallel_blocks(some.size(), context_, [&](std::size_t i) {
      const Vector3d middle = face(sheets_[some[i]]).middle();
      for (int a = 0; a < 3; ++a) order[i].first[std::size_t(a)] = std::int32_t(std::floor(middle[a])) >> 3;
      order[i].second = some[i];
    });
    std::sort(order.begin(), order.end());
    return order;
  }

  /// Calls f(sheet, prober) for some of the sheets in parallel. A call writes to its own sheet alone.
  template <class F>
  void for_each_sheet(const std::vector<std::uint32_t>& some, double done, double to, F&& f) {
    const std::vector<std::pair<BlockAt, std::uint32_t>> order = by_block(some);
    tbb::enumerable_thread_specific<Prober> probers(
        [&] { return Prober(soup_, bins_, band_, inside_, suspects_); });
    in_parts(order.size(), done, to, [&](std::size_t i) { f(sheets_[order[i].second], probers.local()); });
  }

  /// Looks from every face, and notes what could not be cut to the end.
  void find_sides() {
    std::vector<std::uint32_t> all(sheets_.size());
    std::iota(all.begin(), all.end(), 0u);
    for_each_sheet(all, 0.6, 0.8, [&](TriangleSheet& sheet, Prober& prober) {
      prober.look(face(sheet), unit_normal(sheet), sheet);
    });
    std::size_t crowded = 0;
    double largest = 0;
    for (const TriangleSheet& sheet : sheets_) {
      if (faces_[sheet.triangle].empty() || faces_[sheet.triangle][sheet.face].whole) continue;
      if (sheet.side == Side::outer) continue;
      ++crowded;
      largest = std::max(largest, faces_[sheet.triangle][sheet.face].size());
    }
    if (crowded > 0) note_crowded(crowded, largest);
  }

  /// Leaves a note about the faces that were not cut to the end.
  void note_crowded(std::size_t faces, double largest) {
    char size[32];
    std::snprintf(size, sizeof size, "%.2g", largest);
    context_.note(
        "The polygons cross one another more often than there are samples to show it: " +
        std::to_string(faces) + " parts of them, of up to " + size +
        " voxels, were not cut to the end, and distances inside are uncertain by as much near them.");
  }

  /// Sheets that cross one another within a voxel enclose spaces that hold none, so that no way leads out of
  /// them, and only winding numbers tell an overlap from a gap. They are asked where interior faces are the
  /// rule, and what is doubtful are the seams between them: parts of a model that overlap. Where as much is
  /// doubtful as is inner, these are the folds and crevices of a scan, of which nothing goes far; their walls
  /// stay. For winding numbers and the search for ways along a crevice take longer than all the rest of the
  /// signs; of a small model they are asked as well where little is doubtful.
  void settle_doubts() {
    std::vector<std::uint32_t> doubtful;
    std::size_t doubtful_triangles = 0, inner_triangles = 0;
    double inner_area = 0, doubtful_area = 0;
    std::uint32_t last_doubtful = BlockTable::kNone, last_inner = BlockTable::kNone;
    for (std::uint32_t i = 0; i < sheets_.size(); ++i) {
      const TriangleSheet& sheet = sheets_[i];
      if (sheet.side == Side::outer) continue;
      const bool inner = sheet.side == Side::inner;
      (inner ? inner_area : doubtful_area) += face(sheet).area();
      if (std::exchange(inner ? last_inner : last_doubtful, sheet.triangle) != sheet.triangle)
        ++(inner ? inner_triangles : doubtful_triangles);
      if (!inner) doubtful.push_back(i);
    }
    if (doubtful.empty() || inner_triangles == 0) return;
    constexpr std::size_t kTheRule = 4;  // inner triangles to a doubtful one, or inner area to doubtful area
    constexpr std::size_t kFew = 5000, kSmallModel = 50'000;  // some tenths of a second
    // Of large triangles nearly all have doubtful places, along the edges of parts, however little these are.
    const bool little_doubt = doubtful.size() <= kFew || inner_area >= double(kTheRule) * doubtful_area;
    const bool quick = little_doubt && soup_.size() <= kSmallModel;
    if (!quick && inner_triangles < kTheRule * doubtful_triangles) return;
    const OrientedWinding winding(soup_);
    // Faces that agree on no side have no numbers that tell.
    if (!winding.usable()) return;
    if (doubtful.size() <= kFew)
      for_each_sheet(doubtful, 0.8, 0.9, [&](TriangleSheet& sheet, Prober& prober) {
        prober.follow_spaces(face(sheet), unit_normal(sheet), sheet);
      });
    wind(doubtful, winding.number());
  }

  /// Asks the winding numbers about sides of which nothing is known. Outside of all that is closed the number
  /// is 0, whatever the orientation of each part.
  void wind(const std::vector<std::uint32_t>& doubtful, const WindingNumber& winding) {
    const std::vector<std::pair<BlockAt, std::uint32_t>> order = by_block(doubtful);
    constexpr std::size_t kTogether = 256;  // two places each
    std::vector<std::size_t> first;         // of those that are asked together, of one block
    for (std::size_t i = 0; i < order.size(); ++i)
      if (i == 0 || order[i].first != order[i - 1].first || i - first.back() == kTogether) first.push_back(i);
    first.push_back(order.size());
    in_parts(first.size() - 1, 0.9, 1.0, [&](std::size_t k) {
      std::vector<Vector3d> places;
      for (std::size_t i = first[k]; i < first[k + 1]; ++i) {
        const TriangleSheet& sheet = sheets_[order[i].second];
        const TriangleFace of = face(sheet);
        for (const Vector3d& place : places_beside(of, of.middle(), unit_normal(sheet)))
          places.push_back(place);
      }
      // A batch is a block's share in a fixed order, so that its single precision errs in the same way on any
      // run.
      std::vector<float> numbers(places.size());
      winding.at(places, numbers);
      for (std::size_t i = 0; i < places.size(); ++i) {
        Side& side = sheets_[order[first[k] + i / 2].second].sides[i % 2];
        if (side == Side::unknown) side = std::abs(numbers[i]) > 0.5f ? Side::inner : Side::outer;
      }
      for (std::size_t i = first[k]; i < first[k + 1]; ++i) sheets_[order[i].second].conclude();
    });
  }

  /// Adds a face as a fan of triangles in world units.
  static void add_pieces(const TriangleFace& face, double voxel_size, std::uint32_t parent,
                         InteriorFaces& sheets) {
    const std::uint32_t n = std::uint32_t(sheets.pieces.points.size());
    for (const Vector3d& corner : face.corners)
      sheets.pieces.points.push_back((corner * voxel_size).cast<float>());
    for (std::uint32_t i = 2; i < face.corners.size(); ++i) {
      sheets.pieces.triangles.push_back({n, n + i - 1, n + i});
      sheets.parents.push_back(parent);
    }
  }

  /// Finds the blocks whose distances a left out triangle may have touched: those in its box, grown by the
  /// reach.
  void find_blocks(double reach, InteriorFaces& sheets) const {
    std::vector<char> near(band_.blocks.size(), 0);
    BlockFinder finder(bins_.blocks());
    for (const std::uint32_t t : sheets.triangles) {
      const Facet facet(soup_.corners(t));
      std::int32_t from[3], to[3];
      for (int a = 0; a < 3; ++a) {
        from[a] = std::int32_t(std::floor(facet.low()[a] - reach)) >> 3;
        to[a] = std::int32_t(std::floor(facet.high()[a] + reach)) >> 3;
      }
      for (std::int32_t x = from[0]; x <= to[0]; ++x)
        for (std::int32_t y = from[1]; y <= to[1]; ++y)
          for (std::int32_t z = from[2]; z <= to[2]; ++z)
            if (const std::uint32_t i = finder.find({x, y, z}); i != BlockTable::kNone) near[i] = 1;
    }
    for (std::uint32_t i = 0; i < near.size(); ++i)
      if (near[i]) sheets.blocks.push_back(i);
  }

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  const Band& band_;
  const std::vector<BlockMask>& inside_;
  const std::vector<TriangleCorners>& caps_;
  RunContext& context_;
  Suspects suspects_;
  std::vector<std::uint32_t> triangles_;          ///< those that touch suspicious voxels, by number
  std::vector<std::vector<TriangleFace>> faces_;  ///< of each; none where nothing crosses it
  std::vector<TriangleSheet> sheets_;             ///< triangle by triangle
};

}  // namespace

InteriorFaces find_interior_faces(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
                                  const Signs& signs, double reach, double voxel_size, RunContext& context) {
  return Finder(soup, bins, band, signs, context).run(reach, voxel_size);
}

}  // namespace hermesh
