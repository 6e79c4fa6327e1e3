#include "validation/report_scale.h"

#include <cmath>
#include <limits>

namespace hermesh::validation {
namespace {

constexpr int kMostExponent = 150;

class Unscaler {
 public:
  explicit Unscaler(double unit) : unit_(unit) {}

  void length(double& value) const { value *= unit_; }
  // Step by step, for the square of the unit may be beyond what its product with the value is.
  void area(double& value) const { value = value * unit_ * unit_; }
  void volume(double& value) const { value = value * unit_ * unit_ * unit_; }
  // Of a figure that is too small for double precision 0 would be as wrong as infinity of one that is too
  // large.
  void area_or_none(double& value) const { none_if_lost(value, &Unscaler::area); }
  void volume_or_none(double& value) const { none_if_lost(value, &Unscaler::volume); }
  void point(Eigen::Vector3d& value) const { value *= unit_; }
  void point(std::optional<Eigen::Vector3d>& value) const {
    if (value) point(*value);
  }
  void places(Places& value) const {
    for (Eigen::Vector3d& p : value.points) point(p);
  }
  void distances(Distances& value) const {
    for (double* length_of : {&value.max, &value.mean, &value.rms}) length(*length_of);
    point(value.worst);
  }
  void bound(std::optional<HausdorffBound>& value) const {
    if (value) length(value->lower), length(value->upper);
  }
  void areas(Estimate& value) const { area(value.value), area(value.lower), area(value.upper); }
  void volumes(Estimate& value) const { volume(value.value), volume(value.lower), volume(value.upper); }
  void solid(SolidComparison& value) const {
    for (Estimate* e : {&value.mesh_volume, &value.reference_volume, &value.difference, &value.unknown_volume,
                        &value.unexplained})
      volumes(*e);
    for (Estimate* e : {&value.false_area, &value.lost_area}) areas(*e);
    for (double* a : {&value.mesh_area, &value.reference_area, &value.possible_area}) area(*a);
    length(value.explained);
    point(value.false_place), point(value.lost_place), point(value.unexplained_place);
  }

 private:
  void none_if_lost(double& value, void (Unscaler::*change)(double&) const) const {
    const bool something = value != 0.0;
    (this->*change)(value);
    if (something && value == 0.0) value = std::numeric_limits<double>::quiet_NaN();
  }

  double unit_;
};

}  // namespace

double comfortable_scale(std::initializer_list<const MeshFile*> meshes) {
  double largest = 0.0;
  for (const MeshFile* mesh : meshes)
    if (mesh)
      for (const Eigen::Vector3d& p : mesh->points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  if (largest == 0.0 || std::abs(std::ilogb(largest)) <= kMostExponent) return 1.0;
  return std::ldexp(1.0, -std::ilogb(largest));
}

MeshFile scaled(const MeshFile& mesh, double scale, const std::string& name) {
  MeshFile result;
  result.triangles = mesh.triangles;
  result.quads = mesh.quads;
  result.points.reserve(mesh.points.size());
  for (const Eigen::Vector3d& p : mesh.points) {
    result.points.push_back(scale * p);
    if (result.points.back() / scale != p)
      throw Error(
          "the coordinates of " + name +
          " span more orders of magnitude than its figures can be computed for; scale the mesh, or take "
          "out what lies far off");
  }
  return result;
}

void unscale(MeshReport& r, double scale) {
  if (scale == 1.0) return;
  const Unscaler to(1.0 / scale);
  to.area_or_none(r.area), to.volume_or_none(r.volume);
  for (Places* p : {&r.boundary_places, &r.non_manifold_edge_places, &r.non_manifold_vertex_places,
                    &r.inconsistent_places, &r.degenerate_places, &r.duplicate_places, &r.inside_out_places})
    to.places(*p);
  for (LibraryCounts& l : r.libraries) to.area(l.area), to.volume(l.volume);
  if (r.self_intersections) to.places(r.self_intersections->places);
  for (std::optional<Distances>* d : {&r.to_reference, &r.from_reference})
    if (*d) to.distances(**d);
  to.bound(r.certified_to_reference), to.bound(r.certified_from_reference);
  if (r.features) {
    to.length(r.features->edge_length);
    to.distances(r.features->edge_to_mesh), to.distances(r.features->corner_to_mesh);
  }
  if (r.solid) to.solid(*r.solid);
}

}  // namespace hermesh::validation
