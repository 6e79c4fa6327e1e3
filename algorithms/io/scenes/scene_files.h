// Readers and writers of formats that arrange parts in a scene: glTF 2.0 and 3MF. Private to algorithms/io.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

/// Takes the bytes of a file piece by piece, in their order.
using ByteSink = std::function<void(std::string_view)>;

/// Reads the triangles of the default scene of a glTF 2.0 file in binary (.glb). Points of one mesh are
/// shared if all three coordinates are equal, since the format repeats them along seams of normals and
/// textures.
/// @throws Error for a damaged or compressed file, or one that requires an extension by which its shape
/// changes.
void read_glb(std::string_view bytes, MeshBuilder& builder);
/// Reads a glTF 2.0 file in text (.gltf) as above. Its buffers are in the file itself, or files in its
/// directory or below. @throws Error as above, and for a buffer that is elsewhere or cannot be read.
void read_gltf(std::string_view bytes, MeshBuilder& builder);
/// Returns true if the bytes begin like a .glb file.
bool begins_like_glb(std::string_view bytes);

/// Reads the objects that the build of a 3MF file lists, with components, including those that the production
/// extension stores in separate files. The unit is that of MeshFile::metres, and changes no number.
/// Support objects, items that are not to be printed, beam lattices, and parts that a slicer marks as
/// negative or as modifiers are left out, with notes.
/// @throws Error for a damaged file, or one that requires an extension that changes its shape.
void read_three_mf(std::string_view bytes, MeshBuilder& builder);

/// The attributes of a mesh by their use; null where it has none.
struct NamedAttributes {
  const MeshAttribute *colour = nullptr, *normal = nullptr, *uv = nullptr, *material = nullptr;
};

/// Returns the attributes "colour" and "normal" of points, "uv" of points or corners, and "material" of
/// polygons with labels, of those that `stored` lists, where "alpha" allows colours of four components. All
/// others are listed in a note about a `format` such as "an OBJ".
NamedAttributes named_attributes(const std::vector<MeshAttribute>& attributes, std::string_view stored,
                                 const char* format, const std::string& file, RunContext& context);

/// Writes a mesh as glTF 2.0 with its buffer inside, as .glb or as text. Quads become two triangles. The
/// points are those of the mesh in single precision, and its origin is the translation of the node, so that
/// nothing is rounded. Points are repeated where texture coordinates have a seam; each material is a
/// primitive.
/// @param metres length of the unit of the mesh: the scale of the node
/// @throws Error if the mesh is too large for a .glb file, whose lengths have 32 bits.
void write_gltf(const ByteSink& out, const PolygonMesh& mesh, bool binary, const std::string& file,
                double metres, RunContext& context);

/// Writes a mesh as 3MF. @param metres length of the unit of the mesh: the unit of the file if it is one of
/// kThreeMfUnits, else the scale of the build's item in millimetres; 0: millimetres. Quads become two
/// triangles; triangles with a corner twice, which the format forbids, are left out with a note. Numbers are
/// the shortest text of the double; the origin of the mesh is the translation of the build's item. Colours of
/// points are stored in bytes, or else the names of materials. The packed file is built in memory.
void write_three_mf(const ByteSink& out, const PolygonMesh& mesh, double metres, const std::string& file,
                    RunContext& context);

/// The units of 3MF, and their lengths in metres.
inline constexpr std::pair<std::string_view, double> kThreeMfUnits[] = {
    {"micron", 1e-6}, {"millimeter", 1e-3}, {"centimeter", 1e-2},
    {"inch", 0.0254}, {"foot", 0.3048},     {"meter", 1.0}};

/// Returns the origin that a file of these formats has to state because a reader would choose another one.
std::optional<Eigen::Vector3d> stated_origin(const PolygonMesh& mesh);

/// An affine map of points in double precision. Not an Eigen transform, whose products would also multiply
/// the last row.
struct Placement {
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator()(const Eigen::Vector3d& point) const { return linear * point + translation; }
  /// Returns the map that applies `inner` first.
  Placement operator*(const Placement& inner) const {
    return {linear * inner.linear, (*this)(inner.translation)};
  }
};

/// Triangles over points of their own, in the coordinates of the part.
struct ScenePart {
  std::vector<Eigen::Vector3d> points;
  static constexpr std::uint32_t kLeftOut = 0xffffffffu;  ///< corner of triangles that are not placed
  std::vector<Triangle> triangles;                        ///< every other corner is a point of the part
  // Attributes, empty if the part has none. NaN, or a material of -1, is none.
  std::vector<std::array<float, 4>> colours;              ///< of points, with alpha, for screens (sRGB)
  std::vector<std::array<float, 2>> texture_coordinates;  ///< of corners; the second one goes up
  std::vector<std::int32_t> materials;                    ///< of triangles

  /// Returns the bytes that one more copy of the part takes in a mesh.
  double cost() const {
    return double(points.size() * sizeof(Eigen::Vector3d) + triangles.size() * sizeof(Triangle) +
                  colours.size() * sizeof(colours[0]) + materials.size() * sizeof(materials[0]) +
                  texture_coordinates.size() * sizeof(texture_coordinates[0]));
  }
  /// Sets the colour of a point. Returns false if the point already has another colour, which it keeps.
  bool set_colour(std::uint32_t point, const std::array<float, 4>& colour);
};

/// Adds parts to the mesh of a builder and sums up their memory, so that a small file which repeats its parts
/// millions of times is rejected before the memory is allocated.
class PartPlacer {
 public:
  explicit PartPlacer(MeshBuilder& builder) : builder_(builder) {}

  /// Counts bytes that are about to be taken, or work that takes as long as writing them. @throws Error if
  /// the sum exceeds half of the machine's memory.
  void spend(double bytes);
  /// Adds a copy of the part, whose cost was spent before. A mirroring placement reverses its triangles, so
  /// that they still face outwards; a flattening one leaves the part out. @throws Error if the placement is
  /// not finite.
  void place(const ScenePart& part, const Placement& placement);
  /// Makes colours have four components; otherwise alpha is 1 everywhere, and left out.
  void keep_alpha() { colour_components_ = 4; }
  /// Sets the names of the materials, by the numbers in ScenePart::materials.
  void name_materials(const std::vector<std::string>& names);
  /// Notes what was left out: an attribute of a part, for a reason, of which the first counts.
  void leave_out_attribute(const std::string& name, const std::string& reason);
  /// Notes the number of parts that were left out.
  void note_left_out();

 private:
  void place_attributes(const ScenePart& part, bool mirrored);
  /// Returns the number of a column of attributes, which is added when first asked for.
  std::size_t column(const std::string& name);

  MeshBuilder& builder_;
  double spent_ = 0.0;
  std::size_t flattened_ = 0;
  int colour_components_ = 3;
  std::map<std::string, std::size_t> columns_;
};

}  // namespace hermesh::mesh_formats
