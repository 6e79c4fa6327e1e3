// Remeshing tile by tile, in memory of the size of a tile and of the mesh, and distributed over jobs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "algorithms/extraction/certified_collapse/tile_mesh.h"
#include "algorithms/remesh/remesh.h"

namespace hermesh {

/// A share of the tiles of a model: job `number` (from 1) of `count`.
struct TileJob {
  int number = 1, count = 1;
};

/// The tiles that a job has made.
struct TilePart {
  std::uint64_t task = 0;  ///< hash of the polygons and of all parameters except the job
  TileJob job;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< of the mesh, world units
  bool written_in_single = false;  ///< the vertices are proved for files of single precision
  double metres = 0.0;             ///< length of the world's unit; 0 if unknown
  std::vector<TileMesh> tiles;     ///< those with vertices, ascending
};

/// Makes the tiles of a job. The mesh of all jobs (join_parts()) has the bytes of remesh() with the same
/// options, signs of the winding number and thin parts dropped, and does not depend on the number of jobs.
/// (Polygons within the solid are an exception, see ClosedPolygons::hermite().) Memory is that of one tile
/// with kTileHalo cells around it, of the polygons with their winding number, and of the tiles made.
/// @param extracting manifold-dual-contouring with option `tile`, without a field and with isovalue 0
/// @throws Error for other methods and options, if the precision of the file does not suffice, for polygons
/// that are not closed; as remesh(); Cancelled
TilePart remesh_tiles(const PolygonMesh& mesh, const VoxelizeRecipe& voxelizing,
                      const ExtractRecipe& extracting, const TileJob& job, RunContext& context);

/// Joins the parts of all jobs of one task. @throws Error for parts of different tasks, for a job that is
/// missing or occurs twice, for an empty mesh, and as join_tiles()
PolygonMesh join_parts(std::vector<TilePart> parts);

/// Writes a part as a file, atomically. @throws Error if it cannot be written
void write_tile_part(const std::filesystem::path& path, const TilePart& part);
/// Reads such a file. @throws Error if it cannot be read, is not such a file, or is damaged
TilePart read_tile_part(const std::filesystem::path& path);

}  // namespace hermesh
