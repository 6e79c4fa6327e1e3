// Variants: a name with a function, its options and guarantees. The tables of variants
// (algorithms/variants.cpp, reference/variants.cpp) are arrays of these, without self-registration.
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

/// Guarantees of a variant for every finite input. A violated guarantee is an error of the run; other defects
/// are only reported.
struct Promises {
  bool closed = false;                ///< no boundary edge
  bool manifold = false;              ///< no non-manifold edge or vertex
  bool oriented = false;              ///< no inconsistently oriented edge
  bool no_self_intersection = false;  ///< polygons intersect only in shared corners and edges
};

struct AdaptivityField;  // extraction/adaptivity_field.h
struct EdgeCrossing;     // hermite/crossing.h
template <class Crossing>
struct SparseHermite;  // hermite/sparse_hermite.h

/// Input of an extractor: a volume and optional further data on its surface.
struct ExtractionInput {
  const LevelSet& level_set;
  double isovalue = 0.0;                ///< in the units of the grid's values
  const PolygonMesh* source = nullptr;  ///< the polygons that the volume was made from, or null
  const Options& options;
  RunContext& context;
  /// The region in which an adaptive variant observes its error bound, and its behaviour elsewhere; null: the
  /// bound holds everywhere. Uniform variants ignore it.
  const AdaptivityField* field = nullptr;
  /// Exact Hermite data of the surface at isovalue 0, on the level set's lattice and with its signs, instead
  /// of polygons; or null.
  const SparseHermite<EdgeCrossing>* hermite = nullptr;
  /// True if the mesh is to be written to a file with world coordinates in single precision (STL); proofs
  /// then apply to the vertices as written.
  bool written_in_single = false;
  /// The box of index coordinates that contains the vertices of variants without self-intersections
  /// (extraction/volume_ends.h). Up to rounding, all crossings lie in the box.
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

/// Input of a voxelizer: polygons, lattice and band.
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

/// Returns the table's entry of this name. @throws Error that lists the valid names.
const Extractor& find_variant(std::span<const Extractor> table, const std::string& name);
const Voxelizer& find_variant(std::span<const Voxelizer> table, const std::string& name);

}  // namespace hermesh
