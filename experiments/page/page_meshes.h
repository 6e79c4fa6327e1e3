// Meshes for a page: those that a run left beside its rows, packed, with the distance of each point to the
// input.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/harness/columns.h"

namespace hermesh {

/// Which meshes a page gets: all, or as many of the largest files as `count` says.
struct MeshChoice {
  bool all = false;
  std::size_t count = 10;
};

/// "all", "none" or a number. @throws Error for any other text.
MeshChoice mesh_choice(const std::string& text);

/// A mesh as the page holds it: `packed` is base64 of zlib's deflate of
///
///   the points' x, then y, then z: whole numbers of steps from the box's lower corner, as differences to the
///   point before the corners of the triangles, then of the quads: as differences to the corner before where
///   there are distances: the high bytes, then the low bytes of each point's distance, 65535 being the
///   largest
///
/// The differences d are variable-length integers of seven bits a byte, lowest first, of 2d, or of −2d−1
/// where d < 0. A step is 1/256 voxel, or 2^-22 of the box's longest side if that is more.
///
/// `head` says name, row (null if no row is of this mesh), points, triangles, quads, lower (3 numbers), step,
/// both in world units, voxel_size (null without a row), largest (distance of a point, in voxels; null
/// without distances), and `sentence`, why there are none.
struct PageMesh {
  Json head;
  std::string packed;
};

/// The points' distances in voxels; may be empty. @throws Error for a coordinate that is not finite.
PageMesh pack_mesh(const MeshFile& mesh, double voxel_size, const std::vector<double>& distances);

/// The chosen ones of the files meshes/*/*.ply anywhere under the folder, in the order of their names, with
/// the last row whose mesh each of them is. A file that cannot be read, and how many were not chosen, is said
/// in a note of the context. Where the input of a row is not at hand, or another one than the row's, its mesh
/// has no distances.
/// @throws Cancelled.
std::vector<PageMesh> page_meshes(const std::filesystem::path& folder, const std::vector<Json>& rows,
                                  const MeshChoice& choice, RunContext& context);

}  // namespace hermesh
