// glTF 2.0 (Khronos 2017, ISO/IEC 12113). nlohmann's library parses the JSON; every index, count and offset
// in it is checked here before it is followed, since no glTF library does that for accessors.
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/stored_number.h"

namespace hermesh::mesh_formats {

namespace {

using Json = nlohmann::json;

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

/// Returns the bytes of a text in base64, with or without the padding at its end.
std::string decode_base64(std::string_view text, const MeshBuilder& builder) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  if (text.size() % 4 == 1) builder.fail("a buffer in base64 breaks off; the file is truncated or damaged");
  std::array<std::int8_t, 256> values;
  values.fill(-1);
  for (std::size_t i = 0; i < digits.size(); ++i)
    values[static_cast<unsigned char>(digits[i])] = static_cast<std::int8_t>(i);
  values['-'] = 62, values['_'] = 63;  // of the alphabet for URLs, which some programs use
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const int digit = values[static_cast<unsigned char>(c)];
    if (digit < 0)
      builder.fail("a buffer in base64 holds a character that is none of its digits; the file is damaged");
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xff);
  }
  return bytes;
}

/// Returns the path of a relative URI, in which %20 is a blank. Empty if it holds control characters.
std::string decode_percents(std::string_view uri) {
  std::string path;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    int value = static_cast<unsigned char>(uri[i]);
    if (uri[i] == '%') {
      if (uri.size() - i < 3) return "";
      const char* const digits = uri.data() + i + 1;
      if (std::from_chars(digits, digits + 2, value, 16).ptr != digits + 2) return "";
      i += 2;
    }
    // In particular no zero, which would end the name early for the system only.
    if (value < ' ') return "";
    path += static_cast<char>(value);
  }
  return path;
}

/// True if the path stays in the directory that it starts from or below. A foreign mesh file must not make
/// the program read other files.
bool stays_below(const std::filesystem::path& path) {
  if (path.empty() || path.is_absolute() || path.string().find('\\') != std::string::npos) return false;
  return std::ranges::none_of(path, [](const std::filesystem::path& step) { return step == ".."; });
}

/// Returns the bytes of a buffer's URI: base64 in the URI itself, or a file in the directory of the mesh file
/// or below. @throws Error for any other address, for damaged base64, and for a file that cannot be read.
std::string bytes_of_uri(std::string_view uri, const MeshBuilder& builder) {
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string_view::npos || !uri.substr(0, comma).ends_with(";base64"))
      builder.fail("a buffer within it is not in base64, which is the one encoding that is read");
    return decode_base64(uri.substr(comma + 1), builder);
  }
  const auto fail = [&](const char* what) { builder.fail("its buffer ", quoted_word(uri), what); };
  // A colon before any slash ends the scheme of an address, such as https.
  if (uri.substr(0, uri.find('/')).find(':') != std::string_view::npos)
    fail(" is an address; only files in the directory of the file are read, so save it there");
  const std::filesystem::path folder = std::filesystem::path(builder.file()).parent_path() / ".";
  std::error_code error;
  // Some programs do not encode names, so % is no escape there.
  std::filesystem::path relative = decode_percents(uri);
  if (!stays_below(relative) || !std::filesystem::is_regular_file(folder / relative, error))
    if (stays_below(uri) && std::filesystem::is_regular_file(folder / uri, error)) relative = uri;
  if (!stays_below(relative)) fail(" is not in the folder of the file or beneath it; move it there");
  const std::filesystem::path path = folder / relative;
  if (!std::filesystem::is_regular_file(path, error))
    fail(" does not exist: the two files belong into one folder");
  const std::filesystem::path root = std::filesystem::canonical(folder, error);
  if (!stays_below(std::filesystem::canonical(path, error).lexically_relative(root)))
    fail(" is a symbolic link that leads out of the folder of the file; copy it there");
  try {
    return read_whole(path);
  } catch (const Error&) {
    // Its message would contain a path chosen by the author of the file, with any characters.
    builder.fail("its buffer ", quoted_word(uri), " cannot be read");
  }
}

/// Returns the type of an accessor's numbers for a constant of OpenGL; nothing for any other number.
std::optional<NumberType> number_type(std::size_t code) {
  switch (code) {
    case 5120:
      return NumberType::int8;
    case 5121:
      return NumberType::uint8;
    case 5122:
      return NumberType::int16;
    case 5123:
      return NumberType::uint16;
    case 5125:
      return NumberType::uint32;
    case 5126:
      return NumberType::float32;
    default:
      return std::nullopt;
  }
}

bool is_index_type(std::optional<NumberType> type) {
  return type == NumberType::uint8 || type == NumberType::uint16 || type == NumberType::uint32;
}

/// Elements that lie in a buffer at equal distances.
struct Elements {
  std::string_view bytes;  ///< from the first one on
  std::size_t stride;
  NumberType type;

  void read(std::size_t i, std::size_t components, double* to) const {
    const char* at = bytes.data() + i * stride;
    with_type(type, [&](auto zero) {
      for (std::size_t k = 0; k < components; ++k, at += sizeof zero)
        to[k] = static_cast<double>(stored_number<decltype(zero)>(at));
    });
  }
};

/// True for extensions that a file may require although they are unknown here: none moves a triangle.
bool leaves_shapes_alone(std::string_view extension) {
  for (const char* prefix : {"KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "EXT_lights_",
                             "MSFT_texture_", "KHR_xmp", "KHR_animation_pointer", "KHR_mesh_quantization"})
    if (extension.starts_with(prefix)) return true;
  return false;
}

/// Reads one file: parses the JSON, visits the nodes of the scene, decodes their meshes, and adds a copy of
/// the mesh to the builder for each node.
class GltfReader {
 public:
  GltfReader(std::string_view json, std::string_view binary, MeshBuilder& builder)
      : builder_(builder), placer_(builder), binary_(binary), json_(json) {}

  void read() {
    parse();
    const Json* const asset = member(root_, "asset");
    const Json* const version = asset ? member(*asset, "version") : nullptr;
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
  /// Parses the JSON; the library needs no recursion for nested brackets.
  void parse() {
    try {
      root_ = Json::parse(json_.begin(), json_.end());
    } catch (const Json::parse_error& error) {
      builder_.fail("its JSON is truncated or damaged at byte ", error.byte);
    } catch (const Json::exception&) {
      // A number beyond double precision.
      builder_.fail("its JSON holds a number that is too large; the file is damaged");
    }
    if (!root_.is_object()) builder_.fail("its JSON is no object; the file is damaged or no glTF");
  }

  // ---- Lookup. Each of these throws an Error if the JSON has another structure.

  /// Returns a member of an object; null if it has none, or is not an object.
  const Json* member(const Json& object, const char* key) const {
    const auto found = object.is_object() ? object.find(key) : object.end();
    return object.is_object() && found != object.end() ? &*found : nullptr;
  }

  /// Returns a member that is an integer, such as an index, a length or an offset, if there is one.
  std::optional<std::size_t> count_if_any(const Json& object, const char* key) const {
    const Json* const value = member(object, key);
    if (!value) return std::nullopt;
    // Integers with a decimal point are valid JSON.
    const double number = value->is_number() ? value->get<double>() : -1.0;
    if (!(number >= 0.0 && number <= 9007199254740992.0 && number == std::floor(number)))
      builder_.fail("its '", key, "' must be a whole number that is not negative; the file is damaged");
    return static_cast<std::size_t>(number);
  }

  /// Returns a mandatory member as above.
  std::size_t count(const Json& object, const char* key) const {
    const std::optional<std::size_t> value = count_if_any(object, key);
    if (!value) builder_.fail("a '", key, "' is missing; the file is damaged");
    return *value;
  }

  /// Returns the entries of an array, if there is one.
  const Json& list(const Json& object, const char* key) const {
    static const Json none = Json::array();
    const Json* const value = member(object, key);
    if (!value) return none;
    if (!value->is_array()) builder_.fail("its '", key, "' must be an array; the file is damaged");
    return *value;
  }

  /// Returns an entry of one of the arrays of the root.
  const Json& entry(const char* key, std::size_t index) const {
    const Json& entries = list(root_, key);
    if (index >= entries.size())
      builder_.fail("it refers to number ", index, " of '", key, "', but there are ", entries.size(),
                    " (counting from 0)");
    if (!entries[index].is_object())
      builder_.fail("number ", index, " of its '", key, "' is no object; the file is damaged");
    return entries[index];
  }

  /// Returns a member that is an array of `size` numbers, if there is one.
  std::optional<std::vector<double>> numbers(const Json& object, const char* key, std::size_t size) const {
    const Json* const value = member(object, key);
    if (!value) return std::nullopt;
    std::vector<double> result;
    if (value->is_array() && value->size() == size)
      for (const Json& number : *value)
        if (number.is_number()) result.push_back(number.get<double>());
    if (result.size() != size)
      builder_.fail("the '", key, "' of a node must be ", size, " numbers; the file is damaged");
    return result;
  }

  /// Refuses required extensions that may change shapes. Extensions that are only used have a fallback.
  void check_extensions() const {
    for (const Json& required : list(root_, "extensionsRequired")) {
      const std::string name = required.is_string() ? required.get<std::string>() : "?";
      if (leaves_shapes_alone(name)) continue;
      if (name.find("draco") != std::string::npos || name.find("meshopt") != std::string::npos)
        fail_compressed(name);
      builder_.fail("it requires the extension ", quoted_word(name),
                    ", which is not read; export it without");
    }
  }

  [[noreturn]] void fail_compressed(const std::string& extension) const {
    builder_.fail("its meshes are compressed by ", quoted_word(extension),
                  ", which is not read; export it without compression");
  }

  // ---- Buffers and accessors.

  /// Returns the bytes of a buffer. Buffers with a URI are fetched once.
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
      builder_.fail("its buffer ", index, " declares ", length, " bytes, but ", bytes.size(),
                    " exist; the file is truncated or damaged");
    return bytes.substr(0, length);
  }

  /// Returns elements of a buffer view. @throws Error if they reach beyond it, or it beyond its buffer.
  Elements elements(const Json& from, std::size_t view, NumberType type, std::size_t components,
                    std::size_t number) {
    const Json& description = entry("bufferViews", view);
    const std::string_view whole = buffer(count(description, "buffer"));
    // These numbers may be so large that sums overflow, so each is compared with the remaining length.
    const std::size_t start = count_if_any(description, "byteOffset").value_or(0),
                      length = count(description, "byteLength");
    const auto beyond = [&](const std::string& what) {
      builder_.fail(what, " reaches beyond its bytes; the file is truncated or damaged");
    };
    if (start > whole.size() || length > whole.size() - start) beyond("buffer view " + std::to_string(view));
    const std::string_view bytes = whole.substr(start, length);
    const std::size_t size = components * size_of(type);
    const std::size_t stride = count_if_any(description, "byteStride").value_or(size);
    const std::size_t offset = count_if_any(from, "byteOffset").value_or(0);
    // Elements that overlap would make a few bytes millions of points.
    if (stride < size || stride > 65536)
      builder_.fail("the 'byteStride' of buffer view ", view,
                    " does not fit its elements; the file is damaged");
    // The last element need not be followed by the rest of its stride.
    if (number > 0 && (offset > bytes.size() || bytes.size() - offset < size ||
                       number - 1 > (bytes.size() - offset - size) / stride))
      beyond("an accessor of buffer view " + std::to_string(view));
    return {bytes.substr(std::min(offset, bytes.size())), stride, type};
  }

  /// Returns all numbers of an accessor, element by element.
  std::vector<double> values(std::size_t index, std::size_t components, const char* type, bool whole) {
    const Json& accessor = entry("accessors", index);
    const std::string name = "accessor " + std::to_string(index);
    const Json* const given_type = member(accessor, "type");
    const std::optional<NumberType> number_format = number_type(count(accessor, "componentType"));
    const std::size_t number = count(accessor, "count");
    if (!given_type || *given_type != type || !number_format || (whole && !is_index_type(number_format)))
      builder_.fail("its ", name, " is of a type that its use does not allow; the file is damaged");
    const std::optional<std::size_t> view = count_if_any(accessor, "bufferView");
    const Json* const sparse = member(accessor, "sparse");
    // Without a view all values are 0, so the length of the file does not bound their number.
    if (!view && number > binary_.size() + json_.size())
      builder_.fail("its ", name, " declares more elements than it has bytes; the file is damaged");
    std::optional<Elements> from;
    if (view) from = elements(accessor, *view, *number_format, components, number);
    placer_.spend(double(number) * double(components * sizeof(double)));
    std::vector<double> result(number * components, 0.0);
    for (std::size_t i = 0; from && i < number; ++i) from->read(i, components, &result[i * components]);
    if (sparse) read_sparse(*sparse, name, *number_format, components, result);
    // Quantized points: the lowest number of a signed type is −1, as is the one above it.
    const Json* const normalized = member(accessor, "normalized");
    if (normalized && *normalized == true && size_of(*number_format) < 4)
      for (double& value : result) value = std::max(value / largest_of(*number_format), -1.0);
    return result;
  }

  /// Replaces the values that a sparse accessor lists.
  void read_sparse(const Json& sparse, const std::string& name, NumberType type, std::size_t components,
                   std::vector<double>& values) {
    const Json* const where = member(sparse, "indices");
    const Json* const what = member(sparse, "values");
    const std::size_t number = count(sparse, "count");
    if (!where || !what) builder_.fail("its sparse ", name, " lacks indices or values; the file is damaged");
    const std::optional<NumberType> index_type = number_type(count(*where, "componentType"));
    if (!is_index_type(index_type))
      builder_.fail("its sparse ", name, " has indices of a wrong type; the file is damaged");
    const Elements indices = elements(*where, count(*where, "bufferView"), *index_type, 1, number);
    const Elements replacements = elements(*what, count(*what, "bufferView"), type, components, number);
    for (std::size_t i = 0; i < number; ++i) {
      double at = 0.0;
      indices.read(i, 1, &at);
      if (at >= double(values.size() / components))
        builder_.fail("its sparse ", name, " replaces an element beyond its end; the file is damaged");
      replacements.read(i, components, &values[std::size_t(at) * components]);
    }
  }

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
      for (const Json* const primitive : primitives)
        for (const Triangle& triangle : triangles_of(*primitive, points.size()))
          triangles.push_back(triangle);
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
      for (const auto& [a, b, c] : triangles)
        result.triangles.push_back({numbers[a], numbers[b], numbers[c]});
    }
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
    const std::size_t scenes = list(root_, "scenes").size();
    if (scenes > 1) builder_.note("it has ", scenes, " scenes; the default one was read");
    if (scenes > 0) return indices(entry("scenes", count_if_any(root_, "scene").value_or(0)), "nodes");
    std::set<std::size_t> all;
    const std::size_t nodes = list(root_, "nodes").size();
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
    std::vector<bool> seen(list(root_, "nodes").size());
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
  void take_origin(const Json& asset) {
    const Json* const generator = member(asset, "generator");
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
