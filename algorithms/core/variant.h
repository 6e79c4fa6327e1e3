// What a variant is: a name with a function, its options, and what it promises. The tables of variants
// (algorithms/variants.cpp, reference/variants.cpp) are arrays of these; nothing registers itself.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "algorithms/core/bounds.h"
#include "algorithms/core/level_set.h"
#include "algorithms/core/options.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// What a variant guarantees for every finite input. A broken promise is an error of the run; a defect that
/// nobody promised away is a plain figure.
struct Promises {
  bool closed = false;                ///< no boundary edge
  bool manifold = false;              ///< no non-manifold edge or vertex
  bool oriented = false;              ///< no inconsistently oriented edge
  bool no_self_intersection = false;  ///< no pair of polygons meets except along a shared corner or edge
};

struct AdaptivityField;  // extraction/adaptivity_field.h
struct EdgeCrossing;     // hermite/crossing.h
template <class Crossing>
struct SparseHermite;  // hermite/sparse_hermite.h

/// Input of an extractor: a volume, and what else is known of its surface.
struct ExtractionInput {
  const LevelSet& level_set;
  double isovalue = 0.0;  ///< in the units of the grid's values
  const PolygonMesh* source =
      nullptr;  ///< the polygons that the volume was made from, where they are at hand; else null
  const Options& options;
  RunContext& context;
  /// Where an adaptive variant keeps its error bound, and what it does elsewhere; null: everywhere. A uniform
  /// variant ignores it.
  const AdaptivityField* field = nullptr;
  /// Exact Hermite data of the surface at isovalue 0, on the level set's lattice and with its signs, where
  /// they are at hand instead of polygons; else null.
  const SparseHermite<EdgeCrossing>* hermite = nullptr;
  /// True if the mesh goes into a file that holds world coordinates in single precision (STL), so that a
  /// variant which proves something of its mesh proves it of the points as they will be written.
  bool written_in_single = false;
  /// The box of index coordinates that a variant keeps its vertices in if it guarantees that nothing
  /// intersects (extraction/volume_ends.h). Up to rounding, all crossings lie in the box.
  Bounds caps = Bounds::unbounded();
};

/// Entry of a table: a method that turns a volume into a mesh.
struct Extractor {
  std::string name;
  std::string summary;  ///< one line
  Promises promises;
  std::vector<OptionSpec> options;
  PolygonMesh (*extract)(const ExtractionInput&);
};

/// Input of a voxelizer: polygons, and the lattice and band that are wanted.
struct VoxelizationInput {
  const PolygonMesh& mesh;
  double voxel_size;           ///< world units
  double exterior_band = 3.0;  ///< voxels
  double interior_band = 3.0;  ///< voxels
  RunContext& context;
  Options options = {};  ///< the options that the variant declares, checked
};

/// Entry of a table: a method that turns polygons into a level set.
struct Voxelizer {
  std::string name;
  std::string summary;
  std::vector<OptionSpec> options;
  LevelSet (*voxelize)(const VoxelizationInput&);
};

/// The table's entry of this name. @throws Error that lists the names there are.
const Extractor& find_variant(std::span<const Extractor> table, const std::string& name);
/// The table's entry of this name. @throws Error that lists the names there are.
const Voxelizer& find_variant(std::span<const Voxelizer> table, const std::string& name);

}  // namespace hermesh
