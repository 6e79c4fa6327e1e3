#include "algorithms/extraction/manifold_dual_contouring/region_proposals.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "algorithms/extraction/manifold_dual_contouring/region_cubes.h"
#include "algorithms/extraction/manifold_dual_contouring/widened_mask.h"

namespace hermesh {
namespace {

using Eigen::Array4f;
using Eigen::Vector3d;

/// How far a cube's place may be from the planes for a tolerance, root mean square, where nothing else is
/// asked. Up to two voxels the proof knows distances well (region_shell.h); beyond, it looks at slabs
/// (region_slabs.h) that are some six times as thick.
double flatness_for(double tolerance) { return std::max(0.3 * std::min(tolerance, 2.0), 0.15 * tolerance); }
/// Length of the mean of a cube's unit normals: what bends more than this, the proof would mostly split.
double least_agreement_for(double tolerance) { return tolerance <= 2.0 ? 0.93 : 0.75; }
/// How strongly the place is drawn to the mean of the crossings, against the planes: it should lie in the
/// middle of what it stands for, but on the surface.
constexpr double kPullToMean = 0.02;
/// No cell becomes part of a cube that is at most so many steps from one whose polygons the rule of envelopes
/// does not cover (uniform_mesh.h). Those lie within the cells next to it, and those of a cube, if they are
/// not loose, within the cube and the cells next to that.
constexpr int kAway = 2;

constexpr int kStep[3] = {64, 8, 1};  ///< from a cell to the next

int coordinate(int cell, int axis) { return (cell / kStep[axis]) & 7; }

}  // namespace

float CellTolerances::least(const CellBlocks& cells, std::int32_t block, int first, int side) const {
  if (by_cell_.empty()) return all_;
  float least = std::numeric_limits<float>::max();
  for (int x = coordinate(first, 0); x < coordinate(first, 0) + side; ++x)
    for (std::uint64_t row = cells[block].active[static_cast<std::size_t>(x)] & rows_of(first, side, 0, 0);
         row != 0; row &= row - 1)
      least = std::min(least, by_cell_[cells.cell_number(block, 64 * x + std::countr_zero(row))]);
  return least;
}

void RegionProposals::Sum::add(const EdgeCrossing& crossing, const Array4f& place) {
  const auto& n = crossing.normal;
  const float away = -(n[0] * place[0] + n[1] * place[1] + n[2] * place[2]);
  const Array4f plane(n[0], n[1], n[2], away);
  for (int row = 0; row < 4; ++row) products[static_cast<std::size_t>(row)] += plane[row] * plane;
  normals += plane;
  places += place;
}

void RegionProposals::Sum::add(const Sum& other) {
  for (std::size_t row = 0; row < 4; ++row) products[row] += other.products[row];
  normals += other.normals;
  places += other.places;
}

bool RegionProposals::propose_whole(std::int32_t block, ProposedCube& cube) {
  read(block);
  for (std::size_t word = 0; word < 8; ++word)
    if (cells_[block].active[word] & ~free_[word]) return false;
  if (!is_disc(0, 8)) return false;
  Sum sum;
  for_each_crossing(
      [&](int, const EdgeCrossing& crossing, const Array4f& place) { sum.add(crossing, place); });
  return propose(kCubeLevels, 0, sum, cube);
}

void RegionProposals::propose_parts(std::int32_t block, std::array<std::uint64_t, 2>& proposed,
                                    std::vector<ProposedCube>& cubes) {
  read(block);
  std::uint64_t used = 0;
  for_each_crossing([&](int sample, const EdgeCrossing& crossing, const Array4f& place) {
    const int part = cube_of(sample, 1);
    if (!((used >> part) & 1)) sums_[static_cast<std::size_t>(part)] = Sum();
    used |= std::uint64_t{1} << part;
    sums_[static_cast<std::size_t>(part)].add(crossing, place);
  });
  std::array<Sum, 8> wider;
  std::uint64_t used_wider = 0;
  for (std::uint64_t parts = used; parts != 0; parts &= parts - 1) {
    const int part = std::countr_zero(parts), cube = cube_of(first_cell(part, 1), 2);
    used_wider |= std::uint64_t{1} << cube;
    wider[static_cast<std::size_t>(cube)].add(sums_[static_cast<std::size_t>(part)]);
  }
  ProposedCube cube;
  const auto look = [&](int level, std::uint64_t all, const Sum* sums) {
    for (; all != 0; all &= all - 1) {
      const int i = std::countr_zero(all);
      if (!is_disc(first_cell(i, level), 1 << level) || !propose(level, i, sums[i], cube)) continue;
      proposed[static_cast<std::size_t>(level - 1)] |= std::uint64_t{1} << i;
      cubes.push_back(cube);
    }
  };
  look(1, used, sums_.data());
  look(2, used_wider, wider.data());
}

void RegionProposals::read(std::int32_t block) {
  block_ = block;
  const auto& neighbours = cells_.source(block).neighbours;
  free_.fill(~std::uint64_t{0});
  if (std::ranges::any_of(neighbours,
                          [&](std::int32_t there) { return there >= 0 && any(cells_[there].special); })) {
    free_ = widened<kAway>([&](int x, int y, int z) -> const BlockMask* {
      const std::int32_t there = neighbours[static_cast<std::size_t>(neighbour_slot(x, y, z))];
      return there < 0 ? nullptr : &cells_[there].special;
    });
    for (std::uint64_t& word : free_) word = ~word;
  }
  const std::array<BlockMask, 8> signs = cells_.corner_signs(block);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = std::size_t{1} << (axis + 1) % 3, v = std::size_t{1} << (axis + 2) % 3;
    for (std::size_t word = 0; word < 8; ++word) {
      const std::uint64_t a = signs[0][word], b = signs[u][word], c = signs[v][word], d = signs[u | v][word];
      lower_faces_[axis][word] = (a | b | c | d) & ~(a & b & c & d);
    }
  }
  cells_.grid().crossings(block, crossings_.data());
}

/// Calls f(sample, crossing, its place about the block's middle, with a 1 behind).
template <class F>
void RegionProposals::for_each_crossing(F&& f) {
  const EdgeCrossing* next = crossings_.data();
  for (int axis = 0; axis < 3; ++axis)
    for_each_bit(cells_.source(block_).crossing[static_cast<std::size_t>(axis)], [&](int sample) {
      Array4f place(static_cast<float>((sample >> 6) - 4), static_cast<float>(((sample >> 3) & 7) - 4),
                    static_cast<float>((sample & 7) - 4), 1.0f);
      place[axis] += next->offset;
      f(sample, *next++, place);
    });
}

bool RegionProposals::propose(int level, int cube, const Sum& sum, ProposedCube& result) const {
  const int first = first_cell(cube, level), side = 1 << level;
  const double tolerance = double(options_.tolerance.least(cells_, block_, first, side));
  const Eigen::Vector3f normal = sum.normals.head<3>();
  if (!(tolerance > 0 && double(normal.norm()) >= least_agreement_for(tolerance) * double(sum.count())))
    return false;
  if (!crosses_an_edge(first, side) || !find_place(sum, first, side, tolerance, result.place)) return false;
  result.normal = normal.normalized();
  return true;
}

/// By its Euler characteristic, and because its cells hang together; and they are two or more, all free.
bool RegionProposals::is_disc(int first, int side) const {
  const auto lower = static_cast<std::size_t>(first >> 6), n = static_cast<std::size_t>(side);
  const std::uint64_t rows = rows_of(first, side, 0, 0), upper_rows = rows_of(first, side, 1, 0),
                      right = rows_of(first, side, 0, 1), both = upper_rows & right;
  const CellBlocks::Block& own = cells_[block_];
  const auto& crossing = cells_.source(block_).crossing;
  std::array<std::uint64_t, 8> cells;
  std::array<std::array<std::uint64_t, 8>, 3> faces;  // between two of the cube's cells, at the upper one
  int count = 0, euler = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t x = lower + i;
    cells[i] = own.active[x] & rows;
    if (cells[i] & ~free_[x]) return false;
    faces[0][i] = i > 0 ? lower_faces_[0][x] & rows : 0;
    faces[1][i] = lower_faces_[1][x] & upper_rows;
    faces[2][i] = lower_faces_[2][x] & right;
    count += bits_in(cells[i]);
    euler -= bits_in(faces[0][i]) + bits_in(faces[1][i]) + bits_in(faces[2][i]);
    euler += bits_in(crossing[0][x] & both);
    if (i > 0) euler += bits_in(crossing[1][x] & right) + bits_in(crossing[2][x] & upper_rows);
  }
  if (count < 2 || euler + count != 1) return false;
  std::array<std::uint64_t, 8> reached{};
  const auto start = static_cast<std::size_t>(
      std::ranges::find_if(cells, [](std::uint64_t word) { return word != 0; }) - cells.begin());
  reached[start] = cells[start] & -cells[start];
  for (int last = 0, now = 1; now != last;) {
    last = now;
    const auto spread = [&](std::size_t i) {
      std::uint64_t word = reached[i];
      if (i > 0) word |= reached[i - 1] & faces[0][i];
      if (i + 1 < n) word |= reached[i + 1] & faces[0][i + 1];
      word |= (word << 8 & faces[1][i]) | (word & faces[1][i]) >> 8;
      word |= (word << 1 & faces[2][i]) | (word & faces[2][i]) >> 1;
      reached[i] = word;
    };
    for (std::size_t i = 0; i < n; ++i) spread(i);
    for (std::size_t i = n; i-- > 0;) spread(i);
    now = 0;
    for (std::size_t i = 0; i < n; ++i) now += bits_in(reached[i]);
  }
  for (std::size_t i = 0; i < n; ++i)
    if (reached[i] != cells[i]) return false;
  return true;
}

/// Else the border lies within one face, and beyond it is perhaps one other cube: with no third region around
/// any edge there would be no polygon at all.
bool RegionProposals::crosses_an_edge(int first, int side) const {
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 4; ++corner) {
      int at[3] = {coordinate(first, 0), coordinate(first, 1), coordinate(first, 2)};
      at[(axis + 1) % 3] += corner & 1 ? side : 0;
      at[(axis + 2) % 3] += corner & 2 ? side : 0;
      const CellBlocks::Cell sample = cells_.locate(block_, at[0], at[1], at[2]);
      if (cells_.crossings_on({sample.block, sample.cell, axis}, side) > 0) return true;
    }
  return false;
}

bool RegionProposals::find_place(const Sum& sum, int first, int side, double tolerance,
                                 Vector3d& place) const {
  const double count = double(sum.count());
  Eigen::Matrix3d a;
  Vector3d b;
  for (int row = 0; row < 3; ++row) {
    a.row(row) = sum.products[static_cast<std::size_t>(row)].head<3>().matrix().transpose().cast<double>();
    b[row] = double(sum.products[static_cast<std::size_t>(row)][3]);
  }
  const Vector3d mean = sum.places.head<3>().matrix().cast<double>() / count;
  // The sum of squared distances to the planes, about the mean.
  const double at_mean = mean.dot(a * mean) + 2 * b.dot(mean) + double(sum.products[3][3]);
  b += a * mean;
  const double weight = kPullToMean * a.trace() + 1e-12;
  Vector3d x = mean + (a + weight * Eigen::Matrix3d::Identity()).ldlt().solve(-b) + Vector3d::Constant(4);
  const double margin = cells_.margin();
  for (int axis = 0; axis < 3; ++axis) {
    const int lower = coordinate(first, axis);
    x[axis] = std::clamp(x[axis], lower + margin, lower + side - margin);
  }
  const Vector3d off = x - Vector3d::Constant(4) - mean;
  const double hoped_for = flatness_for(tolerance),
               most = options_.flatness > 0 ? std::min(options_.flatness, hoped_for) : hoped_for;
  if (!(off.dot(a * off) + 2 * b.dot(off) + at_mean <= most * most * count)) return false;
  place = file_.rounded(cells_.corner(block_, 0) + x);
  return true;
}

}  // namespace hermesh
