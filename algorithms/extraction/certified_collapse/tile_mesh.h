// Decimation of a uniform mesh tile by tile, and the mesh that the tiles make together.
//
// **What is decimated.** Tiles are cubes of cells of the lattice; a vertex belongs to the tile of its cell. A
// triangle *touches* the tiles of its corners and those whose closed box meets its own box. It is *loose* if
// it touches one tile only, and *fixed* otherwise: then it is part of the mesh as it is, and its corners are
// pinned. The *patch* of a tile consists of all triangles that touch it. Each patch is decimated as a mesh of
// its own (decimate_certified()), with merged vertices strictly inside the box of its tile. Each fixed
// triangle is written by the least tile of its corners.
//
// **Why no two triangles intersect.** A loose triangle lies in the open box of its tile and has all corners
// there. All triangles around a vertex that is not pinned are loose, so a vertex merges only with others that
// are in the open box, and a triangle that changes lies in it before and after, because boxes are convex.
// Open boxes of two tiles are disjoint; so are changed triangles of two tiles, which have no common vertex
// either. A fixed triangle that a changed one might intersect meets the box of the changed one's tile, and so
// is part of the proof of that patch. Two fixed triangles are those of the uniform mesh.
//
// **Distance.** No patch contains a loose triangle of another tile, so the final mesh contains all that a
// patch becomes, and the proof of each patch holds for the final mesh. Each triangle of the uniform mesh is
// in a patch.
//
// **Topology.** All triangles around a vertex are in the patch of its tile, so the tests of edges and links
// are complete, and merges within a tile preserve the topology of the whole.
//
// **Orientation.** A shell within the closed box of a tile is part of that tile's patch, and its volume is
// tested (shell_volumes.h); a patch's shells with a boundary are not. Any other shell has points on both
// sides of a plane between tiles, and so has the body that it encloses, which is connected: it contains a
// point x of the plane. All triangles that change lie in open boxes on one side of that plane or the other,
// so the section of the surface with the plane stays the same, and with it the winding number about x. As the
// shell is embedded and connected before and after, its winding number about any point is 0 or, for all
// points within, +1 if it faces outwards and −1 if not. So it faces the same way.
//
// All this requires that the patches are parts of one uniform mesh. If they are made separately, join_tiles()
// checks it: for each fixed triangle, all tiles that it touches must have it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/certified_decimation.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"

namespace hermesh {

/// Index coordinates of a tile's first cell, divided by the side of the tiles.
using TileAt = std::array<std::int32_t, 3>;

/// The decimated patch of a tile, and what other tiles share with it.
struct TileMesh {
  TileAt tile;
  std::uint32_t own = 0;                ///< number of vertices that belong to the tile, which come first
  std::vector<Eigen::Vector3f> points;  ///< world units relative to the origin; then those of other tiles
  std::vector<Triangle> triangles;      ///< those that this tile writes
  std::vector<Triangle> fixed;          ///< all fixed triangles of the patch
  /// The tiles that each of `fixed` touches: bit 9 (dx + 1) + 3 (dy + 1) + dz + 1 for that at `tile` + (dx,
  /// dy, dz).
  std::vector<std::uint32_t> touched;
  /// Vertices of fixed triangles with their keys, ascending by vertex.
  std::vector<std::pair<std::uint32_t, VertexKey>> keys;
};

/// Parameters of the decimation of all tiles.
struct TileDecimation {
  int side;          ///< of the tiles, in cells: a multiple of 8, and at least kLeastTile
  double tolerance;  ///< voxels; 0 merges nothing
  Nearness nearness = {};
};

/// Least side of a tile, in cells: a triangle then touches only tiles next to each other.
inline constexpr int kLeastTile = 16;

/// The patches of the tiles of a uniform mesh.
class TilePatches {
 public:
  /// @param uniform, keys the mesh and the keys of its vertices
  /// @param decimation side of the tiles and tolerance
  /// @param file precision of the output
  /// @param only the tile whose patch is made; all if there is none
  TilePatches(UniformMesh uniform, std::vector<VertexKey> keys, const TileDecimation& decimation,
              const FilePoints& file, const std::optional<TileAt>& only);

  /// Returns the tiles that have vertices, ascending; of a single one that or nothing.
  std::vector<TileAt> tiles() const;
  /// Decimates the patch of one of tiles(). The result depends on nothing but the patch. @throws Cancelled
  TileMesh decimated(const TileAt& tile, RunContext& context);

 private:
  template <class F>
  void for_each_touched(const Triangle& t, F&& f) const;
  TileAt tile_of(std::uint32_t vertex) const;
  Bounds box_of(const TileAt& tile) const;

  const TileDecimation decimation_;
  const FilePoints& file_;
  const std::vector<Eigen::Vector3d> points_;
  const std::vector<VertexKey> keys_;
  const std::vector<Triangle> triangles_;
  std::map<TileAt, std::vector<std::uint32_t>> patches_;  ///< triangles of each tile, ascending
  std::vector<std::uint32_t> number_;                     ///< scratch: by vertex, its number in a patch
};

/// Returns the mesh that tiles make together: vertices and triangles tile by tile, the tiles ascending.
/// @param tiles all tiles that have vertices, in any order
/// @param origin of the points, world units
/// @throws Error if a tile is missing or occurs twice, or if two tiles differ in a vertex or fixed triangle
PolygonMesh join_tiles(std::vector<TileMesh> tiles, const Eigen::Vector3d& origin);

}  // namespace hermesh
