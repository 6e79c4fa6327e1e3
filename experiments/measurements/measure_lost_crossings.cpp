// Crossings that a layout of the Hermite voxel cannot distinguish from none: trap T2 of the notes on the
// thesis.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "algorithms/hermite/samplers.h"
#include "algorithms/thesis/voxels/dense_hermite.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Returns a box about the origin, turned about y, as signed distance: exact next to its faces, with correct
/// signs everywhere.
AnalyticSurface turned_box(const Vector3d& half, double degrees) {
  const Eigen::Matrix3d to_box =
      Eigen::AngleAxisd(-degrees * std::numbers::pi / 180.0, Vector3d::UnitY()).toRotationMatrix();
  const auto excess = [=](const Vector3d& p) -> Vector3d { return (to_box * p).cwiseAbs() - half; };
  return {[=](const Vector3d& p) { return excess(p).maxCoeff(); },
          [=](const Vector3d& p) -> Vector3d {
            int face = 0;
            excess(p).maxCoeff(&face);
            const Vector3d local = to_box * p;
            return to_box.transpose() * (std::copysign(1.0, local[face]) * Vector3d::Unit(face));
          }};
}

template <class Voxel>
std::size_t lost_by(const FloatHermite& hermite, RunContext& context) {
  std::size_t lost = 0;
  to_sparse(to_dense<Voxel>(hermite, context), context, &lost);
  return lost;
}

}  // namespace

std::vector<MeasuredRow> measure_lost_crossings(const MeasurementInput& input) {
  const int resolution = int(input.parameters.number("resolution"));
  const double half = 0.5 * resolution;
  std::vector<MeasuredRow> rows;
  for (const double degrees : {0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0, 2.0, 5.0, 10.0, 30.0, 45.0}) {
    input.context.check();
    MeasuredRow row{"box", readable(degrees) + "°"};
    if (!input.wants(row.table, row.label)) continue;
    // Its centre lies off the samples, so that no face passes through them.
    AnalyticSurface box = turned_box(Vector3d(half, 0.6 * half, 0.8 * half), degrees);
    IndexToWorld lattice;
    lattice.offset = Vector3d(0.317, 0.211, 0.113);
    const int reach = int(std::ceil(1.5 * half)) + 2;
    const FloatHermite hermite =
        sample_function(box, lattice, {-reach, -reach, -reach}, {reach, reach, reach}, 1e-9, input.context);
    const std::size_t lost = lost_by<ThesisVoxel>(hermite, input.context);
    row.values = {{"degrees", degrees},
                  {"crossings", hermite.crossings.size()},
                  {"thesis", lost},
                  {"thesis_share", double(lost) / double(hermite.crossings.size())},
                  {"fixed", lost_by<FixedVoxel>(hermite, input.context)}};
    if (row.values["fixed"] != 0) row.broken.push_back("the fixed layout lost crossings");
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace hermesh
