#include "algorithms/extraction/certified_octree/region_proposals.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "algorithms/extraction/certified_octree/region_cubes.h"
#include "algorithms/extraction/certified_octree/widened_mask.h"

namespace hermesh {
namespace {

using Eigen::Array4f;
using Eigen::Vector3d;

/// How far a cube's place may be from the planes for a tolerance, root mean square, where nothing else is
/// asked. Up to two voxels the proof knows distances well (region_shell.h); beyond, it looks at slabs
/// (region_slabs.h) that are some six times as thick.
double flatness_for(double tolerance) { return std::max(0.3 * std::min(tolerance, 2.0), 0.15 * tolerance); }
/// How long the mean of a cube's unit normals must be: what bends more, the proof would mostly split.
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

/// The places of samples about the block's middle, behind a 1.
const std::array<Array4f, 512> kPlaces = [] {
  std::array<Array4f, 512> places;
  for (int sample = 0; sample < 512; ++sample)
    places[static_cast<std::size_t>(sample)] =
        Array4f(1.0f, static_cast<float>(coordinate(sample, 0) - 4),
                static_cast<float>(coordinate(sample, 1) - 4), static_cast<float>(coordinate(sample, 2) - 4));
  return places;
}();

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

void RegionProposals::Sum::clear() {
  for (Array4f* all : {&products[0], &products[1], &products[2], &normals, &places}) all->setZero();
}

/// Adds the plane of a crossing, by whole vectors: built from single numbers they would take longer than all
/// the rest. An EdgeCrossing is read as four floats, its offset and its normal.
void RegionProposals::Sum::add(const EdgeCrossing& crossing, const Array4f& place) {
  const Array4f first(1, 0, 0, 0), others(0, 1, 1, 1);
  const Array4f normal = others * Eigen::Map<const Array4f>(&crossing.offset);
  const float above = (normal * place).sum();
  const Array4f plane = normal - above * first;
  for (std::size_t row = 0; row < 3; ++row) products[row] += crossing.normal[row] * plane;
  normals += normal + (above * above) * first;
  places += place;
}

std::uint64_t RegionProposals::propose(std::int32_t block, int level, std::uint64_t asked,
                                       std::vector<ProposedCube>& found) {
  // One pass over the block's crossings sums up all cubes of the level. A crossing counts for the cube that
  // its first sample is in, whose cell has it for an edge.
  read(block);
  std::uint64_t used = 0;
  for_each_crossing([&](int sample, const EdgeCrossing& crossing, const Array4f& place) {
    const int cube = cube_of(sample, level);
    if (!((asked >> cube) & 1)) return;
    if (!((used >> cube) & 1)) sums_[static_cast<std::size_t>(cube)].clear();
    used |= std::uint64_t{1} << cube;
    sums_[static_cast<std::size_t>(cube)].add(crossing, place);
  });
  std::uint64_t proposed = 0;
  ProposedCube cube;
  for (; used != 0; used &= used - 1) {
    const int i = std::countr_zero(used);
    if (!try_cube(level, i, sums_[static_cast<std::size_t>(i)], cube)) continue;
    proposed |= std::uint64_t{1} << i;
    found.push_back(cube);
  }
  return proposed;
}

void RegionProposals::read(std::int32_t block) {
  if (std::exchange(block_, block) == block) return;
  const auto& neighbours = cells_.source(block).neighbours;
  // Most blocks have no special cell near, and all of their cells are free.
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
    // The surface passes through a face if its four corners are not all alike.
    const std::size_t u = std::size_t{1} << (axis + 1) % 3, v = std::size_t{1} << (axis + 2) % 3;
    for (std::size_t word = 0; word < 8; ++word) {
      const std::uint64_t a = signs[0][word], b = signs[u][word], c = signs[v][word], d = signs[u | v][word];
      lower_faces_[axis][word] = (a | b | c | d) & ~(a & b & c & d);
    }
  }
  cells_.grid().crossings(block, crossings_.data());
}

/// Calls f(sample, crossing, its place about the block's middle, behind a 1).
template <class F>
void RegionProposals::for_each_crossing(F&& f) {
  const EdgeCrossing* next = crossings_.data();
  for (int axis = 0; axis < 3; ++axis) {
    Array4f along = Array4f::Zero();
    along[axis + 1] = 1;
    for_each_bit(cells_.source(block_).crossing[static_cast<std::size_t>(axis)], [&](int sample) {
      const Array4f place = kPlaces[static_cast<std::size_t>(sample)] + next->offset * along;
      f(sample, *next++, place);
    });
  }
}

bool RegionProposals::try_cube(int level, int cube, const Sum& sum, ProposedCube& result) const {
  const int first = first_cell(cube, level), side = 1 << level;
  // The tests that cost least come first: those of bits before those of numbers.
  if (!is_disc(first, side)) return false;
  const double tolerance = double(options_.tolerance.least(cells_, block_, first, side));
  const Eigen::Vector3f normal = sum.normals.tail<3>();
  if (!(tolerance > 0 && double(normal.norm()) >= least_agreement_for(tolerance) * double(sum.count())))
    return false;
  if (!has_simple_border(first, side) || !find_place(sum, first, side, tolerance, result.place)) return false;
  result.normal = normal.normalized();
  return true;
}

/// Whether the surface within a cube is a disc: by its Euler characteristic, and because its cells hang
/// together; and they are two or more, all free. Counted is the part of the uniform mesh within the cube: a
/// point for each cell, an edge for each face between two of them that is passed, a polygon for each crossing
/// edge within.
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
    count += std::popcount(cells[i]);
    euler -= std::popcount(faces[0][i]) + std::popcount(faces[1][i]) + std::popcount(faces[2][i]);
    euler += std::popcount(crossing[0][x] & both);
    if (i > 0) euler += std::popcount(crossing[1][x] & right) + std::popcount(crossing[2][x] & upper_rows);
  }
  if (count < 2 || euler + count != 1) return false;
  // From one cell across faces that are passed, forwards and backwards until nothing is new.
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
    for (std::size_t i = 0; i < n; ++i) now += std::popcount(reached[i]);
  }
  for (std::size_t i = 0; i < n; ++i)
    if (reached[i] != cells[i]) return false;
  return true;
}

/// Whether no edge of a cube is crossed more than once, no face's border more than twice, and some edge is:
/// else all would lie within one face, and if one other cube is beyond that, there would be no polygon at
/// all.
bool RegionProposals::has_simple_border(int first, int side) const {
  std::array<std::array<int, 4>, 3> crossings;  // by axis of the edges, and where they are along the next two
  int all = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 4; ++corner) {
      int at[3] = {coordinate(first, 0), coordinate(first, 1), coordinate(first, 2)};
      at[(axis + 1) % 3] += corner & 1 ? side : 0;
      at[(axis + 2) % 3] += corner & 2 ? side : 0;
      const CellBlocks::Cell sample = cells_.locate(block_, at[0], at[1], at[2]);
      const int here = cells_.crossings_on({sample.block, sample.cell, axis}, side);
      if (here > 1) return false;
      all += crossings[static_cast<std::size_t>(axis)][static_cast<std::size_t>(corner)] = here;
    }
  // The border passes a face in as many pieces as half its crossings on the face's edges.
  for (std::size_t across = 0; across < 3; ++across)
    for (std::size_t upper = 0; upper < 2; ++upper) {
      const auto &p = crossings[(across + 1) % 3], &q = crossings[(across + 2) % 3];
      if (p[2 * upper] + p[2 * upper + 1] + q[upper] + q[upper + 2] > 2) return false;
    }
  return all > 0;
}

bool RegionProposals::find_place(const Sum& sum, int first, int side, double tolerance,
                                 Vector3d& place) const {
  // The normal equation of the QEF (thesis, equations 6.3 and 6.4), from the products of the planes. A weak
  // pull to the mean of the crossings takes the part of the truncated decomposition of §6.2.1: it decides
  // where planes do not.
  const double count = double(sum.count());
  Eigen::Matrix3d a;
  Vector3d b;
  for (int row = 0; row < 3; ++row) {
    a.row(row) = sum.products[static_cast<std::size_t>(row)].tail<3>().matrix().transpose().cast<double>();
    b[row] = double(sum.products[static_cast<std::size_t>(row)][0]);
  }
  const Vector3d mean = sum.places.tail<3>().matrix().cast<double>() / count;
  // The sum of squared distances to the planes, about the mean.
  const double at_mean = mean.dot(a * mean) + 2 * b.dot(mean) + double(sum.normals[0]);
  b += a * mean;
  const double weight = kPullToMean * a.trace() + 1e-12;
  Vector3d x = mean + (a + weight * Eigen::Matrix3d::Identity()).ldlt().solve(-b) + Vector3d::Constant(4);
  // Within the cube, as every proof here wants it, and off its faces when rounded.
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
