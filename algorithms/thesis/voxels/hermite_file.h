// Hermite data in .vdb files.
//
// Dense grids are written unchanged, under the name `hermite`: one grid of a type that only this program
// knows.
//
// Packed data are written as two grids of OpenVDB's own types, so that any tool opens the file:
//   hermite_signs      bool: the sign of every sample, true inside; a sample is active if it owns a crossing
//   edge (an edge to
//                      the next sample along x, y or z with another sign), so that no leaf with one is
//                      uniform, and pruning changes nothing
//   hermite_crossings  int32: crossing number n at voxel (8⌊n/512⌋ + i, j, k) with 64i + 8j + k = n mod 512,
//   leaf after leaf
//                      along x. Bits 0 to 15 are the normal, 16 to 25 the offset, 26 to 31 the tag
//                      (PackedCrossing). Crossings are numbered by leaf in ascending order of (x, y, z), in
//                      it by axis, in that by sample.
// The metadata of all grids hold the version of this format, the code of the normals, and that these are unit
// vectors of index space, towards the outside.
#pragma once

#include <filesystem>
#include <string>
#include <variant>

#include "algorithms/thesis/voxels/dense_hermite.h"

namespace hermesh {

using AnyHermite = std::variant<PackedHermite, FixedDense, ThesisDense, DirectedDense, FloatDense>;

/// Writes the data aside, then renames. @throws Error if the path cannot be written.
void write_hermite(const std::filesystem::path& path, const PackedHermite& hermite, RunContext& context);
template <DenseVoxel Voxel>
void write_hermite(const std::filesystem::path& path, const DenseHermite<Voxel>& hermite,
                   RunContext& context);
/// Writes the data as FloatVoxel, which loses nothing. @throws Error if the path cannot be written.
void write_hermite(const std::filesystem::path& path, const FloatHermite& hermite, RunContext& context);

/// Reads the output of write_hermite(), bit by bit the same. @throws Error that names the file if it is
/// missing, truncated, not a .vdb, without Hermite data or with data of another version, and as
/// check_consistent() does.
AnyHermite read_hermite(const std::filesystem::path& path, RunContext& context);

/// Form and size of Hermite data.
struct HermiteSummary {
  std::string representation;  ///< "packed" or the name of the voxel type
  std::string normal_code;     ///< "none" where normals are not coded
  std::size_t leaves = 0, crossings = 0, memory_bytes = 0;
};
HermiteSummary summary_of(const AnyHermite& hermite);

/// Converts any representation to single precision. `lost` as in to_sparse().
FloatHermite to_float(const AnyHermite& hermite, RunContext& context, std::size_t* lost = nullptr);

}  // namespace hermesh
