#include "reference/marching_cubes_decimated.h"

#include <OpenMesh/Core/Mesh/Traits.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <OpenMesh/Tools/Decimater/Observer.hh>
#include <cmath>

#include "algorithms/extraction/marching_cubes/marching_cubes.h"

namespace hermesh {
namespace {

struct Traits : OpenMesh::DefaultTraitsDouble {
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Normal);
};
using TriMesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;
using Decimater = OpenMesh::Decimater::DecimaterT<TriMesh>;

/// Reports progress and, once cancelled, asks OpenMesh to stop: OpenMesh is not made for exceptions thrown
/// through it.
class Watcher : public OpenMesh::Decimater::Observer {
 public:
  Watcher(const RunContext& context, double steps) : Observer(4096), context_(context), steps_(steps) {}
  void notify(std::size_t step) override { context_.progress("decimation", double(step) / steps_); }
  bool abort() const override { return context_.cancelled(); }

 private:
  const RunContext& context_;
  double steps_;
};

/// Silences OpenMesh, which complains on the terminal about a triangle that it refuses; here the refusal
/// becomes an Error.
class QuietOpenMesh {
 public:
  QuietOpenMesh() { omerr().disable(); }
  ~QuietOpenMesh() { omerr().enable(); }
  QuietOpenMesh(const QuietOpenMesh&) = delete;
  QuietOpenMesh& operator=(const QuietOpenMesh&) = delete;
};

TriMesh load(const PolygonMesh& mesh) {
  const QuietOpenMesh quiet;
  TriMesh result;
  const std::vector<Triangle> triangles = triangulated(mesh);
  result.reserve(mesh.points.size(), triangles.size() * 3 / 2, triangles.size());
  for (const Eigen::Vector3f& p : mesh.points) result.add_vertex(TriMesh::Point(p.x(), p.y(), p.z()));
  std::vector<TriMesh::VertexHandle> corners(3);
  for (const Triangle& t : triangles) {
    for (int i = 0; i < 3; ++i) corners[i] = result.vertex_handle(t[i]);
    if (!result.add_face(corners).is_valid())
      throw Error("The decimation needs a manifold mesh, and OpenMesh refuses a triangle of this one.");
  }
  result.update_face_normals();
  return result;
}

PolygonMesh unload(const TriMesh& mesh, const Eigen::Vector3d& origin) {
  PolygonMesh result;
  result.origin = origin;
  for (const auto v : mesh.vertices()) {
    const TriMesh::Point& p = mesh.point(v);
    result.points.emplace_back(float(p[0]), float(p[1]), float(p[2]));
  }
  for (const auto f : mesh.faces()) {
    Triangle t{};
    int i = 0;
    for (const auto v : mesh.fv_range(f)) t[i++] = std::uint32_t(v.idx());
    result.triangles.push_back(t);
  }
  return result;
}

}  // namespace

PolygonMesh decimate(const PolygonMesh& mesh, std::size_t budget, double normal_flip_degrees,
                     RunContext& context) {
  const Stage stage(context, "decimation");
  TriMesh work = load(mesh);
  context.check();

  Decimater decimater(work);
  OpenMesh::Decimater::ModQuadricT<TriMesh>::Handle quadric;
  decimater.add(quadric);
  decimater.module(quadric).unset_max_err();
  OpenMesh::Decimater::ModNormalFlippingT<TriMesh>::Handle flipping;
  if (normal_flip_degrees < 180.0) {
    decimater.add(flipping);
    decimater.module(flipping).set_max_normal_deviation(normal_flip_degrees);
  }
  // A collapse takes two triangles away.
  Watcher watcher(context, 0.5 * double(work.n_faces() - std::min(work.n_faces(), budget)) + 1.0);
  decimater.set_observer(&watcher);
  decimater.initialize();
  decimater.decimate_to_faces(0, budget);
  context.check();
  work.garbage_collection();
  if (work.n_faces() > budget && budget > 0)
    context.note("The decimation stopped at " + std::to_string(work.n_faces()) +
                 " triangles, above its budget of " + std::to_string(budget) +
                 ": no further collapse keeps the topology.");
  return unload(work, mesh.origin);
}

PolygonMesh marching_cubes_decimated(const ExtractionInput& input) {
  const PolygonMesh fine = marching_cubes(input.level_set, input.isovalue, nullptr, input.context);
  const double absolute = input.options.number("triangles");
  const double budget =
      absolute > 0.0 ? absolute : input.options.number("fraction") * double(fine.triangle_count());
  return decimate(fine, std::size_t(std::floor(budget)), input.options.number("normal_flip"), input.context);
}

}  // namespace hermesh
