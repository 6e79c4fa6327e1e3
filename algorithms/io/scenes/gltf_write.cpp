// glTF 2.0 out: one node with one mesh, whose primitives are its materials.
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

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

/// Returns the linear value of a component of a colour for screens (sRGB).
float to_linear(float screen) {
  const double x = std::clamp(double(screen), 0.0, 1.0);
  return static_cast<float>(x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4));
}

/// A mesh as glTF arranges it: points with all their attributes, and a list of corners for each material.
class Arrangement {
 public:
  Arrangement(const PolygonMesh& mesh, const NamedAttributes& named) : mesh_(mesh), named_(named) {
    if (mesh.empty()) return;
    const std::int32_t* materials = named.material ? std::get<1>(named.material->values).data() : nullptr;
    const std::size_t labels = materials ? named.material->labels.size() : 0;
    // The last list is that of polygons without a material.
    corners_.resize(labels + 1);
    if (!splits_points()) {
      points_.resize(mesh.points.size());
      for (std::size_t i = 0; i < points_.size(); ++i) points_[i] = static_cast<std::uint32_t>(i);
    }
    std::size_t polygon = 0, corner = 0;
    const auto list_of_next = [&]() -> std::vector<std::uint32_t>& {
      const std::int32_t own = materials ? materials[polygon] : -1;
      ++polygon;
      return corners_[own >= 0 && std::size_t(own) < labels ? std::size_t(own) : labels];
    };
    for (const Triangle& triangle : mesh.triangles) {
      std::vector<std::uint32_t>& list = list_of_next();
      for (const std::uint32_t point : triangle) list.push_back(vertex(point, corner++));
    }
    for (const Quad& quad : mesh.quads) {
      std::vector<std::uint32_t>& list = list_of_next();
      std::array<std::uint32_t, 4> at;
      for (std::size_t k = 0; k < 4; ++k) at[k] = vertex(quad[k], corner++);
      list.insert(list.end(), {at[0], at[1], at[2], at[0], at[2], at[3]});
    }
  }

  /// Returns the JSON up to the URI of the buffer.
  std::string json(double metres) const {
    std::string text = R"({"asset":{"generator":"hermesh","version":"2.0"},"scene":0,"scenes":[{)";
    // An accessor has at least one element, so an empty mesh is a scene without nodes.
    if (mesh_.empty()) return text + "}]";
    text += R"("nodes":[0]}],"nodes":[{"mesh":0)";
    if (const auto origin = stated_origin(mesh_))
      text += R"(,"translation":)" + list_of(Eigen::Vector3d(metres * *origin));
    if (metres != 1.0) text += R"(,"scale":)" + list_of(Eigen::Vector3d(Eigen::Vector3d::Constant(metres)));
    // Bounds of all points, used or not, as validators of the format compute them.
    Eigen::Vector3f lower = mesh_.points[points_[0]], upper = lower;
    for (const std::uint32_t point : points_)
      lower = lower.cwiseMin(mesh_.points[point]), upper = upper.cwiseMax(mesh_.points[point]);
    std::string accessors, views, primitives, attributes;
    std::size_t bytes = 0, number = 0;
    // Appends an accessor with a view of its own, and returns its number.
    const auto add = [&](std::size_t count, std::size_t components, const char* type, bool index,
                         const std::string& bounds) {
      if (number > 0) accessors += ',', views += ',';
      accessors += R"({"bufferView":)" + std::to_string(number) + R"(,"componentType":)" +
                   (index ? "5125" : "5126") + R"(,"count":)" + std::to_string(count) + R"(,"type":")" +
                   type + '"' + bounds + '}';
      views += R"({"buffer":0)" + (bytes ? R"(,"byteOffset":)" + std::to_string(bytes) : std::string()) +
               R"(,"byteLength":)" + std::to_string(4 * count * components) + R"(,"target":)" +
               (index ? "34963}" : "34962}");
      bytes += 4 * count * components;
      return std::to_string(number++);
    };
    attributes = R"("POSITION":)" + add(points_.size(), 3, "VEC3", false,
                                        R"(,"min":)" + list_of(lower) + R"(,"max":)" + list_of(upper));
    if (named_.normal) attributes += R"(,"NORMAL":)" + add(points_.size(), 3, "VEC3", false, "");
    if (named_.colour)
      attributes += R"(,"COLOR_0":)" + add(points_.size(), std::size_t(named_.colour->components),
                                           named_.colour->components == 4 ? "VEC4" : "VEC3", false, "");
    if (named_.uv) attributes += R"(,"TEXCOORD_0":)" + add(points_.size(), 2, "VEC2", false, "");
    for (std::size_t m = 0; m < corners_.size(); ++m) {
      if (corners_[m].empty()) continue;
      primitives += (primitives.empty() ? "" : ",") + (R"({"attributes":{)" + attributes) +
                    R"(},"indices":)" + add(corners_[m].size(), 1, "SCALAR", true, "") +
                    (m + 1 < corners_.size() ? R"(,"material":)" + std::to_string(m) : "") + '}';
    }
    text += R"(}],"meshes":[{"primitives":[)" + primitives + R"(]}],"accessors":[)" + accessors +
            R"(],"bufferViews":[)" + views + "]";
    if (named_.material) {
      text += R"(,"materials":[)";
      for (const std::string& label : named_.material->labels)
        text += R"({"name":)" +
                nlohmann::json(label).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + "},";
      text.back() = ']';
    }
    return text + R"(,"buffers":[{"byteLength":)" + std::to_string(bytes);
  }

  /// Returns the length of the buffer; 0 for an empty mesh.
  std::uint64_t buffer_size() const {
    std::uint64_t numbers = 0;
    for (const std::vector<std::uint32_t>& list : corners_) numbers += list.size();
    std::uint64_t of_point = 3;
    for (const MeshAttribute* each : {named_.normal, named_.colour, named_.uv})
      of_point += each ? std::uint64_t(each->components) : 0;
    return 4 * (numbers + of_point * points_.size());
  }

  /// Writes what json() describes, in its order.
  void write_buffer(const ByteSink& out, bool base64) const {
    BufferWriter buffer(out, base64);
    for (const std::uint32_t point : points_)
      for (const float x : mesh_.points[point]) buffer.put(x);
    if (named_.normal) {
      const std::vector<float>& normals = std::get<0>(named_.normal->values);
      for (const std::size_t point : points_)
        for (std::size_t k = 0; k < 3; ++k) buffer.put(normals[3 * point + k]);
    }
    if (named_.colour) {
      const std::vector<float>& colours = std::get<0>(named_.colour->values);
      const auto components = std::size_t(named_.colour->components);
      for (const std::size_t point : points_)
        for (std::size_t k = 0; k < components; ++k) {
          const float value = colours[components * point + k];
          buffer.put(k < 3 ? to_linear(value) : value);
        }
    }
    // The second coordinate of glTF goes down.
    if (named_.uv)
      for (std::size_t i = 0; i < points_.size(); ++i) {
        const auto [u, v] = splits_points() ? uv_[i] : uv_at(points_[i]);
        buffer.put(u), buffer.put(1.0f - v);
      }
    for (const std::vector<std::uint32_t>& list : corners_)
      for (const std::uint32_t corner : list) buffer.put(corner);
    buffer.flush();
  }

 private:
  using TextureCoordinates = std::pair<float, float>;

  bool splits_points() const { return named_.uv && named_.uv->domain == AttributeDomain::corner; }
  TextureCoordinates uv_at(std::size_t element) const {
    const std::vector<float>& values = std::get<0>(named_.uv->values);
    return {values[2 * element], values[2 * element + 1]};
  }

  /// Returns the number of the point as a corner of the file: another one for each of its texture
  /// coordinates.
  std::uint32_t vertex(std::uint32_t point, std::size_t corner) {
    if (!splits_points()) return point;
    const TextureCoordinates uv = uv_at(corner);
    const auto [at, is_new] = vertices_.try_emplace({point, uv}, static_cast<std::uint32_t>(points_.size()));
    if (is_new) points_.push_back(point), uv_.push_back(uv);
    return at->second;
  }

  const PolygonMesh& mesh_;
  const NamedAttributes named_;
  std::vector<std::uint32_t> points_;                ///< of the mesh, by the numbers of the file
  std::vector<TextureCoordinates> uv_;               ///< of points_, if these depend on the corner
  std::vector<std::vector<std::uint32_t>> corners_;  ///< of triangles, by material
  std::map<std::pair<std::uint32_t, TextureCoordinates>, std::uint32_t> vertices_;
};

}  // namespace

void write_gltf(const ByteSink& out, const PolygonMesh& mesh, bool binary, const std::string& file,
                double metres, RunContext& context) {
  const Arrangement arranged(
      mesh, named_attributes(mesh.attributes, "colour alpha normal uv material", "a glTF", file, context));
  // Not by a library: the text is short, and its bytes must not change with the version of a library.
  const auto word = [](std::uint64_t value) {
    const auto bytes = bytes_of_number(static_cast<std::uint32_t>(value));
    return std::string(bytes.data(), bytes.size());
  };
  std::string json = arranged.json(metres);
  if (!binary) {
    out(json);
    if (!mesh.empty()) {
      out(R"(,"uri":"data:application/octet-stream;base64,)");
      arranged.write_buffer(out, true);
      out("\"}]");
    }
    out("}\n");
    return;
  }
  json += mesh.empty() ? "}" : "}]}";
  // Chunks begin at multiples of four bytes; JSON is padded by blanks, and the buffer consists of words.
  while (json.size() % 4 != 0) json += ' ';
  const std::uint64_t bytes = arranged.buffer_size();
  const std::uint64_t length = 20 + json.size() + (mesh.empty() ? 0 : 8 + bytes);
  if (length > 0xffffffff)
    throw Error(
        joined("cannot write ", in_quotes(file), ": a .glb file holds 4 GB at most; write .gltf or .ply"));
  out("glTF" + word(2) + word(length) + word(json.size()) + "JSON" + json);
  if (mesh.empty()) return;
  out(word(bytes) + std::string("BIN\0", 4));
  arranged.write_buffer(out, false);
}

}  // namespace hermesh::mesh_formats
