// Mesh files of tests.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/io/mesh_file_formats.h"
#include "algorithms/io/stored_number.h"

namespace hermesh {

/// Returns the bytes of a number in either byte order.
template <class T>
std::string raw(T value, bool big_endian = false) {
  const auto bytes = bytes_of_number(value, is_swapped(big_endian));
  return {bytes.data(), bytes.size()};
}
/// Returns the bytes of several numbers, one behind the other.
template <class T>
std::string raw_list(const std::vector<T>& values, bool big_endian = false) {
  std::string bytes;
  for (const T value : values) bytes += raw(value, big_endian);
  return bytes;
}

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

/// Checks a message: it must contain `part`.
inline void expect_words(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << "'" << message << "' without '" << part << "'";
}

// A tetrahedron in several formats.

const std::vector<Eigen::Vector3d> tetrahedron_points = {{0, 0, 0}, {1, 0, 0}, {0, 1.5, 0}, {0, 0, -2.25}};
const std::vector<Triangle> tetrahedron_triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};

const std::string ply_head =
    "format ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const std::string off_body = "0 0 0\n1 0 0\n0 1.5 0\n0 0 -2.25\n3 0 1 2\n3 0 2 3\n3 0 3 1\n3 1 3 2\n";
const std::string ply_text =
    "ply\n" + ply_head + "element face 4\nproperty list uchar int vertex_indices\nend_header\n" + off_body;
const std::string obj_text = "v 0 0 0\nv 1 0 0\nv 0 1.5 0\nv 0 0 -2.25\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n";
const std::string off_text = "OFF\n4 4 0\n" + off_body;

inline std::string stl_text(const std::string& name = "part", const std::string& end_loop = "endloop",
                            const std::string& end_facet = "endfacet") {
  std::ostringstream text;
  text << "solid " << name << "\n";
  for (const Triangle& t : tetrahedron_triangles) {
    text << " facet normal nan 0 0\n  outer loop\n";
    for (const auto i : t) text << "   vertex " << tetrahedron_points[i].transpose() << "\n";
    text << "  " << end_loop << "\n " << end_facet << "\n";
  }
  return text.str();
}

inline std::string binary_stl(std::uint32_t count, std::string header = "exported") {
  header.resize(80, ' ');
  std::string bytes = header + raw(count);
  for (const Triangle& t : tetrahedron_triangles) {
    bytes += std::string(12, '\0');
    for (const auto i : t)
      for (const double x : tetrahedron_points[i]) bytes += raw(static_cast<float>(x));
    bytes += "\x1f\x80";  // a colour
  }
  return bytes;
}

/// Fixture with a directory of its own, which is removed when the test ends.
class MeshFileTest : public testing::Test {
 protected:
  MeshFileTest() {
    std::string pattern = (std::filesystem::temp_directory_path() / "hermesh-test-XXXXXX").string();
    folder = mkdtemp(pattern.data());
  }
  ~MeshFileTest() override { std::filesystem::remove_all(folder); }

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder / name, std::ios::binary) << bytes;
    return folder / name;
  }
  std::string bytes_of(const std::filesystem::path& path) const {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
  }
  /// Reads the mesh in the bytes of a file of this name, which is written only if it is gzipped.
  MeshFile read(const std::string& name, const std::string& bytes) {
    const std::optional<mesh_formats::MeshPath> path = mesh_formats::parse_mesh_path(name);
    if (!path || path->gzipped || bytes.empty()) return read_mesh_file(write(name, bytes), context);
    return mesh_formats::parse_mesh(bytes, path->format, name, context);
  }
  /// Returns the message of the Error that `call` throws, without the directory; empty if it succeeds.
  template <class Call>
  std::string error_in(Call call) const {
    try {
      call();
    } catch (const Error& error) {
      std::string text = error.what();
      const std::size_t at = text.find(folder.string() + "/");
      return at == std::string::npos ? text : text.erase(at, folder.string().size() + 1);
    }
    return "";
  }
  std::string error_of_path(const std::filesystem::path& path) {
    return error_in([&] { read_mesh_file(path, context); });
  }
  std::string error_of(const std::string& name, const std::string& bytes) {
    return error_in([&] { read(name, bytes); });
  }
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      names.push_back(entry.path().filename().string());
    return names;
  }

  std::filesystem::path folder;
  RunContext context;
};

/// Returns a mesh of random triangles and quads.
inline PolygonMesh random_mesh(std::uint32_t seed, const Eigen::Vector3d& origin, std::size_t count = 500) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-0.5f, 0.5f);
  PolygonMesh mesh;
  mesh.origin = origin;
  for (std::size_t i = 0; i < count; ++i) mesh.points.emplace_back(unit(random), unit(random), unit(random));
  const auto corner = [&] { return static_cast<std::uint32_t>(random() % count); };
  for (std::size_t i = 0; i < count; ++i) mesh.triangles.push_back({corner(), corner(), corner()});
  for (std::size_t i = 0; i < count; ++i) mesh.quads.push_back({corner(), corner(), corner(), corner()});
  return mesh;
}

}  // namespace hermesh
