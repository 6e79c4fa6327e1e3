#include "algorithms/io/scenes/gltf_buffers.h"

#include <bit>

#include "algorithms/io/scenes/scene_files.h"

namespace hermesh::mesh_formats {

namespace {

constexpr std::size_t kHeader = 12, kChunkHeader = 8;
constexpr std::uint32_t kJson = 0x4e4f534a, kBinary = 0x004e4942;  // "JSON" and "BIN\0", little-endian

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
  // Words lie at any address, so they are copied and not read in place.
  std::uint32_t word;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return std::endian::native == std::endian::big ? __builtin_bswap32(word) : word;
}

/// Value of a digit of base64; −1 for any other character.
int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  // The alphabet for URLs is written in URIs, too, and means nothing else.
  if (c == '+' || c == '-') return 62;
  if (c == '/' || c == '_') return 63;
  return -1;
}

/// The bytes of a text in base64, with or without the padding at its end.
std::string decode_base64(std::string_view text, const MeshBuilder& builder) {
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  if (text.size() % 4 == 1) builder.fail("a buffer in base64 breaks off; the file is truncated or damaged");
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const int digit = base64_digit(c);
    if (digit < 0)
      builder.fail("a buffer in base64 holds a character that is none of its digits; the file is damaged");
    // Six bits come in, and whole bytes go out.
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xff);
  }
  return bytes;
}

/// The path that a relative URI stands for, %20 being a blank. Empty where it holds what no path may.
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
    // A zero would end the name early for the system and not for us.
    if (value < ' ') return "";
    path += static_cast<char>(value);
  }
  return path;
}

/// Whether the path leads to the folder that it starts from or beneath it. A mesh file of somebody else's
/// must not make the program read what lies elsewhere.
bool stays_below(const std::filesystem::path& path) {
  if (path.empty() || path.is_absolute() || path.string().find('\\') != std::string::npos) return false;
  return std::ranges::none_of(path, [](const std::filesystem::path& step) { return step == ".."; });
}

}  // namespace

bool begins_like_glb(std::string_view bytes) { return bytes.starts_with("glTF"); }

GlbChunks split_glb(std::string_view bytes, MeshBuilder& builder) {
  if (bytes.size() < kHeader + kChunkHeader)
    builder.fail("the file is truncated: a .glb file has at least 20 bytes");
  // The words of the header: magic, version, length.
  const std::uint32_t version = word_at(bytes, 4), length = word_at(bytes, 8);
  if (version != 2)
    builder.fail("it is of version " + std::to_string(version) + " of glTF; only version 2 is read");
  if (length > bytes.size())
    builder.fail("the file is truncated: it has " + std::to_string(bytes.size()) + " bytes of the " +
                 std::to_string(length) + " that it declares");
  // What is longer than it declares may only be padded.
  if (!without_padding(bytes.substr(length)).empty())
    builder.fail("it declares " + std::to_string(length) + " bytes, but " +
                 std::to_string(bytes.size() - length) + " more follow; the file is damaged");
  builder.note_padding(bytes.substr(length));
  bytes = bytes.substr(0, length);
  GlbChunks chunks;
  for (std::size_t at = kHeader; at < bytes.size();) {
    if (bytes.size() - at < kChunkHeader) builder.fail("its last chunk breaks off; the file is damaged");
    const std::size_t size = word_at(bytes, at);
    const std::uint32_t kind = word_at(bytes, at + 4);
    const bool first = at == kHeader;
    at += kChunkHeader;
    if (size > bytes.size() - at)
      builder.fail("a chunk of it is longer than the file has bytes left; the file is damaged");
    // The order is the format's: JSON, then at most one of bytes; others belong to extensions and are passed
    // over.
    if (first != (kind == kJson))
      builder.fail("its first chunk, and no other, must be JSON; the file is damaged");
    if (first) chunks.json = bytes.substr(at, size);
    if (kind == kBinary && chunks.binary.empty()) chunks.binary = bytes.substr(at, size);
    at += size;
  }
  if (chunks.json.empty()) builder.fail("it has no JSON; the file is damaged");
  return chunks;
}

std::string bytes_of_uri(std::string_view uri, const MeshBuilder& builder) {
  if (uri.starts_with("data:")) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string_view::npos || !uri.substr(0, comma).ends_with(";base64"))
      builder.fail("a buffer within it is not in base64, which is the one encoding that is read");
    return decode_base64(uri.substr(comma + 1), builder);
  }
  const std::string name = quoted_word(uri);
  // A colon before any slash ends the scheme of an address, such as https.
  if (uri.substr(0, uri.find('/')).find(':') != std::string_view::npos)
    builder.fail("its buffer " + name + " is an address; only files beside it are read, so save it there");
  const std::filesystem::path relative = decode_percents(uri);
  if (!stays_below(relative))
    builder.fail("its buffer " + name + " is not in the folder of the file or beneath it; move it there");
  // Beside the mesh file, wherever the program runs.
  const std::filesystem::path folder = std::filesystem::path(builder.file()).parent_path() / ".";
  const std::filesystem::path path = folder / relative;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    builder.fail("its buffer " + name + " is not there: the two files belong into one folder");
  const std::filesystem::path root = std::filesystem::canonical(folder, error);
  const std::filesystem::path inside = std::filesystem::canonical(path, error).lexically_relative(root);
  if (!stays_below(inside))
    builder.fail("its buffer " + name +
                 " is a symbolic link that leads out of the folder of the file; copy it there");
  try {
    return read_whole(path);
  } catch (const Error&) {
    // The sentence would name a path that somebody else has chosen, in letters that they have chosen.
    builder.fail("its buffer " + name + " cannot be read");
  }
}

}  // namespace hermesh::mesh_formats
