#include "algorithms/extraction/manifold_dual_contouring/uniform_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/dual_contouring/qef.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// A point leaves its cell only where the best place within it lies this far off the planes, in voxels and root mean
/// square: next to a feature that passes outside.
constexpr double kWorthLeaving = 0.03;

/// Of a determinant whose terms are of the order of one, far above rounding: what is called positive.
constexpr double kPositive = 1e-5;

double volume(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  return (b - a).cross(c - a).dot(d - a);
}

class Contourer {
 public:
  Contourer(const CellGrid& grid, const DualContouringOptions& options, const FilePoints& file, RunContext& context,
            PolygonEdges* numbers)
      : numbers_(numbers), cells_(grid, context), options_(options), file_(file), wishes_(cells_.size()), edges_(cells_.size()) {}

  UniformMesh run(RunContext& context) {
    UniformMesh mesh;
    place_points(mesh, context);
    let_points_leave(mesh, context);
    connect(mesh, context);
    return mesh;
  }

 private:
  /// Where a point would rather be.
  struct Wish {
    int cell;
    Vector3d place;
  };
  /// What becomes of a block's crossing edges.
  struct BlockEdges {
    std::array<BlockMask, 3> fanned{}, second_diagonal{};
    std::uint32_t first_crossing_point = 0, first_quad = 0, first_triangle = 0;
  };

  void place_points(UniformMesh& mesh, RunContext& context) {
    Stage stage(context, "place points");
    mesh.points.resize(cells_.point_count());
    std::vector<std::uint32_t> several(cells_.size());
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      for_each_bit(cells_[block].active, [&](int cell) {
        const int sheets = cells_.point_count(block, cell);
        several[b] += sheets > 1;
        for (int sheet = 0; sheet < sheets; ++sheet)
          mesh.points[cells_.point(block, cell, sheet)] = file_.rounded(place(block, cell, sheet, sheets));
      });
    });
    for (std::size_t b = 0; b < cells_.size(); ++b) {
      mesh.cells += static_cast<std::uint64_t>(count(cells_[static_cast<std::int32_t>(b)].active));
      mesh.joints += static_cast<std::uint64_t>(count(cells_[static_cast<std::int32_t>(b)].joints));
      mesh.several_sheets += several[b];
    }
  }

  /// Within the cell, and noted if it would be better off outside. With several sheets the mean of the loop's crossings:
  /// in their hull.
  Vector3d place(std::int32_t block, int cell, int sheet, int sheets) {
    const CellSheets& loops = cells_.sheets(block, cell);
    const bool joint = cells_.is_joint(block, cell);
    const Vector3d corner = cells_.corner(block, cell);
    Qef qef(corner + Vector3d::Constant(0.5));
    Vector3d sum = Vector3d::Zero();
    int crossings = 0;
    for (int edge = 0; edge < 12; ++edge) {
      if (!joint && loops.sheet_of[edge] != sheet) continue;
      const CellBlocks::Edge at = cells_.edge_of_cell(block, cell, edge);
      if (joint && !cells_.is_crossed(at)) continue;
      const EdgeCrossing crossing = cells_.grid().crossing(at.block, at.sample, at.axis);
      const Vector3d point = cells_.crossing_point(at);
      const auto& n = crossing.normal;
      qef.add_plane(point, Vector3d(n[0], n[1], n[2]));
      sum += point;
      ++crossings;
    }
    if (sheets > 1 || options_.placement == DualContouringOptions::Placement::average) return sum / crossings;
    return best_place(block, cell, qef, corner);
  }

  Vector3d best_place(std::int32_t block, int cell, const Qef& qef, const Vector3d& corner) {
    const Vector3d margin = Vector3d::Constant(CellBlocks::kMargin);
    const Vector3d held = qef.minimiser_within(corner + margin, corner + Vector3d::Ones() - margin, options_.truncation);
    if (options_.reach > 0 && qef.error(held) > kWorthLeaving * kWorthLeaving * qef.planes()) {
      const Vector3d free = qef.minimiser(options_.truncation);
      const Vector3d from_centre = free - corner - Vector3d::Constant(0.5);
      if (from_centre.cwiseAbs().maxCoeff() <= 0.5 + options_.reach) wishes_[block].push_back({cell, free});
    }
    return held;
  }

  /// Cells of one parity share no face, so their points move independently of one another: eight rounds, the same result
  /// whatever the order within each.
  void let_points_leave(UniformMesh& mesh, RunContext& context) {
    Stage stage(context, "let points leave");
    std::vector<std::uint32_t> escaped(cells_.size());
    for (int parity = 0; parity < 8; ++parity)
      parallel_blocks(cells_.size(), context, [&](std::size_t b) {
        for (const Wish& wish : wishes_[b]) {
          const int x = wish.cell >> 6, y = (wish.cell >> 3) & 7, z = wish.cell & 7;
          if (((x & 1) | (y & 1) << 1 | (z & 1) << 2) == parity)
            escaped[b] += leave(static_cast<std::int32_t>(b), wish, mesh.points);
        }
      });
    for (const std::uint32_t n : escaped) mesh.escaped += n;
  }

  bool leave(std::int32_t block, const Wish& wish, std::vector<Vector3d>& points) const {
    if (cells_.has_explicit_face(block, wish.cell)) return false;
    Vector3d& point = points[cells_.point(block, wish.cell, 0)];
    const Vector3d corner = cells_.corner(block, wish.cell);
    std::array<Vector3d, 6> beside;
    for (int face = 0; face < 6; ++face) {
      const std::optional<Vector3d> there = point_beside(block, wish.cell, face, points);
      if (!there) return false;
      beside[face] = *there;
    }
    for (const double share : {1.0, 0.75, 0.5, 0.25}) {
      const Vector3d candidate = file_.rounded(point + share * (wish.place - point));
      if (!tetrahedra_are_positive(corner, candidate, beside)) continue;
      point = candidate;
      return true;
    }
    return false;
  }

  /// The middle of a cell that the surface does not pass through: no polygon uses it, but the tetrahedra do.
  std::optional<Vector3d> point_beside(std::int32_t block, int cell, int face, const std::vector<Vector3d>& points) const {
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
    return points[cells_.point(there.block, there.cell, 0)];
  }

  static bool tetrahedra_are_positive(const Vector3d& corner, const Vector3d& point,
                                      const std::array<Vector3d, 6>& beside) {
    for (int face = 0; face < 6; ++face) {
      const std::array<int, 4> corners = face_corners(face);
      for (int i = 0; i < 4; ++i) {
        const auto at = [&](int c) {
          const std::array<int, 3> offset = corner_offset(c);
          return Vector3d(corner + Vector3d(offset[0], offset[1], offset[2]));
        };
        // Corners run counter-clockwise seen along the face's axis, so from the cell below to the one above.
        const double v = volume(at(corners[i]), at(corners[(i + 1) % 4]), point, beside[face]);
        if ((face & 1 ? v : -v) < kPositive) return false;
      }
    }
    return true;
  }

  void connect(UniformMesh& mesh, RunContext& context) {
    Stage stage(context, "connect");
    const std::size_t blocks = cells_.size();
    std::vector<std::uint64_t> crossing_points(blocks), quads(blocks), triangles(blocks);
    parallel_blocks(blocks, context, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      cells_.for_each_crossing_edge(block, [&](const CellBlocks::Edge& edge) {
        const std::optional<int> fan = decide(edge, mesh.points);
        quads[b] += !fan;
        crossing_points[b] += fan.has_value();
        triangles[b] += static_cast<std::uint64_t>(fan.value_or(0));
      });
    });
    const std::size_t of_cells = mesh.points.size();
    mesh.fanned_edges = exclusive_scan(crossing_points, "points");
    if (of_cells + mesh.fanned_edges > std::numeric_limits<std::uint32_t>::max())
      throw Error("the mesh would have more points than 32-bit indices can number; use larger voxels");
    mesh.points.resize(of_cells + mesh.fanned_edges);
    mesh.quads.resize(exclusive_scan(quads, "quads"));
    mesh.triangles.resize(exclusive_scan(triangles, "triangles"));
    for (std::size_t b = 0; b < blocks; ++b) {
      edges_[b].first_crossing_point = static_cast<std::uint32_t>(of_cells + crossing_points[b]);
      edges_[b].first_quad = static_cast<std::uint32_t>(quads[b]);
      edges_[b].first_triangle = static_cast<std::uint32_t>(triangles[b]);
    }
    parallel_blocks(blocks, context, [&](std::size_t b) { fill(static_cast<std::int32_t>(b), mesh); });
    if (numbers_) number_polygons(mesh, context);
  }

  /// Blocks count their crossing edges in the order in which fill() makes the polygons.
  void number_polygons(const UniformMesh& mesh, RunContext& context) {
    std::vector<std::uint64_t> first(cells_.size());
    for (std::size_t b = 0; b < cells_.size(); ++b)
      for (const BlockMask& edges : cells_.grid().blocks()[b].crossing) first[b] += static_cast<std::uint64_t>(count(edges));
    exclusive_scan(first, "edge crossings");
    numbers_->quads.resize(mesh.quads.size());
    numbers_->triangles.resize(mesh.triangles.size());
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      auto number = static_cast<std::uint32_t>(first[b]);
      std::uint32_t* quad = numbers_->quads.data() + edges_[b].first_quad;
      std::uint32_t* triangle = numbers_->triangles.data() + edges_[b].first_triangle;
      cells_.for_each_crossing_edge(static_cast<std::int32_t>(b), [&](const CellBlocks::Edge& edge) {
        if (test(edges_[b].fanned[edge.axis], edge.sample))
          for (int left = fan_size(edge, cells_.around(edge)); left > 0; --left) *triangle++ = number;
        else
          *quad++ = number;
        ++number;
      });
    });
  }

  /// Triangles of a fanned edge: 0 where the other ends of its segments speak for all of them.
  int fan_size(const CellBlocks::Edge& edge, const CellBlocks::Around& around) const {
    int made = 0;
    for (int i = 0; i < 4; ++i) {
      if (!cells_.is_explicit(around, i))
        ++made;
      else if (cells_.comes_first(edge, cells_.other_end(around, i)))
        made += 2;
    }
    return made;
  }

  /// Number of triangles that the edge is fanned into, which is 0 where the other ends of its segments speak for them;
  /// nothing if it becomes a quad.
  std::optional<int> decide(const CellBlocks::Edge& edge, const std::vector<Vector3d>& points) {
    BlockEdges& edges = edges_[edge.block];
    const CellBlocks::Around around = cells_.around(edge);
    bool any_explicit = false;
    for (int i = 0; i < 4; ++i) any_explicit = any_explicit || cells_.is_explicit(around, i);
    const int diagonal = any_explicit ? -1 : safe_diagonal(edge, around, points);
    if (diagonal < 0) {
      set(edges.fanned[edge.axis], edge.sample);
      return fan_size(edge, around);
    }
    if (diagonal == 1) set(edges.second_diagonal[edge.axis], edge.sample);
    return std::nullopt;
  }

  static void set(BlockMask& mask, int sample) { mask[sample >> 6] |= std::uint64_t{1} << (sample & 63); }

  /// The corner of a quad in the edge's own frame: along (axis+1) % 3, (axis+2) % 3 and the axis, from the edge's start.
  struct Corner {
    double u, v, h;
  };

  /// 0 or 1 for the diagonal to cut along; −1 if neither keeps the triangles in the envelope.
  int safe_diagonal(const CellBlocks::Edge& edge, const CellBlocks::Around& around,
                    const std::vector<Vector3d>& points) const {
    const Vector3d start = cells_.corner(edge.block, edge.sample);
    std::array<Corner, 4> r;
    for (int i = 0; i < 4; ++i) {
      const Vector3d p = points[around.points[i]] - start;
      r[i] = {p[(edge.axis + 1) % 3], p[(edge.axis + 2) % 3], p[edge.axis]};
    }
    const double hit = cells_.grid().crossing(edge.block, edge.sample, edge.axis).offset;
    std::array<std::optional<double>, 2> off;  // of the surface from the crossing, in voxels along the edge
    for (int d = 0; d < 2; ++d)
      if (const std::optional<double> height = height_if_safe(r, d)) off[d] = std::abs(*height - hit);
    if (!off[0] && !off[1]) return -1;
    if (!off[0] || !off[1]) return off[1] ? 1 : 0;
    // The split must follow a crease. The crossing itself lies on the surface, so the diagonal is right whose triangles
    // pass nearer to it; where both do, the shorter one makes the better triangles.
    constexpr double kAlike = 1e-4;
    if (std::abs(*off[0] - *off[1]) > kAlike) return *off[1] < *off[0];
    const auto squared = [&](int i, int j) {
      const double du = r[i].u - r[j].u, dv = r[i].v - r[j].v, dh = r[i].h - r[j].h;
      return du * du + dv * dv + dh * dh;
    };
    return squared(1, 3) < squared(0, 2);
  }

  /// Where the edge passes through the two triangles of diagonal (d, d+2), if both lie in the envelope. The diagonal
  /// passes the edge on one side, through the half-plane of the corner k there. If it passes through the triangle of the
  /// edge with k, the triangle on that side is within the two tetrahedra of k; if, besides, the edge passes through the
  /// other triangle, that one is within all four.
  static std::optional<double> height_if_safe(const std::array<Corner, 4>& r, int d) {
    constexpr double kMargin = 1e-4;
    const auto cross = [](const Corner& a, const Corner& b) { return a.u * b.v - a.v * b.u; };
    for (int i = 0; i < 4; ++i)
      if (cross(r[i], r[(i + 1) % 4]) < kPositive) return std::nullopt;
    const Corner &a = r[d], &c = r[d + 2];
    const bool left = cross(a, c) > 0;  // the edge is on the left of the diagonal, and so is corner d+3
    const Corner &beyond = r[left ? d + 1 : (d + 3) % 4], &other = r[left ? (d + 3) % 4 : d + 1];
    // Where the diagonal meets the half-plane of `beyond`: at `share` of the way to it from the edge.
    const double from_a = cross(beyond, a), from_c = cross(beyond, c);
    const double t = from_a / (from_a - from_c);
    const Corner q = {a.u + t * (c.u - a.u), a.v + t * (c.v - a.v), a.h + t * (c.h - a.h)};
    const double share = (q.u * beyond.u + q.v * beyond.v) / (beyond.u * beyond.u + beyond.v * beyond.v);
    if (!(share > -kMargin && share < 1 - kMargin)) return std::nullopt;
    if (!(q.h > share * beyond.h + kMargin && q.h < 1 - share * (1 - beyond.h) - kMargin)) return std::nullopt;
    const double wa = cross(c, other), wc = cross(other, a), wo = cross(a, c), sum = wa + wc + wo;
    if (std::abs(sum) < kPositive) return std::nullopt;
    const double height = (wa * a.h + wc * c.h + wo * other.h) / sum;
    if (!(height > kMargin && height < 1 - kMargin)) return std::nullopt;
    return height;
  }

  std::uint32_t crossing_point(const CellBlocks::Edge& edge) const {
    const BlockEdges& edges = edges_[edge.block];
    std::uint32_t number = edges.first_crossing_point;
    for (int axis = 0; axis < edge.axis; ++axis) number += static_cast<std::uint32_t>(count(edges.fanned[axis]));
    return number + rank_in(edges.fanned[edge.axis], edge.sample);
  }

  void fill(std::int32_t block, UniformMesh& mesh) const {
    const BlockEdges& edges = edges_[block];
    Quad* quad = mesh.quads.data() + edges.first_quad;
    Triangle* triangle = mesh.triangles.data() + edges.first_triangle;
    cells_.for_each_crossing_edge(block, [&](const CellBlocks::Edge& edge) {
      const CellBlocks::Around around = cells_.around(edge);
      const bool outwards = test(cells_[block].inside, edge.sample);  // along the axis
      if (!test(edges.fanned[edge.axis], edge.sample)) {
        const int d = test(edges.second_diagonal[edge.axis], edge.sample);
        Quad q = {around.points[d], around.points[d + 1], around.points[d + 2], around.points[(d + 3) % 4]};
        if (!outwards) std::swap(q[1], q[3]);
        *quad++ = q;
        return;
      }
      const std::uint32_t x = crossing_point(edge);
      mesh.points[x] = file_.rounded(cells_.crossing_point(edge));
      const auto add = [&](std::uint32_t b, std::uint32_t c) {
        *triangle++ = outwards ? Triangle{x, b, c} : Triangle{x, c, b};
      };
      for (int i = 0; i < 4; ++i) {
        const std::uint32_t p = around.points[i], q = around.points[(i + 1) % 4];
        if (!cells_.is_explicit(around, i)) {
          add(p, q);
          continue;
        }
        const CellBlocks::Edge other = cells_.other_end(around, i);
        if (!cells_.comes_first(edge, other)) continue;
        const std::uint32_t y = crossing_point(other);
        add(p, y);
        add(y, q);
      }
    });
  }

  PolygonEdges* const numbers_;
  CellBlocks cells_;
  const DualContouringOptions options_;
  const FilePoints& file_;
  std::vector<std::vector<Wish>> wishes_;  ///< by block
  std::vector<BlockEdges> edges_;
};

/// Hermite data have no cuts.
class HermiteCells : public CellGrid {
 public:
  explicit HermiteCells(const HermiteView& view) : view_(view) {}
  const std::vector<HermiteView::Block>& blocks() const override { return view_.blocks(); }
  const IndexToWorld& placement() const override { return view_.placement(); }
  EdgeCrossing crossing(std::int32_t block, int sample, int axis) const override {
    return view_.crossing(block, sample, axis);
  }

 private:
  const HermiteView& view_;
};

}  // namespace

UniformMesh uniform_mesh(const HermiteView& grid, const DualContouringOptions& options, const FilePoints& file,
                         RunContext& context) {
  return uniform_mesh(HermiteCells(grid), options, file, context);
}

UniformMesh uniform_mesh(const CellGrid& grid, const DualContouringOptions& options, const FilePoints& file,
                         RunContext& context, PolygonEdges* edges) {
  return Contourer(grid, options, file, context, edges).run(context);
}

}  // namespace hermesh
