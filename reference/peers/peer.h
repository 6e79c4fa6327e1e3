// Shared by the stand-alone peers: a mesh of triangles, its OBJ file, and the report of time and memory.
// Nothing of hermesh is included here, so that a peer is equivalent to a program that its users would build.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace peers {

/// Points in world units; faces are triangles of indices from 0.
struct Mesh {
  std::vector<std::array<double, 3>> points;
  std::vector<std::array<int, 3>> triangles;
};

/// Reads points and faces of an OBJ file; a face of more corners becomes a fan. @throws std::runtime_error
inline Mesh read_obj(const std::string& path) {
  std::ifstream stream(path);
  if (!stream) throw std::runtime_error("cannot read " + path);
  Mesh mesh;
  for (std::string line; std::getline(stream, line);) {
    const char* at = line.c_str();
    char* end = nullptr;
    if (line.rfind("v ", 0) == 0) {
      std::array<double, 3> point{};
      at += 2;
      for (double& x : point) x = std::strtod(at, &end), at = end;
      mesh.points.push_back(point);
    } else if (line.rfind("f ", 0) == 0) {
      std::vector<int> corners;
      std::istringstream words(line.substr(2));
      for (std::string word; words >> word;) corners.push_back(std::atoi(word.c_str()) - 1);
      for (std::size_t i = 2; i < corners.size(); ++i)
        mesh.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }
  }
  return mesh;
}

inline void write_obj(const std::string& path, const Mesh& mesh) {
  std::FILE* const file = std::fopen(path.c_str(), "w");
  if (!file) throw std::runtime_error("cannot write " + path);
  for (const auto& p : mesh.points) std::fprintf(file, "v %.9g %.9g %.9g\n", p[0], p[1], p[2]);
  for (const auto& t : mesh.triangles) std::fprintf(file, "f %d %d %d\n", t[0] + 1, t[1] + 1, t[2] + 1);
  if (std::fclose(file) != 0) throw std::runtime_error("cannot write " + path);
}

/// How many triangles of a mesh are to stay where its user says a share below 1, or how many.
inline std::size_t kept_triangles(const Mesh& mesh, double number) {
  return static_cast<std::size_t>(number < 1 ? number * double(mesh.triangles.size()) : number);
}

/// A line such as "VmHWM:  1234 kB" of /proc/self/status, in bytes; 0 where there is none.
inline double status_bytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double kibibytes = 0;
    if (word == key + ":" && status >> kibibytes) return kibibytes * 1024;
    status.ignore(1 << 12, '\n');
  }
  return 0;
}

/// Runs the work, and says on the standard output how long it took and how far the peak of resident memory
/// rose (experiments/harness/command_extractor.h).
inline void measured(const std::function<void()>& work) {
  std::ofstream("/proc/self/clear_refs") << "5";  // sets the high-water mark to the resident size
  const double before = status_bytes("VmRSS");
  const auto start = std::chrono::steady_clock::now();
  work();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::cout << "seconds " << seconds << "\nbytes " << std::max(0.0, status_bytes("VmHWM") - before) << '\n';
}

/// Runs main's work; an exception is a sentence on the standard error, and exit code 1.
inline int guarded(const std::function<void()>& work) {
  try {
    work();
    return 0;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}

}  // namespace peers
