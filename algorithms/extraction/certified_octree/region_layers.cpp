#include "algorithms/extraction/certified_octree/region_layers.h"

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

/// Added thickness of layers, in voxels: far above the rounding of single precision within a block and in the
/// file, and above that of kUnit.
constexpr float kLayerRounding = 1e-3f;
/// Positions in a block are stored in 16 bits, in this fraction of a voxel, because there are as many as
/// crossings.
constexpr float kUnit = 4096;

std::array<int, 3> coordinates(int cell) { return {cell >> 6, (cell >> 3) & 7, cell & 7}; }

/// Replaces a value by a better one, concurrently. The least or the greatest of several does not depend on
/// the order.
template <class Compare>
void replace_if(float& value, float by, Compare better) {
  const std::atomic_ref<float> shared(value);
  float now = shared.load(std::memory_order_relaxed);
  while (better(by, now) && !shared.compare_exchange_weak(now, by, std::memory_order_relaxed)) {
  }
}

/// Returns true if no two points of two convex bodies are farther apart than the tolerance; it suffices to
/// test their corners.
bool all_within(std::span<const Vector3d> corners, std::span<const Vector3d> others, double tolerance) {
  return std::ranges::all_of(corners, [&](const Vector3d& p) {
    return std::ranges::all_of(
        others, [&](const Vector3d& q) { return (p - q).squaredNorm() <= tolerance * tolerance; });
  });
}

}  // namespace

/// The points of a box that are at least at a height.
struct RegionLayers::Part {
  Vector3d lower, upper, up;
  double least;

  /// Returns the squared distance to the point found by going up, along the faces of the box where necessary.
  /// This is not always the nearest point, so the proof may fail, but never wrongly succeed.
  double squared_distance(const Vector3d& from) const {
    Vector3d place = from;
    // Each turn gets high enough or reaches another face of the box; after three faces it ends.
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

/// The corners of the convex intersection of a layer and a box: corners of the box within the layer, and
/// intersections of its edges with the layer's planes.
struct RegionLayers::Corners {
  Corners(const BoundsOf<int>& box, const Vector3d& up, const Layer& layer) {
    for (int c = 0; c < 8; ++c) {
      const std::array<int, 3> at = corner_offset(c);
      Vector3d place;
      for (int a = 0; a < 3; ++a) place[a] = at[a] ? box.upper[a] : box.lower[a];
      const double height = up.dot(place);
      if (height >= double(layer.low) && height <= double(layer.high)) places[count++] = place;
      for (int a = 0; a < 3; ++a) {
        if (at[a]) continue;
        for (const float plane : {layer.low, layer.high}) {
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

RegionLayers::RegionLayers(const CellRegions& regions, const UniformPoints* points, RunContext& context)
    : regions_(regions), cells_(regions.cells()), bins_(cells_.size()), first_(cells_.size()) {
  Stage stage(context, "list crossings");
  // Count, scan, fill. Within a block, positions are sorted by bins of 2³ samples, by counting.
  std::vector<std::uint64_t> first(cells_.size());
  for (std::size_t b = 0; b < first.size(); ++b) {
    const auto block = static_cast<std::int32_t>(b);
    for (const BlockMask& crossing : cells_.source(block).crossing) first[b] += count(crossing);
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
        places[found][a] = static_cast<std::uint16_t>(place[a] * kUnit + 0.5f);
      ++found;
    };
    cells_.grid().crossings(block, crossings.data());
    const EdgeCrossing* crossing = crossings.data();
    const auto margin = static_cast<float>(cells_.margin());
    cells_.for_each_crossing_edge(block, [&](const CellBlocks::Edge& edge) {
      const auto [x, y, z] = coordinates(edge.sample);
      Vector3f place(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
      // As in CellBlocks::crossing_point().
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
    for (std::size_t i = 0; i < 64; ++i) next[i + 1] = static_cast<std::uint16_t>(next[i + 1] + next[i]);
    bins_[b] = next;
    for (std::size_t i = 0; i < found; ++i) places_[first_[b] + next[bin[i]]++] = places[i];
  });
}

/// Calls f(block, step, first, end) for the blocks that a box touches: `step` is the offset in blocks, and
/// the box covers samples `first` to less than `end` of the block.
template <class F>
void RegionLayers::for_each_block_at(std::int32_t block, const BoundsOf<int>& box, F&& f) const {
  using Eigen::Vector3i;
  Vector3i step;
  for (step[0] = box.lower[0] >> 3; step[0] <= (box.upper[0] - 1) >> 3; ++step[0])
    for (step[1] = box.lower[1] >> 3; step[1] <= (box.upper[1] - 1) >> 3; ++step[1])
      for (step[2] = box.lower[2] >> 3; step[2] <= (box.upper[2] - 1) >> 3; ++step[2])
        if (const std::int32_t there =
                cells_.source(block).neighbours[neighbour_slot(step[0], step[1], step[2])];
            there >= 0)
          f(there, step, Vector3i((box.lower - 8 * step).cwiseMax(0)),
            Vector3i((box.upper - 8 * step).cwiseMin(8)));
}

/// Calls f(position), in the block's coordinates, for the crossings and vertices in a box, including its
/// faces. The box may extend eight samples below the block and, without its faces, as many above.
template <class F>
void RegionLayers::for_each_near(std::int32_t block, const BoundsOf<int>& box, F&& f) const {
  const Vector3f lower = box.lower.cast<float>(), upper = box.upper.cast<float>();
  BoundsOf<int> closed = box;
  closed.upper.array() += 1;
  for_each_block_at(
      block, closed, [&](std::int32_t there, const auto& step, const auto& from, const auto& end) {
        const Eigen::Vector3i first = from / 2, last = (end.array() - 1).matrix() / 2;  // bins
        const Vector3f shift = (8 * step).template cast<float>();
        const auto& bins = bins_[there];
        const auto* const places = places_.data() + first_[there];
        for (int x = first[0]; x <= last[0]; ++x)
          for (int y = first[1]; y <= last[1]; ++y) {
            const int row = x << 4 | y << 2;
            // Bins along z are consecutive, so a row of them is one range.
            for (std::size_t i = bins[row | first[2]], stop = bins[(row | last[2]) + 1]; i < stop; ++i) {
              const float px = float(places[i][0]) / kUnit + shift[0],
                          py = float(places[i][1]) / kUnit + shift[1],
                          pz = float(places[i][2]) / kUnit + shift[2];
              if ((px >= lower[0]) & (px <= upper[0]) & (py >= lower[1]) & (py <= upper[1]) &
                  (pz >= lower[2]) & (pz <= upper[2]))
                f(Vector3f(px, py, pz));
            }
          }
      });
}

void RegionLayers::begin(const Region& cube) {
  // Includes the cells around the cube, in which polygons of S within it may have corners.
  const std::array<int, 3> at = coordinates(cube.cell);
  BoundsOf<int> box;
  box.add({at[0] - 1, at[1] - 1, at[2] - 1});
  box.upper.array() += cube.side() + 2;
  const Vector3f up = regions_.normal(cube).cast<float>(),
                 point = (regions_.point(cube) - cells_.corner(cube.block, 0)).cast<float>();
  Layer layer{0, 0};  // contains the cube's vertex
  for_each_near(cube.block, box, [&](const Vector3f& place) { layer.add(up.dot(place - point)); });
  layers_[regions_.number(cube)] = {layer.low - kLayerRounding, layer.high + kLayerRounding};
}

/// Widens a cube's layer to contain these points.
void RegionLayers::widen(const Region& cube, std::span<const Vector3d> places) {
  const Vector3d up = regions_.normal(cube), point = regions_.point(cube);
  double low = std::numeric_limits<double>::max(), high = -low;
  for (const Vector3d& place : places) {
    const double height = up.dot(place - point);
    low = std::min(low, height);
    high = std::max(high, height);
  }
  Layer& layer = layers_[regions_.number(cube)];
  replace_if(layer.low, static_cast<float>(low) - kLayerRounding, std::less<>());
  replace_if(layer.high, static_cast<float>(high) + kLayerRounding, std::greater<>());
}

/// The corners of a loose polygon and of a fan in its envelope, i.e. the crossing and a point on each face,
/// and the box of lattice cells around them all.
struct RegionLayers::Fan {
  std::array<Vector3d, 9> places;
  std::size_t count = 0;
  BoundsOf<int> box;

  std::span<const Vector3d> all() const { return std::span(places).first(count); }
};

RegionLayers::Fan RegionLayers::fan_of(const RegionPolygon& loose) const {
  Fan fan;
  fan.places[fan.count++] = cells_.crossing_point(loose.crossing);
  for (int i = 0; i < loose.corners; ++i) {
    fan.places[fan.count++] = loose.points[i];
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

void RegionLayers::add(const RegionPolygon& polygon) {
  // A loose polygon may be anywhere in its box, so it counts as a whole for every cube there.
  if (polygon.loose) {
    const Fan fan = fan_of(polygon);
    for_each_cube(polygon.crossing.block, fan.box, [&](const Region& cube) { widen(cube, fan.all()); });
    return;
  }
  // In each region, the polygon is in the hull of the region's vertex, of the points where its two sides
  // leave it, and of those where the diagonal intersects the two planes through the edge.
  const int n = polygon.corners;
  std::array<Vector3d, 4> sides, places;
  for (int i = 0; i < n; ++i) sides[i] = polygon.pass(i, polygon.next(i), polygon.across[i]);
  std::size_t count = 2;
  if (n == 4)
    for (const int step : {1, 2})
      places[count++] =
          polygon.pass(polygon.diagonal, polygon.diagonal + 2, (polygon.crossing.axis + step) % 3);
  for (int i = 0; i < n; ++i) {
    if (!polygon.regions[i].merged()) continue;
    places[0] = sides[i];
    places[1] = sides[i > 0 ? i - 1 : n - 1];
    widen(polygon.regions[i], std::span(places).first(count));
  }
}

/// Calls f(Region) for the cubes that overlap a box.
template <class F>
void RegionLayers::for_each_cube(std::int32_t block, const BoundsOf<int>& box, F&& f) const {
  for_each_block_at(block, box, [&](std::int32_t there, const auto&, const auto& first, const auto& end) {
    const std::uint64_t row = (std::uint64_t{1} << end[2]) - (std::uint64_t{1} << first[2]);
    std::uint64_t rows = 0;
    for (int y = first[1]; y < end[1]; ++y) rows |= row << (8 * y);
    // Each cube once: its cells are removed when it is found.
    BlockMask left{};
    for (int x = first[0]; x < end[0]; ++x) left[x] = rows & regions_.merged(there)[x];
    for (int x = first[0]; x < end[0]; ++x)
      while (left[x] != 0) {
        const Region cube = regions_.at(there, 64 * x + std::countr_zero(left[x]));
        f(cube);
        const std::uint64_t cells = rows_of(cube.cell, cube.side(), 0, 0);
        for (int k = 0; k < cube.side(); ++k) left[(cube.cell >> 6) + k] &= ~cells;
      }
  });
}

bool RegionLayers::holds(const RegionPolygon& loose) const {
  const Fan fan = fan_of(loose);
  const std::int32_t block = loose.crossing.block;
  const auto n = static_cast<std::size_t>(loose.corners);
  const auto& p = loose.points;
  const Vector3d origin = cells_.corner(block, 0);
  // Up points outside. The cross product of a quad's diagonals faces the side from which its corners are
  // counter-clockwise; that of two sides of a triangle, as below, faces the opposite one.
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
  // A box that ends near the polygon has no part above or below it, so a higher one is tried, too.
  BoundsOf<int> box = fan.box;
  for (const int more : {0, 1}) {
    box.lower[steepest] -= more;
    box.upper[steepest] += more;
    BoundsOf<int> around = box;
    for (int a = 0; a < 3; ++a)
      if (--around.lower[a] < -8 || ++around.upper[a] > 15) return false;  // beyond the neighbouring blocks
    Layer layer{std::numeric_limits<float>::max(), -std::numeric_limits<float>::max()};
    const auto add = [&](const Vector3f& place) { layer.add(up_here.dot(place)); };
    for (std::size_t i = 0; i < n; ++i) add(corners[i].cast<float>());
    // Polygons of S in the box may have corners in the cells around it.
    for_each_near(block, around, add);
    layer = {layer.low - kLayerRounding, layer.high + kLayerRounding};
    const auto polygon = std::span(corners).first(n);
    if (are_near_parts(block, box, coordinates(loose.crossing.sample), up, layer, polygon, tolerance) ||
        all_within(polygon, Corners(box, up, layer).all(), tolerance))
      return true;
  }
  return false;
}

bool RegionLayers::holds(const Region& cube) const {
  const Vector3d up = regions_.normal(cube), point = regions_.point(cube) - cells_.corner(cube.block, 0);
  const std::array<int, 3> at = coordinates(cube.cell);
  const double tolerance = double(regions_.tolerance(cube));
  // Stored relative to the cube's vertex, where single precision is most accurate; here relative to the
  // block.
  const auto level = static_cast<float>(up.dot(point));
  const Layer& relative = layers_[regions_.number(cube)];
  const Layer layer{relative.low + level, relative.high + level};
  BoundsOf<int> box;
  box.add({at[0], at[1], at[2]});
  box.upper.array() += cube.side();
  const Corners corners(box, up, layer);
  return are_near_parts(cube.block, box, at, up, layer, corners.all(), tolerance) ||
         all_within(corners.all(), corners.all(), tolerance);
}

/// Returns true if sample `to` is inside, by the crossings on the path from `from`, a sample of the block.
/// `to` may be outside all blocks.
bool RegionLayers::is_inside(std::int32_t block, std::array<int, 3> from,
                             const std::array<int, 3>& to) const {
  bool inside = test(cells_.source(block).inside, sample_index(from[0], from[1], from[2]));
  for (int axis = 0; axis < 3; ++axis) {
    while (from[axis] != to[axis]) {
      const bool up = from[axis] < to[axis];
      if (!up) --from[axis];
      const CellBlocks::Cell sample = cells_.locate(block, from[0], from[1], from[2]);
      inside = inside != cells_.is_crossed({sample.block, sample.cell, axis});
      if (up) ++from[axis];
    }
  }
  return inside;
}

/// Returns true if the part of a box above a layer is outside, the part below it inside, and a convex body
/// with these corners near both: the distance to either is a convex function, so the corners suffice. All
/// coordinates are relative to the block; `known` is a sample of it.
bool RegionLayers::are_near_parts(std::int32_t block, const BoundsOf<int>& box,
                                  const std::array<int, 3>& known, const Vector3d& up, const Layer& layer,
                                  std::span<const Vector3d> corners, double tolerance) const {
  Eigen::Vector3i highest = box.upper, lowest = box.lower;
  Part above{{}, {}, up, double(layer.high)};
  double high = 0, low = 0;
  // The corners A and B of the header: farthest up and farthest down.
  for (int a = 0; a < 3; ++a) {
    if (up[a] < 0) std::swap(highest[a], lowest[a]);
    above.lower[a] = box.lower[a];
    above.upper[a] = box.upper[a];
    high += up[a] * highest[a];
    low += up[a] * lowest[a];
  }
  if (!(high > double(layer.high) && low < double(layer.low))) return false;
  const Part below{above.lower, above.upper, -up, -double(layer.low)};
  for (const Vector3d& corner : corners)
    for (const Part* part : {&std::as_const(above), &below})
      if (part->squared_distance(corner) > tolerance * tolerance) return false;
  // Last, because it walks along edges. One sample decides for a whole part, which no polygon intersects.
  const auto sample = [](const Eigen::Vector3i& at) { return std::array{at[0], at[1], at[2]}; };
  return is_inside(block, known, sample(lowest)) && !is_inside(block, known, sample(highest));
}

}  // namespace hermesh
