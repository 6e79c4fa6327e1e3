// glTF 2.0 (Khronos 2017, ISO/IEC 12113). The JSON is parsed by nlohmann's library; every index, count and
// offset in it is held against what is there before it is followed, because no library for glTF does that for
// accessors.
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "algorithms/io/scenes/gltf_buffers.h"
#include "algorithms/io/scenes/gltf_numbers.h"
#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/scenes/scene_part.h"

namespace hermesh::mesh_formats {

namespace {

using Json = nlohmann::json;

/// Elements that lie in a buffer at equal distances.
struct Elements {
  std::string_view bytes;  ///< from the first one on
  std::size_t stride, component;
};

/// Extensions that a file may require although nothing is known of them here: none changes where a triangle
/// is.
bool leaves_shapes_alone(std::string_view extension) {
  for (const char* prefix : {"KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "EXT_lights_",
                             "MSFT_texture_", "KHR_xmp", "KHR_animation_pointer", "KHR_mesh_quantization"})
    if (extension.starts_with(prefix)) return true;
  return false;
}

/// Reads one file: parses the JSON, goes through the nodes of the scene, decodes the meshes that they show,
/// and adds a copy of the mesh for each of them to the builder.
class GltfReader {
 public:
  GltfReader(std::string_view json, std::string_view binary, MeshBuilder& builder)
      : builder_(builder), placer_(builder), binary_(binary), json_(json) {}

  void read() {
    parse();
    const Json* const asset = member(root_, "asset");
    const Json* const version = asset ? member(*asset, "version") : nullptr;
    // Version 1 has another layout altogether, and no version may come after 2 that readers of 2 can read.
    if (!version || !version->is_string()) builder_.fail("it does not say which version of glTF it is");
    if (!version->get_ref<const std::string&>().starts_with("2."))
      builder_.fail("it is of version " + quoted_word(version->get_ref<const std::string&>()) +
                    " of glTF; only version 2 is read");
    check_extensions();
    place_nodes();
    take_origin(*asset);
    note_what_is_left_out();
  }

 private:
  /// Parses the JSON. The library needs no recursion for it, so that brackets may be nested as deeply as they
  /// like.
  void parse() {
    try {
      root_ = Json::parse(json_.begin(), json_.end());
    } catch (const Json::parse_error& error) {
      builder_.fail("its JSON is truncated or damaged at byte " + std::to_string(error.byte));
    } catch (const Json::exception&) {
      // A number beyond double precision.
      builder_.fail("its JSON holds a number that is too large; the file is damaged");
    }
    if (!root_.is_object()) builder_.fail("its JSON is no object; the file is damaged or no glTF");
  }

  // ---- Looking up. Each of these fails with a sentence where the JSON is not what it should be.

  /// A member of an object; null where there is none, or no object either.
  const Json* member(const Json& object, const char* key) const {
    const auto found = object.is_object() ? object.find(key) : object.end();
    return object.is_object() && found != object.end() ? &*found : nullptr;
  }

  /// A member that is a whole number, such as an index, a length or an offset; none where it is left out.
  std::optional<std::size_t> count_if_any(const Json& object, const char* key) const {
    const Json* const value = member(object, key);
    if (!value) return std::nullopt;
    // Some programs write whole numbers with a point; JSON makes no difference.
    const double number = value->is_number() ? value->get<double>() : -1.0;
    if (!(number >= 0.0 && number <= 9007199254740992.0 && number == std::floor(number)))
      builder_.fail("its '" + std::string(key) +
                    "' must be a whole number that is not negative; the file is damaged");
    return static_cast<std::size_t>(number);
  }

  /// A member as above that the format does not allow to be left out.
  std::size_t count(const Json& object, const char* key) const {
    const std::optional<std::size_t> value = count_if_any(object, key);
    if (!value) builder_.fail("a '" + std::string(key) + "' is missing; the file is damaged");
    return *value;
  }

  /// The entries of an array; none where there is no array.
  const Json& list(const Json& object, const char* key) const {
    static const Json none = Json::array();
    const Json* const value = member(object, key);
    if (!value) return none;
    if (!value->is_array())
      builder_.fail("its '" + std::string(key) + "' must be an array; the file is damaged");
    return *value;
  }

  /// An entry of one of the arrays of the file's topmost object.
  const Json& entry(const char* key, std::size_t index) const {
    const Json& entries = list(root_, key);
    if (index >= entries.size())
      builder_.fail("it refers to number " + std::to_string(index) + " of '" + key + "', but there are " +
                    std::to_string(entries.size()) + " (counting from 0)");
    if (!entries[index].is_object())
      builder_.fail("number " + std::to_string(index) + " of its '" + key +
                    "' is no object; the file is damaged");
    return entries[index];
  }

  /// A member that is an array of so many numbers; none where it is left out.
  std::optional<std::vector<double>> numbers(const Json& object, const char* key, std::size_t size) const {
    const Json* const value = member(object, key);
    if (!value) return std::nullopt;
    std::vector<double> result;
    if (value->is_array() && value->size() == size)
      for (const Json& number : *value)
        if (number.is_number()) result.push_back(number.get<double>());
    if (result.size() != size)
      builder_.fail("the '" + std::string(key) + "' of a node must be " + std::to_string(size) +
                    " numbers; the file is damaged");
    return result;
  }

  /// Refuses what the file itself says cannot be read without more knowledge. What it merely uses has a
  /// fallback, by the rules of the format.
  void check_extensions() const {
    for (const Json& required : list(root_, "extensionsRequired")) {
      const std::string name = required.is_string() ? required.get<std::string>() : "?";
      if (leaves_shapes_alone(name)) continue;
      if (name.find("draco") != std::string::npos || name.find("meshopt") != std::string::npos)
        fail_compressed(name);
      builder_.fail("it requires the extension " + quoted_word(name) +
                    ", which is not read; export it without");
    }
  }

  /// The two ways to compress meshes that exporters offer; neither has a library that all systems have.
  [[noreturn]] void fail_compressed(const std::string& extension) const {
    builder_.fail("its meshes are compressed by " + quoted_word(extension) +
                  ", which is not read; export it without compression");
  }

  // ---- Buffers and accessors.

  /// The bytes of a buffer. Those from elsewhere than the second chunk are fetched once, and kept while the
  /// file is read.
  std::string_view buffer(std::size_t index) {
    const Json& description = entry("buffers", index);
    const std::size_t length = count(description, "byteLength");
    const auto found = buffers_.find(index);
    std::string_view bytes;
    if (found != buffers_.end()) {
      bytes = found->second;
    } else if (const Json* const uri = member(description, "uri")) {
      if (!uri->is_string()) builder_.fail("the 'uri' of a buffer must be a string; the file is damaged");
      bytes = buffers_[index] = bytes_of_uri(uri->get_ref<const std::string&>(), builder_);
    } else if (index == 0) {
      bytes = binary_;
    }
    if (bytes.size() < length)
      builder_.fail("its buffer " + std::to_string(index) + " declares " + std::to_string(length) +
                    " bytes, but " + std::to_string(bytes.size()) +
                    " are there; the file is truncated or damaged");
    return bytes.substr(0, length);
  }

  /// Elements of a buffer view. @throws Error where they reach beyond it, or it beyond its buffer.
  Elements elements(const Json& from, std::size_t view, std::size_t component, std::size_t components,
                    std::size_t number) {
    const Json& description = entry("bufferViews", view);
    const std::string_view whole = buffer(count(description, "buffer"));
    // All of these are as large as the file likes, so that sums may overflow; each is held against what is
    // left instead.
    const std::size_t start = count_if_any(description, "byteOffset").value_or(0),
                      length = count(description, "byteLength");
    const auto beyond = [&](const std::string& what) {
      builder_.fail(what + " reaches beyond its bytes; the file is truncated or damaged");
    };
    if (start > whole.size() || length > whole.size() - start) beyond("buffer view " + std::to_string(view));
    const std::string_view bytes = whole.substr(start, length);
    const std::size_t size = components * size_of(component);
    const std::size_t stride = count_if_any(description, "byteStride").value_or(size);
    const std::size_t offset = count_if_any(from, "byteOffset").value_or(0);
    // Elements that overlap would make a few bytes millions of points.
    if (stride < size || stride > 65536)
      builder_.fail("the 'byteStride' of buffer view " + std::to_string(view) +
                    " does not fit its elements; the file is damaged");
    // The last element need not be followed by the rest of its stride.
    if (number > 0 && (offset > bytes.size() || bytes.size() - offset < size ||
                       number - 1 > (bytes.size() - offset - size) / stride))
      beyond("an accessor of buffer view " + std::to_string(view));
    return {bytes.substr(std::min(offset, bytes.size())), stride, component};
  }

  /// All numbers of an accessor, those of each element in turn.
  std::vector<double> values(std::size_t index, std::size_t components, const char* type, bool whole) {
    const Json& accessor = entry("accessors", index);
    const std::string name = "accessor " + std::to_string(index);
    // Types are asked for by those who use the accessor: points are vectors, indices are whole numbers.
    const Json* const given_type = member(accessor, "type");
    const std::size_t component = count(accessor, "componentType"), number = count(accessor, "count");
    const bool is_index =
        component == kUnsignedByte || component == kUnsignedShort || component == kUnsignedInt;
    if (!given_type || *given_type != type || size_of(component) == 0 || (whole && !is_index))
      builder_.fail("its " + name + " is of a type that its use does not allow; the file is damaged");
    const std::optional<std::size_t> view = count_if_any(accessor, "bufferView");
    const Json* const sparse = member(accessor, "sparse");
    // Without a view all values are 0, and nothing says that there cannot be billions.
    if (!view && number > binary_.size() + json_.size())
      builder_.fail("its " + name + " declares more elements than it has bytes; the file is damaged");
    std::optional<Elements> from;
    if (view) from = elements(accessor, *view, component, components, number);
    placer_.spend(double(number) * double(components * sizeof(double)));
    std::vector<double> result(number * components, 0.0);
    for (std::size_t i = 0; from && i < number; ++i)
      read_element(*from, i, components, &result[i * components]);
    if (sparse) read_sparse(*sparse, name, component, components, result);
    // Quantized points: the lowest of a signed type is −1 like the one above it.
    const Json* const normalized = member(accessor, "normalized");
    if (normalized && *normalized == true && component < kUnsignedInt)
      for (double& value : result) value = std::max(value / largest_of(component), -1.0);
    return result;
  }

  static void read_element(const Elements& from, std::size_t i, std::size_t components, double* to) {
    const char* const at = from.bytes.data() + i * from.stride;
    for (std::size_t k = 0; k < components; ++k)
      to[k] = number_at(at + k * size_of(from.component), from.component);
  }

  /// Puts the values of a sparse accessor in place of those that it lists.
  void read_sparse(const Json& sparse, const std::string& name, std::size_t component, std::size_t components,
                   std::vector<double>& values) {
    const Json* const where = member(sparse, "indices");
    const Json* const what = member(sparse, "values");
    const std::size_t number = count(sparse, "count");
    if (!where || !what)
      builder_.fail("its sparse " + name + " lacks indices or values; the file is damaged");
    const std::size_t index_type = count(*where, "componentType");
    if (index_type != kUnsignedByte && index_type != kUnsignedShort && index_type != kUnsignedInt)
      builder_.fail("its sparse " + name + " has indices of a wrong type; the file is damaged");
    const Elements indices = elements(*where, count(*where, "bufferView"), index_type, 1, number);
    const Elements replacements = elements(*what, count(*what, "bufferView"), component, components, number);
    for (std::size_t i = 0; i < number; ++i) {
      double at = 0.0;
      read_element(indices, i, 1, &at);
      // The accessor has its full length already, and a replacement makes it no longer.
      if (at >= double(values.size() / components))
        builder_.fail("its sparse " + name + " replaces an element that is not there; the file is damaged");
      read_element(replacements, i, components, &values[std::size_t(at) * components]);
    }
  }

  // ---- Meshes.

  /// The points of a POSITION accessor, in single precision as the format has them.
  std::vector<Eigen::Vector3d> points_of(std::size_t accessor) {
    const std::vector<double> numbers = values(accessor, 3, "VEC3", false);
    std::vector<Eigen::Vector3d> points;
    points.reserve(numbers.size() / 3);
    for (std::size_t i = 0; i < numbers.size(); i += 3)
      points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
    return points;
  }

  /// The triangles of a primitive as corners of its POSITION accessor, which has `points` elements.
  std::vector<Triangle> triangles_of(const Json& primitive, std::size_t points) {
    const std::size_t mode = count_if_any(primitive, "mode").value_or(4);
    // Without indices the corners are the points in their order.
    std::vector<std::uint32_t> corners;
    if (const std::optional<std::size_t> indices = count_if_any(primitive, "indices")) {
      for (const double index : values(*indices, 1, "SCALAR", true)) {
        if (index >= double(points))
          builder_.fail("a triangle refers to point " + std::to_string(std::uint64_t(index)) +
                        ", but there are " + std::to_string(points) + " (counting from 0)");
        corners.push_back(static_cast<std::uint32_t>(index));
      }
    } else {
      placer_.spend(double(points) * sizeof(std::uint32_t));
      for (std::size_t i = 0; i < points; ++i) corners.push_back(static_cast<std::uint32_t>(i));
    }
    if (mode == 4 && corners.size() % 3 != 0)
      builder_.fail("a list of triangles has " + std::to_string(corners.size()) +
                    " corners, which is no multiple of 3; the file is truncated or damaged");
    // Strips and fans have nearly as many triangles as corners.
    placer_.spend(double(corners.size()) * sizeof(Triangle) / (mode == 4 ? 3.0 : 1.0));
    return connect(corners, mode);
  }

  /// The triangles between corners, by the mode of the primitive: 4 is a list, 5 a strip and 6 a fan.
  static std::vector<Triangle> connect(const std::vector<std::uint32_t>& corners, std::size_t mode) {
    std::vector<Triangle> triangles;
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      triangles.push_back({corners[a], corners[b], corners[c]});
    };
    if (mode == 4)
      for (std::size_t i = 2; i < corners.size(); i += 3) add(i - 2, i - 1, i);
    // Every other triangle of a strip would be the wrong way round. Those with a corner twice join two
    // strips.
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

  /// The primitives of a mesh that have triangles, by the accessor of their points. Primitives may share one,
  /// each using some of its points.
  std::map<std::size_t, std::vector<const Json*>> primitives_of(const Json& mesh) {
    std::map<std::size_t, std::vector<const Json*>> result;
    for (const Json& primitive : list(mesh, "primitives")) {
      const std::size_t mode = count_if_any(primitive, "mode").value_or(4);
      if (mode > 6)
        builder_.fail("a primitive has the mode " + std::to_string(mode) +
                      ", which glTF has not; the file is damaged");
      const Json* const attributes = member(primitive, "attributes");
      const std::optional<std::size_t> position =
          attributes ? count_if_any(*attributes, "POSITION") : std::nullopt;
      if (mode < 4 || !position) {
        ++lines_;
        continue;
      }
      check_not_compressed(primitive, *position);
      // The mesh at rest is what the accessors hold; targets are displacements from it.
      morphed_ += !list(primitive, "targets").empty();
      result[*position].push_back(&primitive);
    }
    return result;
  }

  /// A file that does not require Draco has the plain data, too; one that lacks them cannot be read.
  void check_not_compressed(const Json& primitive, std::size_t position) const {
    const Json* const extensions = member(primitive, "extensions");
    const Json& accessor = entry("accessors", position);
    if (extensions && member(*extensions, "KHR_draco_mesh_compression") && !member(accessor, "bufferView") &&
        !member(accessor, "sparse"))
      fail_compressed("KHR_draco_mesh_compression");
  }

  /// The part that a mesh is, made once however many nodes show it. Points that no triangle uses are left
  /// out: primitives share accessors, and what another mesh uses is not this one's.
  const ScenePart& part(std::size_t index) {
    // A map keeps its entries where they are, so that references to parts stay good while others are added.
    const auto [at, is_new] = parts_.try_emplace(index);
    ScenePart& result = at->second;
    if (!is_new) return result;
    // One merger for all primitives of the mesh: materials divide it, and the surface goes on across.
    PointMerger merger(result.points);
    for (const auto& [position, primitives] : primitives_of(entry("meshes", index))) {
      builder_.context().check();
      const std::vector<Eigen::Vector3d> points = points_of(position);
      std::vector<Triangle> triangles;
      for (const Json* const primitive : primitives)
        for (const Triangle& triangle : triangles_of(*primitive, points.size()))
          triangles.push_back(triangle);
      std::vector<bool> used(points.size());
      for (const Triangle& triangle : triangles)
        for (const std::uint32_t corner : triangle) used[corner] = true;
      // In the order of the file, so that a mesh which shares its points already keeps their order.
      std::vector<std::uint32_t> numbers(points.size());
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (!used[i]) continue;
        // Before it is merged, because NaN equals nothing.
        if (!points[i].allFinite())
          builder_.fail("point " + std::to_string(i) + " of accessor " + std::to_string(position) +
                        " (both count from 0) has a coordinate that is not a finite number");
        numbers[i] = merger.add(points[i]);
      }
      for (const auto& [a, b, c] : triangles)
        result.triangles.push_back({numbers[a], numbers[b], numbers[c]});
    }
    return result;
  }

  // ---- Nodes.

  /// The transform of a node: a matrix, or a scale, then a rotation, then a translation.
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

  /// The rotation of a quaternion of any length but 0: files hold unit ones in few digits.
  Eigen::Matrix3d rotation(double x, double y, double z, double w) const {
    const double length = std::hypot(std::hypot(x, y), std::hypot(z, w));
    if (!(length > 0.0 && std::isfinite(length)))
      builder_.fail("the rotation of a node has the length 0; the file is damaged");
    x /= length, y /= length, z /= length, w /= length;
    // The usual formula, in double precision; a rotation about an axis of the lattice leaves zeros that are
    // exact.
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

  /// Indices that an array lists.
  std::vector<std::size_t> indices(const Json& object, const char* key) const {
    std::vector<std::size_t> result;
    for (const Json& index : list(object, key)) {
      const double number = index.is_number() ? index.get<double>() : -1.0;
      if (!(number >= 0.0 && number < 4294967296.0))
        builder_.fail("its '" + std::string(key) + "' hold what is no index; the file is damaged");
      result.push_back(static_cast<std::size_t>(number));
    }
    return result;
  }

  /// The nodes that the scene shows by itself: those of the default scene, or of the first one, or, where
  /// there is none, all that are no other's child.
  std::vector<std::size_t> roots() {
    // Scenes are alternatives of one another, and showing all would put them into one place.
    const std::size_t scenes = list(root_, "scenes").size();
    if (scenes > 1) builder_.note("it has " + std::to_string(scenes) + " scenes; the default one was read");
    if (scenes > 0) return indices(entry("scenes", count_if_any(root_, "scene").value_or(0)), "nodes");
    std::set<std::size_t> all;
    const std::size_t nodes = list(root_, "nodes").size();
    for (std::size_t i = 0; i < nodes; ++i) all.insert(i);
    for (std::size_t i = 0; i < nodes; ++i)
      for (const std::size_t child : indices(entry("nodes", i), "children")) all.erase(child);
    return {all.begin(), all.end()};
  }

  void place_nodes() {
    // A stack of our own, since a file may nest nodes as deeply as it likes.
    std::vector<Visit> open;
    const auto push = [&](const std::vector<std::size_t>& nodes, const Placement& parent) {
      // The last one goes first, so that the first comes off the stack first.
      for (std::size_t i = nodes.size(); i > 0; --i) open.push_back({nodes[i - 1], parent});
    };
    push(roots(), Placement());
    std::vector<bool> seen(list(root_, "nodes").size());
    while (!open.empty()) {
      const Visit visit = open.back();
      open.pop_back();
      const Json& node = entry("nodes", visit.node);
      // The format has trees alone; anything else could grow beyond all bounds.
      if (seen[visit.node])
        builder_.fail("node " + std::to_string(visit.node) +
                      " has two parents or is within itself, which glTF forbids");
      seen[visit.node] = true;
      const Placement placement = visit.parent * placement_of(node);
      if (const std::optional<std::size_t> mesh = count_if_any(node, "mesh")) show(node, *mesh, placement);
      push(indices(node, "children"), placement);
    }
    // What all copies take is known before the first one is made.
    for (const Copy& copy : copies_) placer_.spend(part(copy.mesh).cost());
    for (const Copy& copy : copies_) placer_.place(part(copy.mesh), copy.placement);
    placer_.note_left_out();
  }

  /// Takes note of a node that shows a mesh.
  void show(const Json& node, std::size_t mesh, const Placement& placement) {
    const Json* const extensions = member(node, "extensions");
    instanced_ += extensions && member(*extensions, "EXT_mesh_gpu_instancing");
    const bool skinned = member(node, "skin");
    skinned_ += skinned;
    // A skin's joints place its points, and not the node. Bound as it was made, its points are where they are
    // stored.
    copies_.push_back({mesh, skinned ? Placement() : placement, &node});
  }

  /// Takes the translation of the one node for the origin, where this program wrote it.
  void take_origin(const Json& asset) {
    const Json* const generator = member(asset, "generator");
    if (copies_.size() != 1 || !generator || *generator != "hermesh") return;
    if (const auto t = numbers(*copies_[0].node, "translation", 3))
      builder_.mesh.origin = Eigen::Vector3d((*t)[0], (*t)[1], (*t)[2]);
  }

  void note_what_is_left_out() {
    const auto note = [&](std::size_t number, const char* what) {
      if (number > 0) builder_.note(std::to_string(number) + what);
    };
    // In an order of its own and not of the file, so that notes are found where they are looked for.
    note(lines_, " of its primitives have points or lines and no triangles, and were left out");
    note(skinned_, " of its meshes are bent by joints; they were read as they are stored");
    note(morphed_, " of its primitives have morph targets, which were left out");
    note(instanced_,
         " of its nodes show their mesh many times (EXT_mesh_gpu_instancing); they were read once");
  }

  MeshBuilder& builder_;
  PartPlacer placer_;
  std::string_view binary_, json_;
  Json root_;
  std::map<std::size_t, std::string> buffers_;
  std::map<std::size_t, ScenePart> parts_;
  std::vector<Copy> copies_;  ///< of meshes, in the order of the scene
  std::size_t lines_ = 0, skinned_ = 0, morphed_ = 0, instanced_ = 0;
};

}  // namespace

void read_glb(std::string_view bytes, MeshBuilder& builder) {
  const GlbChunks chunks = split_glb(bytes, builder);
  GltfReader(chunks.json, chunks.binary, builder).read();
}

void read_gltf(std::string_view bytes, MeshBuilder& builder) {
  // Editors put a byte order mark before the text, although JSON forbids it.
  GltfReader(without_byte_order_mark(without_padding(bytes)), {}, builder).read();
  builder.note_padding(bytes);
}

}  // namespace hermesh::mesh_formats
