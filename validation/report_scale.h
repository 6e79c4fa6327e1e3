// Meshes whose figures double precision would not hold: judged at another scale.
#pragma once

#include <initializer_list>
#include <optional>

#include "validation/mesh_report.h"

namespace hermesh::validation {

/// The power of two by which coordinates have to be multiplied so that products of several lengths stay in
/// the range of double precision: 1 as long as the largest coordinate lies between 2^-150 and 2^150. Null
/// pointers are passed over.
double comfortable_scale(std::initializer_list<const MeshFile*> meshes);

/// The mesh times a power of two, without its attributes.
/// @throws Error if a coordinate would lose digits; `name` says whose.
MeshFile scaled(const MeshFile& mesh, double scale, const std::string& name);

/// Turns the figures of meshes that were multiplied by a power of two into those of the meshes as they were.
/// Figures beyond the range of double precision become infinite.
void unscale(MeshReport& report, double scale);

}  // namespace hermesh::validation
