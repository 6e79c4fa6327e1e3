// What users are told of a bound that was reached, and of one that was not.
#include <cmath>

#include "algorithms/core/number_text.h"
#include "algorithms/remesh/bounded_remesh.h"

namespace hermesh {

std::vector<std::string> notes(const BoundedMesh& made) {
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
             "; give --over-holes to let the bound hold elsewhere";
    case Unmet::thin:
      break;
  }
  const std::string what = refused.thickness > 0.0 ? "a wall or gap of " + text(refused.thickness) +
                                                         " there is too thin for voxels of "
                                                   : "something there is too small for voxels of ";
  return at + what + text(refused.voxel_size) + ", the smallest that may be;" + distance +
         "; raise the error, or allow smaller ones with --smallest-voxel and --limit-points";
}

}  // namespace hermesh
