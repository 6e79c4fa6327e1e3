#include "algorithms/extraction/embedded_mesh/uniform_tiling.h"

#include "algorithms/core/parallel.h"

namespace hermesh {

std::optional<EdgeMasks> edges_of_active_cells(const CellBlocks& cells, const RunContext& context) {
  bool all = true;
  for (std::size_t b = 0; all && b < cells.size(); ++b)
    all = cells.grid().is_complete(cells.source(static_cast<std::int32_t>(b)).lower);
  if (all) return std::nullopt;
  EdgeMasks edges(cells.size());
  parallel_blocks(cells.size(), context, [&](std::size_t b) {
    cells.for_each_crossing_edge(static_cast<std::int32_t>(b), [&](const CellBlocks::Edge& edge) {
      for (int i = 0; i < 4; ++i)
        if (!cells.is_active(cells.cell_around(edge, i))) return;
      set_bit(edges.at(b)[edge.axis], edge.sample);
    });
  });
  return edges;
}

std::vector<VertexKey> vertex_keys(const CellBlocks& cells, const EdgePolygons& polygons,
                                   const RunContext& context) {
  std::vector<VertexKey> keys(polygons.point_count());
  parallel_blocks(cells.size(), context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    const auto at = [&](int sample) {
      const auto& lower = cells.source(block).lower;
      return std::array{lower[0] + (sample >> 6), lower[1] + (sample >> 3 & 7), lower[2] + (sample & 7)};
    };
    for_each_bit(cells[block].active_mask(), [&](int cell) {
      for (int sheet = 0; sheet < cells.point_count(block, cell); ++sheet)
        keys[cells.point(block, cell, sheet)] = {at(cell), sheet};
    });
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(polygons.fanned(block, axis), [&](int sample) {
        keys[polygons.crossing_point({block, sample, axis})] = {at(sample), 4 + axis};
      });
  });
  return keys;
}

}  // namespace hermesh
