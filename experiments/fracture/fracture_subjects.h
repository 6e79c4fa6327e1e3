// The objects that fractures are measured on, at the sizes of the thesis's figures 9.15 and 9.16.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "experiments/fracture/fracture_run.h"
#include "experiments/harness/measurement.h"

namespace hermesh {

/// A model at the size of the thesis's figures, or of the case.
struct FractureSubject {
  std::string label;
  std::string source;               ///< case that the subject is made from
  std::array<double, 3> size = {};  ///< voxels along each axis; 0: the case's own proportions
  double longest = 0.0;             ///< voxels
};

/// Returns all subjects. Neither object of the figures is available; a rough ball and the Armadillo,
/// stretched to their boxes, are used as substitutes.
const std::vector<FractureSubject>& fracture_subjects();

/// Returns the mesh of a subject's case, stretched to its proportions. @throws Error as load_case() does.
PolygonMesh load_subject(const FractureSubject& subject, const MeasurementInput& input);

struct SampledSubject {
  FractureObject object;
  double hermite_seconds = 0.0;  ///< time that the Hermite data took
};
/// Samples the mesh as an object to break, with `longest` voxels along its longest side, its signs from a
/// voxelizer of `hermesh list`.
SampledSubject sample_subject(const PolygonMesh& mesh, double longest, const MeasurementInput& input,
                              const std::string& voxelizer = "hermesh");

}  // namespace hermesh
