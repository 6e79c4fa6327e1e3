#include "algorithms/extraction/certified_octree/region_slabs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <utility>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// What slabs are widened by, in voxels: far above what single precision makes of places within a block and
/// in the file, and beyond what kUnit does.
constexpr float kSlabRounding = 1e-3f;
/// Places in a block are kept in 16 bits, in this many parts of a voxel, for there are as many as crossings.
constexpr float kUnit = 4096;

std::array<int, 3> coordinates(int cell) { return {cell >> 6, (cell >> 3) & 7, cell & 7}; }

/// Replaces a value by a better one while other threads do the same. The least or the greatest of several is
/// the same in any order.
template <class Compare>
void replace_if(float& value, float by, Compare better) {
  const std::atomic_ref<float> shared(value);
  float now = shared.load(std::memory_order_relaxed);
  while (better(by, now) && !shared.compare_exchange_weak(now, by, std::memory_order_relaxed)) {
  }
}

/// Whether no place of a convex body is farther from one of another than the tolerance: their corners tell.
bool all_within(std::span<const Vector3d> corners, std::span<const Vector3d> others, double tolerance) {
  return std::ranges::all_of(corners, [&](const Vector3d& p) {
    return std::ranges::all_of(
        others, [&](const Vector3d& q) { return (p - q).squaredNorm() <= tolerance * tolerance; });
  });
}

}  // namespace

/// The places of a box that are far enough up.
struct RegionSlabs::Part {
  Vector3d lower, upper, up;
  double least;

  /// The squared distance to the place that is found by going up, along the box's faces where these are in
  /// the way: it may be too large, for that is not always the nearest one, and so the proof may fail, but
  /// never wrongly hold.
  double squared_distance(const Vector3d& from) const {
    Vector3d place = from;
    // Each turn gets high enough or runs into a further face of the box; after three there is no way on.
    for (int turn = 0; turn < 4; ++turn) {
      const double missing = least - up.dot(place);
      if (missing <= 0) return (place - from).squaredNorm();
      Vector3d along = up;
      for (int a = 0; a < 3; ++a)
        if (up[a] > 0 ? place[a] >= upper[a] : place[a] <= lower[a]) along[a] = 0;
      const double gain = along.squaredNorm();
      if (gain == 0) break;
      place = (place + (missing / gain + 1e-9) * along).cwiseMax(lower).cwiseMin(upper);
    }
    return std::numeric_limits<double>::max();
  }
};

/// The corners of what a slab has of a box, which is a convex body: corners of the box within the slab, and
/// where its edges pass the slab's planes.
struct RegionSlabs::Corners {
  Corners(const BoundsOf<int>& box, const Vector3d& up, const Slab& slab) {
    for (int c = 0; c < 8; ++c) {
      const std::array<int, 3> at = corner_offset(c);
      Vector3d place;
      for (int a = 0; a < 3; ++a) place[a] = at[static_cast<std::size_t>(a)] ? box.upper[a] : box.lower[a];
      const double height = up.dot(place);
      if (height >= double(slab.low) && height <= double(slab.high)) places[count++] = place;
      for (int a = 0; a < 3; ++a) {
        if (at[static_cast<std::size_t>(a)]) continue;
        for (const float plane : {slab.low, slab.high}) {
          const double by = (double(plane) - height) / up[a];
          if (by >= 0 && by <= box.upper[a] - box.lower[a]) places[count++] = place + by * Vector3d::Unit(a);
        }
      }
    }
  }
  std::span<const Vector3d> all() const { return std::span(places).first(count); }

  std::array<Vector3d, 32> places;
  std::size_t count = 0;
};

RegionSlabs::RegionSlabs(const CellRegions& regions, const UniformPoints* points, RunContext& context)
    : regions_(regions), cells_(regions.cells()), bins_(cells_.size()), first_(cells_.size()) {
  Stage stage(context, "list crossings");
  // Count, scan, fill; within a block places are sorted by cubes of 2³ samples, by counting.
  std::vector<std::uint64_t> first(cells_.size());
  for (std::size_t b = 0; b < first.size(); ++b) {
    const auto block = static_cast<std::int32_t>(b);
    for (const BlockMask& crossing : cells_.source(block).crossing)
      first[b] += static_cast<std::uint64_t>(count(crossing));
    if (points) first[b] += cells_.points_in(block);
  }
  places_.resize(exclusive_scan(first, "edge crossings"));
  parallel_blocks(cells_.size(), context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    first_[b] = static_cast<std::uint32_t>(first[b]);
    // A cell has four points at most.
    constexpr std::size_t kMost = 3 * 512 + 4 * 512;
    std::array<EdgeCrossing, 3 * 512> crossings;
    std::array<Place, kMost> places;
    std::array<std::uint8_t, kMost> bin;
    std::array<std::uint16_t, 65> next{};
    std::size_t found = 0;
    const auto add = [&](int cell, const Vector3f& place) {
      const auto [x, y, z] = coordinates(cell);
      bin[found] = static_cast<std::uint8_t>((x >> 1) << 4 | (y >> 1) << 2 | z >> 1);
      ++next[bin[found] + 1u];
      for (std::size_t a = 0; a < 3; ++a)
        places[found][a] = static_cast<std::uint16_t>(place[static_cast<int>(a)] * kUnit + 0.5f);
      ++found;
    };
    cells_.grid().crossings(block, crossings.data());
    const EdgeCrossing* crossing = crossings.data();
    const auto margin = static_cast<float>(cells_.margin());
    cells_.for_each_crossing_edge(block, [&](const CellBlocks::Edge& edge) {
      const auto [x, y, z] = coordinates(edge.sample);
      Vector3f place(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
      // Where the uniform mesh has it (CellBlocks::crossing_point()).
      place[edge.axis] += std::clamp((crossing++)->offset, margin, 1 - margin);
      add(edge.sample, place);
    });
    if (points) {
      const Vector3d corner = cells_.corner(block, 0);
      for_each_bit(cells_[block].active, [&](int cell) {
        for (int sheet = 0; sheet < cells_.point_count(block, cell); ++sheet)
          add(cell, ((*points)[cells_.point(block, cell, sheet)] - corner).cast<float>());
      });
    }
    // Sums: where each bin begins. Then each place goes to the next free one of its bin.
    for (std::size_t i = 0; i < 64; ++i) next[i + 1] = static_cast<std::uint16_t>(next[i + 1] + next[i]);
    bins_[b] = next;
    for (std::size_t i = 0; i < found; ++i) places_[first_[b] + next[bin[i]]++] = places[i];
  });
}

void RegionSlabs::make_room() { slabs_.resize(regions_.cube_count()); }

/// Calls f(place), in the block's coordinates, for the crossings and points in a box, its faces included. The
/// box may reach eight samples below the block and, less its faces, as many above.
template <class F>
void RegionSlabs::for_each_near(std::int32_t block, const BoundsOf<int>& box, F&& f) const {
  const auto& neighbours = cells_.source(block).neighbours;
  float lower[3], upper[3];
  int step[3], from[3], to[3];
  for (int a = 0; a < 3; ++a) {
    lower[a] = static_cast<float>(box.lower[a]);
    upper[a] = static_cast<float>(box.upper[a]);
    from[a] = box.lower[a] >> 3;
    to[a] = box.upper[a] >> 3;
  }
  for (step[0] = from[0]; step[0] <= to[0]; ++step[0])
    for (step[1] = from[1]; step[1] <= to[1]; ++step[1])
      for (step[2] = from[2]; step[2] <= to[2]; ++step[2]) {
        const std::int32_t there =
            neighbours[static_cast<std::size_t>(neighbour_slot(step[0], step[1], step[2]))];
        if (there < 0) continue;
        int first[3], last[3];  // cubes of 2³ samples
        float shift[3];
        for (int a = 0; a < 3; ++a) {
          first[a] = std::max(0, box.lower[a] - 8 * step[a]) / 2;
          last[a] = std::min(7, box.upper[a] - 8 * step[a]) / 2;
          shift[a] = static_cast<float>(8 * step[a]);
        }
        const auto& bins = bins_[static_cast<std::size_t>(there)];
        const auto* const places = places_.data() + first_[static_cast<std::size_t>(there)];
        for (int x = first[0]; x <= last[0]; ++x)
          for (int y = first[1]; y <= last[1]; ++y) {
            const int row = x << 4 | y << 2;
            // Bins along z follow one another, so a row of them is one range.
            for (std::size_t i = bins[static_cast<std::size_t>(row | first[2])],
                             end = bins[static_cast<std::size_t>(row | last[2]) + 1];
                 i < end; ++i) {
              const float px = float(places[i][0]) / kUnit + shift[0],
                          py = float(places[i][1]) / kUnit + shift[1],
                          pz = float(places[i][2]) / kUnit + shift[2];
              if ((px >= lower[0]) & (px <= upper[0]) & (py >= lower[1]) & (py <= upper[1]) &
                  (pz >= lower[2]) & (pz <= upper[2]))
                f(Vector3f(px, py, pz));
            }
          }
      }
}

void RegionSlabs::begin(const Region& cube) {
  // With the cells around the cube: polygons of S within it may have corners in these.
  const std::array<int, 3> at = coordinates(cube.cell);
  BoundsOf<int> box;
  box.add({at[0] - 1, at[1] - 1, at[2] - 1});
  box.upper.array() += cube.side() + 2;
  const Vector3f up = regions_.normal(cube).cast<float>(),
                 point = (regions_.point(cube) - cells_.corner(cube.block, 0)).cast<float>();
  // From zero, so the cube's own point is in the slab.
  Slab slab{0, 0};
  for_each_near(cube.block, box, [&](const Vector3f& place) {
    const float height = up.dot(place - point);
    slab.low = std::min(slab.low, height);
    slab.high = std::max(slab.high, height);
  });
  slabs_[regions_.number(cube)] = {slab.low - kSlabRounding, slab.high + kSlabRounding};
}

/// Widens a cube's slab to contain these places.
void RegionSlabs::widen(const Region& cube, std::span<const Vector3d> places) {
  const Vector3d up = regions_.normal(cube), point = regions_.point(cube);
  double low = std::numeric_limits<double>::max(), high = -low;
  for (const Vector3d& place : places) {
    const double height = up.dot(place - point);
    low = std::min(low, height);
    high = std::max(high, height);
  }
  Slab& slab = slabs_[regions_.number(cube)];
  replace_if(slab.low, static_cast<float>(low) - kSlabRounding, std::less<>());
  replace_if(slab.high, static_cast<float>(high) + kSlabRounding, std::greater<>());
}

/// A loose polygon's corners, and the places of a fan in its envelope: the crossing and a place on each face;
/// with lattice cubes about them all.
struct RegionSlabs::Fan {
  std::array<Vector3d, 9> places;
  std::size_t count = 0;
  BoundsOf<int> box;

  std::span<const Vector3d> all() const { return std::span(places).first(count); }
};

RegionSlabs::Fan RegionSlabs::fan_of(const RegionPolygon& loose) const {
  Fan fan;
  fan.places[fan.count++] = cells_.crossing_point(loose.crossing);
  for (int i = 0; i < loose.corners; ++i) {
    fan.places[fan.count++] = loose.points[static_cast<std::size_t>(i)];
    fan.places[fan.count++] = place_on_face(cells_, loose, i);
  }
  const Vector3d corner = cells_.corner(loose.crossing.block, 0);
  for (const Vector3d& place : fan.all())
    for (int a = 0; a < 3; ++a) {
      const double at = place[a] - corner[a];
      fan.box.lower[a] = std::min(fan.box.lower[a], static_cast<int>(std::floor(at)));
      fan.box.upper[a] = std::max(fan.box.upper[a], static_cast<int>(std::ceil(at)));
    }
  return fan;
}

void RegionSlabs::add(const RegionPolygon& polygon) {
  // A loose polygon may be anywhere in its box, so all of it counts for every cube there.
  if (polygon.loose) {
    const Fan fan = fan_of(polygon);
    for_each_cube(polygon.crossing.block, fan.box, [&](const Region& cube) { widen(cube, fan.all()); });
    return;
  }
  const auto n = static_cast<std::size_t>(polygon.corners);
  // Where the segment between two corners passes the plane of a face at the edge.
  const auto pass = [&](std::size_t i, std::size_t j, int axis) -> Vector3d {
    const Vector3d &p = polygon.points[i], &q = polygon.points[j];
    return p + (polygon.start[axis] - p[axis]) / (q[axis] - p[axis]) * (q - p);
  };
  std::array<Vector3d, 4> sides, places;
  // In each region the polygon is in the hull of the region's point, where its two sides there leave, and
  // where the diagonal passes the two planes through the edge.
  for (std::size_t i = 0; i < n; ++i) sides[i] = pass(i, i + 1 < n ? i + 1 : 0, polygon.across[i]);
  std::size_t count = 2;
  if (n == 4)
    for (const int step : {1, 2}) {
      const auto d = static_cast<std::size_t>(polygon.diagonal);
      places[count++] = pass(d, d + 2, (polygon.axis() + step) % 3);
    }
  for (std::size_t i = 0; i < n; ++i) {
    if (!polygon.regions[i].merged()) continue;
    places[0] = sides[i];
    places[1] = sides[i > 0 ? i - 1 : n - 1];
    widen(polygon.regions[i], std::span(places).first(count));
  }
}

/// Calls f(Region) for the cubes that share places with a box.
template <class F>
void RegionSlabs::for_each_cube(std::int32_t block, const BoundsOf<int>& box, F&& f) const {
  const auto& neighbours = cells_.source(block).neighbours;
  int step[3];
  for (step[0] = box.lower[0] >> 3; step[0] <= (box.upper[0] - 1) >> 3; ++step[0])
    for (step[1] = box.lower[1] >> 3; step[1] <= (box.upper[1] - 1) >> 3; ++step[1])
      for (step[2] = box.lower[2] >> 3; step[2] <= (box.upper[2] - 1) >> 3; ++step[2]) {
        const std::int32_t there =
            neighbours[static_cast<std::size_t>(neighbour_slot(step[0], step[1], step[2]))];
        if (there < 0) continue;
        int first[3], end[3];
        for (int a = 0; a < 3; ++a) {
          first[a] = std::max(0, box.lower[a] - 8 * step[a]);
          end[a] = std::min(8, box.upper[a] - 8 * step[a]);
        }
        const std::uint64_t row = ((std::uint64_t{1} << end[2]) - (std::uint64_t{1} << first[2]));
        std::uint64_t rows = 0;
        for (int y = first[1]; y < end[1]; ++y) rows |= row << (8 * y);
        // Each cube once: its cells are taken out when it is found.
        const BlockMask& merged = regions_.merged(there);
        BlockMask left{};
        for (auto x = static_cast<std::size_t>(first[0]); x < static_cast<std::size_t>(end[0]); ++x)
          left[x] = rows & merged[x];
        for (int x = first[0]; x < end[0]; ++x)
          while (left[static_cast<std::size_t>(x)] != 0) {
            const Region cube =
                regions_.at(there, 64 * x + std::countr_zero(left[static_cast<std::size_t>(x)]));
            f(cube);
            const std::uint64_t cells = rows_of(cube.cell, cube.side(), 0, 0);
            for (int k = 0; k < cube.side(); ++k)
              left[static_cast<std::size_t>((cube.cell >> 6) + k)] &= ~cells;
          }
      }
}

bool RegionSlabs::holds(const RegionPolygon& loose) const {
  const Fan fan = fan_of(loose);
  const std::int32_t block = loose.crossing.block;
  const auto n = static_cast<std::size_t>(loose.corners);
  const auto& p = loose.points;
  const Vector3d origin = cells_.corner(block, 0);
  // Up is where the outside is. The cross product of a quad's diagonals faces the side that its corners are
  // counter-clockwise from; for three corners it is taken the other way round.
  const bool turns_over = loose.outwards == (n == 4);
  const Vector3d up =
      (p[2] - p[0]).cross(n == 4 ? p[3] - p[1] : p[1] - p[0]).normalized() * (turns_over ? 1 : -1);
  double tolerance = std::numeric_limits<double>::max();
  std::array<Vector3d, 4> corners;
  for (std::size_t i = 0; i < n; ++i) {
    tolerance = std::min(tolerance, double(regions_.tolerance(loose.regions[i])));
    corners[i] = p[i] - origin;
  }
  const Vector3f up_here = up.cast<float>();
  int steepest;
  up.cwiseAbs().maxCoeff(&steepest);
  // Where the box ends near the polygon there is nothing above or below that, so one that is higher is tried,
  // too.
  BoundsOf<int> box = fan.box;
  for (const int more : {0, 1}) {
    box.lower[steepest] -= more;
    box.upper[steepest] += more;
    BoundsOf<int> around = box;
    for (int a = 0; a < 3; ++a)
      if (--around.lower[a] < -8 || ++around.upper[a] > 15)
        return false;  // beyond the neighbours of the block
    Slab slab{std::numeric_limits<float>::max(), -std::numeric_limits<float>::max()};
    const auto add = [&](const Vector3f& place) {
      const float height = up_here.dot(place);
      slab.low = std::min(slab.low, height);
      slab.high = std::max(slab.high, height);
    };
    for (std::size_t i = 0; i < n; ++i) add(corners[i].cast<float>());
    // Polygons of S in the box may have corners in the cells around it.
    for_each_near(block, around, add);
    slab = {slab.low - kSlabRounding, slab.high + kSlabRounding};
    const auto polygon = std::span(corners).first(n);
    if (are_near_parts(block, box, coordinates(loose.crossing.sample), up, slab, polygon, tolerance) ||
        all_within(polygon, Corners(box, up, slab).all(), tolerance))
      return true;
  }
  return false;
}

bool RegionSlabs::holds(const Region& cube) const {
  const Vector3d up = regions_.normal(cube), point = regions_.point(cube) - cells_.corner(cube.block, 0);
  const std::array<int, 3> at = coordinates(cube.cell);
  const double tolerance = double(regions_.tolerance(cube));
  // The slab is kept relative to the cube's point, where single precision is best; here it is wanted in the
  // block.
  const auto level = static_cast<float>(up.dot(point));
  const Slab& relative = slabs_[regions_.number(cube)];
  const Slab slab{relative.low + level, relative.high + level};
  BoundsOf<int> box;
  box.add({at[0], at[1], at[2]});
  box.upper.array() += cube.side();
  const Corners corners(box, up, slab);
  return are_near_parts(cube.block, box, at, up, slab, corners.all(), tolerance) ||
         all_within(corners.all(), corners.all(), tolerance);
}

/// Whether sample `to` is inside: by the crossings on the way from `from`, a sample of the block, whose bit
/// is known. The other may be where there is no block.
bool RegionSlabs::is_inside(std::int32_t block, std::array<int, 3> from, const std::array<int, 3>& to) const {
  bool inside = test(cells_.source(block).inside, sample_index(from[0], from[1], from[2]));
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    while (from[a] != to[a]) {
      if (from[a] > to[a]) --from[a];
      const CellBlocks::Cell sample = cells_.locate(block, from[0], from[1], from[2]);
      inside = inside != cells_.is_crossed({sample.block, sample.cell, axis});
      if (from[a] < to[a])
        ++from[a];
      else if (from[a] == to[a])
        break;
    }
  }
  return inside;
}

/// Whether what is above a slab in a box is outside, what is below it inside, and a convex body with these
/// corners near both: the distance to either is a convex function, so the corners tell. All is relative to
/// the block; `known` is a sample of it.
bool RegionSlabs::are_near_parts(std::int32_t block, const BoundsOf<int>& box,
                                 const std::array<int, 3>& known, const Vector3d& up, const Slab& slab,
                                 std::span<const Vector3d> corners, double tolerance) const {
  Eigen::Vector3i highest = box.upper, lowest = box.lower;
  Part above{{}, {}, up, double(slab.high)};
  double high = 0, low = 0;
  // The corners A and B of the header: farthest up and farthest down.
  for (int a = 0; a < 3; ++a) {
    if (up[a] < 0) std::swap(highest[a], lowest[a]);
    above.lower[a] = box.lower[a];
    above.upper[a] = box.upper[a];
    high += up[a] * highest[a];
    low += up[a] * lowest[a];
  }
  if (!(high > double(slab.high) && low < double(slab.low))) return false;
  const Part below{above.lower, above.upper, -up, -double(slab.low)};
  for (const Vector3d& corner : corners)
    for (const Part* part : {&std::as_const(above), &below})
      if (part->squared_distance(corner) > tolerance * tolerance) return false;
  // Last, for it walks over edges; one sample tells of all of a part, which nothing passes through.
  const auto sample = [](const Eigen::Vector3i& at) { return std::array{at[0], at[1], at[2]}; };
  return is_inside(block, known, sample(lowest)) && !is_inside(block, known, sample(highest));
}

}  // namespace hermesh
