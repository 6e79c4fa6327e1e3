#include "algorithms/extraction/certified_collapse/cube_decimation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "algorithms/extraction/certified_collapse/cube_collapse.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// What the mean squared distance of the new point to the planes that an edge's ends stand for may be, in
/// tolerances squared: beyond, the edge is not worth a test. (1 would lose some 4 % of the collapses of a
/// scan, 4 none and save nothing.)
constexpr double kHopeless = 2.0;
/// What the mean squared distance of the new point to the planes may be in a bold collapse, in tolerances
/// squared: nothing else is asked of distances there. (With 0.3 the proof takes back a third of what is
/// collapsed, with 0.03 nearly all is left to careful collapses, which cost five times as much each.)
constexpr double kBold = 0.12;

/// Collapses edges of a cube, cheapest first. The heap may hold proposals that are out of date: the versions
/// of their ends tell.
class EdgeCollapses {
  struct Proposal {
    float cost;
    std::uint32_t u, v, version_u, version_v;
    /// The order of a heap with the cheapest on top; ties are broken by number, so that there is one order.
    bool operator<(const Proposal& other) const {
      if (cost != other.cost) return cost > other.cost;
      return u != other.u ? u > other.u : v > other.v;
    }
  };

 public:
  EdgeCollapses(CubeCollapse& collapses, double hopeless)
      : collapses_(collapses), mesh_(collapses.mesh()), hopeless_(hopeless) {}

  void run(const RunContext& context) {
    for (const CubeMesh::Face& face : mesh_.faces) {
      if (!face.own || face.gone) continue;
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t u = face.corners[i], v = face.corners[(i + 1) % 3];
        // Each edge between two own faces once. One at the border of these may be left out: both its ends
        // have a face that is not the cube's, and neither may move.
        if (u < v && (collapses_.is_dirty(u) || collapses_.is_dirty(v))) propose(u, v);
      }
    }
    for (std::size_t step = 0; !heap_.empty(); ++step) {
      if (step % 256 == 0) context.check();
      std::pop_heap(heap_.begin(), heap_.end());
      const Proposal next = heap_.back();
      heap_.pop_back();
      const CubeMesh::Vertex &u = mesh_.vertices[next.u], &v = mesh_.vertices[next.v];
      if (!u.gone && !v.gone && u.version == next.version_u && v.version == next.version_v)
        try_edge(next.u, next.v);
    }
  }

 private:
  struct Target {
    Vector3d x;
    double cost;
    bool hopeless;
  };

  /// Where the ends of an edge would go, and at what cost; an end that may not move stays.
  Target target(std::uint32_t u, std::uint32_t v) const {
    const CubeMesh::Vertex &at_u = mesh_.vertices[u], &at_v = mesh_.vertices[v];
    const Vector3d middle = 0.5 * (at_u.point + at_v.point);
    const WideQuadric q = collapses_.quadric_about(u, v, middle);
    const bool forgets = collapses_.moment() > 0;
    const WideQuadric cost = forgets ? collapses_.quadric_of_faces(u, v, middle) : q;
    Vector3d x = !at_u.free   ? Vector3d(at_u.point - middle)
                 : !at_v.free ? Vector3d(at_v.point - middle)
                              : cost.minimiser();
    const double squared = (at_u.point - at_v.point).squaredNorm();
    // Planes that are nearly parallel meet far away: no farther than the edge is long.
    if (x.squaredNorm() > squared) x *= std::sqrt(squared) / x.norm();
    const double off = q(x), tolerance = std::min(collapses_.tolerance_at(u), collapses_.tolerance_at(v));
    const double now = forgets ? cost(x) : off;
    const bool hopeless =
        off > hopeless_ * tolerance * tolerance * q.a.trace() || (forgets && now > collapses_.moment());
    // Where planes tell nothing apart, as on flat parts, short edges come before long ones.
    return {middle + x, now + kPull * cost.a.trace() * squared, hopeless};
  }

  void propose(std::uint32_t u, std::uint32_t v) {
    const CubeMesh::Vertex &at_u = mesh_.vertices[u], &at_v = mesh_.vertices[v];
    if (!at_u.here || !at_v.here || (!at_u.free && !at_v.free)) return;
    if (u > v) return propose(v, u);
    const Target at = target(u, v);
    if (at.hopeless) return;
    heap_.push_back({static_cast<float>(at.cost), u, v, at_u.version, at_v.version});
    std::push_heap(heap_.begin(), heap_.end());
  }

  void try_edge(std::uint32_t u, std::uint32_t v) {
    if (!mesh_.vertices[u].free) std::swap(u, v);  // u goes, v stays
    if (!keeps_topology(u, v)) return;
    // To round once more what may not move could move it.
    const bool free = mesh_.vertices[v].free;
    if (try_at(u, v, free ? collapses_.rounded(target(u, v).x) : mesh_.vertices[v].point) || !free) return;
    // Where the best place will not do, one end may.
    const Vector3d &at_u = mesh_.vertices[u].point, &at_v = mesh_.vertices[v].point;
    const WideQuadric q = collapses_.quadric_about(u, v, at_v);
    try_at(u, v, q(at_u - at_v) < q(Vector3d::Zero()) ? at_u : at_v);
  }

  /// Whether the link condition holds (Dey et al. 1999): the ends have two adjacent vertices in common, those
  /// opposite the edge. A tetrahedron, all of whose vertices have three faces, must not collapse either.
  bool keeps_topology(std::uint32_t u, std::uint32_t v) {
    const std::uint32_t question = mesh_.ask();
    std::size_t at_u = 0, at_v = 0;
    int common = 0;
    mesh_.for_each_face(u, [&](std::uint32_t f, int i) {
      for (const int k : {1, 2}) mesh_.vertices[mesh_.faces[f].corners[(i + k) % 3]].seen = question;
      ++at_u;
    });
    mesh_.for_each_face(v, [&](std::uint32_t f, int i) {
      ++at_v;
      for (const int k : {1, 2}) {
        const std::uint32_t w = mesh_.faces[f].corners[(i + k) % 3];
        if (w == u || std::exchange(mesh_.vertices[w].seen, 0) != question) continue;
        ++common;
      }
    });
    return common == 2 && (at_u > 3 || at_v > 3);
  }

  bool try_at(std::uint32_t u, std::uint32_t v, const Vector3d& x) {
    if (!collapses_.gather(u, v, x) || !collapses_.passes()) return false;
    collapses_.apply();
    // The new edges; those proposed at v before are out of date.
    mesh_.for_each_face(v, [&](std::uint32_t f, int i) { propose(v, mesh_.faces[f].corners[(i + 1) % 3]); });
    return true;
  }

  CubeCollapse& collapses_;
  CubeMesh& mesh_;
  std::vector<Proposal> heap_;
  double hopeless_;
};

}  // namespace

std::vector<Join> decimate_cube(DecimatedMesh& mesh, Collapses kind, const FilePoints& file,
                                const DecimationCube& cube, std::span<const std::uint32_t> triangles,
                                CubeNumbers& numbers, const RunContext& context) {
  CubeCollapse collapses(mesh, kind, file, cube, triangles, numbers);
  EdgeCollapses(collapses, kind == Collapses::bold ? kBold : kHopeless).run(context);
  return std::move(collapses.joins());
}

}  // namespace hermesh
