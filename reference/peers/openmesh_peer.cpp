// OpenMesh: its decimater with quadrics for the order and the module that forbids flips, within a Hausdorff
// distance or to a number of triangles.
//   openmesh_peer IN.obj OUT.obj TOLERANCE             world units
//   openmesh_peer quadric IN.obj OUT.obj NUMBER        a share of the triangles, or from 1 on how many stay
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

/// Down to `triangles`, or where there are none as far as the tolerance allows.
peers::Mesh decimated(const peers::Mesh& mesh, double tolerance, std::size_t triangles) {
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
    if (triangles == 0) decimater.add(hausdorff);
    decimater.add(flipping);
    // One module gives the order, so the quadric's has no bound, which would make it a yes or no.
    decimater.module(quadric).unset_max_err();
    if (triangles == 0) decimater.module(hausdorff).set_tolerance(tolerance);
    if (!decimater.initialize()) throw std::runtime_error("OpenMesh's decimater could not be set up");
    if (triangles == 0)
      decimater.decimate();  // as far as the modules allow
    else
      decimater.decimate_to_faces(0, triangles);
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
    if (argc == 5 && std::string(argv[1]) == "quadric") {
      const peers::Mesh mesh = peers::read_obj(argv[2]);
      return peers::write_obj(argv[3], decimated(mesh, 0, peers::kept_triangles(mesh, std::atof(argv[4]))));
    }
    if (argc != 4) throw std::runtime_error("openmesh_peer IN OUT TOLERANCE, or quadric IN OUT NUMBER");
    peers::write_obj(argv[2], decimated(peers::read_obj(argv[1]), std::atof(argv[3]), 0));
  });
}
