// Mesh files: reads and writes PLY (ASCII, binary of both byte orders), OBJ, OFF (text, binary), STL,
// glTF 2.0 (binary, text) and 3MF, each also gzipped. PLY and STL are written in binary and OFF as text.
#pragma once

#include <filesystem>
#include <optional>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// The extensions of mesh files, for messages.
inline constexpr const char* kMeshEndings = ".ply, .obj, .off, .stl, .glb, .gltf or .3mf (.gz may follow)";

/// A mesh exactly as in its file: points in world units and double precision.
/// Polygons with more than four corners are cut into a fan about their first corner, or into ears if they are
/// so concave that a fan would leave them (polygon_cut.h). Points of STL, and of one mesh within a glTF or
/// 3MF file, are shared if all three coordinates are equal. The transforms of glTF and 3MF are applied in
/// double precision; axes and units are unchanged.
struct MeshFile {
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> triangles;
  LargeArray<Quad> quads;
  std::vector<MeshAttribute> attributes;  ///< only if ReadOptions asked for them
  bool attributes_left_out = false;       ///< true if some could not be read; notes give the reasons
  /// Centre of the writer's single precision; hermesh stores it as a comment `origin x y z` so that reading
  /// back gives the same points.
  std::optional<Eigen::Vector3d> origin;
  /// Length in metres of the unit of the points, as 3MF and glTF state it; 0 for other formats.
  double metres = 0.0;
  /// If ReadOptions asked for them: the number in the file of each of triangulated()'s triangles, counting
  /// from 0 over the polygons in their order, each cut into as many triangles as it has corners less two.
  /// Empty if that is the order of triangulated() anyway.
  std::vector<std::uint32_t> triangle_numbers;

  std::size_t triangle_count() const { return triangles.size() + 2 * quads.size(); }
};

/// Attributes are read on request only, since they take time and memory:
/// - PLY vertices: nx ny nz as "normal"; red green blue [alpha] as "colour" of 3 or 4 components, whole
///   numbers scaled to 0 … 1; u v, s t or texture_u texture_v as "uv"; any other number by its name, integers
///   as such.
/// - PLY faces: the same, and a list texcoord or texture_uv as "uv" of corners.
/// - OBJ: vn as "normal" and the first two numbers of vt as "uv" of corners; r g b behind the coordinates of
/// a
///   point as "colour" of points; usemtl as "material" of polygons, with labels.
/// - glTF: COLOR_0 as "colour" of points, from linear to screen values, TEXCOORD_0 as "uv" of corners, whose
///   second number goes up, as in OBJ, and "material" of polygons, with labels. A point that the file repeats
///   with another colour has the first one, with a note.
/// - 3MF: groups of colours as "colour" of points, as above, and basematerials as "material" of polygons.
/// OFF and STL give none.
///
/// The pieces of a cut polygon keep the values of its corners and its own; a dropped polygon drops its
/// values. Degenerate polygons and points that no polygon uses keep theirs; nothing is merged in these
/// formats. If only some elements have a value, the others get 0, or −1 for integers, with a note. A name
/// that is taken gets the domain in front ("polygon-quality"). An attribute that cannot be read is left out
/// with a note: one with a value that is not a number, not finite or, for integers, beyond 32 bits, with an
/// index out of range, or with a list of another length than the polygon.
struct ReadOptions {
  bool attributes = false;
  std::vector<std::string> required = {};  ///< attributes for which it is an Error that they cannot be read
  bool triangle_numbers = false;           ///< fills MeshFile::triangle_numbers
};

/// Reads a mesh file, in the format of its name, against which the content is checked.
///
/// Files that violate their format are read if they are unambiguous. With a note: a wrong count in a binary
/// STL file whose size shows the number of triangles, no `endsolid`, surplus words behind an element of an
/// ASCII PLY file, unknown lines of a PLY header, an OFF file without its keyword or with the count joined to
/// it, unused points that are not finite (left out), zeros or Ctrl-Z behind the data. Without a note: byte
/// order marks, line ends of any system, blanks, comments, `end solid`, triangle strips, binary OFF of either
/// byte order. Parts of a scene that cannot be read as shown (lines, skins, morph targets) are noted, too.
/// @throws Error that names the file if it is missing, empty, truncated, of an unknown or wrong type, longer
/// than it declares, or has an index out of range, a coordinate of a polygon that is not finite, or no
/// polygon.
MeshFile read_mesh_file(const std::filesystem::path& path, RunContext& context,
                        const ReadOptions& options = {});

/// Returns the mesh in single precision relative to the file's own origin, or to choose_origin() of its
/// bounds. The second form takes over the arrays. @throws Error for coordinates beyond single precision.
PolygonMesh to_polygon_mesh(const MeshFile& file);
PolygonMesh to_polygon_mesh(MeshFile&& file);
/// Returns the points of a mesh in world coordinates and double precision, as write_mesh() writes them.
MeshFile to_mesh_file(const PolygonMesh& mesh);

/// Combines read_mesh_file() and to_polygon_mesh(). @throws Error as these do.
PolygonMesh read_mesh(const std::filesystem::path& path, RunContext& context,
                      const ReadOptions& options = {});

/// Writes a file atomically (atomic_file.h). Every point is stored as world() returns it: binary PLY in
/// single precision if that is exact and in double precision otherwise, OBJ and OFF in the shortest text of
/// the double, STL in single precision only, with a note about the loss; glTF and 3MF relative to the mesh's
/// origin, which is the translation of the only part, in single precision and in the shortest text of the
/// double. Reading the file back gives the same double positions, and the same PolygonMesh bit for bit if the
/// sums origin + point are exact in double precision: always if the origin is 0, and as long as a point's
/// last bit is at least 2^-52 of its distance from 0. PLY stores the attributes of points and of polygons,
/// colours as bytes, and "uv" of corners; OBJ stores "colour" and "normal" of points, "uv" and the names of
/// "material"; glTF stores all of these, and repeats points at seams; 3MF stores "colour", as bytes, or else
/// "material". A note lists those that are left out. STL, glTF and 3MF cut quads into triangles.
/// @param metres length in metres of the unit of the coordinates; 0 if it is unknown. A 3MF file states the
///   unit, or millimetres if it is unknown or none of the format's; a glTF file is in metres. Where the unit
///   differs, the placement of the part scales it, so that no coordinate is rounded.
/// @throws Error for an unknown extension, a path that cannot be written, or a mesh of more than 4 GB in
/// .glb.
void write_mesh(const std::filesystem::path& path, const PolygonMesh& mesh, RunContext& context,
                double metres = 0.0);
/// Returns true if files of this format state the unit of their coordinates.
bool states_unit(const std::filesystem::path& path);

/// Returns true if the path ends in one of kMeshEndings, in letters of either case.
bool is_mesh_path(const std::filesystem::path& path);

}  // namespace hermesh
