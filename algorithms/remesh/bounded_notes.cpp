// Notes and messages on the results of bounded remeshings.
#include <algorithm>
#include <functional>
#include <numeric>

#include "algorithms/core/number_text.h"
#include "algorithms/remesh/bounded_remesh.h"

namespace hermesh {

double BoundedMesh::excepted_area() const {
  return std::transform_reduce(excepted.begin(), excepted.end(), 0.0, std::plus<>(),
                               [](const UnmetPlace& ball) { return ball.area; });
}

std::vector<std::string> notes(const BoundedMesh& made) {
  const auto counted = [](std::size_t n, const std::string& what) {
    return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
  };
  std::vector<std::string> result;
  if (made.free_area > 0.0)
    result.push_back("polygons of " + text(made.free_area) +
                     " in all, as area, have the same on both sides, by winding numbers at places a 16th of "
                     "the error apart, "
                     "and were taken to bound nothing");
  if (made.hole_area > 0.0 && made.over_holes)
    result.push_back("holes of " + text(made.hole_area) +
                     " in all, as area, were closed, where the bound is to the surface on which the winding "
                     "number is 1/2");
  if (!made.excepted.empty()) {
    const auto largest = std::ranges::max_element(made.excepted, {}, &UnmetPlace::radius);
    const UnmetPlace& farthest = made.excepted.front();
    result.push_back("the bound does NOT hold at " + counted(made.excepted.size(), "place") +
                     " (holes, walls or gaps too thin for the voxels), the largest within " +
                     text(largest->radius) + " of " + text(largest->place) + ": polygons and mesh of " +
                     text(made.excepted_area()) +
                     " in all, as area, are not shown to be near, and the surfaces are at least " +
                     text(farthest.distance) + " apart at " + text(farthest.place));
  }
  const Topology& before = made.topology;
  const Topology after = topology_of(made.mesh.points, made.mesh.triangles);
  if (after.components != before.components)
    result.push_back("the mesh has " + counted(after.components, "component") +
                     " and the polygons that bound the solid have " +
                     counted(before.components, "connected part") + ": " +
                     (after.components > before.components
                          ? "thin walls came apart or gaps were closed within the error"
                          : "parts were lost, or joined to others that they touch or nearly touch"));
  if (before.genus && after.genus && *after.genus != *before.genus)
    result.push_back("the mesh has the genus " + std::to_string(*after.genus) +
                     " and the polygons that bound the solid have " + std::to_string(*before.genus) +
                     ": handles or tunnels were added or lost within the error");
  return result;
}

std::string explanation(const BoundedMesh& refused) {
  const UnmetPlace& first = refused.unmet.front();
  const std::string at =
      "the error of " + text(refused.error) + " is not kept at " + text(first.place) + ": ";
  const std::string distance = std::isfinite(first.distance)
                                   ? " the surfaces are at least " + text(first.distance) + " apart there"
                                   : std::string(" nothing of the polygons shows");
  switch (first.why) {
    case Unmet::hole:
      return at + "the polygons have a hole there, which has to be closed;" + distance +
             "; give --over-holes to let the bound hold elsewhere, --except-thin to except this place, or "
             "--signs flood-fill for a shell around the polygons";
    case Unmet::thin:
      break;
  }
  const std::string what = refused.thickness > 0.0 ? "a wall or gap of " + text(refused.thickness) +
                                                         " there is too thin for voxels of "
                                                   : "something there is too small for voxels of ";
  return at + what + text(refused.voxel_size) + ", the smallest that may be;" + distance +
         "; raise the error, allow smaller ones with --smallest-voxel and --limit-points, or except such "
         "places with --except-thin";
}

}  // namespace hermesh
