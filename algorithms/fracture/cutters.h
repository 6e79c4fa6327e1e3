// The cutters that divide a solid: they assign a code to every position and define the surface between two
// codes.
//
// A *code* identifies the part of space that contains a sample: the nearest seed, the side of each plane, or
// the first of the cutting solids that contains it. Samples of one code form one piece, until fracture.h
// splits disconnected samples into several pieces. All of these are functions of the position only, so the
// same seed gives the same pieces at any thread count.
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
#include "algorithms/lattice/placement.h"

namespace hermesh {

/// The part of space that contains a sample; the meaning of the bits depends on the kind of cutters.
using CutCode = std::uint64_t;

/// Where the surface between two codes crosses a lattice edge, and which cutter it belongs to.
struct CutCrossing {
  EdgeCrossing crossing;
  std::int32_t cutter;
};

/// The interface that labelling and meshing use. Const members may be called from several threads at once.
class Cutters {
 public:
  using At = std::array<std::int32_t, 3>;  ///< index coordinates

  virtual ~Cutters() = default;

  /// Writes the codes of the 512 samples of the block whose first sample is `lower`, in the order of
  /// sample_index().
  virtual void codes(const At& lower, std::span<CutCode, 512> codes) const = 0;

  /// Returns false if no sample of the block has the code. May also return true for other blocks, if that is
  /// cheaper to determine.
  virtual bool may_hold(const At& /*lower*/, CutCode) const { return true; }

  /// Returns the crossing of the edge from sample `at` along `axis` with the surface between two codes,
  /// `first` at the edge's first sample and `second` at the other. Returns nothing if that surface does not
  /// cross the edge, which is possible if a sample has been assigned to a piece other than its own.
  virtual std::optional<CutCrossing> crossing(const At& at, int axis, CutCode first,
                                              CutCode second) const = 0;

  /// Returns, for an edge that the surface between its two codes does not cross, the end of the edge that is
  /// nearer to the surface (offset 0 or 1), with the surface's normal. Returns nothing if the cutters cannot
  /// determine it.
  virtual std::optional<CutCrossing> nearest(const At&, int /*axis*/, CutCode, CutCode) const {
    return std::nullopt;
  }

  /// Returns the number of cutters; they are numbered from 0.
  virtual std::size_t count() const = 0;
  /// Returns the name of one cutter in an output.
  virtual std::string name(std::size_t cutter) const = 0;

  /// Returns the unit normal, in world space, of the plane that separates two codes; for a displaced wall,
  /// the normal of the plane before the displacement. Swapping the codes leaves it unchanged or negates it.
  /// Returns nothing if no single plane separates them.
  virtual std::optional<Eigen::Vector3d> plane_between(CutCode first, CutCode second) const = 0;

  /// Returns true if a code is a pattern of sides of planes, one bit per plane. Otherwise a code is the
  /// number of the cutter that contains the sample, or count() if none does.
  virtual bool plane_sides() const { return false; }
  /// Returns true if the cutter is a solid of its own that contains no sample.
  virtual bool is_empty(std::size_t) const { return false; }
  /// Returns, for a cutter that is a solid of its own, the samples of the block at `lower` inside it, even
  /// those that other cutters also contain. Returns nothing for other cutters.
  virtual std::optional<BlockMask> signs(std::size_t, const At& /*lower*/) const { return std::nullopt; }
  /// Returns the Hermite data of a cutter that is a solid of its own, owned by this object; null for other
  /// and for empty cutters.
  virtual const FloatHermite* solid(std::size_t) const { return nullptr; }
  /// Returns the name, in an output, of a piece with this code.
  virtual std::string name_of(CutCode code) const = 0;
};

/// The plane normal · x = distance, in world units; the normal need not be of unit length.
struct CuttingPlane {
  Eigen::Vector3d normal;
  double distance;
};

/// Cutters whose pieces are the patterns of the sides of all planes. On an edge that several planes cross,
/// the first of them counts.
/// @throws Error for more than 64 planes, or one whose normal has no length.
std::unique_ptr<Cutters> plane_cutters(std::vector<CuttingPlane> planes, const IndexToWorld& placement);

/// Displacement of the walls of Voronoi cells. A position x belongs to the seed nearest to x + amplitude ·
/// n(x), where n is a smooth random field of three components between −1 and 1 and two octaves (noise.h): a
/// *chunk*.
struct Displacement {
  double amplitude = 0.0;   ///< world units; 0 leaves the walls plane
  double wavelength = 1.0;  ///< world units, of the coarser octave; larger is smoother
  std::uint64_t seed = 0;
};

/// The error of the offset at which a displaced wall crosses an edge, as a part of the edge's length.
inline constexpr double kCrossingError = 1e-6;

/// Cutters whose pieces are the Voronoi cells of the seeds (world units); of equal distances the lower number
/// wins. A wall carries the number of the lower of its two seeds as its cutter.
/// @throws Error if there are no seeds.
std::unique_ptr<Cutters> voronoi_cutters(std::vector<Eigen::Vector3d> seeds, const Displacement& displacement,
                                         const IndexToWorld& placement);

/// A solid that cuts, where it lies in the world (world units).
struct CuttingMesh {
  std::string name;
  PolygonMesh mesh;
};

/// Returns cutters from solids that are applied one after another (Aldén 2011, §7.1): piece k is the part of
/// the solid inside cutter k and outside all cutters before it, and the last piece is the part outside all
/// cutters. Each mesh is voxelized on the object's lattice; its crossings are the exact hits of its polygons.
/// A mesh that is empty, or so small that it contains no sample, makes no piece.
/// @throws Error as check_voxelization_fits(); Cancelled.
std::unique_ptr<Cutters> mesh_cutters(const std::vector<CuttingMesh>& meshes, const IndexToWorld& placement,
                                      RunContext& context);

/// Returns the Hermite data of a mesh on the lattice of `placement`, which may be any regular affine map;
/// nothing for a mesh that holds no sample. @throws Error as check_voxelization_fits(); Cancelled.
std::optional<FloatHermite> hermite_on_lattice(const PolygonMesh& mesh, const IndexToWorld& placement,
                                               RunContext& context);

/// Returns a copy of the mesh, rotated about `centre` by a matrix, scaled, and translated so that `centre`
/// moves to `place` (world units).
PolygonMesh placed(const PolygonMesh& mesh, const Eigen::Matrix3d& rotation, double scale,
                   const Eigen::Vector3d& centre, const Eigen::Vector3d& place);

}  // namespace hermesh
