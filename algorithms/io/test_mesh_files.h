// Mesh files of tests.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

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

namespace hermesh {

/// Fixture with a folder of its own, which goes when the test ends.
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
  /// The mesh in the bytes of a file of this name, which is written only where it is gzipped.
  MeshFile read(const std::string& name, const std::string& bytes) {
    const std::optional<mesh_formats::MeshPath> path = mesh_formats::parse_mesh_path(name);
    if (!path || path->gzipped || bytes.empty()) return read_mesh_file(write(name, bytes), context);
    return mesh_formats::parse_mesh(bytes, path->format, name, context);
  }
  /// The sentence of what `call` throws, without the folder; empty if it succeeds.
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

/// A mesh with triangles and quads whose points are as the argument makes them.
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
