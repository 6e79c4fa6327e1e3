#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <span>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"
#include "algorithms/extraction/dual_contouring/qef.h"
#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/embedded_mesh/late_moves.h"
#include "algorithms/extraction/embedded_mesh/polygon_neighbourhood.h"
#include "algorithms/extraction/embedded_mesh/sheet_trials.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// A point leaves its cell only where the best place within it lies this far off the planes, in voxels and
/// root mean square: next to a feature that passes outside.
constexpr double kWorthLeavingCell = 0.03;

/// A place within the cell that is as near to the planes as this will do, in voxels and root mean square.
constexpr double kGoodEnough = 0.005;

/// What a determinant whose terms are of the order of one must exceed to be called positive: far above
/// rounding.
constexpr double kLeastVolume = 1e-5;

/// Six times the signed volume of a tetrahedron, voxels cubed.
double volume(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  return (b - a).cross(c - a).dot(d - a);
}

/// The crossings of all edges that a block's cells have, laid out as the vector code wants them
/// (leaf_kernels::RecordCube). One object serves many blocks, one after another.
class CellRecords {
 public:
  /// Reads the crossings of a block and of the lower layers of those above. False where a normal is none, as
  /// in data without normals.
  bool read(const CellBlocks& cells, std::int32_t block) {
    // The cube is large and mostly empty: only what the block before has written is cleared.
    for (const int number : written_) std::fill_n(records_[static_cast<std::size_t>(number)].data(), 4, 0.0f);
    written_.clear();
    bool all_unit = true;
    cells.grid().crossings(block, own_.data());
    const EdgeCrossing* next = own_.data();
    // Slot 0 is the block itself. From a block above, its cells have edges that start in the layer next to
    // it, and none along an axis by which that block lies above: those begin beyond the cells.
    for (int slot = 0; slot < 8; ++slot) {
      const int d[3] = {slot & 1, (slot >> 1) & 1, slot >> 2};
      const std::int32_t there =
          cells.source(block).neighbours[static_cast<std::size_t>(neighbour_slot(d[0], d[1], d[2]))];
      if (there < 0) continue;
      const std::uint64_t rows = first_layers(d[1], d[2]);
      for (int axis = 0; axis < 3; ++axis) {
        if (d[axis]) continue;
        for (int x = 0; x < (d[0] ? 1 : 8); ++x)
          for (std::uint64_t word = cells.source(there).crossing[axis][x] & rows; word != 0;
               word &= word - 1) {
            const int bit = std::countr_zero(word);
            // The block's own ones come in this very order, by axis and then by sample.
            const EdgeCrossing crossing =
                slot == 0 ? *next++ : cells.grid().crossing(there, 64 * x + bit, axis);
            const auto& n = crossing.normal;
            const int number = leaf_kernels::RecordCube::number(axis, x + 8 * d[0], (bit >> 3) + 8 * d[1],
                                                                (bit & 7) + 8 * d[2]);
            written_.push_back(number);
            records_[static_cast<std::size_t>(number)] = {
                static_cast<float>(std::clamp(double(crossing.offset), cells.margin(), 1.0 - cells.margin())),
                n[axis], n[(axis + 1) % 3], n[(axis + 2) % 3]};
            all_unit = all_unit && n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 0.5f;
          }
      }
    }
    return all_unit;
  }
  const float (*data() const)[4] { return reinterpret_cast<const float(*)[4]>(records_.data()); }

 private:
  std::vector<std::array<float, 4>> records_ =
      std::vector<std::array<float, 4>>(leaf_kernels::RecordCube::kAll);
  std::vector<int> written_;
  std::vector<EdgeCrossing> own_ = std::vector<EdgeCrossing>(3 * 512);  ///< the block's
};

/// Makes the uniform mesh step by step: cells, points, moves by the rule of tetrahedra, polygons, late moves.
class UniformContourer {
 public:
  UniformContourer(const CellGrid& grid, const DualContouringOptions& options, const FilePoints& file,
                   RunContext& context, PolygonEdges* numbers)
      : numbers_(numbers),
        cells_(grid, context),
        options_(options),
        reach_(std::min(options.reach, kFarthestFromCell)),
        file_(file),
        targets_(cells_.size()),
        points_(UniformPoints::of_few(cells_.point_count())) {
    counts_.cells = cells_.cell_count();
    if (grid.cuts().empty()) return;  // no joints
    for (std::size_t b = 0; b < cells_.size(); ++b)
      counts_.joints += static_cast<std::uint64_t>(count(cells_[static_cast<std::int32_t>(b)].joints));
  }

  const CellBlocks& cells() const { return cells_; }
  const UniformPoints& points() const { return points_; }
  const UniformCounts& counts() const { return counts_; }

  UniformMesh run(RunContext& context) {
    // The proof of the header speaks of points that lie within their cells or whose tetrahedra stay positive:
    // those of the first two steps. Polygons are made by these. Late moves keep the polygons and change
    // places alone.
    place_all_points(context);
    let_points_leave(context);
    const EdgePolygons polygons = connect(nullptr, context);
    UniformMesh mesh;
    fill(polygons, mesh, context);
    if (numbers_) number_polygons(polygons, mesh, context);
    move_points(cells_, polygons, targets_, file_, points_, context);
    // Only points with a target outside can have left.
    for_each_with_target([&](double outside) { counts_.escaped += outside > 0; });
    mesh.points = points_.take();
    mesh.counts = std::move(counts_);
    return mesh;
  }

  /// Places the points of all active cells, in place of whatever points there are.
  void place_all_points(RunContext& context) {
    points_ = UniformPoints::of_all(cells_.point_count());
    place_points_of([&](std::size_t b) { return cells_[static_cast<std::int32_t>(b)].active_mask(); },
                    context);
  }

  /// Places the points of the cells in `wanted`: active ones, a mask per block, whose points are not there
  /// yet.
  void place_points(std::span<const BlockMask> wanted, RunContext& context) {
    parallel_blocks(wanted.size(), context, [&](std::size_t b) {
      for_each_bit(wanted[b], [&](int cell) {
        const auto block = static_cast<std::int32_t>(b);
        for (int sheet = 0; sheet < cells_.point_count(block, cell); ++sheet)
          points_.ask(cells_.point(block, cell, sheet));
      });
    });
    points_.make_room();
    place_points_of([&](std::size_t b) { return wanted[b]; }, context);
  }

  /// Makes the polygons of `edges`, all crossing ones if null. The points of fanned edges come behind those
  /// of cells.
  EdgePolygons connect(const EdgeMasks* edges, RunContext& context) {
    EdgePolygons polygons = [&] {
      Stage stage(context, "connect");
      return EdgePolygons(cells_, points_, edges, context);
    }();
    // A later call is for more edges of the same cells: to hold others than the first time would make other
    // polygons where there are some already.
    if (held_) {
      polygons.centre(centred_);
      if (!held_->empty()) polygons.hold(*held_, points_, context);
      place_crossings(cells_, polygons, file_, points_, context);
    } else {
      // How far any point is out of its cell bounds where the polygons near another have their edges.
      double farthest = 0;
      for_each_with_target([&](double outside) { farthest = std::max(farthest, outside); });
      for (const CellBlocks::Cell& cell :
           hold_cells_that_meet(cells_, polygons, file_, points_, farthest, context))
        counts_.meeting_joints.emplace_back(cell.block, cell.cell);
      held_ = polygons.held_cells();
      centred_ = polygons.centred_cells();
    }
    counts_.held = held_->size();
    counts_.fanned_edges = polygons.fanned_edges();
    return polygons;
  }

 private:
  /// Places the points of the active cells wanted(b) of each block b. There is room for their points.
  template <class Wanted>
  void place_points_of(Wanted&& wanted, RunContext& context) {
    Stage stage(context, "place points");
    std::vector<std::uint32_t> several(cells_.size());
    // A block writes the points and targets of its own cells alone; targets end up in the order of cells.
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      const BlockMask asked = wanted(b);
      if (!any(asked)) return;
      const BlockMask placed = place_plain_cells(block, asked);
      for_each_bit(asked, [&](int cell) {
        if (test(placed, cell)) return;
        if (cells_.is_plain(block, cell)) {
          points_[cells_.point(block, cell, 0)] = file_.rounded(place_plain(block, cell));
          return;
        }
        const int sheets = cells_.point_count(block, cell);
        several[b] += sheets > 1;
        for (int sheet = 0; sheet < sheets; ++sheet)
          points_[cells_.point(block, cell, sheet)] = file_.rounded(place(block, cell, sheet, sheets));
      });
    });
    for (const std::uint32_t found : several) counts_.several_sheets += found;
  }

  /// Places most of a block's wanted cells by vector code: plain ones, and in optimal placement only those
  /// whose planes are nearly parallel. Returns which; all others are left to the code for single cells.
  BlockMask place_plain_cells(std::int32_t block, const BlockMask& wanted) {
    BlockMask placed{};
    const bool average = options_.placement == DualContouringOptions::Placement::average;
    if (!average && options_.truncation < leaf_kernels::kLeastTruncation) return placed;
    thread_local CellRecords records;
    if (!records.read(cells_, block)) return placed;
    constexpr std::size_t kMost = 512 + leaf_kernels::kLargestVector;
    std::array<std::uint16_t, kMost> cell{};
    std::array<std::array<float, kMost>, 3> place;
    std::array<std::uint8_t, kMost> is_placed;
    std::array<std::uint32_t, kMost> point;
    std::size_t found = 0;
    for_each_bit(wanted, [&](int at) {
      if (!cells_.is_plain(block, at)) return;
      point[found] = cells_.point(block, at, 0);
      cell[found++] = static_cast<std::uint16_t>(at);
    });
    // The last vector reads on: what it finds there must be cells, and what it makes of them is not looked
    // at.
    for (std::size_t i = 0; i < leaf_kernels::kLargestVector; ++i) cell[found + i] = 0;
    float* const out[3] = {place[0].data(), place[1].data(), place[2].data()};
    const leaf_kernels::PlainCells plain{records.data(), cell.data(), static_cast<int>(found)};
    if (average) {
      kernels_.place_mean(plain, out);
      is_placed.fill(1);
    } else {
      // Where points may leave, a cell that is far off its planes goes to best_place(), which notes the
      // target. Where they may not, any error will do.
      kernels_.place_flat(
          plain,
          {.truncation = static_cast<float>(options_.truncation),
           .smooth_share = static_cast<float>(options_.smooth_share()),
           .margin = static_cast<float>(cells_.margin()),
           .most_error = static_cast<float>(reach_ > 0 ? kWorthLeavingCell * kWorthLeavingCell : 1e6),
           .most_error_held = static_cast<float>(kGoodEnough * kGoodEnough)},
          out, is_placed.data());
    }
    for (std::size_t i = 0; i < found; ++i) {
      if (!is_placed[i]) continue;
      placed[static_cast<std::size_t>(cell[i] >> 6)] |= std::uint64_t{1} << (cell[i] & 63);
      points_[point[i]] =
          file_.rounded(cells_.corner(block, cell[i]) + Vector3d(place[0][i], place[1][i], place[2][i]));
    }
    return placed;
  }

  /// The place of a plain cell that the vector code has left over: its crossed edges follow from the signs.
  Vector3d place_plain(std::int32_t block, int cell) {
    const int signs = cells_.corner_code(cells_.cell_number(block, cell));
    const Vector3d corner = cells_.corner(block, cell);
    Qef qef(corner + Vector3d::Constant(0.5));
    for (unsigned edges = kCrossedEdges[static_cast<std::size_t>(signs)]; edges != 0; edges &= edges - 1) {
      const CellBlocks::Edge at = cells_.edge_of_cell(block, cell, std::countr_zero(edges));
      const EdgeCrossing crossing = cells_.grid().crossing(at.block, at.sample, at.axis);
      const auto& n = crossing.normal;
      qef.add_plane(cells_.crossing_point(at, crossing), Vector3d(n[0], n[1], n[2]));
    }
    if (options_.placement == DualContouringOptions::Placement::average) return qef.mass_point();
    return best_place(block, cell, qef, corner);
  }

  /// The place of a sheet's point, within the cell, and noted if it would be better off outside. With several
  /// sheets it is the mean of the loop's crossings: in their hull, which no other loop's hull meets
  /// (cell_sheets.h).
  Vector3d place(std::int32_t block, int cell, int sheet, int sheets) {
    const CellSheets& loops = cells_.sheets(block, cell);
    const Vector3d corner = cells_.corner(block, cell);
    Qef qef(corner + Vector3d::Constant(0.5));
    Vector3d sum = Vector3d::Zero();
    int crossings = 0;
    for (int edge = 0; edge < 12; ++edge) {
      if (sheets > 1 && loops.sheet_of[edge] != sheet) continue;
      const CellBlocks::Edge at = cells_.edge_of_cell(block, cell, edge);
      // A joint of one point has all crossing edges of its cell, its cuts included, of which sheet_of does
      // not tell.
      if (sheets == 1 && !cells_.is_crossed(at)) continue;
      const EdgeCrossing crossing = cells_.grid().crossing(at.block, at.sample, at.axis);
      const Vector3d point = cells_.crossing_point(at, crossing);
      const auto& n = crossing.normal;
      qef.add_plane(point, Vector3d(n[0], n[1], n[2]));
      sum += point;
      ++crossings;
    }
    if (sheets > 1 || options_.placement == DualContouringOptions::Placement::average) return sum / crossings;
    return best_place(block, cell, qef, corner);
  }

  /// The place within the cell, margin() off its faces, with the least error, drawn back on smooth surfaces.
  /// If even that is far from the planes, as beside a sharp feature that passes outside, or if these meet
  /// elsewhere, the free minimiser is aimed at.
  Vector3d best_place(std::int32_t block, int cell, const Qef& qef, const Vector3d& corner) {
    const Vector3d margin = Vector3d::Constant(cells_.margin());
    const Vector3d lower = corner + margin, upper = corner + Vector3d::Ones() - margin;
    const Vector3d free = qef.minimiser(options_.truncation),
                   mass = qef.mass_point().cwiseMax(lower).cwiseMin(upper);
    const double share = qef.share_of_minimiser(options_.smooth_share(), options_.truncation);
    // To clamp the minimiser is cheap, and mostly good enough; the search over faces, edges and corners is
    // not.
    const Vector3d nearest = free.cwiseMax(lower).cwiseMin(upper);
    // From a level set planes never meet exactly, and whether they nearly do is chance.
    const bool meet = reach_ > 0 && !options_.linear_crossings && qef.planes_meet(free, nearest);
    if (!meet && qef.error(nearest) <= kGoodEnough * kGoodEnough * qef.planes())
      return mass + share * (nearest - mass);
    const Vector3d held = qef.minimiser_within(lower, upper, options_.truncation);
    if (reach_ > 0 && (qef.error(held) > kWorthLeavingCell * kWorthLeavingCell * qef.planes() ||
                       (meet && qef.planes_meet(free, held)))) {
      const auto is_near = [&](const Vector3d& p) {
        return (p - corner - Vector3d::Constant(0.5)).cwiseAbs().maxCoeff() <= 0.5 + reach_;
      };
      // Where minima form a line or a plane, the one next to the place in the cell needs the shorter move.
      const Vector3d nearer = qef.minimiser_near(held, options_.truncation);
      if (is_near(free)) targets_[block].push_back({cell, free, is_near(nearer) ? nearer : free});
    }
    return mass + share * (held - mass);
  }

  /// Lets points leave their cells by the rule of tetrahedra. Cells of one parity share no face, so their
  /// points move independently of one another: eight rounds, with the same result whatever the order within
  /// each.
  void let_points_leave(RunContext& context) {
    Stage stage(context, "let points leave");
    for (int parity = 0; parity < 8; ++parity)
      parallel_blocks(cells_.size(), context, [&](std::size_t b) {
        for (const PointTarget& target : targets_[b]) {
          const int x = target.cell >> 6, y = (target.cell >> 3) & 7, z = target.cell & 7;
          if (((x & 1) | (y & 1) << 1 | (z & 1) << 2) == parity) leave(static_cast<std::int32_t>(b), target);
        }
      });
  }

  /// Calls f(how far the point is out of its cell along an axis, negative inside) for all that would rather
  /// be outside.
  template <class F>
  void for_each_with_target(F&& f) const {
    for (std::size_t b = 0; b < cells_.size(); ++b)
      for (const PointTarget& target : targets_[b]) {
        const auto block = static_cast<std::int32_t>(b);
        const Vector3d from_middle = points_[cells_.point(block, target.cell, 0)] -
                                     cells_.corner(block, target.cell) - Vector3d::Constant(0.5);
        f(from_middle.cwiseAbs().maxCoeff() - 0.5);
      }
  }

  /// Moves the point of one cell as far towards its target as its 24 tetrahedra stay positive. Cells with
  /// explicit faces, and those beside such, keep to their cells: the cones over their segments need it
  /// (uniform_mesh.h).
  void leave(std::int32_t block, const PointTarget& target) {
    if (cells_.has_explicit_face(block, target.cell)) return;
    Vector3d& point = points_[cells_.point(block, target.cell, 0)];
    const Vector3d corner = cells_.corner(block, target.cell);
    std::array<Vector3d, 6> beside;
    for (int face = 0; face < 6; ++face) {
      const std::optional<Vector3d> there = point_beside(block, target.cell, face);
      if (!there) return;
      beside[face] = *there;
    }
    unsigned crossed = 0;  // a bit an edge
    for (int edge = 0; edge < 12; ++edge)
      crossed |= unsigned(cells_.is_crossed(cells_.edge_of_cell(block, target.cell, edge))) << edge;
    for (const double share : {1.0, 0.75, 0.5, 0.25}) {
      // Tested as the file will hold it. Shares of the way, because the target may be just out of reach.
      const Vector3d candidate = file_.rounded(point + share * (target.place - point));
      if (!tetrahedra_are_positive(corner, candidate, beside, crossed, cells_.rounding())) continue;
      point = candidate;
      return;
    }
  }

  /// The point of the cell beyond a face, the middle of one that the surface does not pass through (no
  /// polygon uses it, but the tetrahedra do), or none if that cell has an explicit face.
  std::optional<Vector3d> point_beside(std::int32_t block, int cell, int face) const {
    int at[3] = {cell >> 6, (cell >> 3) & 7, cell & 7};
    const int step = face & 1 ? 1 : -1;
    at[face >> 1] += step;
    const CellBlocks::Cell there = cells_.locate(block, at[0], at[1], at[2]);
    if (there.block < 0 || !test(cells_[there.block].active, there.cell)) {
      Vector3d middle = cells_.corner(block, cell) + Vector3d::Constant(0.5);
      middle[face >> 1] += step;
      return middle;
    }
    if (cells_.has_explicit_face(there.block, there.cell)) return std::nullopt;
    return points_[cells_.point(there.block, there.cell, 0)];
  }

  /// Whether all tetrahedra of a lattice edge of the cell, its point and that of a cell beside it are
  /// positively oriented, and those of crossed edges stay so if a point up to `aside` from the edge's middle
  /// cuts them in two.
  static bool tetrahedra_are_positive(const Vector3d& corner, const Vector3d& point,
                                      const std::array<Vector3d, 6>& beside, unsigned crossed,
                                      const Vector3d& aside) {
    for (int face = 0; face < 6; ++face) {
      const std::array<int, 4> corners = face_corners(face), edges = face_edges(face);
      for (int i = 0; i < 4; ++i) {
        const auto at = [&](int c) {
          const std::array<int, 3> offset = corner_offset(c);
          return Vector3d(corner + Vector3d(offset[0], offset[1], offset[2]));
        };
        // Corners run counter-clockwise for a viewer whom the face's axis points at.
        const double v = volume(at(corners[i]), at(corners[(i + 1) % 4]), point, beside[face]);
        if ((face & 1 ? v : -v) < kLeastVolume) return false;
        // Either part has half of the volume, of which the move leaves a tenth at least (fan_point()).
        if (!(crossed >> edges[i] & 1)) continue;
        for (const int end : {i, (i + 1) % 4}) {
          const Vector3d to_point = point - at(corners[end]), to_beside = beside[face] - at(corners[end]);
          if (std::abs(v) < 2.5 * aside.dot(to_point.cross(to_beside).cwiseAbs())) return false;
        }
      }
    }
    return true;
  }

  /// Writes the polygons of each block to where EdgePolygons has counted them to be.
  void fill(const EdgePolygons& polygons, UniformMesh& mesh, RunContext& context) const {
    Stage stage(context, "connect");
    mesh.quads.resize(polygons.quad_count());
    mesh.triangles.resize(polygons.triangle_count());
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      Quad* quad = mesh.quads.data() + polygons.first_quad(block);
      Triangle* triangle = mesh.triangles.data() + polygons.first_triangle(block);
      PlainPoints near;
      near.read(cells_, block);
      cells_.for_each_crossing_edge(block, [&](const CellBlocks::Edge& edge) {
        polygons.polygons_of(
            edge, [&](const Quad& q) { *quad++ = q; }, [&](const Triangle& t) { *triangle++ = t; }, &near);
      });
    });
  }

  /// Writes the number of each polygon's edge. Blocks count their crossing edges in the order in which fill()
  /// makes the polygons.
  void number_polygons(const EdgePolygons& polygons, const UniformMesh& mesh, RunContext& context) {
    std::vector<std::uint64_t> first(cells_.size());
    for (std::size_t b = 0; b < cells_.size(); ++b)
      for (const BlockMask& edges : cells_.grid().blocks()[b].crossing)
        first[b] += static_cast<std::uint64_t>(count(edges));
    exclusive_scan(first, "edge crossings");
    numbers_->quads.resize(mesh.quads.size());
    numbers_->triangles.resize(mesh.triangles.size());
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      auto number = static_cast<std::uint32_t>(first[b]);
      std::uint32_t* quad = numbers_->quads.data() + polygons.first_quad(block);
      std::uint32_t* triangle = numbers_->triangles.data() + polygons.first_triangle(block);
      cells_.for_each_crossing_edge(block, [&](const CellBlocks::Edge& edge) {
        polygons.polygons_of(
            edge, [&](const Quad&) { *quad++ = number; }, [&](const Triangle&) { *triangle++ = number; });
        ++number;
      });
    });
  }

  PolygonEdges* const numbers_;
  CellBlocks cells_;
  const DualContouringOptions options_;
  const double reach_;  ///< how far points may be from their cells, voxels
  const FilePoints& file_;
  const leaf_kernels::Kernels& kernels_ = chosen_kernels<leaf_kernels::Kernels>();
  std::vector<std::vector<PointTarget>> targets_;  ///< one list per block, ascending by cell
  UniformPoints points_;
  UniformCounts counts_;
  /// The cells held, found when polygons are made first: all edges that the answer depends on are among those
  /// asked for then, and ever after.
  std::optional<std::vector<CellBlocks::Cell>> held_;
  std::vector<CellBlocks::Cell> centred_;  ///< likewise
};

/// The lattice of Hermite data, which have no cuts.
class HermiteCells : public CellGrid {
 public:
  explicit HermiteCells(const HermiteView& view) : view_(view) {}
  const HermiteView::Blocks& blocks() const override { return view_.blocks(); }
  const IndexToWorld& placement() const override { return view_.placement(); }
  EdgeCrossing crossing(std::int32_t block, int sample, int axis) const override {
    return view_.crossing(block, sample, axis);
  }
  void crossings(std::int32_t block, EdgeCrossing* out) const override { view_.crossings(block, out); }

 private:
  const HermiteView& view_;
};

}  // namespace

UniformMesh uniform_mesh(const HermiteView& grid, const DualContouringOptions& options,
                         const FilePoints& file, RunContext& context) {
  return uniform_mesh(HermiteCells(grid), options, file, context);
}

struct UniformCells::Made {
  Made(const HermiteView& view, const DualContouringOptions& options, const FilePoints& file,
       RunContext& context)
      : grid(view),
        contourer(grid, options, file, context, nullptr),
        placed(filled(contourer.cells().size(), BlockMask{}, context)) {}

  // Before the contourer, which refers to it.
  const HermiteCells grid;
  UniformContourer contourer;
  LargeArray<BlockMask> placed;  ///< cells of each block whose points are there
};

UniformCells::UniformCells(const HermiteView& grid, const DualContouringOptions& options,
                           const FilePoints& file, RunContext& context)
    : made_(std::make_unique<Made>(grid, options, file, context)) {}
UniformCells::~UniformCells() = default;

const CellBlocks& UniformCells::cells() const { return made_->contourer.cells(); }
const UniformPoints& UniformCells::points() const { return made_->contourer.points(); }
const UniformCounts& UniformCells::counts() const { return made_->contourer.counts(); }

void UniformCells::place(std::span<const BlockMask> wanted, RunContext& context) {
  // What is there already stays where it is: places that polygons were made by must not change.
  LargeArray<BlockMask> missing(wanted.size());
  parallel_blocks(missing.size(), context, [&](std::size_t b) {
    for (std::size_t word = 0; word < missing[b].size(); ++word) {
      missing[b][word] = wanted[b][word] & ~made_->placed[b][word];
      made_->placed[b][word] |= wanted[b][word];
    }
  });
  made_->contourer.place_points(missing, context);
}

void UniformCells::place_all(RunContext& context) {
  for (std::size_t b = 0; b < made_->placed.size(); ++b)
    made_->placed[b] = cells()[static_cast<std::int32_t>(b)].active_mask();
  made_->contourer.place_all_points(context);
}

EdgePolygons UniformCells::connect(const EdgeMasks* edges, RunContext& context) {
  return made_->contourer.connect(edges, context);
}

UniformMesh uniform_mesh(const CellGrid& grid, const DualContouringOptions& options, const FilePoints& file,
                         RunContext& context, PolygonEdges* edges) {
  return UniformContourer(grid, options, file, context, edges).run(context);
}

}  // namespace hermesh
