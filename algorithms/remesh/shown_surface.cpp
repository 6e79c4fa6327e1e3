#include "algorithms/remesh/shown_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/remesh/shell.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

constexpr double kShown = 0.5;  ///< distance within which the solid's surface shows a piece
constexpr double kShownByShell = kShellRadius + 0.2;  ///< the same for the outer face of a shell
constexpr double kAligned = 0.7;      ///< cosine of the angle up to which two normals count as parallel
constexpr double kNearPlane = 0.2;    ///< error of distances up to which samples represent a plane
constexpr double kDepthSlack = 1e-3;  ///< by which a position has to be deeper inside than it could be

openvdb::Coord cell_of(const Vector3d& at) {
  return {int(std::floor(at.x())), int(std::floor(at.y())), int(std::floor(at.z()))};
}

/// Calls f(part, piece, triangle, normal) for all pieces of a mesh, with a part for each task, and returns
/// the parts.
template <class Part, class MakePart, class F>
std::vector<Part> over_pieces(const PolygonMesh& mesh, double voxel_size, RunContext& context,
                              const MakePart& make, const F& f) {
  const std::vector<Triangle> triangles = triangulated(mesh);
  std::vector<Part> parts((triangles.size() + kTrianglesPerTask - 1) / kTrianglesPerTask);
  parallel_blocks(parts.size(), context, [&](std::size_t task) {
    auto state = make();
    const std::size_t end = std::min(triangles.size(), (task + 1) * kTrianglesPerTask);
    for (std::size_t t = task * kTrianglesPerTask; t < end; ++t) {
      const Corners corners = corners_of(mesh, triangles[t], voxel_size);
      const Vector3d normal = normal_of(corners);
      if (normal.isZero()) continue;
      for_each_piece(corners, kPiece, [&](const Corners& piece) {
        f(parts[task], piece, static_cast<std::uint32_t>(t), normal, state);
      });
    }
  });
  return parts;
}

}  // namespace

Corners corners_of(const PolygonMesh& mesh, const Triangle& triangle, double voxel_size) {
  const auto at = [&](std::size_t i) {
    return Vector3d(mesh.points[triangle[i]].cast<double>() / voxel_size);
  };
  return {at(0), at(1), at(2)};
}

Vector3d centre(const Corners& c) { return (c[0] + c[1] + c[2]) / 3.0; }

double area_of(const Corners& c) { return 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm(); }

Vector3d normal_of(const Corners& c) {
  const Vector3d normal = (c[1] - c[0]).cross(c[2] - c[0]).stableNormalized();
  return normal.squaredNorm() > 0.5 ? normal : Vector3d::Zero();
}

std::vector<Corners> cut(const Corners& c, double limit) {
  constexpr double kSliver = 0.5;  // height over length
  const double side[3] = {(c[2] - c[1]).norm(), (c[0] - c[2]).norm(), (c[1] - c[0]).norm()};
  const auto i = static_cast<std::size_t>(std::max_element(side, side + 3) - side);
  const double length = side[i];
  if (length <= limit) return {};
  const Vector3d &apex = c[i], &from = c[(i + 1) % 3], &to = c[(i + 2) % 3];
  const double height = 2.0 * area_of(c) / length;
  if (height >= kSliver * length || length <= 2.0 * limit) {
    const Vector3d middle = 0.5 * (from + to);
    return {Corners{apex, from, middle}, Corners{apex, middle, to}};
  }
  // The diagonals of slices are no longer than the limit, or the slices are square.
  const double width = std::max(std::sqrt(std::max(0.0, limit * limit - height * height)), height);
  const double foot = std::clamp((apex - from).dot(to - from) / (length * length), 0.0, 1.0);
  std::vector<Corners> parts;
  // From each end of the longest side to below the apex.
  for (const auto& [end, part, reversed] :
       {std::tuple(from, foot, false), std::tuple(to, 1.0 - foot, true)}) {
    const int slices = static_cast<int>(std::ceil(part * length / width));
    const Vector3d below = from + foot * (to - from);
    Vector3d low = end, high = end;
    for (int k = 1; k <= slices; ++k) {
      const Vector3d next_low = end + double(k) / slices * (below - end),
                     next_high = end + double(k) / slices * (apex - end);
      const auto add = [&](const Vector3d& a, const Vector3d& b, const Vector3d& d) {
        parts.push_back(reversed ? Corners{a, d, b} : Corners{a, b, d});
      };
      add(low, next_low, next_high);
      if (k > 1) add(low, next_high, high);
      low = next_low;
      high = next_high;
    }
  }
  return parts;
}

ShownSurface::ShownSurface(const LevelSet& level_set, const FloatHermite& hermite, const Vector3d& frame,
                           RunContext& context)
    : grid_(*level_set.grid().grid), voxel_size_(level_set.voxel_size()) {
  if (hermite.leaves.empty()) return;
  RunContext quiet;
  quiet.cancel = context.cancel;
  mesh_ = dual_contouring(view_of(hermite, quiet), {}, quiet);
  triangles_ = triangulated(mesh_);
  tree_.emplace(mesh_.points, triangles_, 1.0 / voxel_size_);
  shift_ = (frame - mesh_.origin) / voxel_size_;
}

ShownSurface::Verdict ShownSurface::look(const Vector3d& at, const Vector3d& normal, double limit,
                                         double aligned, Samples& samples) const {
  const openvdb::Coord cell = cell_of(at);
  bool with = true, against = true, inside_somewhere = false, outside_somewhere = false, hidden = false;
  // Most cells have all their corners in one leaf.
  const bool in_one_leaf = (cell.x() & 7) != 7 && (cell.y() & 7) != 7 && (cell.z() & 7) != 7;
  const auto* leaf = in_one_leaf ? samples.probeConstLeaf(cell) : nullptr;
  const float* values = leaf ? leaf->buffer().data() + leaf->coordToOffset(cell) : nullptr;
  for (int i = 0; i < 8; ++i) {
    const int x = i & 1, y = i >> 1 & 1, z = i >> 2;
    const Vector3d away = Vector3d(cell.x() + x, cell.y() + y, cell.z() + z) - at;
    const double value =
        (values ? values[64 * x + 8 * y + z] : samples.getValue(cell.offsetBy(x, y, z))) / voxel_size_;
    const double plane = away.dot(normal);
    with &= std::abs(value - plane) <= kNearPlane;
    against &= std::abs(value + plane) <= kNearPlane;
    (value < 0.0 ? inside_somewhere : outside_somewhere) = true;
    // No boundary is nearer to a sample inside than its depth.
    hidden |= value < 0.0 && -value > away.norm() + kDepthSlack;
  }
  if (hidden) return Verdict::hidden;
  // The distances are those to this plane, which is the cell's surface.
  if ((with || against) && inside_somewhere && outside_somewhere) return Verdict::shown;
  if (!mesh_shows(at, normal, limit, aligned)) return Verdict::lost;
  return is_pierced(at, normal, samples) ? Verdict::pierced : Verdict::shown;
}

/// Returns true if an edge of the cell around a position has both ends outside, on different sides of its
/// plane.
bool ShownSurface::is_pierced(const Vector3d& at, const Vector3d& normal, Samples& samples) const {
  const openvdb::Coord cell = cell_of(at);
  bool before[8], behind[8];
  for (int i = 0; i < 8; ++i) {
    const openvdb::Coord corner = cell.offsetBy(i & 1, i >> 1 & 1, i >> 2);
    const bool outside = samples.getValue(corner) >= 0.0f;
    const double side = (Vector3d(corner.x(), corner.y(), corner.z()) - at).dot(normal);
    before[i] = outside && side > 0.0;
    behind[i] = outside && side < 0.0;
  }
  for (int i = 0; i < 8; ++i)
    for (const int axis : {1, 2, 4})
      if (before[i] && behind[i ^ axis]) return true;
  return false;
}

bool ShownSurface::is_all(bool inside, const Vector3d& at) const {
  Samples values = samples();
  const openvdb::Coord cell = cell_of(at);
  for (int i = 0; i < 8; ++i)
    if ((values.getValue(cell.offsetBy(i & 1, i >> 1 & 1, i >> 2)) < 0.0f) != inside) return false;
  return true;
}

bool ShownSurface::mesh_shows(const Vector3d& at, const Vector3d& normal, double limit,
                              double aligned) const {
  if (!tree_) return false;
  bool shown = false;
  const Vector3d place = at + shift_, reach = Vector3d::Constant(limit);
  tree_->for_each_near(place - reach, place + reach, [&](std::uint32_t t) {
    if (shown) return;
    const Vector3d a = tree_->corner(t, 0), b = tree_->corner(t, 1), c = tree_->corner(t, 2);
    const Vector3d facing = (b - a).cross(c - a);
    shown = std::abs(facing.dot(normal)) >= aligned * facing.norm() &&
            squared_distance(place, a, b, c) <= limit * limit;
  });
  return shown;
}

Near::Near(const std::vector<Vector3d>& places, double distance) {
  const Vector3d reach = Vector3d::Constant(distance);
  for (const Vector3d& p : places)
    cells_.fill(openvdb::CoordBBox(cell_of(p - reach), cell_of(p + reach)), true);
  cells_.voxelizeActiveTiles();
}

bool Near::holds(Reader& reader, const Vector3d& p) { return reader.isValueOn(cell_of(p)); }

SurfaceComparison compare_with_solid(const PolygonMesh& mesh, const ShownSurface& shown, double voxel_size,
                                     RunContext& context) {
  struct Part {
    std::vector<LostPiece> lost, pierced;
    std::vector<ShownSurface::Verdict> verdicts;
    double area = 0.0;
  };
  std::vector<Part> parts = over_pieces<Part>(
      mesh, voxel_size, context, [&] { return shown.samples(); },
      [&](Part& part, const Corners& piece, std::uint32_t t, const Vector3d& normal,
          ShownSurface::Samples& samples) {
        const Vector3d at = centre(piece);
        const double area = area_of(piece);
        part.area += area;
        part.verdicts.push_back(shown.look(at, normal, kShown, kAligned, samples));
        if (part.verdicts.back() == ShownSurface::Verdict::lost) part.lost.push_back({at, normal, t, area});
        if (part.verdicts.back() == ShownSurface::Verdict::pierced)
          part.pierced.push_back({at, normal, t, area});
      });
  SurfaceComparison all;
  for (Part& part : parts) {
    all.lost.insert(all.lost.end(), part.lost.begin(), part.lost.end());
    all.pierced.insert(all.pierced.end(), part.pierced.begin(), part.pierced.end());
    all.area += part.area;
    all.verdicts.push_back(std::move(part.verdicts));
  }
  return all;
}

std::vector<Vector3d> lost_after_thickening(const PolygonMesh& mesh, const ShownSurface& shown,
                                            double voxel_size, const Near& around, RunContext& context) {
  using Part = std::vector<Vector3d>;
  const auto parts = over_pieces<Part>(
      mesh, voxel_size, context, [&] { return std::pair(shown.samples(), around.reader()); },
      [&](Part& part, const Corners& piece, std::uint32_t, const Vector3d& normal,
          std::pair<ShownSurface::Samples, Near::Reader>& state) {
        const Vector3d at = centre(piece);
        if (Near::holds(state.second, at) &&
            shown.look(at, normal, kShownByShell, 0.0, state.first) == ShownSurface::Verdict::lost &&
            !shown.is_all(true, at))
          part.push_back(at);
      });
  Part all;
  for (const Part& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace hermesh
