// Stand-ins for volumes whose files are missing.
#include <algorithm>
#include <cmath>

#include "algorithms/core/level_set_grid.h"
#include "experiments/cases/recipes.h"

namespace hermesh {
namespace {

using openvdb::Coord;

/// Returns a number from 0 to 1 for each lattice point (a finalizer of MurmurHash3).
double lattice_noise(int x, int y, int z) {
  std::uint32_t h =
      std::uint32_t(x) * 0x9e3779b1u ^ std::uint32_t(y) * 0x85ebca77u ^ std::uint32_t(z) * 0xc2b2ae3du;
  h = (h ^ (h >> 16)) * 0x85ebca6bu;
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  return double((h ^ (h >> 16)) >> 8) / 0x1p24;
}

/// Returns noise from 0 to 1, trilinear between lattice points `spacing` samples apart.
double noise(const Coord& at, int spacing) {
  const double scaled[3] = {double(at.x()) / spacing, double(at.y()) / spacing, double(at.z()) / spacing};
  const int low[3] = {int(std::floor(scaled[0])), int(std::floor(scaled[1])), int(std::floor(scaled[2]))};
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    int at_corner[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int up = (corner >> axis) & 1;
      at_corner[axis] = low[axis] + up;
      weight *= up ? scaled[axis] - low[axis] : 1.0 - (scaled[axis] - low[axis]);
    }
    sum += weight * lattice_noise(at_corner[0], at_corner[1], at_corner[2]);
  }
  return sum;
}

double distance_to(const Coord& at, double x, double y, double z) {
  return std::sqrt((at.x() - x) * (at.x() - x) + (at.y() - y) * (at.y() - y) + (at.z() - z) * (at.z() - z));
}

LevelSet make_scan() {
  auto grid = openvdb::FloatGrid::create(-1.0f);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(1.0));
  for (const Coord& at : openvdb::CoordBBox(Coord(0), Coord(95, 95, 63))) {
    const double radius = distance_to(at, 47.3, 48.1, 18.2) + 8.0 * noise(at, 12);
    const double bone = std::max(0.0, 1.0 - std::fabs(radius - 36.0) / 5.0),
                 flesh = radius < 42.0 ? 200.0 : 0.0;
    const double value = flesh + 600.0 * bone + 150.0 * noise(at, 5) * (radius < 33.0 ? 1.0 : 0.1);
    grid->tree().setValue(at, static_cast<float>(std::floor(std::min(value, 999.0))));
  }
  return make_level_set(grid);
}

LevelSet make_fog() {
  auto grid = openvdb::FloatGrid::create(0.0f);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  for (const Coord& at : openvdb::CoordBBox(Coord(-48), Coord(48))) {
    const double density = 1.4 * noise(at, 9) + 0.7 - distance_to(at, 0.2, 0.3, 0.1) / 30.0;
    if (density > 0.0) grid->tree().setValueOn(at, static_cast<float>(std::min(density, 1.0)));
  }
  return make_level_set(grid);
}

LevelSet make_cube() {
  constexpr double kHalf = 30.4, kBand = 3.0;
  auto grid = openvdb::FloatGrid::create(float(kBand));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  for (const Coord& at : openvdb::CoordBBox(Coord(-36), Coord(36))) {
    double outside = 0.0, nearest = -kHalf;
    for (int axis = 0; axis < 3; ++axis) {
      const double d = std::abs(at[axis]) - kHalf;
      outside += std::max(0.0, d) * std::max(0.0, d);
      nearest = std::max(nearest, d);
    }
    const double distance = nearest > 0.0 ? std::sqrt(outside) : nearest;
    if (std::fabs(distance) < kBand)
      grid->tree().setValueOn(at, float(distance));
    else if (distance < 0.0)
      grid->tree().setValueOff(at, -float(kBand));
  }
  return make_level_set(grid);
}

}  // namespace

LevelSet make_volume_stand_in(const std::string& name) {
  initialize_openvdb();
  return name == "scan" ? make_scan() : name == "fog" ? make_fog() : make_cube();
}

}  // namespace hermesh
