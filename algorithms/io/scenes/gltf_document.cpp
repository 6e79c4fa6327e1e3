#include "algorithms/io/scenes/gltf_document.h"

namespace hermesh::mesh_formats {

namespace {

using Json = nlohmann::json;

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
  // Some programs do not encode names; a % in them stands for itself.
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

/// True for extensions that a file may require although they are unknown here: none moves a triangle.
bool leaves_shapes_alone(std::string_view extension) {
  for (const char* prefix : {"KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "EXT_lights_",
                             "MSFT_texture_", "KHR_xmp", "KHR_animation_pointer", "KHR_mesh_quantization"})
    if (extension.starts_with(prefix)) return true;
  return false;
}

}  // namespace

/// Elements that lie in a buffer at equal distances.
struct GltfDocument::Elements {
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

GltfDocument::GltfDocument(std::string_view json, std::string_view binary, MeshBuilder& builder)
    : builder_(builder), placer_(builder), binary_(binary), json_(json) {
  try {
    root_ = Json::parse(json_.begin(), json_.end());  // without recursion for nested brackets
  } catch (const Json::parse_error& error) {
    builder_.fail("its JSON is truncated or damaged at byte ", error.byte);
  } catch (const Json::exception&) {
    // A number beyond double precision.
    builder_.fail("its JSON holds a number that is too large; the file is damaged");
  }
  if (!root_.is_object()) builder_.fail("its JSON is not an object; the file is damaged or not glTF");
  const Json* const asset = member(root_, "asset");
  const Json* const version = asset ? member(*asset, "version") : nullptr;
  if (!version || !version->is_string()) builder_.fail("it does not say which version of glTF it is");
  if (!version->get_ref<const std::string&>().starts_with("2."))
    builder_.fail("it is of version " + quoted_word(version->get_ref<const std::string&>()) +
                  " of glTF; only version 2 is read");
  check_extensions();
}

const Json* GltfDocument::member(const Json& object, const char* key) const {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() ? &*found : nullptr;
}

std::optional<std::size_t> GltfDocument::count_if_any(const Json& object, const char* key) const {
  const Json* const value = member(object, key);
  if (!value) return std::nullopt;
  // Integers with a decimal point are valid JSON.
  const double number = value->is_number() ? value->get<double>() : -1.0;
  if (!(number >= 0.0 && number <= 9007199254740992.0 && number == std::floor(number)))
    builder_.fail("its '", key, "' must be a whole number that is not negative; the file is damaged");
  return static_cast<std::size_t>(number);
}

std::size_t GltfDocument::count(const Json& object, const char* key) const {
  const std::optional<std::size_t> value = count_if_any(object, key);
  if (!value) builder_.fail("a '", key, "' is missing; the file is damaged");
  return *value;
}

const Json& GltfDocument::list(const Json& object, const char* key) const {
  static const Json none = Json::array();
  const Json* const value = member(object, key);
  if (!value) return none;
  if (!value->is_array()) builder_.fail("its '", key, "' must be an array; the file is damaged");
  return *value;
}

const Json& GltfDocument::entry(const char* key, std::size_t index) const {
  const Json& entries = list(root_, key);
  if (index >= entries.size())
    builder_.fail("it refers to number ", index, " of '", key, "', but there are ", entries.size(),
                  " (counting from 0)");
  if (!entries[index].is_object())
    builder_.fail("number ", index, " of its '", key, "' is not an object; the file is damaged");
  return entries[index];
}

std::optional<std::vector<double>> GltfDocument::numbers(const Json& object, const char* key,
                                                         std::size_t size) const {
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

void GltfDocument::check_extensions() const {
  for (const Json& required : list(root_, "extensionsRequired")) {
    const std::string name = required.is_string() ? required.get<std::string>() : "?";
    if (leaves_shapes_alone(name)) continue;
    if (name.find("draco") != std::string::npos || name.find("meshopt") != std::string::npos)
      fail_compressed(name);
    builder_.fail("it requires the extension ", quoted_word(name), ", which is not read; export it without");
  }
}

void GltfDocument::fail_compressed(const std::string& extension) const {
  builder_.fail("its meshes are compressed by ", quoted_word(extension),
                ", which is not read; export it without compression");
}

std::string_view GltfDocument::buffer(std::size_t index) {
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

GltfDocument::Elements GltfDocument::elements(const Json& from, std::size_t view, NumberType type,
                                              std::size_t components, std::size_t number) {
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

std::vector<double> GltfDocument::values(std::size_t index, std::size_t components, const char* type,
                                         bool whole) {
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

void GltfDocument::read_sparse(const Json& sparse, const std::string& name, NumberType type,
                               std::size_t components, std::vector<double>& values) {
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

}  // namespace hermesh::mesh_formats
