// Mesh files: PLY (ascii, binary of both endians), OBJ, OFF (text, binary), STL, glTF 2.0 (binary, text) and
// 3MF, each also gzipped, in; the same out, PLY and STL in binary and OFF as text.
#pragma once

#include <filesystem>
#include <optional>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// The ends of the names of mesh files, for sentences: of what read_mesh_file() reads and of what
/// write_mesh() writes.
inline constexpr const char* kMeshEndings = ".ply, .obj, .off, .stl, .glb, .gltf or .3mf (.gz may follow)";

/// A mesh exactly as a file holds it: points in world units and double precision. Judges work on this.
/// Polygons with more than four corners are cut into a fan about their first corner, or into ears where they
/// are so concave that a fan would leave them (polygon_cut.h); points of STL, and of one mesh within a glTF
/// or 3MF file, are shared where all three coordinates are equal. Of glTF and 3MF the points are where the
/// file's transforms put them, which are computed in double precision; axes and units stay as they are.
struct MeshFile {
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> triangles;
  LargeArray<Quad> quads;
  std::vector<MeshAttribute> attributes;  ///< only where ReadOptions asked for them
  bool attributes_left_out = false;  ///< whether some that were asked for could not be read; notes say why
  /// Where the writer centred single precision; hermesh stores it as a comment `origin x y z` so that reading
  /// back gives the same points.
  std::optional<Eigen::Vector3d> origin;
  /// Where ReadOptions asked for them: the number in the file of each of triangulated()'s triangles, counting
  /// from 0 over the file's polygons in their order, each cut into as many triangles as it has corners less
  /// two. Empty where that is the order of triangulated() anyway.
  std::vector<std::uint32_t> triangle_numbers;

  std::size_t triangle_count() const { return triangles.size() + 2 * quads.size(); }
};

/// Attributes take time and memory, so they are passed over unless asked for. Then these are read:
///
/// | file          | what                                                     | attribute | | ------------- |
/// -------------------------------------------------------- | ------------------------------------ | | PLY
/// vertices, | nx ny nz                                                 | "normal" | | PLY faces     | red
/// green blue [alpha], whole numbers brought to 0 … 1   | "colour", 3 or 4 components          | | | u v, s
/// t, texture_u texture_v                            | "uv"                                 | | | any other
/// number                                         | by its name; whole numbers as such   | | PLY faces     |
/// list texcoord or texture_uv                              | "uv" of corners                      | | OBJ |
/// vn, vt (the first two numbers)                           | "normal", "uv" of corners            | | | r g
/// b behind the coordinates of a point                  | "colour" of points                   | | | usemtl
/// | "material" of polygons, with labels  |
///
/// What is cut takes its corners' values along, and each of its triangles its polygon's; a polygon that is
/// dropped drops its values. Degenerate polygons and points that no polygon uses keep theirs; nothing is
/// welded in these formats. Where only some elements have a value, the others get 0, or −1 where the values
/// are whole numbers, and a note says so. A name that is taken gets the domain in front ("polygon-quality").
/// OFF, STL, glTF and 3MF give none. An attribute that cannot be read is left out with a note: one with a
/// value that is no number, not finite or, where it is a whole number, beyond 32 bits, with an index out of
/// range, or with a list of another length than the polygon's.
struct ReadOptions {
  bool attributes = false;
  /// Names of attributes for which it is an Error that they cannot be read.
  std::vector<std::string> required = {};
  bool triangle_numbers = false;  ///< whether to fill in MeshFile::triangle_numbers
};

/// Reads a mesh file of any of the formats, told by its name and checked against its content.
///
/// What programs write although the format says otherwise is read wherever it can mean one thing only, with a
/// note: a wrong count in a binary STL file whose size says how many triangles it holds, no `endsolid`, words
/// behind an element of an ASCII PLY file, unknown lines of a PLY header, an OFF file without its keyword or
/// with the count glued to it, points that no polygon uses and that are not finite (left out), zeros or
/// Ctrl-Z behind the data. Without a note: byte order marks, line ends of any system, blanks, comments, `end
/// solid`, triangle strips, binary OFF of either order of bytes. A scene's parts that cannot be read as they
/// are shown (lines, skins, morph targets), and a unit other than the millimetre in 3MF, are notes, too.
/// @throws Error for a file that is missing, empty, truncated, of an unknown or wrong type, holds more than
/// it declares, an index out of range, a coordinate of a polygon that is not finite, or no polygon; the
/// sentence names the file.
MeshFile read_mesh_file(const std::filesystem::path& path, RunContext& context,
                        const ReadOptions& options = {});

/// The mesh in single precision relative to the file's own origin, or to choose_origin() of its bounds.
/// @throws Error for coordinates beyond single precision.
PolygonMesh to_polygon_mesh(const MeshFile& file);
/// The mesh as above, from a file whose arrays it takes over. @throws Error as above.
PolygonMesh to_polygon_mesh(MeshFile&& file);
/// A mesh's points in world coordinates and double precision: what write_mesh() puts into a file.
MeshFile to_mesh_file(const PolygonMesh& mesh);

/// read_mesh_file() and to_polygon_mesh() in one. @throws Error as these do.
PolygonMesh read_mesh(const std::filesystem::path& path, RunContext& context,
                      const ReadOptions& options = {});

/// Writes beside the path and renames, so that no half-written file stands there. Every point is stored as
/// world() has it: binary PLY in single precision where that loses nothing and in double precision otherwise,
/// OBJ and OFF in the shortest text of the double, STL in single precision only, with a note that says what
/// that cost; glTF and 3MF relative to the mesh's origin, which is the translation of the one part, in single
/// precision and in the shortest text of the double. Reading the file back gives the same double positions,
/// and the same PolygonMesh bit for bit wherever the sums origin + point are exact in double precision:
/// always where the origin is 0, and as long as a point's last bit is at least 2^-52 of its distance from 0.
/// A PLY keeps the attributes of points and of polygons, colours as bytes, and "uv" of corners; the other
/// formats keep none. STL, glTF and 3MF have triangles alone, into which quads are cut.
/// @throws Error for an unknown extension, a path that cannot be written, or a mesh of more than 4 GB in .glb
/// or .3mf.
void write_mesh(const std::filesystem::path& path, const PolygonMesh& mesh, RunContext& context);

/// Whether the path ends as kMeshEndings says, in letters of either case.
bool is_mesh_path(const std::filesystem::path& path);

}  // namespace hermesh
