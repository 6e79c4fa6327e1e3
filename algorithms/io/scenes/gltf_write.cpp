// glTF 2.0 out: one node with one mesh of one primitive.
#include <bit>

#include "algorithms/io/scenes/scene_files.h"

namespace hermesh::mesh_formats {

namespace {

constexpr std::size_t kBufferPiece = std::size_t(1) << 16;

/// The shortest text that reads back as the same number of the same precision.
template <class T>
std::string shortest(T value) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

template <class Vector>
std::string list_of(const Vector& numbers) {
  return "[" + shortest(numbers[0]) + "," + shortest(numbers[1]) + "," + shortest(numbers[2]) + "]";
}

/// Hands bytes on in large pieces, as they are or as base64.
class BufferWriter {
 public:
  BufferWriter(const ByteSink& out, bool base64) : out_(out), base64_(base64) {}

  template <class T>
  void put(T value) {
    std::array<char, sizeof(T)> bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
    piece_.append(bytes.data(), bytes.size());
    // A multiple of three bytes at a time, so that padding comes at the end alone.
    if (piece_.size() >= 3 * kBufferPiece) flush();
  }

  void flush() {
    out_(base64_ ? encoded() : piece_);
    piece_.clear();
  }

 private:
  /// The piece in base64: four digits for three bytes.
  std::string encoded() const {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve(piece_.size() / 3 * 4 + 4);
    for (std::size_t i = 0; i < piece_.size(); i += 3) {
      std::uint32_t bits = 0;
      for (std::size_t k = 0; k < 3; ++k)
        bits = bits << 8 | (i + k < piece_.size() ? static_cast<unsigned char>(piece_[i + k]) : 0u);
      // A digit that holds no bit of a byte is padding.
      for (std::size_t k = 0; k < 4; ++k)
        text += i + k <= piece_.size() ? digits[bits >> (18 - 6 * k) & 63] : '=';
    }
    return text;
  }

  const ByteSink& out_;
  bool base64_;
  std::string piece_;
};

/// The JSON in front of what the URI of the buffer is, without its end.
std::string json_of(const PolygonMesh& mesh) {
  const std::string head = R"({"asset":{"generator":"hermesh","version":"2.0"},"scene":0,"scenes":[{)";
  // An accessor has at least one element, so that a mesh without triangles is a scene without nodes.
  if (mesh.empty()) return head + "}]";
  Eigen::Vector3f lower = mesh.points[0], upper = lower;
  for (const Eigen::Vector3f& point : mesh.points)
    lower = lower.cwiseMin(point), upper = upper.cwiseMax(point);
  // The bounds are those of all points, used or not, as validators of the format compute them.
  const std::size_t points = mesh.points.size(), corners = 3 * mesh.triangle_count();
  std::string text = head + R"("nodes":[0]}],"nodes":[{"mesh":0)";
  if (const auto origin = stated_origin(mesh)) text += R"(,"translation":)" + list_of(*origin);
  text += R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"accessors":[)"
          R"({"bufferView":0,"componentType":5126,"count":)" +
          std::to_string(points) + R"(,"type":"VEC3","min":)" + list_of(lower) + R"(,"max":)" +
          list_of(upper) + R"(},{"bufferView":1,"componentType":5125,"count":)" + std::to_string(corners) +
          R"(,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteLength":)" + std::to_string(12 * points) +
          R"(,"target":34962},{"buffer":0,"byteOffset":)" + std::to_string(12 * points) +
          R"(,"byteLength":)" + std::to_string(4 * corners) +
          R"(,"target":34963}],"buffers":[{"byteLength":)" + std::to_string(12 * points + 4 * corners);
  return text;
}

/// The points, then the triangles. Other machines than little-endian ones turn each number.
void write_buffer(const ByteSink& out, const PolygonMesh& mesh, bool base64) {
  BufferWriter buffer(out, base64);
  for (const Eigen::Vector3f& point : mesh.points)
    for (const float x : point) buffer.put(x);
  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    for (const std::uint32_t corner : {a, b, c}) buffer.put(corner);
  };
  for (const auto& [a, b, c] : mesh.triangles) triangle(a, b, c);
  for (const auto& [a, b, c, d] : mesh.quads) triangle(a, b, c), triangle(a, c, d);
  buffer.flush();
}

/// A word of the container, little-endian.
std::string word(std::uint64_t value) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xff);
  return bytes;
}

}  // namespace

std::optional<Eigen::Vector3d> stated_origin(const PolygonMesh& mesh) {
  // As to_mesh_file() has it: left out only at 0, where a reader would choose 0 by itself.
  if (mesh.origin.isZero(0.0) && choose_origin(bounds(mesh)).isZero(0.0)) return std::nullopt;
  return mesh.origin;
}

void write_gltf(const ByteSink& out, const PolygonMesh& mesh, bool binary, const std::string& file) {
  // By hand and not by a library: the text is short, and its bytes must not change with a version of somebody
  // else's.
  std::string json = json_of(mesh);
  if (!binary) {
    out(json);
    if (!mesh.empty()) {
      out(R"(,"uri":"data:application/octet-stream;base64,)");
      write_buffer(out, mesh, true);
      out("\"}]");
    }
    out("}\n");
    return;
  }
  json += mesh.empty() ? "}" : "}]}";
  // Chunks begin at multiples of four bytes; JSON is padded by blanks, and the buffer is all words.
  while (json.size() % 4 != 0) json += ' ';
  const std::uint64_t bytes = mesh.empty() ? 0 : 12 * (mesh.points.size() + mesh.triangle_count());
  const std::uint64_t length = 20 + json.size() + (mesh.empty() ? 0 : 8 + bytes);
  if (length > 0xffffffff)
    throw Error("cannot write " + in_quotes(file) + ": a .glb file holds 4 GB at most; write .gltf or .ply");
  out("glTF" + word(2) + word(length) + word(json.size()) + "JSON" + json);
  if (mesh.empty()) return;
  out(word(bytes) + std::string("BIN\0", 4));
  write_buffer(out, mesh, false);
}

}  // namespace hermesh::mesh_formats
