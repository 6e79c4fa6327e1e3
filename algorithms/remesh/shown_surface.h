// The parts of polygons that a solid's surface does not show: the comparison by which thin parts are found.
// All lengths and positions are in voxels relative to the polygons' origin, unless stated otherwise.
#pragma once

#include <openvdb/tree/ValueAccessor.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {

/// The vertices of a triangle or of a piece of one.
using Corners = std::array<Eigen::Vector3d, 3>;

Corners corners_of(const PolygonMesh& mesh, const Triangle& triangle, double voxel_size);
Eigen::Vector3d centre(const Corners& c);
double area_of(const Corners& c);
/// Returns the normal of unit length, or zero for a degenerate triangle.
Eigen::Vector3d normal_of(const Corners& c);

/// Cuts a triangle whose longest side is longer than `limit` into smaller ones, in a fixed order: in half
/// from the vertex opposite that side, or into slices across it if the triangle is a sliver, of which halving
/// would make many. Returns nothing for a triangle that is small enough.
std::vector<Corners> cut(const Corners& c, double limit);

/// Longest side of the pieces that are compared, about.
inline constexpr double kPiece = 1.5;

/// The triangles of polygons are compared in tasks of this size, which do not depend on the number of
/// threads.
inline constexpr std::size_t kTrianglesPerTask = 1024;

/// Calls f(piece) for the pieces of a triangle, in a fixed order.
template <class F>
void for_each_piece(const Corners& c, double limit, const F& f) {
  const std::vector<Corners> parts = cut(c, limit);
  if (parts.empty()) return f(c);
  for (const Corners& part : parts) for_each_piece(part, limit, f);
}

/// The surface of a solid as its samples and its uniform mesh represent it.
class ShownSurface {
 public:
  /// @param frame the polygons' origin, world units
  ShownSurface(const LevelSet& level_set, const FloatHermite& hermite, const Eigen::Vector3d& frame,
               RunContext& context);

  using Samples = openvdb::FloatGrid::ConstUnsafeAccessor;
  Samples samples() const { return grid_.getConstUnsafeAccessor(); }

  enum class Verdict : std::uint8_t {
    shown,
    pierced,  ///< shown, but a lattice edge with both ends outside passes through: maybe a hole of a wall
    hidden,
    lost
  };
  /// Returns `shown` if the solid has surface within `limit` of a position whose normal is parallel or
  /// opposite to a normal of unit length to within a cosine of `aligned`, and `hidden` for a position inside
  /// the solid.
  Verdict look(const Eigen::Vector3d& at, const Eigen::Vector3d& normal, double limit, double aligned,
               Samples& samples) const;

  /// Returns true if all eight samples around a position are on the given side.
  bool is_all(bool inside, const Eigen::Vector3d& at) const;

  /// Returns true if the uniform mesh has surface within `limit` whose normal is parallel or opposite to
  /// within a cosine of `aligned`.
  bool mesh_shows(const Eigen::Vector3d& at, const Eigen::Vector3d& normal, double limit,
                  double aligned) const;

 private:
  bool is_pierced(const Eigen::Vector3d& at, const Eigen::Vector3d& normal, Samples& samples) const;

  const openvdb::FloatGrid& grid_;
  double voxel_size_;
  PolygonMesh mesh_;
  std::vector<Triangle> triangles_;
  std::optional<TriangleTree> tree_;
  Eigen::Vector3d shift_ = Eigen::Vector3d::Zero();
};

/// A piece that is not shown.
struct LostPiece {
  Eigen::Vector3d at, normal;
  std::uint32_t triangle;
  double area;
};

/// A set of voxels that contains all positions within a distance of some others.
class Near {
 public:
  Near(const std::vector<Eigen::Vector3d>& places, double distance);
  using Reader = openvdb::tree::ValueAccessor<const openvdb::MaskTree>;
  Reader reader() const { return Reader(cells_); }
  static bool holds(Reader& reader, const Eigen::Vector3d& p);

 private:
  openvdb::MaskTree cells_;
};

/// The comparison of all pieces with a solid's surface.
struct SurfaceComparison {
  std::vector<LostPiece> lost, pierced;
  double area = 0.0;  ///< of all polygons
  /// Results of look() for each piece of each task's triangles, in their order.
  std::vector<std::vector<ShownSurface::Verdict>> verdicts;
};

/// Compares polygons with the solid that their level set represents. A piece is shown by aligned surface
/// within half a voxel.
SurfaceComparison compare_with_solid(const PolygonMesh& mesh, const ShownSurface& shown, double voxel_size,
                                     RunContext& context);

/// Returns the positions of the pieces near some positions that a solid with a shell around thin parts does
/// not show either, by surface at the distance of the shell. Pieces in filled gaps do not count.
std::vector<Eigen::Vector3d> lost_after_thickening(const PolygonMesh& mesh, const ShownSurface& shown,
                                                   double voxel_size, const Near& around,
                                                   RunContext& context);

}  // namespace hermesh
