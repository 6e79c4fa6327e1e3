// Tiles of a lattice, so that its uniform mesh can be made part by part.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <vector>

#include "algorithms/extraction/embedded_mesh/edge_polygons.h"

namespace hermesh {

/// Identifies a vertex of the uniform mesh, in every part of a lattice that has it.
struct VertexKey {
  std::array<std::int32_t, 3> at;  ///< index coordinates of its cell, or of the first sample of its edge
  std::int32_t part;               ///< sheet of the cell, or 4 plus the axis of the fanned edge
  auto operator<=>(const VertexKey&) const = default;
};

/// A lattice that is divided into cubic tiles, which begin at multiples of their side.
///
/// **Dependencies of a tile.** The vertices and polygons of a tile, and of the three cells around it, depend
/// on the data up to kTileHalo cells around it:
/// - The code for the vertices of a cell is chosen by block, from the normals of it and its upper neighbours:
///   up to 16 cells.
/// - A vertex leaves its cell in one of eight rounds, each of which reads the cells next to it, and corners
///   that depend on cells up to two further away: 11 cells.
/// - Each round in which cells are held (tested_polygons.h) depends on data up to six cells away. Two rounds
///   are nearly always enough.
/// - Late moves never depend on another tile (late_moves.h).
///
/// Chains of ambiguous faces and of held cells have no bound, e.g. in noise. Code that joins tiles must
/// therefore compare their common vertices and polygons.
struct UniformTiling {
  int side = 0;          ///< of a tile, in cells, a multiple of 8; 0 for no tiles
  SampleBox whole = {};  ///< contains the blocks of the whole lattice, which decide on CellBlocks::margin()
  SampleBox known = SampleBox::unbounded();  ///< first samples of the cells that the data contain completely;
                                             ///< all other cells are inactive
  std::vector<VertexKey>* keys = nullptr;    ///< receives the keys of the vertices, unless null
};

/// Number of cells around a tile that its data must include, a multiple of 8; see UniformTiling.
inline constexpr int kTileHalo = 40;

/// Returns the crossed edges all of whose cells are active, or nothing if all are, as in a whole lattice.
/// @throws Cancelled
std::optional<EdgeMasks> edges_of_active_cells(const CellBlocks& cells, const RunContext& context);

/// Returns the keys of all vertices, by number. @throws Cancelled
std::vector<VertexKey> vertex_keys(const CellBlocks& cells, const EdgePolygons& polygons,
                                   const RunContext& context);

}  // namespace hermesh
