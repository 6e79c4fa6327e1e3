// The triangles that touch one cube of a round, with their connections (decimation.h).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/extraction/manifold_dual_contouring/cube_decimation.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_contact.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_grid.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_reach.h"

namespace hermesh {

/// What a thread keeps from cube to cube: numbers in a cube by numbers in the whole mesh. Old entries do no harm.
struct CubeNumbers {
  std::vector<std::uint32_t> vertex, face;
};

/// Vertices and faces have numbers of their own here, in the order in which the triangles name them.
struct CubeMesh {
  static constexpr std::uint32_t kNone = 0xffffffffu;

  struct Vertex {
    Eigen::Vector3d point;
    std::uint32_t global;
    std::uint32_t first_corner = kNone;
    std::uint32_t version = 0;  ///< goes up when the vertex changes
    bool here = false;          ///< in the cube, so that all its triangles are known
    bool free = false;          ///< all its triangles belong to the cube and it is not pinned, so that it may move
    bool gone = false;
    std::uint32_t seen = 0;     ///< number of the last question that it was looked at for
  };
  struct Face {
    std::array<std::uint32_t, 3> corners;
    std::uint32_t global;
    Box3 box;  ///< empty when it is gone
    bool own = false;
    std::uint32_t seen = 0;  ///< number of the last question that it was looked at for
    bool gone() const { return box.lower[0] > box.upper[0]; }
  };

  CubeMesh(const DecimatedMesh& mesh, const DecimationCube& cube, std::span<const std::uint32_t> triangles,
           CubeNumbers& numbers);

  template <class F>
  void for_each_face(std::uint32_t v, F&& f) const {
    for (std::uint32_t corner = vertices[v].first_corner; corner != kNone; corner = next_corner[corner])
      if (!faces[corner / 3].gone()) f(corner / 3, static_cast<int>(corner % 3));
  }
  Corners corners_of(std::uint32_t f) const {
    const auto& c = faces[f].corners;
    return {vertices[c[0]].point, vertices[c[1]].point, vertices[c[2]].point};
  }
  /// By their numbers in the whole mesh; kNone if they are not among these.
  std::uint32_t find_face(std::uint32_t triangle) const {
    const std::uint32_t f = numbers.face[triangle];
    return f < faces.size() && faces[f].global == triangle ? f : kNone;
  }
  std::uint32_t find_vertex(std::uint32_t point) const {
    const std::uint32_t v = numbers.vertex[point];
    return v < vertices.size() && vertices[v].global == point ? v : kNone;
  }
  /// `staying` takes over the corners of `going` that are left: dead ones would make the walk around it longer and longer.
  void merge_corners(std::uint32_t going, std::uint32_t staying);
  /// Counts a face out, and files those that are left anew when they have become few, and so wider than the grid's cells.
  void count_out();
  /// A new question, for `seen`.
  std::uint32_t ask() { return ++question; }

  CubeNumbers& numbers;
  std::vector<Vertex> vertices;
  std::vector<Face> faces;
  std::vector<std::uint32_t> next_corner;  ///< by corner, 3 × face + i: the next one at the same vertex
  std::optional<TriangleGrid> grid;
  std::size_t left = 0, left_when_filed = 0;  ///< faces
  std::uint32_t question = 0;

 private:
  void file_faces();
};

/// A proposal: some vertices that hang together become one point x, which keeps the number of one of them, v.
struct Collapse {
  struct NewFace {
    std::uint32_t face;
    int corner;  ///< of x
    Corners at;  ///< x first, in the order of the face
    std::array<std::uint32_t, 2> others;
    Box3 box;
    Eigen::Vector3d normal;  ///< not of unit length
    TriangleReach reach;
  };
  struct Attached {
    std::uint32_t sample;
    std::uint32_t triangle;  ///< index among the new ones
  };

  std::uint32_t v;
  std::vector<std::uint32_t> going;  ///< all but v
  Eigen::Vector3d x;
  bool v_moves;                     ///< else x is where v is, and its faces stay unless others are in them
  std::vector<std::uint32_t> old;   ///< faces that go or change, ascending
  std::vector<NewFace> made;        ///< faces as they will be
  std::vector<Attached> attached;   ///< samples of the old faces, and those of the vertices that move
};

}  // namespace hermesh
