#include "experiments/bench/sphere_level_set.h"

#include <openvdb/tools/LevelSetSphere.h>

#include "algorithms/core/level_set_grid.h"

namespace hermesh {

LevelSet sphere_level_set(int resolution) {
  initialize_openvdb();
  // A centre at a lattice point would put whole families of samples on exactly the same distance.
  const openvdb::Vec3f centre(0.3f, -0.2f, 0.1f);
  return make_level_set(openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      0.5f * static_cast<float>(resolution), centre, 1.0f));
}

}  // namespace hermesh
