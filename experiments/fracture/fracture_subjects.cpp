#include "experiments/fracture/fracture_subjects.h"

#include "algorithms/hermite/samplers.h"
#include "experiments/harness/cell.h"
#include "experiments/measure.h"
#include "experiments/pipeline.h"

namespace hermesh {

const std::vector<FractureSubject>& fracture_subjects() {
  static const std::vector<FractureSubject> all = {
      {"dragon", "dragon", {}, 400},
      {"fandisk", "fandisk", {}, 200},
      {"rock (9.15)", "noise-sphere-1m", {404, 200, 357}, 404},
      {"statue stand-in (9.16)", "armadillo", {506, 563, 465}, 563}};
  return all;
}

PolygonMesh load_subject(const FractureSubject& subject, const MeasurementInput& input) {
  PolygonMesh mesh = input.tables.load(subject.source, input.context).mesh;
  if (subject.size[0] == 0) return mesh;
  const Bounds box = bounds(mesh);
  for (auto& p : mesh.points)
    for (int a = 0; a < 3; ++a) p[a] = static_cast<float>(double(p[a]) * subject.size[a] / box.size()[a]);
  mesh.origin.setZero();
  return mesh;
}

SampledSubject sample_subject(const PolygonMesh& mesh, double longest, const MeasurementInput& input,
                              const std::string& voxelizer) {
  RunContext child = child_context(input.context, false);
  SampledSubject result;
  result.object.level_set =
      voxelize(mesh, {.chosen = choose(input.tables.voxelizers, voxelizer), .resolution = longest}, child);
  result.hermite_seconds =
      timed([&] { result.object.hermite = sample_polygons(result.object.level_set, 0.0, mesh, child); });
  return result;
}

}  // namespace hermesh
