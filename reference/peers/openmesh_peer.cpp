// OpenMesh: its decimater with quadrics for the order, and the modules that bound the Hausdorff distance and
// forbid flips.
//   openmesh_peer IN.obj OUT.obj TOLERANCE     world units
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModHausdorffT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "reference/peers/peer.h"

namespace {

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using Surface = OpenMesh::TriMesh_ArrayKernelT<Traits>;

peers::Mesh decimated(const peers::Mesh& mesh, double tolerance) {
  Surface surface;
  std::vector<Surface::VertexHandle> handles;
  for (const auto& p : mesh.points) handles.push_back(surface.add_vertex({p[0], p[1], p[2]}));
  for (const auto& t : mesh.triangles)
    surface.add_face(handles[std::size_t(t[0])], handles[std::size_t(t[1])], handles[std::size_t(t[2])]);
  surface.request_face_normals();
  surface.update_face_normals();
  peers::measured([&] {
    OpenMesh::Decimater::DecimaterT<Surface> decimater(surface);
    OpenMesh::Decimater::ModQuadricT<Surface>::Handle quadric;
    OpenMesh::Decimater::ModHausdorffT<Surface>::Handle hausdorff;
    OpenMesh::Decimater::ModNormalFlippingT<Surface>::Handle flipping;
    decimater.add(quadric);
    decimater.add(hausdorff);
    decimater.add(flipping);
    // One module gives the order, so the quadric's has no bound, which would make it a yes or no.
    decimater.module(quadric).unset_max_err();
    decimater.module(hausdorff).set_tolerance(tolerance);
    if (!decimater.initialize()) throw std::runtime_error("OpenMesh's decimater could not be set up");
    decimater.decimate();  // as far as the modules allow
    surface.garbage_collection();
  });
  peers::Mesh result;
  for (const auto v : surface.vertices())
    result.points.push_back({surface.point(v)[0], surface.point(v)[1], surface.point(v)[2]});
  for (const auto f : surface.faces()) {
    std::array<int, 3> corners{};
    std::size_t i = 0;
    for (const auto v : surface.fv_range(f)) corners[i++] = v.idx();
    result.triangles.push_back(corners);
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  return peers::guarded([&] {
    if (argc != 4) throw std::runtime_error("openmesh_peer IN OUT TOLERANCE");
    peers::write_obj(argv[2], decimated(peers::read_obj(argv[1]), std::atof(argv[3])));
  });
}
