// For tests of fracture: solids to break, cutters for them, and the validation of the pieces.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/fracture/fracture.h"
#include "algorithms/fracture/noise.h"
#include "algorithms/fracture/scatter.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/cases/recipes.h"
#include "validation/fracture_report.h"

namespace hermesh {

inline constexpr double kHalf = 14.0;

inline FloatHermite sampled(const AnalyticSurface& surface, std::array<int, 3> reach) {
  RunContext context;
  return sample_function(surface, IndexToWorld(), {-reach[0], -reach[1], -reach[2]},
                         {reach[0], reach[1], reach[2]}, 1e-9, context);
}

inline FloatHermite sphere() {
  return sampled({.value = [](const Eigen::Vector3d& p) { return p.norm() - kHalf; },
                  .gradient = [](const Eigen::Vector3d& p) { return p; }},
                 {20, 20, 20});
}

inline FloatHermite turned_box() {
  const Eigen::Matrix3d back =
      (Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()))
          .matrix()
          .transpose();
  const Eigen::Vector3d half(12.0, 9.0, 14.0);
  return sampled(
      {.value = [=](const Eigen::Vector3d& p) { return ((back * p).cwiseAbs() - half).maxCoeff(); },
       .gradient =
           [=](const Eigen::Vector3d& p) {
             const Eigen::Vector3d q = back * p;
             int axis;
             (q.cwiseAbs() - half).maxCoeff(&axis);
             return Eigen::Vector3d(back.row(axis).transpose() * (q[axis] < 0 ? -1.0 : 1.0));
           }},
      {24, 24, 24});
}

/// Returns a ball with a rough surface: overhangs, thin ridges, cells of several sheets.
inline FloatHermite rock() {
  const VectorNoise noise(7);
  const auto value = [=](const Eigen::Vector3d& p) { return p.norm() - kHalf - 4.0 * noise(p / 4.0)[0]; };
  const auto gradient = [=](const Eigen::Vector3d& p) {
    Eigen::Vector3d g;
    for (int a = 0; a < 3; ++a)
      g[a] = (value(p + 1e-4 * Eigen::Vector3d::Unit(a)) - value(p - 1e-4 * Eigen::Vector3d::Unit(a))) / 2e-4;
    return g;
  };
  return sampled({.value = value, .gradient = gradient, .lipschitz = 8.0}, {24, 24, 24});
}

inline std::vector<Eigen::Vector3d> seeds(const FloatHermite& object, std::size_t count) {
  RunContext context;
  return scatter(whole_solid(object, context), count, {.seed = 5, .density = {}}, context);
}

inline std::unique_ptr<Cutters> cutters_of(const std::string& kind, const FloatHermite& object,
                                           std::size_t count) {
  const std::vector<Eigen::Vector3d> places = seeds(object, count);
  if (kind == "voronoi") return voronoi_cutters(places, {}, object.placement);
  if (kind == "chunks") return voronoi_cutters(places, {1.5, 5.0, 3}, object.placement);
  Random random(11);
  std::vector<CuttingPlane> planes;
  for (const Eigen::Vector3d& place : places) {
    const Eigen::Vector3d normal = random.direction();
    planes.push_back({normal, normal.dot(place)});
  }
  return plane_cutters(planes, object.placement);
}

inline std::vector<PolygonMesh> pieces_of(const LabelledFracture& fracture) {
  std::vector<PolygonMesh> result;
  for (std::uint32_t i = 1; i <= fracture.piece_count(); ++i)
    result.push_back(piece_mesh(fracture.mesh, fracture.pieces->of(i)));
  return result;
}

inline validation::FractureReport judged(const std::vector<PolygonMesh>& pieces,
                                         const validation::ExpectedVolumes& expected = {}) {
  RunContext context;
  std::vector<MeshFile> files;
  for (const PolygonMesh& piece : pieces) files.push_back(to_mesh_file(piece));
  for (std::size_t i = 0; i < pieces.size(); ++i) files[i].attributes = pieces[i].attributes;
  return validation::check_fracture(files, context, expected);
}

inline std::string text(const validation::FractureReport& ledger) {
  std::string all;
  for (const std::string& s : ledger.sentences()) all += s + "\n";
  for (const std::string& s : ledger.places) all += s + "\n";
  return all;
}

}  // namespace hermesh
