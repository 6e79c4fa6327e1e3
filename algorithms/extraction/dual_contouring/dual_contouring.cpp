#include "algorithms/extraction/dual_contouring/dual_contouring.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "algorithms/core/option_table.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/dual_contouring/qef.h"
#include "algorithms/extraction/hermite_input.h"
#include "algorithms/lattice/active_cells.h"

namespace hermesh {
namespace {

/// Distance of a vertex that is held in its cell from the cell's faces, in voxels, so that two never
/// coincide.
constexpr double kCellMargin = 1.0 / 1024.0;

/// A vertex leaves its cell if the best position within it lies this far off the planes, in voxels and root
/// mean square: next to a feature that passes outside. Releasing every minimiser nearly doubles the
/// self-intersections of a scan, where they leave without need.
constexpr double kWorthLeaving = 0.1;

/// The part of the mesh from one block, and its range.
struct BlockOutput : ActiveCells {
  std::uint32_t first_quad;

  std::uint32_t point_in(int cell) const { return first_point + rank_of(*this, cell); }
};

class Contourer {
 public:
  Contourer(const HermiteView& grid, const DualContouringOptions& options)
      : grid_(grid), options_(options), outputs_(grid.blocks().size()) {}

  PolygonMesh run(RunContext& context) {
    // Count, scan, fill (core/parallel.h): in each pass a block writes its own entries and reads those of
    // earlier passes. So the mesh is the same for any number of threads.
    const std::size_t blocks = outputs_.size();
    std::vector<std::uint64_t> points(blocks), quads(blocks);
    PolygonMesh mesh;
    mesh.origin = grid_.placement().origin;
    {
      Stage stage(context, "count");
      parallel_blocks(blocks, context, [&](std::size_t b) {
        std::ranges::copy(cells_with_crossings(grid_.blocks(), b), outputs_[b].active);
        points[b] = count_before(outputs_[b]);
        for (const BlockMask& axis : grid_.blocks()[b].crossing)
          quads[b] += static_cast<std::uint64_t>(count(axis));
      });
    }
    mesh.points.resize(exclusive_scan(points, "points"));
    mesh.quads.resize(exclusive_scan(quads, "quads"));
    // Positions in voxels and double precision, for the choice of diagonals.
    positions_.resize(mesh.points.size());
    for (std::size_t b = 0; b < blocks; ++b) {
      outputs_[b].first_point = static_cast<std::uint32_t>(points[b]);
      outputs_[b].first_quad = static_cast<std::uint32_t>(quads[b]);
    }
    {
      Stage stage(context, "place points");
      parallel_blocks(blocks, context,
                      [&](std::size_t b) { place_points(static_cast<std::int32_t>(b), mesh); });
    }
    Stage stage(context, "connect");
    parallel_blocks(blocks, context, [&](std::size_t b) { connect(static_cast<std::int32_t>(b), mesh); });
    turn_lone_samples(mesh, context);
    return mesh;
  }

 private:
  /// A sample whose 26 neighbours are all on the other side, with the vertices and quads around it.
  struct LoneSample {
    Eigen::Vector3d place;                ///< voxels, relative to the placement's base
    double sign;                          ///< 1 inside, −1 outside
    std::array<std::uint32_t, 8> points;  ///< by octant, a bit an axis
    std::array<std::uint32_t, 6> quads;
    std::array<std::array<double, 2>, 3> hits;  ///< distances of the crossings below and above, by axis
  };

  /// Finds the lone samples of a block.
  void find_lone_samples(std::int32_t b, std::vector<LoneSample>& found) const {
    const HermiteView::Block& block = grid_.blocks()[b];
    BlockMask candidates;
    for (std::size_t word = 0; word < candidates.size(); ++word)
      candidates[word] = block.crossing[0][word] & block.crossing[1][word] & block.crossing[2][word];
    for_each_bit(candidates, [&](int sample) {
      const int at[3] = {sample >> 6, (sample >> 3) & 7, sample & 7};
      LoneSample lone;
      for (int axis = 0; axis < 3; ++axis) {
        lone.place[axis] = block.lower[axis] - grid_.placement().base[axis] + at[axis];
        int below[3] = {at[0], at[1], at[2]};
        --below[axis];
        const LatticePlace first[2] = {locate(block.neighbours, below[0], below[1], below[2]), {b, sample}};
        if (first[0].block < 0 || !test(grid_.blocks()[first[0].block].crossing[axis], first[0].sample))
          return;
        for (int side = 0; side < 2; ++side) {
          const auto& [there, start] = first[side];
          const double offset = grid_.crossing(there, start, axis).offset;
          lone.hits[axis][side] = side ? offset : 1.0 - offset;
          lone.quads[2 * axis + side] = outputs_[there].first_quad + grid_.blocks()[there].rank(axis, start);
        }
      }
      // If a neighbour has the same sign, the two surfaces share vertices and form one component.
      for (int n = 0; n < 27; ++n) {
        const LatticePlace other =
            locate(block.neighbours, at[0] + n / 9 - 1, at[1] + n / 3 % 3 - 1, at[2] + n % 3 - 1);
        if (n != 13 && other.block >= 0 &&
            test(grid_.blocks()[other.block].inside, other.sample) == test(block.inside, sample))
          return;
      }
      for (int octant = 0; octant < 8; ++octant) {
        const LatticePlace cell = locate(block.neighbours, at[0] - 1 + (octant & 1),
                                         at[1] - 1 + (octant >> 1 & 1), at[2] - 1 + (octant >> 2));
        lone.points[octant] = outputs_[cell.block].point_in(cell.sample);
      }
      lone.sign = test(block.inside, sample) ? 1.0 : -1.0;
      found.push_back(lone);
    });
  }

  /// Prevents the surface around a lone sample from being inside out, because vertices that leave their cells
  /// can pass one another in the middle there (but do not reach the opposite side around other samples). If
  /// its volume has the wrong sign, or none, the eight vertices move to the means of the edge crossings next
  /// to the sample, a box around it.
  void turn_lone_samples(PolygonMesh& mesh, RunContext& context) const {
    std::vector<std::vector<LoneSample>> found(outputs_.size());
    parallel_blocks(found.size(), context,
                    [&](std::size_t b) { find_lone_samples(static_cast<std::int32_t>(b), found[b]); });
    constexpr double kLeastVolume = 1e-6, kLeastHit = 1.0 / 16;  // voxels
    const double least = kLeastVolume * std::abs(grid_.placement().linear.determinant());
    const auto volume = [&](const LoneSample& lone) {
      const Eigen::Vector3d apex = mesh.points[lone.points[0]].cast<double>();
      const auto at = [&](std::uint32_t p) { return Eigen::Vector3d(mesh.points[p].cast<double>() - apex); };
      double six = 0;
      for (const std::uint32_t number : lone.quads) {
        const Quad& q = mesh.quads[number];
        six += at(q[0]).dot(at(q[1]).cross(at(q[2])) + at(q[2]).cross(at(q[3])));
      }
      return six / 6;
    };
    const auto turned = [&](const LoneSample& lone) {
      if (lone.sign * volume(lone) >= least) return false;
      for (int octant = 0; octant < 8; ++octant) {
        Eigen::Vector3d place = lone.place;
        for (int axis = 0; axis < 3; ++axis) {
          const int side = octant >> axis & 1;
          place[axis] += (side ? 1.0 : -1.0) * std::max(lone.hits[axis][side], kLeastHit) / 3.0;
        }
        mesh.points[lone.points[octant]] = grid_.placement().local(place).cast<float>();
      }
      return true;
    };
    // Two lone samples, diagonally apart, may share vertices, so all are tested again after one was turned.
    // None is turned twice: a vertex within its cell is on the right side of both.
    const auto turn = [&](std::vector<LoneSample>& list) { return std::erase_if(list, turned) > 0; };
    while (std::ranges::count_if(found, turn) > 0) {
    }
  }

  Qef gather(std::int32_t b, const int (&cell)[3], const Eigen::Vector3d& corner) const {
    // About the cell's centre, since no edge crossing is farther from it than the corners.
    Qef qef(corner + Eigen::Vector3d::Constant(0.5));
    for (int axis = 0; axis < 3; ++axis)
      for (int step = 0; step < 4; ++step) {
        int d[3] = {0, 0, 0};
        d[(axis + 1) % 3] = step & 1;
        d[(axis + 2) % 3] = step >> 1;
        const LatticePlace at =
            locate(grid_.blocks()[b].neighbours, cell[0] + d[0], cell[1] + d[1], cell[2] + d[2]);
        if (at.block < 0 || !test(grid_.blocks()[at.block].crossing[axis], at.sample)) continue;
        const EdgeCrossing crossing = grid_.crossing(at.block, at.sample, axis);
        Eigen::Vector3d point = corner + Eigen::Vector3d(d[0], d[1], d[2]);
        point[axis] += crossing.offset;
        const auto& n = crossing.normal;
        qef.add_plane(point, Eigen::Vector3d(n[0], n[1], n[2]));
      }
    return qef;
  }

  void place_points(std::int32_t b, PolygonMesh& mesh) {
    const HermiteView::Block& block = grid_.blocks()[b];
    const IndexToWorld& placement = grid_.placement();
    const Eigen::Vector3d lower(block.lower[0] - placement.base[0], block.lower[1] - placement.base[1],
                                block.lower[2] - placement.base[2]);
    for_each_bit(outputs_[b].active, [&](int sample) {
      const int cell[3] = {sample >> 6, (sample >> 3) & 7, sample & 7};
      const Eigen::Vector3d corner = lower + Eigen::Vector3d(cell[0], cell[1], cell[2]);
      const Qef qef = gather(b, cell, corner);
      const std::uint32_t point = outputs_[b].point_in(sample);
      positions_[point] = options_.placement == DualContouringOptions::Placement::average
                              ? qef.mass_point()
                              : place_by_planes(qef, corner, options_);
      // Rounded once, at the end: up to here everything is relative to the placement's base.
      mesh.points[point] = placement.local(positions_[point]).cast<float>();
    });
  }

  void connect(std::int32_t b, PolygonMesh& mesh) const {
    const HermiteView::Block& block = grid_.blocks()[b];
    const IndexToWorld& placement = grid_.placement();
    Quad* next = mesh.quads.data() + outputs_[b].first_quad;
    const auto connect_edge = [&](int axis, int sample, const std::array<LatticePlace, 4>& cells) {
      const int at[3] = {sample >> 6, (sample >> 3) & 7, sample & 7};
      Quad quad;
      // Around a crossing edge all cells are active, and the view has a block for each active cell.
      for (int i = 0; i < 4; ++i) quad[i] = outputs_[cells[i].block].point_in(cells[i].sample);
      Eigen::Vector3d hit;
      for (int a = 0; a < 3; ++a) hit[a] = block.lower[a] - placement.base[a] + at[a];
      hit[axis] += grid_.crossing(b, sample, axis).offset;
      // Diagonal 0–2 is the split. If the sample before the crossing is inside, the outside lies along the
      // axis, unless the map mirrors.
      if (second_diagonal_is_better(quad, hit, axis)) quad = {quad[1], quad[2], quad[3], quad[0]};
      if (test(block.inside, sample) == placement.mirrors()) std::swap(quad[1], quad[3]);
      *next++ = quad;
    };
    for_each_edge_with_cells(grid_.blocks(), static_cast<std::size_t>(b), connect_edge);
  }

  /// Returns where the plane of three vertices intersects the lattice edge's line, along the axis; NaN if
  /// they are collinear.
  double height(const Quad& quad, std::array<int, 3> corners, const Eigen::Vector3d& hit, int axis) const {
    // Relative to the crossing: a height of 0 means that the surface passes through it.
    const Eigen::Vector3d a = positions_[quad[corners[0]]] - hit;
    const Eigen::Vector3d normal =
        (positions_[quad[corners[1]]] - hit - a).cross(positions_[quad[corners[2]]] - hit - a);
    return normal.dot(a) / normal[axis];
  }

  /// The split must follow a crease. The edge crossing lies on the true surface, so the diagonal whose
  /// surface passes nearer to it is right; if both do, the shorter one makes the better triangles.
  bool second_diagonal_is_better(const Quad& quad, const Eigen::Vector3d& hit, int axis) const {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto left_of = [&](int i, int j) {
      const Eigen::Vector3d a = positions_[quad[i]] - hit, c = positions_[quad[j]] - hit;
      return a[u] * c[v] - a[v] * c[u] > 0;
    };
    // The lattice edge's line passes through one of the diagonal's two triangles, given by the diagonal's
    // side.
    const double first = height(quad, left_of(0, 2) ? std::array{0, 2, 3} : std::array{0, 1, 2}, hit, axis);
    const double second = height(quad, left_of(1, 3) ? std::array{1, 3, 0} : std::array{1, 2, 3}, hit, axis);
    constexpr double kAlike = 1e-3;  // voxels
    const double difference = std::abs(first) - std::abs(second);
    // A height of NaN compares as false, and leaves the choice to the lengths.
    if (std::abs(difference) > kAlike) return difference > 0;
    const double d02 = (positions_[quad[0]] - positions_[quad[2]]).squaredNorm();
    const double d13 = (positions_[quad[1]] - positions_[quad[3]]).squaredNorm();
    return d13 < d02;
  }

  const HermiteView& grid_;
  const DualContouringOptions options_;
  std::vector<BlockOutput> outputs_;
  std::vector<Eigen::Vector3d> positions_;  ///< index space, relative to the placement's base
};

const OptionTable<DualContouringOptions>& contouring_option_table() {
  using Options = DualContouringOptions;
  using Placement = Options::Placement;
  static const auto table = OptionTable<Options>()
                                .choice("placement", &Options::placement,
                                        {{"unbiased", Placement::unbiased},
                                         {"optimal", Placement::optimal},
                                         {"average", Placement::average}},
                                        "where a cell's point goes: 'optimal' minimises the QEF and keeps "
                                        "sharp features; 'unbiased' does so, too, "
                                        "but takes back by how much that lies outside of smooth surfaces; "
                                        "'average' takes the mean of its "
                                        "crossings")
                                .number("truncation", &Options::truncation, {.maximum = 1.0},
                                        "singular values below this share of the largest are dropped; larger "
                                        "is smoother and keeps fewer "
                                        "features",
                                        {"placement=unbiased|optimal"})
                                .number("reach", &Options::reach, {.maximum = 1e6},
                                        "voxels by which a point may leave its cell to meet a feature; "
                                        "larger keeps more, smaller folds "
                                        "the surface less",
                                        {"placement=unbiased|optimal"});
  return table;
}

DualContouringOptions read(const OptionTable<DualContouringOptions>& table, const ExtractionInput& input) {
  DualContouringOptions options = table.read(input.options);
  options.linear_crossings = !wants_polygons(input);
  options.caps = input.caps;
  return options;
}

}  // namespace

double DualContouringOptions::smooth_share() const {
  if (placement != Placement::unbiased) return 1.0;
  return linear_crossings ? Qef::kShareOfLinear : Qef::kShareOfExact;
}

Eigen::Vector3d place_by_planes(const Qef& qef, const Eigen::Vector3d& corner,
                                const DualContouringOptions& options) {
  const Eigen::Vector3d free = qef.minimiser(options.truncation), mass = qef.mass_point();
  const double share = qef.share_of_minimiser(options.smooth_share(), options.truncation);
  const double from_centre = (free - corner - Eigen::Vector3d::Constant(0.5)).cwiseAbs().maxCoeff();
  // Vertices on a lattice plane stay on it, except with a level set's crossings, rounded to both its sides.
  const double inside = options.linear_crossings ? 0.5 - kCellMargin : 0.5;
  if (from_centre <= inside) return mass + share * (free - mass);
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kCellMargin);
  const Eigen::Vector3d lower = corner + margin, upper = corner + Eigen::Vector3d::Ones() - margin;
  const Eigen::Vector3d held = qef.minimiser_within(lower, upper, options.truncation);
  const bool leaves = qef.error(held) > kWorthLeaving * kWorthLeaving * qef.planes() ||
                      (!options.linear_crossings && qef.planes_meet(free, held));
  if (options.reach > 0 && leaves && from_centre <= 0.5 + options.reach) return free;
  // Both ends of the path lie in the cell, and so does the path.
  const Eigen::Vector3d start = mass.cwiseMax(lower).cwiseMin(upper);
  return start + share * (held - start);
}

PolygonMesh dual_contouring(const HermiteView& grid, const DualContouringOptions& options,
                            RunContext& context) {
  return Contourer(grid, options).run(context);
}

DualContouringOptions read_dual_contouring_options(const ExtractionInput& input) {
  return read(contouring_option_table(), input);
}

DualContouringOptions read_placement_options(const ExtractionInput& input) {
  return read(contouring_option_table().without("reach"), input);
}

PolygonMesh dual_contouring(const ExtractionInput& input) {
  const DualContouringOptions options = read_dual_contouring_options(input);
  // Edge crossings without another use are found a leaf at a time and not stored. The polygons are the same
  // except for rounding.
  if (from_level_set_alone(input) && can_contour_level_set(options))
    return contour_level_set(input.level_set, input.isovalue, options, input.context);
  const FloatHermite hermite = hermite_input(input, "dual-contouring", options.needs_normals());
  return dual_contouring(view_of(hermite, input.context), options, input.context);
}

std::vector<OptionSpec> dual_contouring_options() {
  std::vector<OptionSpec> options = contouring_option_table().specs();
  const std::vector<OptionSpec> of_hermite = hermite_options();
  options.insert(options.begin() + 1, of_hermite.begin(), of_hermite.end());
  return options;
}

}  // namespace hermesh
