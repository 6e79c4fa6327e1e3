#include "experiments/cases/test_volumes.h"

#include <openvdb/tools/LevelSetSphere.h>

#include "algorithms/core/level_set_grid.h"

namespace hermesh {

LevelSet make_volume(const std::array<int, 3>& size, float background,
                     const std::function<float(int, int, int)>& value) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(background);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  auto access = grid->getAccessor();
  for (int x = 0; x < size[0]; ++x)
    for (int y = 0; y < size[1]; ++y)
      for (int z = 0; z < size[2]; ++z) access.setValue(openvdb::Coord(x, y, z), value(x, y, z));
  return make_level_set(grid);
}

LevelSet make_patterns(int per_axis, int size, const std::function<std::uint32_t(int)>& pattern,
                       std::mt19937 random) {
  const int pitch = size + 1;
  std::uniform_real_distribution<float> magnitude(0.05f, 1.0f);
  std::vector<std::uint32_t> bits(static_cast<std::size_t>(per_axis) * per_axis * per_axis);
  for (std::size_t i = 0; i < bits.size(); ++i) bits[i] = pattern(static_cast<int>(i));
  const int n = per_axis * pitch;
  return make_volume({n, n, n}, 1.0f, [&, per_axis](int x, int y, int z) {
    const int local[3] = {x % pitch, y % pitch, z % pitch};
    const bool gap = local[0] == size || local[1] == size || local[2] == size;
    const int which = ((x / pitch) * per_axis + y / pitch) * per_axis + z / pitch;
    const bool inside = !gap && ((bits[which] >> ((local[0] * size + local[1]) * size + local[2])) & 1);
    return inside ? -magnitude(random) : magnitude(random);
  });
}

LevelSet make_sphere(double radius_in_voxels, double voxel_size, const std::array<double, 3>& translation) {
  initialize_openvdb();
  auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      static_cast<float>(radius_in_voxels * voxel_size), openvdb::Vec3f(0), static_cast<float>(voxel_size),
      3.0f);
  grid->transform().postTranslate(openvdb::Vec3d(translation[0], translation[1], translation[2]));
  return make_level_set(grid);
}

}  // namespace hermesh
