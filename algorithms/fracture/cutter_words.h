// Cutters by a word: `voronoi:50`, `chunks:50`, `planes:3`, `planes:0,0,1,0.5;1,0,0,0`, `mesh:a.ply,b.ply`,
// `mesh:a.ply*20`.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/level_set.h"
#include "algorithms/fracture/cutters.h"
#include "algorithms/fracture/labelled_solid.h"

namespace hermesh {

/// Parsed form of a cutter specification such as `voronoi:50`.
struct CutterSpec {
  enum class Kind { voronoi, chunks, planes, meshes };
  Kind kind = Kind::voronoi;
  std::size_t count = 0;             ///< how many cells or planes are scattered; 0 for planes that are given
  std::vector<CuttingPlane> planes;  ///< nx,ny,nz,d with n · x = d, world units
  struct File {
    std::string path;
    std::size_t copies = 0;  ///< 0: one copy in place; else the number of copies, rotated at random, with
                             ///< their box centres at scattered positions
    /// The polygons, if they are already loaded and `path` is only their name; null: they are read from the
    /// file.
    const PolygonMesh* mesh = nullptr;
  };
  std::vector<File> files;
};

/// Parses a cutter specification such as `voronoi:50`. @throws Error that states the expected syntax.
CutterSpec parse_cutters(const std::string& word);

/// Returns the word without the directories of its files, for an output that is the same on every machine.
std::string without_folders(const std::string& word);

/// Parameters of scattered cutters that the specification does not contain.
struct CutterChoices {
  std::uint64_t seed = 0;
  /// How far the walls of chunks are displaced, as a part of the mean distance between neighbouring seeds.
  double roughness = 0.12;
  double mesh_scale = 1.0;  ///< scale of scattered meshes
  /// The point (world units) about which seeds cluster, within `impact_radius`; see density_about().
  std::optional<Eigen::Vector3d> impact;
  double impact_radius = 0.0;  ///< 0: a quarter of the object's longest side
  LevelSet density;            ///< relative density of scattered positions: 0 never, its maximum most often
};

/// Cutters, with the meshes and seeds from which they were made.
struct MadeCutters {
  std::unique_ptr<Cutters> cutters;
  std::vector<CuttingMesh> meshes = {};
  std::vector<Eigen::Vector3d> seeds = {};  ///< seeds of the cells, world units
};

/// Returns the box of a solid's samples, world units.
Bounds bounds_of(const FloatHermite& hermite);

/// Makes the cutters of a specification. Scattered cutters are scattered in the object, and random planes
/// pass through scattered positions.
/// @throws Error for a file that cannot be read; Cancelled.
MadeCutters make_cutters(const CutterSpec& spec, const FloatHermite& object, const CutterChoices& choices,
                         RunContext& context);

}  // namespace hermesh
