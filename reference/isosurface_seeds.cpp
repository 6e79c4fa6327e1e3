#include "reference/isosurface_seeds.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace hermesh {
namespace {

using openvdb::Coord;

struct Crossing {
  Coord voxel;  ///< lower end of the edge
  int axis;
  double offset;  ///< position on the edge, 0 to 1
  std::size_t component = 0;

  openvdb::Vec3d point() const {
    openvdb::Vec3d result = voxel.asVec3d();
    result[axis] += offset;
    return result;
  }
  /// The four cells around the edge, by their lower corners.
  std::array<Coord, 4> cells() const {
    Coord u(0), v(0);
    u[(axis + 1) % 3] = 1;
    v[(axis + 2) % 3] = 1;
    return {voxel, voxel - u, voxel - v, voxel - u - v};
  }
};

/// Crossings on the edges that begin or end at an active voxel.
std::vector<Crossing> crossings(const openvdb::FloatGrid& grid, double isovalue) {
  std::vector<Crossing> result;
  openvdb::FloatGrid::ConstAccessor values = grid.getConstAccessor();
  const auto add = [&](const Coord& lower, int axis) {
    Coord upper = lower;
    ++upper[axis];
    const double a = double(values.getValue(lower)) - isovalue, b = double(values.getValue(upper)) - isovalue;
    if ((a < 0.0) != (b < 0.0)) result.push_back({lower, axis, a / (a - b)});
  };
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
    for (auto value = leaf->cbeginValueOn(); value; ++value)
      for (int axis = 0; axis < 3; ++axis) {
        add(value.getCoord(), axis);
        Coord below = value.getCoord();
        --below[axis];
        // The edge below belongs to the voxel at its lower end, unless that one is inactive.
        if (!values.isValueOn(below)) add(below, axis);
      }
  return result;
}

std::size_t root(std::vector<std::size_t>& parent, std::size_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

void label_components(std::vector<Crossing>& all) {
  std::vector<Coord> cells;
  cells.reserve(4 * all.size());
  for (const Crossing& crossing : all)
    for (const Coord& cell : crossing.cells()) cells.push_back(cell);
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());

  std::vector<std::size_t> parent(cells.size());
  std::iota(parent.begin(), parent.end(), std::size_t(0));
  const auto number = [&](const Coord& cell) {
    return std::size_t(std::lower_bound(cells.begin(), cells.end(), cell) - cells.begin());
  };
  for (Crossing& crossing : all) {
    const std::array<Coord, 4> around = crossing.cells();
    crossing.component = number(around[0]);
    for (const Coord& cell : around) {
      const std::size_t a = root(parent, crossing.component), b = root(parent, number(cell));
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  for (Crossing& crossing : all) crossing.component = root(parent, crossing.component);
}

Coord block_of(const Coord& voxel, int spacing) {
  const auto floor_divide = [&](int a) { return a >= 0 ? a / spacing : -((spacing - 1 - a) / spacing); };
  return {floor_divide(voxel.x()), floor_divide(voxel.y()), floor_divide(voxel.z())};
}

/// The seeds of one component, whose crossings are sorted by block.
void choose(const Crossing* first, const Crossing* last, int spacing, std::vector<openvdb::Vec3d>& seeds) {
  constexpr std::size_t kFewest = 12;  // as many as the corners of an icosahedron catch a small closed sheet
  const std::size_t before = seeds.size();
  for (const Crossing* begin = first; begin != last;) {
    const Coord block = block_of(begin->voxel, spacing);
    const Crossing* end = std::find_if(
        begin, last, [&](const Crossing& crossing) { return block_of(crossing.voxel, spacing) != block; });
    seeds.push_back(begin[(end - begin) / 2].point());
    begin = end;
  }
  if (seeds.size() - before >= kFewest) return;
  seeds.resize(before);
  const std::size_t count = std::size_t(last - first), wanted = std::min(count, kFewest);
  for (std::size_t i = 0; i < wanted; ++i) seeds.push_back(first[i * count / wanted].point());
}

}  // namespace

std::vector<openvdb::Vec3d> isosurface_seeds(const openvdb::FloatGrid& grid, double isovalue, int spacing) {
  std::vector<Crossing> all = crossings(grid, isovalue);
  label_components(all);
  std::stable_sort(all.begin(), all.end(), [&](const Crossing& a, const Crossing& b) {
    if (a.component != b.component) return a.component < b.component;
    return block_of(a.voxel, spacing) < block_of(b.voxel, spacing);
  });
  std::vector<openvdb::Vec3d> seeds;
  for (const Crossing* first = all.data(); first != all.data() + all.size();) {
    const Crossing* last =
        std::find_if(first, static_cast<const Crossing*>(all.data() + all.size()),
                     [&](const Crossing& crossing) { return crossing.component != first->component; });
    choose(first, last, spacing, seeds);
    first = last;
  }
  return seeds;
}

}  // namespace hermesh
