// The triangles that touch one cube of a round, with their connections (decimation.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/extraction/certified_collapse/cube_decimation.h"
#include "algorithms/extraction/contact/triangle_contact.h"

namespace hermesh {

/// What a thread keeps from cube to cube: numbers in a cube by numbers in the whole mesh. Entries left by
/// other cubes do no harm.
struct CubeNumbers {
  std::vector<std::uint32_t> vertex;
};

/// The triangles that touch a cube. Vertices and faces have numbers of their own here, in the order in which
/// the triangles name them.
struct CubeMesh {
  static constexpr std::uint32_t kNone = 0xffffffffu;

  struct Vertex {
    Eigen::Vector3d point;
    std::uint32_t global;
    std::uint32_t first_corner = kNone;
    std::uint32_t version = 0;  ///< goes up when the vertex changes
    bool here = false;          ///< in the cube, so that all its triangles are known
    bool free = false;  ///< all its triangles belong to the cube and it is not pinned, so that it may move
    bool gone = false;
    std::uint32_t seen = 0;  ///< number of the last question that it was looked at for
  };
  struct Face {
    std::array<std::uint32_t, 3> corners;
    std::uint32_t global;
    bool own = false;
    bool gone = false;
  };

  CubeMesh(const DecimatedMesh& mesh, const DecimationCube& cube, std::span<const std::uint32_t> triangles,
           CubeNumbers& numbers);

  template <class F>
  void for_each_face(std::uint32_t v, F&& f) const {
    for (std::uint32_t corner = vertices[v].first_corner; corner != kNone; corner = next_corner[corner])
      if (!faces[corner / 3].gone) f(corner / 3, static_cast<int>(corner % 3));
  }
  /// Gives `staying` the corners of `going` that are left: dead ones would make the walk around it longer and
  /// longer.
  void merge_corners(std::uint32_t going, std::uint32_t staying);
  /// Begins a new question, and returns its number for Vertex::seen.
  std::uint32_t ask() { return ++question; }

  std::vector<Vertex> vertices;
  std::vector<Face> faces;
  std::vector<std::uint32_t> next_corner;  ///< for corner 3 × face + i: the next one at the same vertex
  std::uint32_t question = 0;
};

/// A proposal: the ends of an edge become one point x, which keeps the number of one of them, v.
struct Collapse {
  struct NewFace {
    std::uint32_t face;
    int corner;  ///< which of the face's corners x is
    Corners at;  ///< x first, in the order of the face
    std::array<std::uint32_t, 2> others;
    Eigen::Vector3d normal;  ///< not of unit length
  };
  struct Attached {
    std::uint32_t sample;
    std::uint32_t triangle;  ///< index among the new ones
  };

  std::uint32_t v, going;
  Eigen::Vector3d x;
  bool v_moves;                    ///< else x is where v is, and its faces stay unless `going` is in them
  std::vector<std::uint32_t> old;  ///< faces that go or change
  std::vector<NewFace> made;       ///< faces as they will be
  std::vector<Attached> attached;  ///< samples of the old faces, and those of the vertices that move
};

}  // namespace hermesh
