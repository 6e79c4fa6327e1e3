// The mesh whose edges collapse, its part in one domain of a round, and one collapse there
// (collapse_edges()). All lengths are in voxels, positions in index space.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/extraction/certified_collapse/merge_proposals.h"
#include "algorithms/extraction/contact/triangle_contact.h"
#include "algorithms/extraction/contact/triangle_reach.h"

namespace hermesh {

/// A mesh whose edges collapse. The vertices of the fine mesh are its *samples*; its own vertices have the
/// indices of the merged mesh that it began with, of which there are far fewer. FineMesh::kNone stands for no
/// triangle, no sample or no vertex.
struct DecimatedMesh {
  DecimatedMesh(const DecimationInput& in, std::span<const std::uint32_t> sample_of_vertex)
      : input(in), leaders(sample_of_vertex) {}

  const DecimationInput& input;
  // By vertex:
  std::span<const std::uint32_t> leaders;  ///< the sample that represents each, as MergeForest::leader()
  std::vector<Eigen::Vector3d> points;     ///< current positions; FilePoints::rounded()
  std::vector<PlaneQuadric> quadrics;      ///< planes that the vertex represents, about the vertex
  std::vector<float> least_tolerance;      ///< least among the samples that the vertex represents
  std::vector<std::uint8_t> unmoved;       ///< 1 for vertices that are at their sample
  /// 1 if edges at the vertex are tested in this round, and in the next. An edge that failed fails again,
  /// unless something near it has changed or the border of a domain prevented it.
  std::vector<std::uint8_t> dirty, dirty_next;
  // By triangle, except `next_sample`:
  std::vector<Triangle> triangles;           ///< removed if the first corner is kNone
  std::vector<std::uint32_t> fine_triangle;  ///< triangle of the fine mesh that each originates from
  std::vector<std::uint32_t> first_sample;   ///< head of the list of samples attached to each, or kNone
  /// By sample: the next one of the same list, or kNone. Empty for unverified collapses, which use no samples
  std::vector<std::uint32_t> next_sample;

  bool alive(std::size_t triangle) const { return triangles[triangle][0] != FineMesh::kNone; }
};

/// A cubic domain of a round.
struct Domain {
  /// Index of a domain in the round's lattice: its lowest corner is at start + index * side. Positions and
  /// the boxes of triangles are assigned by the same rounding, so no position is in two domains.
  using Index = std::array<std::uint64_t, 3>;
  static Index index_of(const Eigen::Vector3d& p, const Eigen::Vector3d& start, double side) {
    Index index;
    for (int a = 0; a < 3; ++a)
      index[a] = static_cast<std::uint64_t>(std::max(0.0, (p[a] - start[a]) / side));
    return index;
  }

  Eigen::Vector3d start;
  double side;
  Index index;
  double longest_edge;  ///< longest that a collapse may create, so that all domains coarsen evenly
  bool holds(const Eigen::Vector3d& p) const { return index_of(p, start, side) == index; }
};

/// The triangles that touch a domain. Vertices and faces have local indices, in the order in which the
/// triangles refer to them.
struct DomainMesh {
  static constexpr std::uint32_t kNone = FineMesh::kNone;

  struct Vertex {
    Eigen::Vector3d point;
    std::uint32_t global;  ///< index in the decimated mesh
    std::uint32_t first_corner = kNone;
    std::uint32_t version = 0;  ///< incremented when the vertex changes
    bool here = false;          ///< in the domain, so that all its triangles are known
    bool free = false;          ///< it is not pinned and all its triangles belong to the domain: it may move
    bool gone = false;
    std::uint32_t seen = 0;  ///< number of the last query that visited it
  };
  struct Face {
    std::array<std::uint32_t, 3> corners;
    std::uint32_t global;
    bool own = false;
    bool gone = false;
  };

  /// @param local scratch of the thread: local indices by global ones; entries left by other domains are
  ///   harmless
  DomainMesh(const DecimatedMesh& mesh, const Domain& domain, std::span<const std::uint32_t> triangles,
             std::vector<std::uint32_t>& local);

  template <class F>
  void for_each_face(std::uint32_t v, F&& f) const {
    for (std::uint32_t corner = vertices[v].first_corner; corner != kNone; corner = next_corner[corner])
      if (!faces[corner / 3].gone) f(corner / 3, static_cast<int>(corner % 3));
  }
  /// Merges the corner list of `going` into that of `staying`, without corners of removed faces, which would
  /// make the list ever longer.
  void merge_corners(std::uint32_t going, std::uint32_t staying);

  std::vector<Vertex> vertices;
  std::vector<Face> faces;
  std::vector<std::uint32_t> next_corner;  ///< for corner 3 × face + i: the next one at the same vertex
};

/// A proposal: the ends of an edge become one vertex at x, which keeps the index of one of them, v.
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
  bool v_moves;                    ///< otherwise x is at v, whose faces stay unless they contain `going`
  std::vector<std::uint32_t> old;  ///< faces that are removed or changed
  std::vector<NewFace> made;       ///< resulting faces
  std::vector<Attached> attached;  ///< samples of the old faces, and those of the vertices that move
};

/// The distance test of verified collapses (Collapses::careful). It reads the current collapse, and writes
/// Collapse::attached.
class CollapseDistance {
 public:
  CollapseDistance(DecimatedMesh& mesh, DomainMesh& domain, Collapse& collapse)
      : mesh_(mesh), domain_(domain), collapse_(collapse) {}

  /// Returns true if every sample of the old triangles, and each vertex that moves, has a new triangle within
  /// its tolerance, and the new vertex and the new edges are within the tolerance of the fine mesh.
  bool passes();

 private:
  bool attach_samples();
  bool attach(std::uint32_t sample);
  bool point_is_near();
  bool near_fine_around(const Eigen::Vector3d& p, double radius);
  bool near_fine(std::uint32_t t, const Eigen::Vector3d& p, double radius) const;
  bool new_edges_are_near();
  bool is_near_below(const Eigen::Vector3d& to, const Eigen::Vector3d& normal) const;
  bool segment_is_near(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  DecimatedMesh& mesh_;
  DomainMesh& domain_;
  Collapse& collapse_;
  std::vector<TriangleReach> reach_;  ///< of the new triangles
  std::uint32_t below_ = 0;           ///< a fine triangle near the last position
};

/// Arguments of MergeForest::join().
struct Join {
  std::uint32_t going;
  MergeForest::Node node;
};

/// Collapses edges in a domain, and returns the joins in order. `triangles` are those whose boxes touch the
/// domain, ascending; `local` is as for DomainMesh. Changes only triangles with all corners in the domain,
/// the vertices in it and the samples attached to them; of any other triangle it reads only enough to exclude
/// it. So threads may process different domains of a round concurrently. @throws Cancelled
std::vector<Join> collapse_in_domain(DecimatedMesh& mesh, Collapses kind, const Domain& domain,
                                     std::span<const std::uint32_t> triangles,
                                     std::vector<std::uint32_t>& local, const RunContext& context);

}  // namespace hermesh
