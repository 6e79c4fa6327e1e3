// Passes on the pieces of a fracture one after another, with their attributes and mass properties.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "algorithms/fracture/fracture.h"
#include "algorithms/fracture/mass_properties.h"

namespace hermesh {

struct PieceOutput {
  std::uint32_t number = 0;  ///< from 1 on
  std::string name;
  std::optional<std::uint64_t> samples;  ///< how many samples of the labelled grid are the piece's
  PolygonMesh mesh;
  MassProperties mass;
  /// Triangles and area (square world units) of the seam with each neighbour, by its number; only of tagged
  /// pieces.
  std::map<std::int32_t, std::pair<std::uint64_t, double>> neighbours;
  double conversion_seconds = 0.0, csg_seconds = 0.0, extraction_seconds = 0.0;
};

using HandOver = std::function<void(PieceOutput&&)>;

/// Fills in a piece's mass and neighbours from its mesh.
void measure_piece(PieceOutput& piece);

/// Breaks an object as labelled_fracture() does and passes on its pieces, without their measures and numbers,
/// in the order of these: with texture coordinates on the cuts and the attributes of `source`, the polygons
/// of the object, unless that is null. The returned fracture no longer contains the mesh and the pieces.
/// @throws Error and Cancelled as labelled_fracture() does.
LabelledFracture labelled_pieces(const FloatHermite& object, const Cutters& cutters,
                                 const FractureOptions& options, const PolygonMesh* source,
                                 const HandOver& hand_over, RunContext& context);

}  // namespace hermesh
