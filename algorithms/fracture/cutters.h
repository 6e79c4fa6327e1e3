// What a solid is broken along: something that gives every place a code, and knows the surface between two
// codes.
//
// A *code* says which part of space a sample lies in: the nearest seed, on which side of each plane, the
// first of the cutting solids that holds it. Samples of one code are one piece, until fracture.h splits those
// that hang together nowhere. All of these are functions of the place alone, so the same seed gives the same
// pieces at any thread count.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh {

using CutCode = std::uint64_t;

/// Where the surface between two codes crosses a lattice edge, and which cutter it belongs to.
struct CutCrossing {
  EdgeCrossing crossing;
  std::int32_t cutter;
};

class Cutters {
 public:
  using At = std::array<std::int32_t, 3>;  ///< index coordinates

  virtual ~Cutters() = default;

  /// Codes of the 512 samples of a block, by its first sample.
  virtual void codes(const At& lower, std::span<CutCode, 512> codes) const = 0;

  /// Of the edge from sample `at` along `axis`, whose ends have these codes. Nothing where the surface
  /// between the two does not pass between them, as may be asked once a sample has been given to another
  /// piece than its own.
  virtual std::optional<CutCrossing> crossing(const At& at, int axis, CutCode first,
                                              CutCode second) const = 0;

  /// For such an edge: the end that the surface is nearer to (offset 0 or 1), with the surface's normal.
  /// Nothing if there is no telling.
  virtual std::optional<CutCrossing> nearest(const At&, int /*axis*/, CutCode, CutCode) const {
    return std::nullopt;
  }

  /// Cutters have the numbers 0 to count() − 1.
  virtual std::size_t count() const = 0;
  virtual std::string name(std::size_t cutter) const = 0;

  /// Normal of the plane (or of the plane before it was displaced) that separates two codes, in world space,
  /// of unit length, the same or opposite if they change places; nothing if it is no plane.
  virtual std::optional<Eigen::Vector3d> plane_between(CutCode first, CutCode second) const = 0;

  /// True where a code is a pattern of sides; else it is the number of the cutter that holds the sample, or
  /// count() where none does.
  virtual bool plane_sides() const { return false; }
  /// A solid of its own without any sample inside.
  virtual bool is_empty(std::size_t) const { return false; }
  /// For a cutter that is a solid of its own: which samples of a block are in it, whatever the other cutters
  /// hold.
  virtual std::optional<BlockMask> signs(std::size_t, const At& /*lower*/) const { return std::nullopt; }
  /// Its Hermite data, where it has some.
  virtual const FloatHermite* solid(std::size_t) const { return nullptr; }
  /// What a piece of that code is called, in an output.
  virtual std::string name_of(CutCode code) const = 0;
};

/// normal · x = distance in world units; the normal need not be of unit length.
struct CuttingPlane {
  Eigen::Vector3d normal;
  double distance;
};

/// Pieces are the patterns of the sides of all planes. On an edge that several planes cross, the first of
/// them counts.
/// @throws Error for more than 64 planes, or one whose normal has no length.
std::unique_ptr<Cutters> plane_cutters(std::vector<CuttingPlane> planes, const IndexToWorld& placement);

/// How far the walls of Voronoi cells are displaced. A place x belongs to the seed nearest to x + amplitude ·
/// n(x), where n is a smooth random field of three components between −1 and 1 and two octaves (noise.h): a
/// *chunk*.
struct Displacement {
  double amplitude = 0.0;   ///< world units; 0 leaves the walls plane
  double wavelength = 1.0;  ///< world units, of the coarser octave; larger is smoother
  std::uint64_t seed = 0;
};

/// A displaced wall's crossing is found to this part of the edge's length.
inline constexpr double kCrossingError = 1e-6;

/// Pieces are the Voronoi cells of the seeds (world units); of equal distances the lower number wins. A wall
/// carries the number of the lower of its two seeds as its cutter.
std::unique_ptr<Cutters> voronoi_cutters(std::vector<Eigen::Vector3d> seeds, const Displacement& displacement,
                                         const IndexToWorld& placement);

/// A solid that cuts, in place (world units).
struct CuttingMesh {
  std::string name;
  PolygonMesh mesh;
};

/// One after another (Aldén 2011, §7.1): piece k is what cutter k takes from what the ones before it left,
/// and the last piece is what no cutter takes. Each is voxelized on the object's lattice; its crossings are
/// the exact hits of its polygons. A mesh that is empty, or so small that no sample lies inside, takes
/// nothing.
/// @throws Error as check_voxelization_fits(); Cancelled.
std::unique_ptr<Cutters> mesh_cutters(const std::vector<CuttingMesh>& meshes, const IndexToWorld& placement,
                                      RunContext& context);

/// The Hermite data of a mesh on the lattice of `placement`, whatever that is. Nothing for a mesh without an
/// inside.
std::optional<FloatHermite> hermite_on_lattice(const PolygonMesh& mesh, const IndexToWorld& placement,
                                               RunContext& context);

/// Rotated about `centre` by a matrix, scaled, and moved so that `centre` comes to lie at `place`.
PolygonMesh placed(const PolygonMesh& mesh, const Eigen::Matrix3d& rotation, double scale,
                   const Eigen::Vector3d& centre, const Eigen::Vector3d& place);

}  // namespace hermesh
