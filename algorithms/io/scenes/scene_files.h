// Readers and writers of formats that place parts in a scene: glTF 2.0 and 3MF. Private to algorithms/io.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

/// Takes the bytes of a file piece by piece, in their order.
using ByteSink = std::function<void(std::string_view)>;

/// Reads the triangles of the default scene of a glTF 2.0 file in binary (.glb), each node's mesh in its
/// place. Points of one mesh are shared where all three coordinates are equal, since the format repeats them
/// along seams of normals and textures.
/// @throws Error for a damaged or compressed file, or one that requires an extension by which its shape
/// changes.
void read_glb(std::string_view bytes, MeshBuilder& builder);
/// Reads a glTF 2.0 file in text (.gltf) as above. Its buffers are in the file, or files beside it or in
/// folders beneath.
/// @throws Error as above, and for a buffer that is elsewhere or cannot be read.
void read_gltf(std::string_view bytes, MeshBuilder& builder);
/// Whether the bytes begin as a .glb file does.
bool begins_like_glb(std::string_view bytes);

/// Reads the objects of a 3MF file that its build places, with components, and those of the production
/// extension in files of their own. A unit other than the millimetre is noted, and changes no number.
/// @throws Error for a damaged file, or one that requires an extension by which its shape changes.
void read_three_mf(std::string_view bytes, MeshBuilder& builder);

/// Writes a mesh as glTF 2.0 with its buffer within, as .glb or as text. Quads become two triangles. The
/// points are those of the mesh in single precision, and its origin is the translation of the node, so that
/// nothing is rounded.
/// @throws Error where a .glb file, whose lengths have 32 bits, has no room.
void write_gltf(const ByteSink& out, const PolygonMesh& mesh, bool binary, const std::string& file);

/// Writes a mesh as 3MF; `unit` is the format's word for the unit of the coordinates. Quads become two
/// triangles; triangles with a corner twice, which the format forbids, are left out with a note. Numbers are
/// the shortest text of the double; the origin of the mesh is the translation of the build's item. The packed
/// file waits in memory until it is whole.
void write_three_mf(const ByteSink& out, const PolygonMesh& mesh, std::string_view unit,
                    const std::string& file, RunContext& context);

/// The origin that a file of these formats has to state, since a reader would choose another; none where it
/// need not.
std::optional<Eigen::Vector3d> stated_origin(const PolygonMesh& mesh);

}  // namespace hermesh::mesh_formats
