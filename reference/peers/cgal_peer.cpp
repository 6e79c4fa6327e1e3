// CGAL: edge collapse with Garland and Heckbert's quadrics or Lindstrom and Turk's costs, the latter within a
// polyhedral envelope, too, alpha wrapping, Boolean operations by corefinement, and cuts by planes.
//
//   cgal_peer garland-heckbert IN.obj OUT.obj NUMBER
//   cgal_peer lindstrom-turk IN.obj OUT.obj NUMBER
//   cgal_peer envelope IN.obj OUT.obj TOLERANCE
//   cgal_peer alpha-wrap IN.obj OUT.obj ALPHA OFFSET
//   cgal_peer union|intersection|difference IN.obj OUT.obj SECOND.obj
//   cgal_peer cut IN.obj DIRECTORY PLANES
//
// PLANES are nx,ny,nz,d of the points x with n·x = d, separated by semicolons; each piece is a file.
// NUMBER is the share of the triangles that remain or, from 1 on, their number; lengths are world units.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/clip.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_placement.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_ratio_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_plane_policies.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Polyhedral_envelope_filter.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#include <CGAL/alpha_wrap_3.h>

#include "reference/peers/peer.h"

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Surface = CGAL::Surface_mesh<Point>;
namespace simplification = CGAL::Surface_mesh_simplification;
namespace processing = CGAL::Polygon_mesh_processing;

std::vector<Point> points_of(const peers::Mesh& mesh) {
  std::vector<Point> points;
  for (const auto& p : mesh.points) points.emplace_back(p[0], p[1], p[2]);
  return points;
}

/// As a halfedge mesh, which has to be manifold.
Surface to_cgal(const peers::Mesh& mesh) {
  Surface surface;
  if (!processing::is_polygon_soup_a_polygon_mesh(mesh.triangles))
    throw std::runtime_error("CGAL cannot take a mesh that is not manifold");
  processing::polygon_soup_to_polygon_mesh(points_of(mesh), mesh.triangles, surface);
  return surface;
}

peers::Mesh from_cgal(Surface& surface) {
  surface.collect_garbage();
  peers::Mesh mesh;
  for (const auto v : surface.vertices())
    mesh.points.push_back({surface.point(v).x(), surface.point(v).y(), surface.point(v).z()});
  for (const auto f : surface.faces()) {
    std::array<int, 3> corners{};
    int i = 0;
    for (const auto v : surface.vertices_around_face(surface.halfedge(f)))
      corners[std::size_t(i++)] = int(v.idx());
    mesh.triangles.push_back(corners);
  }
  return mesh;
}

/// The user manual's example edge_collapse_garland_heckbert.cpp.
peers::Mesh garland_heckbert(const peers::Mesh& mesh, double number) {
  Surface surface = to_cgal(mesh);
  const double fraction = double(peers::kept_triangles(mesh, number)) / double(mesh.triangles.size());
  peers::measured([&] {
    using Policies = simplification::GarlandHeckbert_plane_policies<Surface, Kernel>;
    const Policies policies(surface);
    const simplification::Bounded_normal_change_placement<Policies::Get_placement> placement(
        policies.get_placement());
    simplification::edge_collapse(surface, simplification::Count_ratio_stop_predicate<Surface>(fraction),
                                  CGAL::parameters::get_cost(policies.get_cost()).get_placement(placement));
  });
  return from_cgal(surface);
}

/// Simplifies by `edge_collapse` with its default parameters, down to a number of edges.
peers::Mesh lindstrom_turk(const peers::Mesh& mesh, double number) {
  Surface surface = to_cgal(mesh);
  const std::size_t edges = peers::kept_triangles(mesh, number) * 3 / 2;
  peers::measured([&] {
    simplification::edge_collapse(surface, simplification::Count_stop_predicate<Surface>(edges + 1));
  });
  return from_cgal(surface);
}

/// The user manual's example edge_collapse_envelope.cpp, which goes on until nothing is left that the
/// envelope allows.
peers::Mesh envelope(const peers::Mesh& mesh, double tolerance) {
  Surface surface = to_cgal(mesh);
  peers::measured([&] {
    const simplification::Polyhedral_envelope_filter<Kernel, simplification::Bounded_normal_change_filter<>>
        filter(tolerance);
    simplification::edge_collapse(surface, simplification::Count_stop_predicate<Surface>(0),
                                  CGAL::parameters::filter(filter)
                                      .get_cost(simplification::LindstromTurk_cost<Surface>())
                                      .get_placement(simplification::LindstromTurk_placement<Surface>()));
  });
  return from_cgal(surface);
}

peers::Mesh alpha_wrap(const peers::Mesh& mesh, double alpha, double offset) {
  const auto points = points_of(mesh);
  Surface surface;
  peers::measured([&] { CGAL::alpha_wrap_3(points, mesh.triangles, alpha, offset, surface); });
  return from_cgal(surface);
}

/// Throws if a mesh does not bound a volume.
void check_bounds_volume(const Surface& surface) {
  if (!CGAL::is_closed(surface) || !processing::does_bound_a_volume(surface))
    throw std::runtime_error("CGAL cannot take a mesh that does not bound a volume");
}

/// Cuts each piece by each plane with `clip`, once for each side, and writes the pieces.
void cut(const peers::Mesh& mesh, const std::string& directory, const std::string& planes) {
  std::vector<Surface> pieces{to_cgal(mesh)};
  check_bounds_volume(pieces[0]);
  peers::measured([&] {
    std::istringstream words(planes);
    for (std::string word; std::getline(words, word, ';');) {
      double a = 0, b = 0, c = 0, d = 0;
      if (std::sscanf(word.c_str(), "%lf,%lf,%lf,%lf", &a, &b, &c, &d) != 4)
        throw std::runtime_error("invalid plane '" + word + "'; expected nx,ny,nz,d");
      const Kernel::Plane_3 plane(a, b, c, -d);
      std::vector<Surface> halves;
      for (const Surface& piece : pieces)
        for (const auto& side : {plane, plane.opposite()}) {
          Surface half = piece;
          if (!processing::clip(half, side, CGAL::parameters::clip_volume(true)))
            throw std::runtime_error("CGAL cannot make a manifold mesh of a piece");
          if (half.number_of_faces() > 0) halves.push_back(std::move(half));
        }
      pieces = std::move(halves);
    }
  });
  for (std::size_t i = 0; i < pieces.size(); ++i)
    peers::write_obj(directory + "/" + std::to_string(i + 1) + ".obj", from_cgal(pieces[i]));
}

peers::Mesh combined(const peers::Mesh& first, const peers::Mesh& second, const std::string& operation) {
  Surface a = to_cgal(first), b = to_cgal(second), result;
  check_bounds_volume(a), check_bounds_volume(b);
  bool is_manifold = false;
  peers::measured([&] {
    is_manifold = operation == "union"          ? processing::corefine_and_compute_union(a, b, result)
                  : operation == "intersection" ? processing::corefine_and_compute_intersection(a, b, result)
                                                : processing::corefine_and_compute_difference(a, b, result);
  });
  if (!is_manifold) throw std::runtime_error("CGAL cannot make a manifold mesh of the result");
  return from_cgal(result);
}

}  // namespace

int main(int argc, char** argv) {
  return peers::guarded([&] {
    const std::string method = argc > 1 ? argv[1] : "";
    if (argc != (method == "alpha-wrap" ? 6 : 5))
      throw std::runtime_error(
          "cgal_peer garland-heckbert|lindstrom-turk|envelope IN OUT NUMBER, or alpha-wrap IN OUT ALPHA "
          "OFFSET, or union|intersection|difference IN OUT SECOND, or cut IN DIRECTORY PLANES");
    const peers::Mesh mesh = peers::read_obj(argv[2]);
    if (method == "cut") return cut(mesh, argv[3], argv[4]);
    if (method == "union" || method == "intersection" || method == "difference")
      return peers::write_obj(argv[3], combined(mesh, peers::read_obj(argv[4]), method));
    const double number = std::atof(argv[4]);
    peers::write_obj(argv[3], method == "garland-heckbert" ? garland_heckbert(mesh, number)
                              : method == "lindstrom-turk" ? lindstrom_turk(mesh, number)
                              : method == "envelope"       ? envelope(mesh, number)
                              : method == "alpha-wrap"
                                  ? alpha_wrap(mesh, number, std::atof(argv[5]))
                                  : throw std::runtime_error("cgal_peer knows no method " + method));
  });
}
