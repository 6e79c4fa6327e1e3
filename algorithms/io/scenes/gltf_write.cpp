// glTF 2.0 out: one node with one mesh of one primitive.
#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/stored_number.h"

namespace hermesh::mesh_formats {

namespace {

constexpr std::size_t kBufferPiece = std::size_t(1) << 16;

template <class Vector>
std::string list_of(const Vector& numbers) {
  std::string text = "[";
  for (const auto x : numbers) (text += NumberText(x)) += ',';
  text.back() = ']';
  return text;
}

/// Passes bytes on in large pieces, unchanged or as base64.
class BufferWriter {
 public:
  BufferWriter(const ByteSink& out, bool base64) : out_(out), base64_(base64) {}

  template <class T>
  void put(T value) {
    const auto bytes = bytes_of_number(value);
    piece_.append(bytes.data(), bytes.size());
    // A multiple of three bytes at a time, so that base64 has padding only at its end.
    if (piece_.size() >= 3 * kBufferPiece) flush();
  }

  void flush() {
    out_(base64_ ? encoded() : piece_);
    piece_.clear();
  }

 private:
  /// Returns the piece in base64: four digits for three bytes.
  std::string encoded() const {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve(piece_.size() / 3 * 4 + 4);
    for (std::size_t i = 0; i < piece_.size(); i += 3) {
      std::uint32_t bits = 0;
      for (std::size_t k = 0; k < 3; ++k)
        bits = bits << 8 | (i + k < piece_.size() ? static_cast<unsigned char>(piece_[i + k]) : 0u);
      for (std::size_t k = 0; k < 4; ++k)
        text += i + k <= piece_.size() ? digits[bits >> (18 - 6 * k) & 63] : '=';
    }
    return text;
  }

  const ByteSink& out_;
  bool base64_;
  std::string piece_;
};

/// Returns the JSON up to the URI of the buffer.
std::string json_of(const PolygonMesh& mesh, double metres) {
  const std::string head = R"({"asset":{"generator":"hermesh","version":"2.0"},"scene":0,"scenes":[{)";
  // An accessor has at least one element, so an empty mesh is a scene without nodes.
  if (mesh.empty()) return head + "}]";
  Eigen::Vector3f lower = mesh.points[0], upper = lower;
  for (const Eigen::Vector3f& point : mesh.points)
    lower = lower.cwiseMin(point), upper = upper.cwiseMax(point);
  // Bounds of all points, used or not, as validators of the format compute them.
  const std::size_t points = mesh.points.size(), corners = 3 * mesh.triangle_count();
  std::string text = head + R"("nodes":[0]}],"nodes":[{"mesh":0)";
  if (const auto origin = stated_origin(mesh))
    text += R"(,"translation":)" + list_of(Eigen::Vector3d(metres * *origin));
  if (metres != 1.0) text += R"(,"scale":)" + list_of(Eigen::Vector3d(Eigen::Vector3d::Constant(metres)));
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

/// Writes the points, then the triangles.
void write_buffer(const ByteSink& out, const PolygonMesh& mesh, bool base64) {
  BufferWriter buffer(out, base64);
  for (const Eigen::Vector3f& point : mesh.points)
    for (const float x : point) buffer.put(x);
  for_each_triangle(mesh, [&](auto... corners) { (buffer.put(std::uint32_t(corners)), ...); });
  buffer.flush();
}

}  // namespace

void write_gltf(const ByteSink& out, const PolygonMesh& mesh, bool binary, const std::string& file,
                double metres) {
  // Not by a library: the text is short, and its bytes must not change with the version of a library.
  const auto word = [](std::uint64_t value) {
    const auto bytes = bytes_of_number(static_cast<std::uint32_t>(value));
    return std::string(bytes.data(), bytes.size());
  };
  std::string json = json_of(mesh, metres);
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
  // Chunks begin at multiples of four bytes; JSON is padded by blanks, and the buffer consists of words.
  while (json.size() % 4 != 0) json += ' ';
  const std::uint64_t bytes = mesh.empty() ? 0 : 12 * (mesh.points.size() + mesh.triangle_count());
  const std::uint64_t length = 20 + json.size() + (mesh.empty() ? 0 : 8 + bytes);
  if (length > 0xffffffff)
    throw Error(
        joined("cannot write ", in_quotes(file), ": a .glb file holds 4 GB at most; write .gltf or .ply"));
  out("glTF" + word(2) + word(length) + word(json.size()) + "JSON" + json);
  if (mesh.empty()) return;
  out(word(bytes) + std::string("BIN\0", 4));
  write_buffer(out, mesh, false);
}

}  // namespace hermesh::mesh_formats
