// The extension module hermesh._validation. Its library is under GPL-3, and so is this module; it is loaded
// at the first use.
#include <pybind11/stl.h>

#include "hermesh/validate.h"
#include "packages/python/watch.h"

namespace hermesh::python {
namespace {

void bind_report(py::module_& m) {
  py::class_<SurfaceDistances>(m, "SurfaceDistances",
                               "Distances from samples of a surface to another, world units.")
      .def_readonly("max", &SurfaceDistances::max)
      .def_readonly("mean", &SurfaceDistances::mean)
      .def_readonly("rms", &SurfaceDistances::rms)
      .def_readonly("worst", &SurfaceDistances::worst, "The position of the greatest.");
  py::class_<HausdorffBracket>(m, "HausdorffBracket",
                               "A certified bracket of a one-sided Hausdorff distance, world units.")
      .def_readonly("lower", &HausdorffBracket::lower)
      .def_readonly("upper", &HausdorffBracket::upper);
  py::class_<DefectPlace>(m, "DefectPlace", "The position of a defect.")
      .def_readonly("point", &DefectPlace::point, "World units.")
      .def_readonly("polygons", &DefectPlace::polygons,
                    "The polygons, triangles first, then quads; the second is -1 if there is only one.");
  py::class_<Defect>(m, "Defect", "A kind of defect, with the positions of the first ten.")
      .def_readonly("name", &Defect::name, "boundary_edges, ..., self_intersecting_pairs")
      .def_readonly("count", &Defect::count)
      .def_readonly("places", &Defect::places, "Those of the first ten.")
      .def("__repr__", [](const Defect& defect) { return std::to_string(defect.count) + " " + defect.name; });
  py::class_<Report>(m, "Report", R"(The validation report of a mesh.

str() of it is the verdict, most important first.

Examples
--------
>>> report = hermesh.validate((points, quads[1:]), reference=cube)
>>> report.boundary_edges, report.genus
(4, None)
>>> [(defect.name, defect.count) for defect in report.defects]
[('boundary_edges', 4)]
>>> report.to_reference.max, round(report.from_reference.max, 1)
(0.0, 0.5)
)")
      .def_readonly("points", &Report::points, "Number of points.")
      .def_readonly("triangles", &Report::triangles, "Number of triangles.")
      .def_readonly("quads", &Report::quads, "Number of quads.")
      .def_readonly("boundary_edges", &Report::boundary_edges, "Edges of only one polygon.")
      .def_readonly("non_manifold_edges", &Report::non_manifold_edges, "Edges of more than two polygons.")
      .def_readonly("non_manifold_vertices", &Report::non_manifold_vertices,
                    "Points whose polygons are not one fan.")
      .def_readonly("inconsistent_edges", &Report::inconsistent_edges,
                    "Edges whose polygons have opposite orientations.")
      .def_readonly("degenerate_polygons", &Report::degenerate_polygons, "Polygons without area.")
      .def_readonly("duplicate_polygons", &Report::duplicate_polygons,
                    "Polygons with the points of another one.")
      .def_readonly("isolated_points", &Report::isolated_points, "Points without a polygon.")
      .def_readonly("components", &Report::components, "Connected components.")
      .def_readonly("euler_characteristic", &Report::euler_characteristic, "Points - edges + polygons.")
      .def_readonly("genus", &Report::genus, "None unless the mesh is closed, manifold and oriented.")
      .def_readonly("self_intersecting_pairs", &Report::self_intersecting_pairs, "None without a search.")
      .def_readonly("volume", &Report::volume, "World units.")
      .def_readonly("area", &Report::area, "World units.")
      .def_readonly("smallest_angle", &Report::smallest_angle, "Degrees.")
      .def_readonly("worst_aspect", &Report::worst_aspect, "1 for the equilateral triangle.")
      .def_readonly("to_reference", &Report::to_reference,
                    "From the mesh to the reference; None without one.")
      .def_readonly("from_reference", &Report::from_reference,
                    "From the reference to the mesh; None without one.")
      .def_readonly("certified_to_reference", &Report::certified_to_reference,
                    "From the mesh to the reference; None unless certified.")
      .def_readonly("certified_from_reference", &Report::certified_from_reference,
                    "From the reference to the mesh; None unless certified.")
      .def_readonly("solid", &Report::solid,
                    "Compared with the reference's: \"same\", \"differs\" or \"unknown\".")
      .def_readonly("defects", &Report::defects, "The kinds that occur, with positions.")
      .def_readonly("sentences", &Report::sentences, "The verdict, most important first.")
      .def_readonly("json", &Report::json, "The report with more values as a JSON object.")
      .def(
          "to_dict",
          [](const Report& report) { return py::module_::import("json").attr("loads")(report.json); },
          "The object of `json` as a dict.")
      .def_property_readonly("closed", &Report::closed, "No boundary edges.")
      .def_property_readonly("manifold", &Report::manifold, "No non-manifold edges and vertices.")
      .def_property_readonly("oriented", &Report::oriented, "No inconsistent edges.")
      .def_property_readonly("watertight", &Report::watertight,
                             "Closed, manifold, oriented and free of self-intersections.")
      .def("__str__", [](const Report& report) {
        std::string all;
        for (const std::string& sentence : report.sentences) all += (all.empty() ? "" : "\n") + sentence;
        return all;
      });
  py::class_<FractureReport>(m, "FractureReport", "The validation report of a fracture.")
      .def_readonly("consistent", &FractureReport::consistent,
                    "True if each piece is valid, and all fit without gap or overlap.")
      .def_readonly("pieces", &FractureReport::pieces, "Number of pieces.")
      .def_readonly("triangles", &FractureReport::triangles, "Triangles of all pieces.")
      .def_readonly("seam_triangles", &FractureReport::seam_triangles, "Triangles that two pieces share.")
      .def_readonly("unmatched_cut", &FractureReport::unmatched_cut,
                    "Triangles of cuts without a counterpart.")
      .def_readonly("intersecting_pairs", &FractureReport::intersecting_pairs,
                    "Pairs of triangles of different pieces that intersect.")
      .def_readonly("broken_pieces", &FractureReport::broken_pieces, "Pieces that are not valid.")
      .def_readonly("pieces_volume", &FractureReport::pieces_volume, "World units.")
      .def_readonly("sentences", &FractureReport::sentences, "The verdict, most important first.");
}

Report judged(const Mesh& mesh, const std::optional<Mesh>& reference, const std::optional<Mesh>& features,
              bool self_intersections, bool libraries, bool certify, std::int64_t samples, double dihedral,
              double voxel_size, Watch& watch) {
  const ValidateOptions options{.reference = reference ? &*reference : nullptr,
                                .features = features ? &*features : nullptr,
                                .self_intersections = self_intersections,
                                .libraries = libraries,
                                .certify = certify,
                                .samples = samples,
                                .dihedral = dihedral,
                                .voxel_size = voxel_size};
  return watched(watch, [&](Context& context) { return validate(mesh, options, context); });
}

}  // namespace
}  // namespace hermesh::python

PYBIND11_MODULE(_validation, m) {
  namespace py = pybind11;
  m.doc() = "Bindings of validation; use the package hermesh.";
  // The types of meshes and exceptions are those of the other module.
  py::module_::import("hermesh._core");
  hermesh::python::bind_report(m);
  m.def("validate", &hermesh::python::judged);
  m.def("validate_fracture",
        hermesh::python::watching<const std::vector<hermesh::Mesh>&>(&hermesh::validate_fracture));
}
