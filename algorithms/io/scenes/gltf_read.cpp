// Reads glTF 2.0 (Khronos 2017, ISO/IEC 12113).
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <span>

#include "algorithms/io/scenes/gltf_document.h"
#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/stored_number.h"

namespace hermesh::mesh_formats {

namespace {

/// The two chunks of a .glb file; `binary` is empty if the file has none.
struct GlbChunks {
  std::string_view json, binary;
};

/// Splits a .glb file into its chunks. @throws Error for a version other than 2, or inconsistent lengths.
GlbChunks split_glb(std::string_view bytes, MeshBuilder& builder) {
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  constexpr std::uint32_t kJson = 0x4e4f534a, kBinary = 0x004e4942;  // "JSON" and "BIN\0", little-endian
  const auto word_at = [&](std::size_t at) { return stored_number<std::uint32_t>(bytes.data() + at); };
  if (bytes.size() < kHeader + kChunkHeader)
    builder.fail("the file is truncated: a .glb file has at least 20 bytes");
  // The words of the header: magic, version, length.
  const std::uint32_t version = word_at(4), length = word_at(8);
  if (version != 2) builder.fail("it is of version ", version, " of glTF; only version 2 is read");
  if (length > bytes.size())
    builder.fail("the file is truncated: it has ", bytes.size(), " bytes of the ", length,
                 " that it declares");
  if (!without_padding(bytes.substr(length)).empty())
    builder.fail("it declares ", length, " bytes, but ", bytes.size() - length,
                 " more follow; the file is damaged");
  builder.note_padding(bytes.substr(length));
  bytes = bytes.substr(0, length);
  GlbChunks chunks;
  for (std::size_t at = kHeader; at < bytes.size();) {
    if (bytes.size() - at < kChunkHeader) builder.fail("its last chunk breaks off; the file is damaged");
    const std::size_t size = word_at(at);
    const std::uint32_t kind = word_at(at + 4);
    const bool first = at == kHeader;
    at += kChunkHeader;
    if (size > bytes.size() - at)
      builder.fail("a chunk of it is longer than the rest of the file; the file is damaged");
    // JSON first, then at most one of bytes; other kinds belong to extensions and are ignored.
    if (first != (kind == kJson))
      builder.fail("its first chunk, and no other, must be JSON; the file is damaged");
    if (first) chunks.json = bytes.substr(at, size);
    if (kind == kBinary && chunks.binary.empty()) chunks.binary = bytes.substr(at, size);
    at += size;
  }
  if (chunks.json.empty()) builder.fail("it has no JSON; the file is damaged");
  return chunks;
}

/// Returns the value for screens (sRGB) of a linear component of a colour.
double to_screen(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

/// Visits the nodes of the scene, decodes their meshes, and adds a copy of the mesh to the builder for each
/// node.
class GltfReader : GltfDocument {
 public:
  GltfReader(std::string_view json, std::string_view binary, MeshBuilder& builder)
      : GltfDocument(json, binary, builder) {}

  void read() {
    place_nodes();
    take_origin();
    note_what_is_left_out();
  }

 private:
  // ---- Meshes.

  /// Returns the triangles of a primitive as corners of its POSITION accessor, which has `points` elements.
  std::vector<Triangle> triangles_of(const Json& primitive, std::size_t points) {
    const std::size_t mode = count_if_any(primitive, "mode").value_or(4);
    // Without indices the corners are the points in their order.
    std::vector<std::uint32_t> corners;
    if (const std::optional<std::size_t> indices = count_if_any(primitive, "indices")) {
      for (const double index : values(*indices, 1, "SCALAR", true)) {
        if (index >= double(points))
          builder_.fail("a triangle refers to point ", std::uint64_t(index), ", but there are ", points,
                        " (counting from 0)");
        corners.push_back(static_cast<std::uint32_t>(index));
      }
    } else {
      placer_.spend(double(points) * sizeof(std::uint32_t));
      for (std::size_t i = 0; i < points; ++i) corners.push_back(static_cast<std::uint32_t>(i));
    }
    if (mode == 4 && corners.size() % 3 != 0)
      builder_.fail("a list of triangles has ", corners.size(),
                    " corners, which is no multiple of 3; the file is truncated or damaged");
    // Strips and fans have nearly as many triangles as corners.
    placer_.spend(double(corners.size()) * sizeof(Triangle) / (mode == 4 ? 3.0 : 1.0));
    return connect(corners, mode);
  }

  /// Returns the triangles between corners by the mode of the primitive: 4 is a list, 5 a strip and 6 a fan.
  static std::vector<Triangle> connect(const std::vector<std::uint32_t>& corners, std::size_t mode) {
    std::vector<Triangle> triangles;
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      triangles.push_back({corners[a], corners[b], corners[c]});
    };
    if (mode == 4)
      for (std::size_t i = 2; i < corners.size(); i += 3) add(i - 2, i - 1, i);
    // Every other triangle of a strip is reversed. Triangles with a corner twice join two strips.
    if (mode == 5)
      for (std::size_t i = 2; i < corners.size(); ++i) {
        if (corners[i] == corners[i - 1] || corners[i] == corners[i - 2] || corners[i - 1] == corners[i - 2])
          continue;
        i % 2 == 0 ? add(i - 2, i - 1, i) : add(i - 1, i - 2, i);
      }
    if (mode == 6)
      for (std::size_t i = 2; i < corners.size(); ++i) add(0, i - 1, i);
    return triangles;
  }

  /// Returns the primitives of a mesh that have triangles, by the accessor of their points, which several may
  /// share.
  std::map<std::size_t, std::vector<const Json*>> primitives_of(const Json& mesh) {
    std::map<std::size_t, std::vector<const Json*>> result;
    for (const Json& primitive : list(mesh, "primitives")) {
      const std::size_t mode = count_if_any(primitive, "mode").value_or(4);
      if (mode > 6)
        builder_.fail("a primitive has the mode ", mode, ", which glTF has not; the file is damaged");
      const Json* const attributes = member(primitive, "attributes");
      const std::optional<std::size_t> position =
          attributes ? count_if_any(*attributes, "POSITION") : std::nullopt;
      if (mode < 4 || !position) {
        ++lines_;
        continue;
      }
      check_not_compressed(primitive, *position);
      morphed_ += !list(primitive, "targets").empty();
      result[*position].push_back(&primitive);
    }
    return result;
  }

  /// Refuses a file that uses Draco compression without the uncompressed data that it should have, too.
  void check_not_compressed(const Json& primitive, std::size_t position) const {
    const Json* const extensions = member(primitive, "extensions");
    const Json& accessor = entry("accessors", position);
    if (extensions && member(*extensions, "KHR_draco_mesh_compression") && !member(accessor, "bufferView") &&
        !member(accessor, "sparse"))
      fail_compressed("KHR_draco_mesh_compression");
  }

  /// Returns the part of a mesh, decoded once for all its nodes. Points that no triangle uses are left out,
  /// since several meshes may share an accessor.
  const ScenePart& part(std::size_t index) {
    // References to entries of a map stay valid while others are added.
    const auto [at, is_new] = parts_.try_emplace(index);
    ScenePart& result = at->second;
    if (!is_new) return result;
    // One merger for all primitives, since the surface continues across boundaries of materials.
    PointMerger merger(result.points);
    for (const auto& [position, primitives] : primitives_of(entry("meshes", index))) {
      builder_.context().check();
      const std::vector<double> numbers_of_points = values(position, 3, "VEC3", false);
      std::vector<Eigen::Vector3d> points;
      points.reserve(numbers_of_points.size() / 3);
      for (std::size_t i = 0; i < numbers_of_points.size(); i += 3)
        points.emplace_back(numbers_of_points[i], numbers_of_points[i + 1], numbers_of_points[i + 2]);
      std::vector<Triangle> triangles;
      std::vector<std::size_t> ends;  // of the triangles of each primitive
      for (const Json* const primitive : primitives) {
        for (const Triangle& triangle : triangles_of(*primitive, points.size()))
          triangles.push_back(triangle);
        ends.push_back(triangles.size());
      }
      std::vector<bool> used(points.size());
      for (const Triangle& triangle : triangles)
        for (const std::uint32_t corner : triangle) used[corner] = true;
      // In the order of the file, which a mesh without duplicate points keeps.
      std::vector<std::uint32_t> numbers(points.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (!used[i]) continue;
        // Before it is merged, because NaN equals nothing.
        if (!points[i].allFinite())
          builder_.fail("point ", i, " of accessor ", position,
                        " (both count from 0) has a coordinate that is not a finite number");
        numbers[i] = merger.add(points[i]);
      }
      for (std::size_t i = 0, first = 0; i < primitives.size(); first = ends[i++]) {
        const auto own = std::span(triangles).subspan(first, ends[i] - first);
        for (const auto& [a, b, c] : own) result.triangles.push_back({numbers[a], numbers[b], numbers[c]});
        if (builder_.attributes()) read_attributes(*primitives[i], own, numbers, result);
      }
    }
    return result;
  }

  /// Reads the colours, texture coordinates and material of a primitive, whose triangles are the last of the
  /// part. `numbers` are those in the part of the points of its accessor.
  void read_attributes(const Json& primitive, std::span<const Triangle> triangles,
                       const std::vector<std::uint32_t>& numbers, ScenePart& part) {
    const Json& attributes = *member(primitive, "attributes");
    // A bad attribute must not cost the mesh.
    const auto attempt = [&](const char* name, auto&& work) {
      try {
        work();
      } catch (const Error& error) {
        placer_.leave_out_attribute(name, error.what());
      }
    };
    const std::size_t before = part.triangles.size() - triangles.size();
    if (const auto material = count_if_any(primitive, "material")) {
      entry("materials", *material);
      part.materials.resize(before, -1);
      part.materials.resize(part.triangles.size(), static_cast<std::int32_t>(*material));
    }
    attempt("colour", [&] {
      const std::optional<std::size_t> index = count_if_any(attributes, "COLOR_0");
      if (!index) return;
      const Json* const type = member(entry("accessors", *index), "type");
      const bool alpha = type && *type == "VEC4";
      const std::size_t components = alpha ? 4 : 3;
      const std::vector<double> values =
          values_of_points(*index, components, alpha ? "VEC4" : "VEC3", numbers.size());
      for (const Triangle& triangle : triangles)
        for (const std::uint32_t corner : triangle) {
          std::array<float, 4> colour = {0, 0, 0, 1};
          for (std::size_t k = 0; k < components; ++k) {
            const double value = std::clamp(values[components * corner + k], 0.0, 1.0);
            colour[k] = static_cast<float>(k < 3 ? to_screen(value) : value);
          }
          if (colour[3] < 1.0f) placer_.keep_alpha();
          if (!part.set_colour(numbers[corner], colour)) ++other_colours_;
        }
    });
    attempt("uv", [&] {
      const std::optional<std::size_t> index = count_if_any(attributes, "TEXCOORD_0");
      if (!index) return;
      const std::vector<double> values = values_of_points(*index, 2, "VEC2", numbers.size());
      constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
      part.texture_coordinates.resize(3 * before, {kNone, kNone});
      for (const Triangle& triangle : triangles)
        for (const std::uint32_t corner : triangle)
          part.texture_coordinates.push_back(
              {static_cast<float>(values[2 * corner]), static_cast<float>(1.0 - values[2 * corner + 1])});
    });
  }

  /// Returns values() of an accessor with an element for each of `points` points.
  std::vector<double> values_of_points(std::size_t index, std::size_t components, const char* type,
                                       std::size_t points) {
    std::vector<double> result = values(index, components, type, false);
    if (result.size() != points * components)
      builder_.fail("accessor ", index, " has ", result.size() / components, " elements for ", points,
                    " points");
    return result;
  }

  // ---- Nodes.

  /// Returns the transform of a node: a matrix, or a scale, then a rotation, then a translation.
  Placement placement_of(const Json& node) const {
    Placement result;
    if (const auto m = numbers(node, "matrix", 16)) {
      // Column by column.
      const auto at = [&](int row, int column) { return (*m)[static_cast<std::size_t>(4 * column + row)]; };
      if (at(3, 0) != 0.0 || at(3, 1) != 0.0 || at(3, 2) != 0.0 || at(3, 3) != 1.0)
        builder_.fail("the matrix of a node is no affine map: its last row must be 0 0 0 1");
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) result.linear(row, column) = at(row, column);
        result.translation[row] = at(row, 3);
      }
      return result;
    }
    if (const auto q = numbers(node, "rotation", 4))
      result.linear = rotation((*q)[0], (*q)[1], (*q)[2], (*q)[3]);
    if (const auto s = numbers(node, "scale", 3))
      for (int axis = 0; axis < 3; ++axis) result.linear.col(axis) *= (*s)[std::size_t(axis)];
    if (const auto t = numbers(node, "translation", 3)) result.translation = {(*t)[0], (*t)[1], (*t)[2]};
    return result;
  }

  /// Returns the rotation of a quaternion, normalised because files hold it in few digits.
  Eigen::Matrix3d rotation(double x, double y, double z, double w) const {
    const double length = std::hypot(std::hypot(x, y), std::hypot(z, w));
    if (!(length > 0.0 && std::isfinite(length)))
      builder_.fail("the rotation of a node has the length 0; the file is damaged");
    x /= length, y /= length, z /= length, w /= length;
    Eigen::Matrix3d m;
    m << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  //
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),   //
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y);
    return m;
  }

  struct Visit {
    std::size_t node;
    Placement parent;
  };
  struct Copy {
    std::size_t mesh;
    Placement placement;
    const Json* node;
  };

  /// Returns the indices that an array lists.
  std::vector<std::size_t> indices(const Json& object, const char* key) const {
    std::vector<std::size_t> result;
    for (const Json& index : list(object, key)) {
      const double number = index.is_number() ? index.get<double>() : -1.0;
      if (!(number >= 0.0 && number < 4294967296.0))
        builder_.fail("its '", key, "' hold what is no index; the file is damaged");
      result.push_back(static_cast<std::size_t>(number));
    }
    return result;
  }

  /// Returns the root nodes: those of the default scene, else of the first one, else all nodes that are not
  /// children.
  std::vector<std::size_t> roots() {
    // Scenes are alternatives, which would overlap.
    builder_.mesh.metres = 1.0;
    const std::size_t scenes = list(root(), "scenes").size();
    if (scenes > 1) builder_.note("it has ", scenes, " scenes; the default one was read");
    if (scenes > 0) return indices(entry("scenes", count_if_any(root(), "scene").value_or(0)), "nodes");
    std::set<std::size_t> all;
    const std::size_t nodes = list(root(), "nodes").size();
    for (std::size_t i = 0; i < nodes; ++i) all.insert(i);
    for (std::size_t i = 0; i < nodes; ++i)
      for (const std::size_t child : indices(entry("nodes", i), "children")) all.erase(child);
    return {all.begin(), all.end()};
  }

  void place_nodes() {
    // An explicit stack, since a file may nest nodes to any depth.
    std::vector<Visit> open;
    const auto push = [&](const std::vector<std::size_t>& nodes, const Placement& parent) {
      // The last one goes first, so that the first comes off the stack first.
      for (std::size_t i = nodes.size(); i > 0; --i) open.push_back({nodes[i - 1], parent});
    };
    push(roots(), Placement());
    std::vector<bool> seen(list(root(), "nodes").size());
    while (!open.empty()) {
      const Visit visit = open.back();
      open.pop_back();
      const Json& node = entry("nodes", visit.node);
      // The format has trees only; shared nodes could multiply beyond all bounds.
      if (seen[visit.node])
        builder_.fail("node ", visit.node, " has two parents or is within itself, which glTF forbids");
      seen[visit.node] = true;
      const Placement placement = visit.parent * placement_of(node);
      if (const std::optional<std::size_t> mesh = count_if_any(node, "mesh")) show(node, *mesh, placement);
      push(indices(node, "children"), placement);
    }
    // The memory of all copies is checked before the first one is made.
    for (const Copy& copy : copies_) placer_.spend(part(copy.mesh).cost());
    for (const Copy& copy : copies_) placer_.place(part(copy.mesh), copy.placement);
    std::vector<std::string> names;
    for (const Json& material : list(root(), "materials")) {
      const Json* const name = member(material, "name");
      names.push_back(name && name->is_string() ? name->get<std::string>()
                                                : "material " + std::to_string(names.size()));
    }
    placer_.name_materials(names);
    placer_.note_left_out();
  }

  /// Records a node that shows a mesh.
  void show(const Json& node, std::size_t mesh, const Placement& placement) {
    const Json* const extensions = member(node, "extensions");
    instanced_ += extensions && member(*extensions, "EXT_mesh_gpu_instancing");
    const bool skinned = member(node, "skin");
    skinned_ += skinned;
    // The points of a skinned mesh are positioned by the skin's joints, not by the node. In the bind pose,
    // points are as stored.
    copies_.push_back({mesh, skinned ? Placement() : placement, &node});
  }

  /// Takes the translation of the only node as the origin if hermesh wrote the file.
  void take_origin() {
    const Json* const generator = member(*member(root(), "asset"), "generator");
    if (copies_.size() != 1 || !generator || *generator != "hermesh") return;
    if (const auto t = numbers(*copies_[0].node, "translation", 3))
      builder_.mesh.origin = Eigen::Vector3d((*t)[0], (*t)[1], (*t)[2]);
  }

  void note_what_is_left_out() {
    const auto note = [&](std::size_t number, const char* what) {
      if (number > 0) builder_.note(number, what);
    };
    note(lines_, " of its primitives have points or lines and no triangles, and were left out");
    note(skinned_, " of its meshes are bent by joints; they were read as they are stored");
    note(morphed_, " of its primitives have morph targets, which were left out");
    note(other_colours_,
         " of its corners have another colour than their point elsewhere, which has one; the first counts");
    note(instanced_,
         " of its nodes show their mesh many times (EXT_mesh_gpu_instancing); they were read once");
  }

  std::map<std::size_t, ScenePart> parts_;
  std::vector<Copy> copies_;  ///< of meshes, in the order of the scene
  std::size_t lines_ = 0, skinned_ = 0, morphed_ = 0, instanced_ = 0, other_colours_ = 0;
};

}  // namespace

bool begins_like_glb(std::string_view bytes) { return bytes.starts_with("glTF"); }

void read_glb(std::string_view bytes, MeshBuilder& builder) {
  const GlbChunks chunks = split_glb(bytes, builder);
  GltfReader(chunks.json, chunks.binary, builder).read();
}

void read_gltf(std::string_view bytes, MeshBuilder& builder) {
  // Some editors put a byte order mark before the text, although JSON forbids it.
  GltfReader(without_byte_order_mark(without_padding(bytes)), {}, builder).read();
  builder.note_padding(bytes);
}

}  // namespace hermesh::mesh_formats
