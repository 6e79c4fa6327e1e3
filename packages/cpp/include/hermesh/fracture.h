// hermesh::fracture: solids into pieces that fit without a gap (chapter 7).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hermesh/context.h"
#include "hermesh/export.h"
#include "hermesh/mesh.h"
#include "hermesh/volume.h"
#include "hermesh/voxelize.h"

namespace hermesh::HERMESH_V1 {

/// A mesh that cuts.
struct CutterMesh {
  std::string name = {};
  Mesh mesh = {};
  std::size_t copies = 0;  ///< 0: in place, once; else as many, scattered and turned at random
};

/// How a solid is broken; what `hermesh fracture` takes.
struct FractureOptions {
  /// voronoi:N, chunks:N (Voronoi cells with rough walls), planes:N, planes:NX,NY,NZ,D;... (N · x = D, world
  /// units), mesh:FILE,... or mesh:FILE*N. Empty where `meshes` are given.
  std::string cutters = {};
  std::vector<CutterMesh> meshes = {};  ///< cutters that are at hand, one after another
  std::uint64_t seed = 0;               ///< of everything random
  double roughness =
      0.12;  ///< displacement of the walls of chunks, as a part of the distance of seeds, 0 to 1
  std::optional<std::array<double, 3>> impact = {};  ///< scatter densest about this point, world units
  std::optional<double> impact_radius =
      {};                   ///< where that density has halved; none: a quarter of the object's longest side
  Volume density = {};      ///< scatter in proportion to its values
  double mesh_scale = 1.0;  ///< of scattered meshes

  std::string method = "labelled";  ///< or "thesis", §7.1 as printed
  double tolerance = 0.0;        ///< voxels that pieces may be from their finest meshes; 0: nothing is merged
  std::string rule = "printed";  ///< of the method thesis: "printed" or "repaired"
  double min_volume = 27.0;      ///< voxels: smaller pieces join a neighbour; 0 keeps all
  bool split = true;             ///< whether a piece that falls apart becomes several
  std::string hermite = "auto";  ///< data of the object: "auto", "exact" from polygons, or "level-set"
};

/// What one piece is.
struct Piece {
  std::string name = {};
  /// World units. Polygon attributes: `surface` (0 original, 1 cut), `neighbour` (the number of the piece
  /// beyond, −1 none) and corner attribute "uv", of the method labelled; and the attributes of the mesh that
  /// was broken.
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

/// Breaks the solid of a mesh. What cutters did not cut is a note. Pieces are closed manifolds that meet in
/// shared triangles (method labelled). The same bytes at any number of threads.
/// @throws Error for options that there are not, or a solid without an inside at this size of voxel;
/// Cancelled.
HERMESH_API Fracture fracture(const Mesh& mesh, const VoxelizeOptions& voxelizing,
                              const FractureOptions& options, Context& context);
/// Breaks the solid of a level set. @throws Error as above; Cancelled.
HERMESH_API Fracture fracture(const Volume& level_set, const FractureOptions& options, Context& context);

}  // namespace hermesh::HERMESH_V1
