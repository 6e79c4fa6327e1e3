#include "algorithms/extraction/certified_octree/cell_regions.h"

#include <tbb/enumerable_thread_specific.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

namespace hermesh {
namespace {

using Eigen::Array4f;
using Eigen::Vector3d;

/// Largest root mean square distance of a cube's vertex from the planes for a tolerance, if no flatness is
/// given. Up to two voxels the proof measures distances well (region_shell.h); beyond, it uses layers
/// (region_layers.h) that are about six times as thick.
double flatness_for(double tolerance) { return std::max(0.3 * std::min(tolerance, 2.0), 0.15 * tolerance); }
/// Least length of the mean of a cube's unit normals: the proof would split most cubes that bend more.
double least_agreement_for(double tolerance) { return tolerance <= 2.0 ? 0.93 : 0.75; }
/// Weight of the mean of the crossings against the planes: the vertex should be in the middle of its part of
/// the surface, but on it.
constexpr double kPullToMean = 0.02;
/// Cells at most this many steps from a special one, which the argument of envelopes does not cover
/// (uniform_mesh.h), are not merged. The polygons of special cells lie within the cells next to them, and
/// those of a cube, unless loose, within the cube and the cells next to it.
constexpr int kAway = 2;

constexpr int kCellStep[3] = {64, 8, 1};  ///< from a cell to the next

int coordinate(int cell, int axis) { return (cell / kCellStep[axis]) & 7; }

/// The positions of samples about the block's centre, preceded by a 1.
const std::array<Array4f, 512> kPlaces = [] {
  std::array<Array4f, 512> places;
  for (int sample = 0; sample < 512; ++sample)
    places[sample] =
        Array4f(1.0f, coordinate(sample, 0) - 4, coordinate(sample, 1) - 4, coordinate(sample, 2) - 4);
  return places;
}();

/// The bits of a row of a level's cubes, spaced by the width of the cubes.
constexpr std::uint64_t spread(std::uint64_t row, int level) {
  if (level == 2) return (row & 1) | (row & 2) << 3;
  if (level > 2) return row;
  row = (row | row << 2) & 0x33;
  return (row | row << 1) & 0x55;
}

/// Returns the cells of a level's cubes.
constexpr BlockMask cells_of(std::uint64_t cubes, int level) {
  BlockMask result{};
  if (cubes == 0) return result;
  const int bits = kCubeLevels - level, across = 1 << bits, side = 1 << level;
  for (int x = 0; x < across; ++x) {
    std::uint64_t rows = 0;  // those of the cubes' first cells
    for (int y = 0; y < across; ++y)
      rows |= spread((cubes >> ((x << bits | y) << bits)) & ((1u << across) - 1), level) << (8 * side * y);
    for (int step = 1; step < side; step *= 2) rows |= rows << step | rows << (8 * step) | rows << (9 * step);
    for (int k = 0; k < side; ++k) result[x * side + k] = rows;
  }
  return result;
}

/// Returns a mask moved by one cell along an axis; `below` is the mask of the block below.
BlockMask moved_up(const BlockMask& mask, const BlockMask& below, int axis) {
  BlockMask result;
  for (int x = 0; x < 8; ++x)
    result[x] = axis == 0   ? (x == 0 ? below[7] : mask[x - 1])
                : axis == 1 ? (mask[x] << 8 | below[x] >> 56)
                            : ((mask[x] & ~kLastZ) << 1 | (below[x] & kLastZ) >> 7);
  return result;
}

}  // namespace

/// Proposes the cubes of CellRegions. One object per thread.
class RegionProposals {
 public:
  RegionProposals(const CellBlocks& cells, const RegionOptions& options, const FilePoints& file)
      : cells_(cells), options_(options), file_(file) {}

  /// Tests those cubes of a level of a block that are `asked` for, one bit each. Returns the bits of those
  /// that pass, and appends them to `found`, ascending.
  std::uint64_t propose(std::int32_t block, int level, std::uint64_t asked, std::vector<ProposedCube>& found);

 private:
  /// Sums over the planes through a cube's crossings, about the centre of the block.
  struct Sum {
    /// By row: products of each plane's normal with its four coefficients, i.e. the distance of the centre
    /// below the plane, and the normal.
    std::array<Array4f, 3> products;
    Array4f normals;  ///< sum of squared distances from the centre, and of normals
    Array4f places;   ///< number of crossings, and sum of their positions

    /// Adds the plane of a crossing in whole vectors: assembled from scalars, they would take longer than all
    /// the rest. An EdgeCrossing is read as four floats, its offset and its normal.
    void add(const EdgeCrossing& crossing, const Array4f& place) {
      const Array4f first(1, 0, 0, 0), others(0, 1, 1, 1);
      const Array4f normal = others * Eigen::Map<const Array4f>(&crossing.offset);
      const float above = (normal * place).sum();
      const Array4f plane = normal - above * first;
      for (int row = 0; row < 3; ++row) products[row] += crossing.normal[row] * plane;
      normals += normal + (above * above) * first;
      places += place;
    }
  };

  void read(std::int32_t block);
  bool try_cube(int level, int cube, const Sum& sum, ProposedCube& result) const;
  bool is_disc(int first, int side) const;
  bool has_simple_border(int first, int side) const;
  bool find_place(const Sum& sum, int first, int side, double tolerance, Vector3d& place) const;

  const CellBlocks& cells_;
  const RegionOptions& options_;
  const FilePoints& file_;
  std::int32_t block_ = -1;                 ///< the block of the following members
  BlockMask free_{};                        ///< cells that may be part of a cube, active or not
  std::array<BlockMask, 3> lower_faces_{};  ///< by axis: the cells whose lower face intersects the surface
  std::array<EdgeCrossing, 3 * 512> crossings_;
  std::array<Sum, 64> sums_;  ///< one per cube of a level
};

float CellTolerances::least(const CellBlocks& cells, std::int32_t block, int first, int side) const {
  if (by_cell_.empty()) return all_;
  float least = std::numeric_limits<float>::max();
  for (int x = coordinate(first, 0); x < coordinate(first, 0) + side; ++x)
    for (std::uint64_t row = cells[block].active[x] & rows_of(first, side, 0, 0); row != 0; row &= row - 1)
      least = std::min(least, by_cell_[cells.cell_number(block, 64 * x + std::countr_zero(row))]);
  return least;
}

std::uint64_t RegionProposals::propose(std::int32_t block, int level, std::uint64_t asked,
                                       std::vector<ProposedCube>& found) {
  // One pass over the block's crossings sums up all cubes of the level. A crossing counts for the cube of its
  // first sample, whose cell has it on an edge.
  read(block);
  std::uint64_t used = 0;
  const EdgeCrossing* next = crossings_.data();
  for (int axis = 0; axis < 3; ++axis) {
    Array4f along = Array4f::Zero();
    along[axis + 1] = 1;
    for_each_bit(cells_.source(block).crossing[axis], [&](int sample) {
      const Array4f place = kPlaces[sample] + next->offset * along;
      const EdgeCrossing& crossing = *next++;
      const int cube = cube_of(sample, level);
      if (!((asked >> cube) & 1)) return;
      Sum& sum = sums_[cube];
      if (!((used >> cube) & 1))
        for (Array4f* all : {&sum.products[0], &sum.products[1], &sum.products[2], &sum.normals, &sum.places})
          all->setZero();
      used |= std::uint64_t{1} << cube;
      sum.add(crossing, place);
    });
  }
  std::uint64_t proposed = 0;
  ProposedCube cube;
  for (; used != 0; used &= used - 1) {
    const int i = std::countr_zero(used);
    if (!try_cube(level, i, sums_[i], cube)) continue;
    proposed |= std::uint64_t{1} << i;
    found.push_back(cube);
  }
  return proposed;
}

void RegionProposals::read(std::int32_t block) {
  if (std::exchange(block_, block) == block) return;
  const auto& neighbours = cells_.source(block).neighbours;
  // Most blocks have no special cell nearby, so all their cells are free.
  free_.fill(~std::uint64_t{0});
  if (std::ranges::any_of(neighbours,
                          [&](std::int32_t there) { return there >= 0 && any(cells_[there].special); })) {
    free_ = widened<kAway>([&](int x, int y, int z) -> const BlockMask* {
      const std::int32_t there = neighbours[neighbour_slot(x, y, z)];
      return there < 0 ? nullptr : &cells_[there].special;
    });
    for (std::uint64_t& word : free_) word = ~word;
  }
  const std::array<BlockMask, 8> signs = cells_.corner_signs(block);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // The surface intersects a face whose corners have both signs.
    const std::size_t u = std::size_t{1} << (axis + 1) % 3, v = std::size_t{1} << (axis + 2) % 3;
    for (std::size_t word = 0; word < 8; ++word) {
      const std::uint64_t a = signs[0][word], b = signs[u][word], c = signs[v][word], d = signs[u | v][word];
      lower_faces_[axis][word] = (a | b | c | d) & ~(a & b & c & d);
    }
  }
  cells_.grid().crossings(block, crossings_.data());
}

bool RegionProposals::try_cube(int level, int cube, const Sum& sum, ProposedCube& result) const {
  const int first = first_cell(cube, level), side = 1 << level;
  // Cheap tests of bits first.
  if (!is_disc(first, side)) return false;
  const double tolerance = double(options_.tolerance.least(cells_, block_, first, side));
  const Eigen::Vector3f normal = sum.normals.tail<3>();
  if (!(tolerance > 0 && double(normal.norm()) >= least_agreement_for(tolerance) * double(sum.places[0])))
    return false;
  if (!has_simple_border(first, side) || !find_place(sum, first, side, tolerance, result.place)) return false;
  result.normal = normal.normalized();
  return true;
}

/// Returns true if the surface within a cube is a disc, by its Euler characteristic and connectivity, and its
/// cells are two or more, all free. The part of the uniform mesh within the cube has a vertex for each active
/// cell, an edge for each intersected face between two cells, and a polygon for each crossed edge inside.
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
  // Flood from one cell across intersected faces, forwards and backwards, until nothing changes.
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

/// Returns true if no edge of a cube is crossed more than once, no face's border more than twice, and some
/// edge is crossed: otherwise all of the surface would leave through one face, and with a single cube beyond
/// it there would be no polygon at all.
bool RegionProposals::has_simple_border(int first, int side) const {
  std::array<std::array<int, 4>, 3> crossings;  // by axis of the edges, and offset along the next two
  int all = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 4; ++corner) {
      int at[3] = {coordinate(first, 0), coordinate(first, 1), coordinate(first, 2)};
      at[(axis + 1) % 3] += corner & 1 ? side : 0;
      at[(axis + 2) % 3] += corner & 2 ? side : 0;
      const CellBlocks::Cell sample = cells_.locate(block_, at[0], at[1], at[2]);
      const int here = cells_.crossings_on({sample.block, sample.cell, axis}, side);
      if (here > 1) return false;
      all += crossings[axis][corner] = here;
    }
  // The number of pieces of the border in a face is half the number of crossings on the face's edges.
  for (std::size_t across = 0; across < 3; ++across)
    for (std::size_t upper = 0; upper < 2; ++upper) {
      const auto &p = crossings[(across + 1) % 3], &q = crossings[(across + 2) % 3];
      if (p[2 * upper] + p[2 * upper + 1] + q[upper] + q[upper + 2] > 2) return false;
    }
  return all > 0;
}

bool RegionProposals::find_place(const Sum& sum, int first, int side, double tolerance,
                                 Vector3d& place) const {
  // The normal equation of the QEF (thesis, equations 6.3 and 6.4). A weak pull to the mean of the crossings
  // replaces the truncated decomposition of §6.2.1: it determines the directions that planes do not.
  const double count = double(sum.places[0]);
  Eigen::Matrix3d a;
  Vector3d b;
  for (int row = 0; row < 3; ++row) {
    a.row(row) = sum.products[row].tail<3>().matrix().transpose().cast<double>();
    b[row] = double(sum.products[row][0]);
  }
  const Vector3d mean = sum.places.tail<3>().matrix().cast<double>() / count;
  // The sum of squared distances to the planes, about the mean.
  const double at_mean = mean.dot(a * mean) + 2 * b.dot(mean) + double(sum.normals[0]);
  b += a * mean;
  const double weight = kPullToMean * a.trace() + 1e-12;
  Vector3d x = mean + (a + weight * Eigen::Matrix3d::Identity()).ldlt().solve(-b) + Vector3d::Constant(4);
  // Within the cube, as the proofs require, and off its faces when rounded.
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

CellRegions::CellRegions(const CellBlocks& cells, const UniformPoints& points, const RegionOptions& options,
                         const FilePoints& file, RunContext& context)
    : cells_(cells), points_(points), options_(options), file_(file), blocks_(cells.size()) {
  Stage stage(context, "propose regions");
  // Starts with the largest cubes of every active block, and continues with the parts of those that fail.
  const int level = std::countr_zero(static_cast<unsigned>(options.largest_cube));
  const std::uint64_t all = ~std::uint64_t{0} >> (64 - (512 >> (3 * level)));
  parallel_blocks(cells.size(), context, [&](std::size_t b) {
    blocks_[b] = {};
    if (any(cells[b].active)) blocks_[b].asked[level - 1] = all;
  });
  propose_parts(context);
}

void CellRegions::propose_parts(RunContext& context) {
  tbb::enumerable_thread_specific<RegionProposals> proposals(
      [&] { return RegionProposals(cells_, options_, file_); });
  // Count, scan, fill: numbers are assigned in the order of blocks.
  std::vector<std::size_t> asked;
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    if (std::ranges::any_of(blocks_[b].asked, [](std::uint64_t cubes) { return cubes != 0; }))
      asked.push_back(b);
  std::vector<std::vector<ProposedCube>> found(asked.size());
  std::vector<std::array<std::uint64_t, kLevels>> before(asked.size());  // proposed
  parallel_blocks(asked.size(), context, [&](std::size_t i) {
    before[i] = blocks_[asked[i]].proposed;
    propose(proposals.local(), static_cast<std::int32_t>(asked[i]), blocks_[asked[i]], found[i]);
  });
  const auto added_to = [&](std::size_t i) {
    std::array<std::uint64_t, kLevels> added;
    for (std::size_t at = 0; at < added.size(); ++at)
      added[at] = blocks_[asked[i]].proposed[at] & ~before[i][at];
    return added;
  };
  // Numbers are permanent, because others use them as names of corners. All 4³ or 8³ cubes of a block are
  // proposed together, and so are the 2³ cubes of one 4³ cube; so a first number and a count of bits
  // determine number().
  std::size_t cubes = cubes_.size();
  for (std::size_t i = 0; i < asked.size(); ++i) {
    BlockRegions& block = blocks_[asked[i]];
    const std::array<std::uint64_t, kLevels> added = added_to(i);
    auto next = static_cast<std::uint32_t>(cubes);
    const auto number_from = [&](std::uint32_t& first, std::uint64_t some) {
      // An earlier first number must not change: cubes are counted from it.
      if (some == 0) return;
      first = next;
      next += static_cast<std::uint32_t>(std::popcount(some));
    };
    for (std::size_t at = 1; at < added.size(); ++at) number_from(block.first_cube[at - 1], added[at]);
    for (int larger = 0; larger < 8; ++larger)
      number_from(block.first_part[larger], added[0] & parts_of(larger, 2));
    cubes += found[i].size();
  }
  check_indices(cubes, "regions");
  cubes_.resize(cubes);
  parallel_blocks(asked.size(), context, [&](std::size_t i) {
    const std::array<std::uint64_t, kLevels> added = added_to(i);
    const std::vector<ProposedCube> own = std::move(found[i]);  // freed here, in parallel
    const ProposedCube* cube = own.data();                      // in the order of propose()
    for (int level = kLevels; level > 0; --level)
      for (std::uint64_t left = added[level - 1]; left != 0; left &= left - 1)
        cubes_[number(region_of(static_cast<std::int32_t>(asked[i]), std::countr_zero(left), level))] =
            *cube++;
  });
}

/// Proposes those cubes of a block that are asked for; the parts of those that fail are tried at the next
/// finer level.
void CellRegions::propose(RegionProposals& proposals, std::int32_t number, BlockRegions& block,
                          std::vector<ProposedCube>& found) {
  for (int level = kLevels; level > 0; --level) {
    const auto at = static_cast<std::size_t>(level - 1);
    std::uint64_t asked = std::exchange(block.asked[at], 0);
    if (asked == 0) continue;
    const std::uint64_t proposed = proposals.propose(number, level, asked, found);
    block.proposed[at] |= proposed;
    block.alive[at] |= proposed;
    asked &= ~proposed;
    if (level > 1)
      for (; asked != 0; asked &= asked - 1) block.asked[at - 1] |= parts_of(std::countr_zero(asked), level);
  }
  find_merged(block);
}

void CellRegions::find_merged(BlockRegions& block) {
  block.merged = {};
  for (int level = 1; level <= kLevels; ++level) {
    const BlockMask cells = cells_of(block.alive[level - 1], level);
    for (std::size_t x = 0; x < 8; ++x) block.merged[x] |= cells[x];
  }
}

void CellRegions::split(const Region& region) {
  BlockRegions& block = blocks_[region.block];
  const int cube = cube_of(region.cell, region.level);
  // The bit remains in `proposed`, by which numbers are counted.
  block.alive[region.level - 1u] &= ~(std::uint64_t{1} << cube);
  if (region.level > 1) block.asked[region.level - 2u] |= parts_of(cube, region.level);
  find_merged(block);
}

/// Returns, by axis, the cells whose lower face is within a cube.
std::array<BlockMask, 3> CellRegions::inner_faces(std::int32_t block) const {
  const BlockRegions& own = blocks_[block];
  std::array<BlockMask, 3> result{};
  // A block that is one cube has no others.
  for (int level = own.alive[kLevels - 1] ? kLevels : 1; level <= kLevels; ++level) {
    const BlockMask cells = cells_of(own.alive[level - 1], level);
    std::uint64_t first_rows = 0, first_columns = 0;  // of all cubes, along y and z
    for (int k = 0; k < 8; k += 1 << level) {
      first_rows |= kFirstY << (8 * k);
      first_columns |= kFirstZ << k;
    }
    for (int x = 0; x < 8; ++x) {
      if (x % (1 << level) != 0) result[0][x] |= cells[x];
      result[1][x] |= cells[x] & ~first_rows;
      result[2][x] |= cells[x] & ~first_columns;
    }
  }
  return result;
}

std::array<BlockMask, 3> CellRegions::merged_edges(std::int32_t block,
                                                   const std::array<BlockMask, 3>& lone) const {
  const auto& neighbours = cells_.source(block).neighbours;
  const std::array<BlockMask, 3> inner = inner_faces(block);
  // Around an edge are its own cell and those below along u, along v, and along both. If both faces across u
  // are within cubes, or both across v, there are at most two regions.
  std::array<std::array<BlockMask, 3>, 3> before;  // by axis of the step, of inner faces
  for (int axis = 0; axis < 3; ++axis) {
    const int step[3] = {-(axis == 0), -(axis == 1), -(axis == 2)};
    const std::int32_t there = neighbours[neighbour_slot(step[0], step[1], step[2])];
    const auto beyond = there < 0 ? std::array<BlockMask, 3>{} : inner_faces(there);
    for (std::size_t a = 0; a < 3; ++a) before[axis][a] = moved_up(inner[a], beyond[a], axis);
  }
  std::array<BlockMask, 3> result;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (std::size_t word = 0; word < 8; ++word) {
      const std::uint64_t one_across_u = inner[u][word] & before[v][u][word],
                          one_across_v = inner[v][word] & before[u][v][word];
      result[axis][word] =
          cells_.source(block).crossing[axis][word] & ~lone[axis][word] & ~one_across_u & ~one_across_v;
    }
  }
  return result;
}

std::array<BlockMask, 3> CellRegions::lone_edges(std::int32_t block) const {
  const auto& neighbours = cells_.source(block).neighbours;
  constexpr BlockMask kNone{};
  std::array<const BlockMask*, 8> at;  // in blocks below along the axes whose bits are set
  for (int below = 0; below < 8; ++below) {
    const std::int32_t there = neighbours[neighbour_slot(-(below & 1), -((below >> 1) & 1), -(below >> 2))];
    at[below] = there < 0 ? &kNone : &merged(there);
  }
  std::array<BlockMask, 3> result = cells_.source(block).crossing;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const BlockMask below_v = moved_up(*at[0], *at[1u << v], v), below_u = moved_up(*at[0], *at[1u << u], u),
                    beyond = moved_up(*at[1u << u], *at[1u << u | 1u << v], v),
                    below_both = moved_up(below_v, beyond, u);
    for (std::size_t word = 0; word < 8; ++word)
      result[axis][word] &= ~((*at[0])[word] | below_u[word] | below_v[word] | below_both[word]);
  }
  return result;
}

Vector3d CellRegions::normal(const Region& region) const {
  if (region.merged()) return cubes_[number(region)].normal.cast<double>();
  Vector3d sum = Vector3d::Zero();
  const int signs =
      cells_.corner_code(cells_.cell_number(region.block, region.cell));  // Hermite data have no joints
  for (unsigned edges = kCrossedEdges[signs]; edges != 0; edges &= edges - 1) {
    const CellBlocks::Edge at = cells_.edge_of_cell(region.block, region.cell, std::countr_zero(edges));
    const auto n = cells_.grid().crossing(at.block, at.sample, at.axis).normal;
    // Of unit length, or zero in data without normals, which add nothing.
    sum += Vector3d(n[0], n[1], n[2]);
  }
  return sum.normalized();
}

}  // namespace hermesh
