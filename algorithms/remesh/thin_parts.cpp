#include "algorithms/remesh/thin_parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <vector>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/remesh/shell.h"
#include "algorithms/remesh/shown_surface.h"
#include "algorithms/search/triangle_point.h"
#include "algorithms/search/triangle_tree.h"
#include "algorithms/voxelization/distance/index_soup.h"
#include "algorithms/voxelization/inside/orientation.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

// All lengths are in voxels.
constexpr double kAround = 3.0;        ///< distance from lost pieces within which thin walls are thickened
constexpr double kBeside = 0.5;        ///< the same for pieces that a shell does not show
constexpr double kBesideCrumbs = 1.5;  ///< the same for parts that came apart
constexpr double kOff = 1e-3;          ///< start of rays, and margin of samples that are certainly inside
constexpr double kWideGap = 1.0;       ///< gaps from here on are shown by the samples in every position
constexpr double kBetween = 0.1;       ///< excess of the distance between the positions that are tested
constexpr std::uint32_t kCrumb = 64;   ///< most samples of a part that may have come apart
constexpr double kFar = 1.4;           ///< a part farther from all surface has vanished completely
constexpr double kLittleLost = 0.01;   ///< share of the area up to which only edges and tips may be lost
constexpr double kParallel = 0.9;      ///< cosine up to which the sides of a wall count as parallel
constexpr double kAlong = 0.7;         ///< the same for an open surface that continues
constexpr double kDeep =
    0.74;  ///< a position one voxel from a wall as thick as rays reach is farther from it
constexpr double kNarrow = 0.8, kEdge = 0.35;  ///< steps along the surface that distinguish wires
constexpr double kNoWall = 1e-3;               ///< thinner walls have no thickness worth reporting
constexpr double kNone = std::numeric_limits<double>::infinity();

std::string short_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// Chooses the radius of the shell around each piece.
class Thickening {
 public:
  Thickening(const PolygonMesh& mesh, double voxel_size)
      : mesh_(mesh),
        voxel_size_(voxel_size),
        triangles_(triangulated(mesh)),
        parts_(parts_of(mesh, triangles_, voxel_size)),
        tree_(parts_.points, parts_.triangles, 1.0 / voxel_size),
        orientation_(orient_faces(mesh.points, triangles_)) {}

  Corners corners(std::size_t t) const { return corners_of(mesh_, triangles_[t], voxel_size_); }

  /// The width of the wall or gap at a piece, and the radius of the shell that it needs.
  struct Need {
    double radius = 0.0;
    double inset = 0.0;   ///< offset of the shell's middle from the piece along its normal
    double wall = kNone;  ///< thickness of the wall that is thickened; 0 for an open surface
    bool is_gap = false;  ///< it fills a gap
  };
  /// Purpose of a shell: to show the pieces, to join parts that came apart at the boundary of an open
  /// surface, or to show pieces that the first shell does not.
  enum class Mode { first, boundaries, wires };
  Need need(const Corners& piece, const Vector3d& normal, std::uint32_t triangle, bool is_lost, Mode mode,
            const ShownSurface& shown) const {
    const Vector3d at = centre(piece), outwards = turn(triangle) * normal;
    const auto [ahead, behind] = across(at, outwards);
    Need result;
    Vector3d inwards = -outwards;
    double wall = kNone, gap = kNone;
    // A wall is not thin if the solid is thick behind it, e.g. where the cavity that it encloses is filled.
    if (behind.faces_away && (is_lost || !shown.is_all(true, at - outwards))) {
      wall = behind.distance;
      if (ahead.faces_here) gap = ahead.distance;
    } else if (is_thick(at, outwards, shown)) {
      if (ahead.faces_here) gap = ahead.distance;
    } else if (ahead.faces_here) {
      wall = ahead.distance;
      inwards = outwards;
    } else if (is_lost && (has_free_sides(at, outwards) || continues_open_surface(at, normal, shown))) {
      wall = 0.0;
    }
    if (std::isfinite(wall)) {
      const Vector3d within = 0.5 * wall * inwards;
      double radius = kShellRadius;
      if (mode == Mode::wires || is_wire(at + within, normal, 0.5 * wall))
        radius = kWireRadius;
      else if (mode == Mode::boundaries)
        radius = std::max(radius, radius_at_boundary(piece, within));
      result.radius = std::max(0.0, radius - 0.5 * wall);
      // The wall is thick enough for the samples, but not part of the solid, e.g. between two open surfaces.
      if (is_lost && !(result.radius > 0.0) && shown.is_all(false, at + within)) {
        result.radius = 0.5 * wall;
        result.inset = within.dot(normal);
      }
      result.wall = wall;
    }
    // A gap in front of a piece that is shown stays open.
    if (!is_lost && gap - 2.0 * result.radius < kWideGap) return {};
    if (gap < kWideGap && 0.5 * gap > result.radius) {
      result.radius = 0.5 * gap + kOff;
      result.is_gap = true;
    }
    return result;
  }

  /// Returns true if a piece bounds space that the solid fills, i.e. a cavity or a narrow gap: the piece is
  /// inside the solid.
  bool bounds_filled_space(const Vector3d& at, const Vector3d& normal, std::uint32_t triangle,
                           const ShownSurface& shown) const {
    const Vector3d outwards = turn(triangle) * normal;
    const Opposite ahead = across(at, outwards)[0];
    const double middle = ahead.faces_here ? std::min(1.0, 0.5 * ahead.distance) : 1.0;
    return shown.is_all(true, at + middle * outwards);
  }

  /// Returns true if a piece is part of a wall that is thinner than a voxel, or of an open surface if these
  /// count, and not near its boundary.
  bool is_amid_wall(const Vector3d& at, const Vector3d& normal, std::uint32_t triangle,
                    bool open_counts) const {
    const Vector3d inwards = -turn(triangle) * normal;
    const Opposite behind = across(at, inwards)[0];
    if (behind.faces_away && !(behind.slope > kParallel && behind.distance < 1.0)) return false;
    if (!behind.faces_away && !(open_counts && has_free_sides(at, inwards))) return false;
    const double half_width = behind.faces_away ? 0.5 * behind.distance : 0.0;
    const Vector3d middle = at + half_width * inwards, u = normal.unitOrthogonal(), v = normal.cross(u);
    for (const auto& [x, y] : {std::pair{1.0, 0.0}, {0.0, 1.0}, {-1.0, 0.0}, {0.0, -1.0}})
      if (is_free(middle + 1.5 * (x * u + y * v), kEdge + half_width)) return false;
    return true;
  }

 private:
  /// The next triangle along a ray: its distance, and true if its outer side faces the ray's start.
  struct Opposite {
    double distance = kNone;  ///< infinite from 2 · kWireRadius on
    bool faces_here = false, faces_away = false;
    double slope = 0.0;  ///< cosine of the angle between the ray and the triangle's normal, not negative
  };
  /// Returns the next triangle along a direction and the next one against it.
  std::array<Opposite, 2> across(const Vector3d& at, const Vector3d& along) const {
    constexpr double kReach = 2.0 * kWireRadius;
    std::array<Opposite, 2> result;
    double nearest[2] = {2.0, 2.0};
    tree_.for_each_on_segment(at - kReach * along, at + kReach * along, [&](std::uint32_t part) {
      const std::uint32_t t = parts_.owner[part];
      const Corners c = corners(t);
      const Facet facet(c[0], c[1], c[2]);
      for (std::size_t side = 0; side < 2; ++side) {
        const Vector3d direction = (side == 0 ? 1.0 : -1.0) * along;
        const double at_part = meeting(at + kOff * direction, at + kReach * direction, facet);
        if (at_part < 0.0 || at_part >= nearest[side]) continue;
        nearest[side] = at_part;
        const double slope = turn(t) * facet.normal().stableNormalized().dot(direction);
        result[side] = {kOff + at_part * (kReach - kOff), slope<0.0, slope> 0.0, std::abs(slope)};
      }
    });
    return result;
  }

  /// The triangles in parts, because the boxes of large triangles intersect many rays.
  struct Parts {
    std::vector<Eigen::Vector3f> points;
    std::vector<Triangle> triangles;
    std::vector<std::uint32_t> owner;  ///< triangle that each part belongs to
  };
  static Parts parts_of(const PolygonMesh& mesh, const std::vector<Triangle>& triangles, double voxel_size) {
    constexpr double kLongest = 4.0;
    Parts parts{mesh.points, {}, {}};
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      const Corners whole = corners_of(mesh, triangles[t], voxel_size);
      if (cut(whole, kLongest).empty()) {
        parts.triangles.push_back(triangles[t]);
        parts.owner.push_back(t);
        continue;
      }
      for_each_piece(whole, kLongest, [&](const Corners& c) {
        const auto first = static_cast<std::uint32_t>(parts.points.size());
        for (const Vector3d& p : c) parts.points.push_back((p * voxel_size).cast<float>());
        parts.triangles.push_back({first, first + 1, first + 2});
        parts.owner.push_back(t);
      });
    }
    return parts;
  }

  /// Returns 1 or −1, the factor that makes the normal of a triangle point outwards.
  double turn(std::uint32_t triangle) const { return orientation_.turns[triangle] < 0 ? -1.0 : 1.0; }

  /// Returns true if the solid is thick on one side of a piece. Both sides are tested, because the
  /// orientation of a part may be wrong.
  static bool is_thick(const Vector3d& at, const Vector3d& normal, const ShownSurface& shown) {
    return shown.is_all(true, at - normal) || shown.is_all(true, at + normal);
  }

  /// Returns true if there are no polygons one voxel away on either side, unlike at the surface of a thick
  /// solid near its edges and at the end of a wall.
  bool has_free_sides(const Vector3d& at, const Vector3d& normal) const {
    return is_free(at - normal, kDeep) && is_free(at + normal, kDeep);
  }

  /// Returns true if a piece near a crease is part of an open surface: farther from the crease both sides are
  /// empty.
  bool continues_open_surface(const Vector3d& at, const Vector3d& normal, const ShownSurface& shown) const {
    constexpr double kOnSheet = 0.5;
    const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    for (const double distance : {1.5, 3.0})
      for (int i = 0; i < 8; ++i) {
        const double angle = i * M_PI / 4.0;
        const Vector3d aside = at + distance * (std::cos(angle) * u + std::sin(angle) * v);
        const std::uint32_t part = tree_.nearest(aside, kOnSheet * kOnSheet).triangle;
        if (part == TriangleTree::kNone) continue;
        const Corners c = corners(parts_.owner[part]);
        const Vector3d there = closest_point(aside, c[0], c[1], c[2]).position, facing = normal_of(c);
        if (std::abs(facing.dot(normal)) < kAlong || is_thick(there, facing, shown)) continue;
        const auto [ahead, behind] = across(there, facing);
        if (std::isinf(ahead.distance) && std::isinf(behind.distance) && has_free_sides(there, facing))
          return true;
      }
    return false;
  }

  /// Returns true if no triangle is within a distance of a position.
  bool is_free(const Vector3d& at, double distance) const {
    return tree_.nearest(at, distance * distance, distance * distance).triangle == TriangleTree::kNone;
  }

  /// Returns true if a thin part ends on both sides along at least two of four lines: a wire or a speck.
  bool is_wire(const Vector3d& at, const Vector3d& normal, double half_width) const {
    const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    const auto ends = [&](double x, double y) {
      return is_free(at + kNarrow * (x * u + y * v), kEdge + half_width);
    };
    constexpr double kHalf = 0.7071067811865476;
    int ended = 0;
    for (const auto& [x, y] : {std::pair{1.0, 0.0}, {kHalf, kHalf}, {0.0, 1.0}, {-kHalf, kHalf}})
      ended += ends(x, y) && ends(-x, -y);
    return ended >= 2;
  }

  /// Returns the radius at the end of an open surface, where the proof for wires holds, too: the sample
  /// nearest to each position has to be inside.
  static double radius_at_boundary(const Corners& c, const Vector3d& within) {
    double farthest = 0.0;
    for (const Vector3d& p : {c[0], c[1], c[2], Vector3d(0.5 * (c[0] + c[1])), Vector3d(0.5 * (c[1] + c[2])),
                              Vector3d(0.5 * (c[2] + c[0])), centre(c)}) {
      const Vector3d q = p + within;
      farthest = std::max(farthest, (q - Vector3d(q.array().round())).norm());
    }
    return std::min(farthest + kBetween, kWireRadius);
  }

  const PolygonMesh& mesh_;
  const double voxel_size_;
  const std::vector<Triangle> triangles_;
  const Parts parts_;
  const TriangleTree tree_;
  const Orientation orientation_;
};

/// Returns the samples of components of at most kCrumb samples that lie next to others. Samples inside are
/// connected along edges and across faces.
std::vector<Vector3d> crumbs(const openvdb::FloatGrid& grid) {
  std::vector<openvdb::Coord> inside;
  openvdb::Int32Tree number(-1);
  openvdb::tree::ValueAccessor<openvdb::Int32Tree> write(number);
  for (auto value = grid.cbeginValueOn(); value; ++value)
    if (*value < 0.0f) {
      write.setValue(value.getCoord(), std::int32_t(inside.size()));
      inside.push_back(value.getCoord());
    }
  DisjointSets sets(inside.size());
  const openvdb::tree::ValueAccessor<const openvdb::Int32Tree> read(number);
  for (std::size_t i = 0; i < inside.size(); ++i)
    for (int n = 0; n < 27; ++n) {
      const openvdb::Coord step(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1);
      const std::int32_t other = read.getValue(inside[i] + step);
      if (other >= 0 && std::abs(step.x()) + std::abs(step.y()) + std::abs(step.z()) <= 2)
        sets.join(std::uint32_t(i), std::uint32_t(other));
    }
  std::vector<std::uint32_t> size(inside.size());
  for (std::uint32_t i = 0; i < inside.size(); ++i) ++size[sets.find(i)];
  std::vector<Vector3d> result;
  for (std::uint32_t i = 0; i < inside.size(); ++i) {
    if (size[sets.find(i)] > kCrumb) continue;
    bool beside_others = false;
    for (int n = 0; n < 125 && !beside_others; ++n) {
      const std::int32_t other =
          read.getValue(inside[i] + openvdb::Coord(n / 25 - 2, n / 5 % 5 - 2, n % 5 - 2));
      beside_others = other >= 0 && sets.find(std::uint32_t(other)) != sets.find(i);
    }
    if (beside_others) result.emplace_back(inside[i].x(), inside[i].y(), inside[i].z());
  }
  return result;
}

/// The shell around the pieces of some triangles, with statistics.
struct Part {
  std::vector<ShellTriangle> shell;
  double area = 0.0, thickened_area = 0.0, merged_area = 0.0;  ///< voxels²
  double thickest = 0.0, thinnest = kNone;                     ///< voxels
  bool has_open = false;
};

/// Chooses the shell around the pieces near some positions, for the triangles of one task.
class ShellMaker {
 public:
  ShellMaker(const Thickening& thickening, const ShownSurface& shown, const Near& around,
             Thickening::Mode mode, const std::vector<ShownSurface::Verdict>& verdicts, double voxel_size)
      : thickening_(thickening),
        shown_(shown),
        around_(around.reader()),
        mode_(mode),
        verdicts_(verdicts),
        voxel_size_(voxel_size) {}

  void add(std::uint32_t t, Part& part) {
    triangle_ = t;
    const Corners corners = thickening_.corners(t);
    normal_ = normal_of(corners);
    if (normal_.isZero()) return;
    part.area += area_of(corners);
    if (const Sweep sweep = sweep_of(corners, part); sweep.radius > 0.0) append(corners, sweep, part);
  }

 private:
  /// The body around a piece. Steps of 1/40 voxel keep faces in one plane together.
  struct Sweep {
    double radius = 0.0;  ///< 0: none, −1: the pieces' bodies are in the shell
    double inset = 0.0;
    bool operator==(const Sweep&) const = default;
  };

  void append(const Corners& c, const Sweep& sweep, Part& part) {
    ShellTriangle triangle{{}, sweep.radius};
    for (std::size_t k = 0; k < 3; ++k)
      triangle.corner[k] = ((c[k] + sweep.inset * normal_) * voxel_size_).cast<float>();
    part.shell.push_back(triangle);
  }

  /// Returns the body of the whole triangle if those of its pieces are the same.
  Sweep sweep_of(const Corners& c, Part& part) {
    const std::vector<Corners> pieces = cut(c, kPiece);
    if (pieces.empty()) return sweep_of_piece(c, part);
    std::vector<Sweep> sweeps;
    for (const Corners& piece : pieces) sweeps.push_back(sweep_of(piece, part));
    if (std::ranges::all_of(sweeps, [&](const Sweep& sweep) { return sweep == sweeps[0]; })) return sweeps[0];
    for (std::size_t i = 0; i < pieces.size(); ++i)
      if (sweeps[i].radius > 0.0) append(pieces[i], sweeps[i], part);
    return {.radius = -1.0};
  }

  Sweep sweep_of_piece(const Corners& c, Part& part) {
    const ShownSurface::Verdict verdict = verdicts_[piece_++];
    // A piece near a lost one may be shown, because it bounds a thick part of the solid.
    if (verdict == ShownSurface::Verdict::hidden || !Near::holds(around_, centre(c))) return {};
    const Thickening::Need need =
        thickening_.need(c, normal_, triangle_, verdict == ShownSurface::Verdict::lost, mode_, shown_);
    if (!(need.radius > 0.0)) return {};
    const double area = area_of(c);
    (need.is_gap ? part.merged_area : part.thickened_area) += area;
    if (!need.is_gap) {
      part.thickest = std::max(part.thickest, 2.0 * (need.radius - std::abs(need.inset)));
      part.has_open |= need.wall == 0.0;
      if (need.wall > 0.0) part.thinnest = std::min(part.thinnest, need.wall);
    }
    constexpr double kStep = 1.0 / 40.0;
    return {kStep * std::ceil(need.radius / kStep - 1e-6), kStep * std::round(need.inset / kStep)};
  }

  const Thickening& thickening_;
  const ShownSurface& shown_;
  Near::Reader around_;
  Thickening::Mode mode_;
  const std::vector<ShownSurface::Verdict>& verdicts_;  ///< of the pieces, in the order of addition
  std::size_t piece_ = 0;
  double voxel_size_;
  std::uint32_t triangle_ = 0;
  Vector3d normal_;
};

/// Returns the level set of an empty solid, on the lattice of unsigned distances.
LevelSet nothing_on(const openvdb::FloatGrid& distances) {
  const auto grid = openvdb::FloatGrid::create(distances.background());
  grid->setName("sdf");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setTransform(distances.transform().copy());
  return make_level_set(grid);
}

/// Returns the positions of the lost pieces that are worth a shell: all if more than kLittleLost of the area
/// is lost; otherwise those of patches with a piece that is far from the solid's surface, or amid a wall,
/// which has a hole there. The others are the outermost parts of edges and tips.
std::vector<Vector3d> worth_a_shell(const SurfaceComparison& all, const ShownSurface& shown,
                                    const Thickening& thickening) {
  std::vector<Vector3d> result;
  double area = 0.0;
  for (const LostPiece& piece : all.lost) area += piece.area;
  if (area > kLittleLost * all.area) {
    for (const LostPiece& piece : all.lost) result.push_back(piece.at);
    return result;
  }
  // Patches are sets of pieces in neighbouring cells twice as large as voxels.
  std::map<std::array<int, 3>, std::uint32_t> cells;
  const auto cell_of = [](const Vector3d& at) {
    return std::array{int(std::floor(0.5 * at.x())), int(std::floor(0.5 * at.y())),
                      int(std::floor(0.5 * at.z()))};
  };
  for (const LostPiece& piece : all.lost) cells.emplace(cell_of(piece.at), std::uint32_t(cells.size()));
  DisjointSets sets(cells.size());
  for (const auto& [cell, number] : cells)
    for (int n = 0; n < 27; ++n) {
      const auto other = cells.find({cell[0] + n / 9 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n % 3 - 1});
      if (other != cells.end()) sets.join(number, other->second);
    }
  std::vector<std::uint8_t> counts(cells.size());
  for (const LostPiece& piece : all.lost)
    if (std::uint8_t& patch = counts[sets.find(cells.at(cell_of(piece.at)))]; !patch)
      patch = !shown.mesh_shows(piece.at, piece.normal, kFar, 0.0) ||
              thickening.is_amid_wall(piece.at, piece.normal, piece.triangle, true);
  for (const LostPiece& piece : all.lost)
    if (counts[sets.find(cells.at(cell_of(piece.at)))]) result.push_back(piece.at);
  return result;
}

/// Changes lost pieces that bound filled space to hidden ones.
void hide_in_filled_space(SurfaceComparison& comparison, const Thickening& thickening,
                          const ShownSurface& shown, RunContext& context) {
  std::vector<std::uint8_t> is_hidden(comparison.lost.size());
  parallel_blocks(
      comparison.lost.size(), context,
      [&](std::size_t i) {
        const LostPiece& piece = comparison.lost[i];
        is_hidden[i] = thickening.bounds_filled_space(piece.at, piece.normal, piece.triangle, shown);
      },
      256);
  std::vector<LostPiece> lost;
  std::size_t i = 0;  // the verdicts have the order of the lost pieces
  for (std::vector<ShownSurface::Verdict>& task : comparison.verdicts)
    for (ShownSurface::Verdict& verdict : task) {
      if (verdict != ShownSurface::Verdict::lost) continue;
      if (is_hidden[i])
        verdict = ShownSurface::Verdict::hidden;
      else
        lost.push_back(comparison.lost[i]);
      ++i;
    }
  comparison.lost = std::move(lost);
}

/// Adds the shell that a solid needs to show all polygons.
std::optional<ThinParts> thicken(const PolygonMesh& mesh, SampledSolid& solid, ThinRule rule,
                                 RunContext& context) {
  const double voxel_size = solid.level_set.voxel_size(), square = voxel_size * voxel_size;
  const Stage stage(context, "thin parts");
  const std::vector<Triangle> triangles = triangulated(mesh);
  const ShownSurface shown(solid.level_set, solid.hermite, mesh.origin, context);
  SurfaceComparison comparison = compare_with_solid(mesh, shown, voxel_size, context);
  if (comparison.lost.empty() && comparison.pierced.empty()) return std::nullopt;
  const Thickening thickening(mesh, voxel_size);
  hide_in_filled_space(comparison, thickening, shown, context);
  std::vector<Vector3d> lost = worth_a_shell(comparison, shown, thickening);
  // The boundary of a narrow hole shows the polygons within it.
  for (const LostPiece& piece : comparison.pierced)
    if (thickening.is_amid_wall(piece.at, piece.normal, piece.triangle, false)) lost.push_back(piece.at);
  if (lost.empty()) return std::nullopt;
  if (rule == ThinRule::refuse) {
    const Vector3d at = mesh.origin + voxel_size * lost.front();
    throw Error("the polygons have parts that voxels of " + short_text(voxel_size) +
                " do not show, such as at (" + short_text(at.x()) + ", " + short_text(at.y()) + ", " +
                short_text(at.z()) + "); use smaller voxels, or keep thin parts, which thickens them");
  }
  const SampledSolid bare = solid;
  ThinParts sum;
  double thinnest = kNone;
  std::vector<ShellTriangle> shell;
  // Adds the shell around the pieces near some positions.
  const auto add = [&](const Near& around, Thickening::Mode mode) {
    std::vector<Part> parts((triangles.size() + kTrianglesPerTask - 1) / kTrianglesPerTask);
    parallel_blocks(parts.size(), context, [&](std::size_t chunk) {
      ShellMaker maker(thickening, shown, around, mode, comparison.verdicts[chunk], voxel_size);
      const std::size_t end = std::min(triangles.size(), (chunk + 1) * kTrianglesPerTask);
      for (std::size_t t = chunk * kTrianglesPerTask; t < end; ++t)
        maker.add(static_cast<std::uint32_t>(t), parts[chunk]);
    });
    for (const Part& part : parts) {
      shell.insert(shell.end(), part.shell.begin(), part.shell.end());
      sum.thickest = std::max(sum.thickest, part.thickest * voxel_size);
      sum.has_open |= part.has_open;
      thinnest = std::min(thinnest, part.thinnest);
      // Later shells surround pieces that already have one.
      if (mode != Thickening::Mode::first) continue;
      sum.area += part.area * square;
      sum.thickened_area += part.thickened_area * square;
      sum.merged_area += part.merged_area * square;
    }
    if (std::isfinite(thinnest)) sum.thinnest_wall = thinnest * voxel_size;
  };
  const auto join = [&] {
    CombinedSolid joined = with_shell(bare, shell, mesh.origin, context);
    solid.level_set = std::move(joined.level_set);
    solid.hermite = std::move(joined.hermite);
  };
  using Mode = Thickening::Mode;
  const Near around_lost(lost, kAround);
  add(around_lost, Mode::first);
  if (shell.empty()) return std::nullopt;
  join();
  const std::size_t first = shell.size();
  const ShownSurface thicker(solid.level_set, solid.hermite, mesh.origin, context);
  if (const auto still = lost_after_thickening(mesh, thicker, voxel_size, around_lost, context);
      !still.empty())
    add(Near(still, kBeside), Mode::wires);
  if (const auto apart = crumbs(*solid.level_set.grid().grid); !apart.empty())
    add(Near(apart, kBesideCrumbs), Mode::boundaries);
  if (shell.size() > first) join();
  return sum;
}

}  // namespace

PolygonSolid solid_of(const PolygonMesh& mesh, const LevelSet& level_set, ThinRule rule,
                      RunContext& context) {
  PolygonSolid result;
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  const bool encloses = rule == ThinRule::drop || grid.getGridClass() == openvdb::GRID_LEVEL_SET;
  result.solid.level_set = encloses ? level_set : nothing_on(grid);
  result.solid.hermite = sample_polygons(result.solid.level_set, 0.0, mesh, context, &result.solid.sampling);
  if (rule != ThinRule::drop) result.thin = thicken(mesh, result.solid, rule, context);
  return result;
}

std::string thin_note(const ThinParts& thin, double voxel_size) {
  const auto share = [&](double area) {
    return short_text(100.0 * area / thin.area) + " % of the polygons' area";
  };
  std::string note;
  if (thin.thickened_area > 0.0) {
    note = share(thin.thickened_area) + " bounds walls that are thinner than voxels of " +
           short_text(voxel_size) + " can show" + (thin.has_open ? ", or nothing at all" : "") +
           ", and was thickened by up to " + short_text(thin.thickest);
    if (thin.thinnest_wall > kNoWall * voxel_size)
      note += "; voxels of " + short_text(thin.thinnest_wall) + " would show the thinnest wall";
  }
  if (thin.merged_area > 0.0)
    note += (note.empty() ? "" : "; ") + share(thin.merged_area) +
            " is at gaps that are thinner than a voxel, which were filled";
  return note;
}

}  // namespace hermesh
