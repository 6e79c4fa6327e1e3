// hermesh::fracture: solids into pieces that fit without a gap (chapter 7).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hermesh/voxelize.h"

namespace hermesh::HERMESH_V1 {

/// A mesh that cuts.
struct CutterMesh {
  std::string name = {};
  Mesh mesh = {};
  std::size_t copies = 0;  ///< 0: once, in place; else the number of copies, scattered and rotated at random
};

/// Options of fracture(), as of `hermesh fracture`.
struct FractureOptions {
  /// voronoi:N, chunks:N (Voronoi cells with rough walls), planes:N, planes:NX,NY,NZ,D;... (N · x = D, world
  /// units), mesh:FILE,... or mesh:FILE*N. Empty if `meshes` are given.
  std::string cutters = {};
  std::vector<CutterMesh> meshes = {};  ///< cutters in memory, applied one after another
  std::uint64_t seed = 0;               ///< random seed
  double roughness = 0.12;  ///< displacement of the walls of chunks relative to the distance of seeds, 0 to 1
  std::optional<std::array<double, 3>> impact = {};  ///< scatter densest about this point, world units
  /// Distance at which that density has halved; none: a quarter of the object's longest side.
  std::optional<double> impact_radius = {};
  Volume density = {};      ///< scatter in proportion to its values
  double mesh_scale = 1.0;  ///< scale factor of scattered meshes

  std::string method = "labelled";  ///< or "thesis", §7.1 as printed
  double tolerance = 0.0;           ///< maximum distance from the finest meshes, voxels; 0: nothing is merged
  std::string rule = "printed";     ///< of the method thesis: "printed" or "repaired"
  double min_volume = 27.0;         ///< voxels: smaller pieces join a neighbour; 0 keeps all
  bool split = true;                ///< true if the disconnected parts of a piece become several pieces
  std::string hermite = "auto";     ///< data of the object: "auto", "exact" from polygons, or "level-set"
};

/// A piece of a fractured solid.
struct Piece {
  std::string name = {};
  /// World units. The method labelled adds the polygon attributes `surface` (0 original, 1 cut) and
  /// `neighbour` (the number of the adjacent piece, −1 none), the corner attribute "uv", and the attributes
  /// of the fractured mesh.
  Mesh mesh = {};
  double volume = 0.0, area = 0.0;  ///< world units
  std::array<double, 3> centre_of_mass = {0, 0, 0};
  std::array<double, 9> inertia = {};  ///< about the centre of mass at density 1, by rows
  /// Triangles and area of the seam with each neighbour, by its number, which counts from 1.
  std::map<std::int32_t, std::pair<std::uint64_t, double>> neighbours = {};
};

/// A solid in pieces; piece number n is pieces[n − 1].
struct Fracture {
  std::vector<Piece> pieces = {};
  double seconds = 0.0;  ///< of the method itself
};

/// Breaks the solid of a mesh, with a note for each cutter without effect. Pieces are closed manifolds that
/// share the triangles of their seams (method labelled). The same bytes at any number of threads.
/// @throws Error for unknown options, or a solid without an inside at this voxel size; Cancelled.
HERMESH_API Fracture fracture(const Mesh& mesh, const VoxelizeOptions& voxelizing,
                              const FractureOptions& options, Context& context);
/// Breaks the solid of a level set. @throws Error as above; Cancelled.
HERMESH_API Fracture fracture(const Volume& level_set, const FractureOptions& options, Context& context);

}  // namespace hermesh::HERMESH_V1
