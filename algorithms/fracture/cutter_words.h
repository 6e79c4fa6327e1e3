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

/// What a word for cutters asks for.
struct CutterSpec {
  enum class Kind { voronoi, chunks, planes, meshes };
  Kind kind = Kind::voronoi;
  std::size_t count = 0;             ///< how many cells or planes are scattered; 0 for planes that are given
  std::vector<CuttingPlane> planes;  ///< nx,ny,nz,d with n · x = d, world units
  struct File {
    std::string path;
    std::size_t copies =
        0;  ///< 0: one copy in place; else as many, turned at random, their box's centre at scattered places
    /// The polygons, where they are at hand and `path` is but their name; null: they are read.
    const PolygonMesh* mesh = nullptr;
  };
  std::vector<File> files;
};

/// Reads a word such as `voronoi:50`. @throws Error that says what such a word looks like.
CutterSpec parse_cutters(const std::string& word);

/// The word without the folders of its files, for an output that is the same on every machine.
std::string without_folders(const std::string& word);

/// What the word does not say of cutters that are scattered.
struct CutterChoices {
  std::uint64_t seed = 0;
  /// How far the walls of chunks are displaced, as a part of the mean distance between neighbouring seeds.
  double roughness = 0.12;
  double mesh_scale = 1.0;  ///< scale of scattered meshes
  /// The point (world units) about which seeds cluster, within `impact_radius`; see density_about().
  std::optional<Eigen::Vector3d> impact;
  double impact_radius = 0.0;  ///< 0: a quarter of the object's longest side
  LevelSet density;            ///< where places are scattered: 0 never, its greatest value most often
};

/// Cutters, and what they were made from.
struct MadeCutters {
  std::unique_ptr<Cutters> cutters;
  std::vector<CuttingMesh> meshes = {};
  std::vector<Eigen::Vector3d> seeds = {};  ///< seeds of the cells, world units
};

/// Box of a solid's samples, world units.
Bounds bounds_of(const FloatHermite& hermite);

/// Makes the cutters of a word; what it asks to scatter is scattered in the object, and random
/// planes go through scattered places.
/// @throws Error for a file that cannot be read; Cancelled.
MadeCutters make_cutters(const CutterSpec& spec, const FloatHermite& object, const CutterChoices& choices,
                         RunContext& context);

}  // namespace hermesh
