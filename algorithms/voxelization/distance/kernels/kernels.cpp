#include "algorithms/voxelization/distance/kernels/kernels.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "algorithms/lattice/simd/simd_level.h"
#include "algorithms/voxelization/distance/kernels/constants.h"

namespace hermesh::kernels {

// The three tables of functions are the same source compiled with other flags; each namespace keeps its copy apart
// from the others, or the linker could pick one that the machine cannot execute.
namespace sse2 {
extern const Kernels kKernels;
}
namespace avx2 {
extern const Kernels kKernels;
}
namespace avx512 {
extern const Kernels kKernels;
}

namespace {

/// Writes a vector to three rows of the batch, rounded to single precision as the kernels' set_up() rounds.
void put(Batch& batch, int row, int lane, const Eigen::Vector3d& v) {
  for (int axis = 0; axis < 3; ++axis) batch.f[row + axis][lane] = float(v[axis]);
}

}  // namespace

void set_up_segment(const Corners& corners, int triangle, Batch& batch) {
  // Plain code, once for all levels: segments are rare.
  Eigen::Vector3d corner[3];
  for (int i = 0; i < 3; ++i)
    for (int axis = 0; axis < 3; ++axis) corner[i][axis] = corners.corner[3 * i + axis][triangle];
  int longest = 0;
  // Side i runs from corner i on; of equally long ones the first is taken, at every level of vector code.
  const auto side = [&](int i) -> Eigen::Vector3d { return corner[(i + 1) % 3] - corner[i]; };
  for (int i = 1; i < 3; ++i)
    if (side(i).squaredNorm() > side(longest).squaredNorm()) longest = i;
  const Eigen::Vector3d& start = corner[longest];
  // A triangle that is a point is a segment of length 0 along x.
  const double length = side(longest).norm();
  const Eigen::Vector3d along =
      length > 0 ? Eigen::Vector3d(side(longest) / length) : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  const Eigen::Vector3d normal = along.unitOrthogonal(), across = along.cross(normal);
  put(batch, Batch::kHeight, triangle, normal);
  batch.f[Batch::kHeight + 3][triangle] = float(-normal.dot(start));
  for (int i = 0; i < 3; ++i) {
    const int edge = Batch::kEdge + Batch::kPerEdge * i;
    // The three edges are one line, seen from both sides: `across` of two has the other sign than that of the third,
    // so that the largest is never below 0 and the edge's distance always counts.
    const double turn = i == 2 ? -1.0 : 1.0;
    put(batch, edge, triangle, turn * across);
    batch.f[edge + 3][triangle] = float(-turn * across.dot(start));
    put(batch, edge + Batch::kAlong, triangle, along);
    batch.f[edge + Batch::kLow][triangle] = float(along.dot(start));
    batch.f[edge + Batch::kHigh][triangle] = float(along.dot(start) + length);
  }
}

std::vector<std::string> levels() {
  std::vector<std::string> names;
  for (const SimdLevel level : available_simd_levels()) names.emplace_back(name(level));
  return names;
}

namespace {

// The functions that parse and choose a level let only those through that the machine can run.
const Kernels& kernels_of(SimdLevel level) {
  return of_level(level, sse2::kKernels, avx2::kKernels, avx512::kKernels);
}

}  // namespace

const Kernels& at_level(std::string_view name) { return kernels_of(parse_simd_level(name)); }
const Kernels& chosen() { return kernels_of(chosen_simd_level()); }

}  // namespace hermesh::kernels
