#include "experiments/pictures/fog.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kStep = 0.5;        // voxels
constexpr double kShadowStep = 1.0;  // voxels
constexpr int kShadowEvery = 2;      // voxels between two points whose shadow is marched
constexpr double kOpaque = 0.003;    // less than half a step of an 8-bit channel passes

double trilinear(const std::vector<float>& values, const Vector3i& size, const Vector3d& at) {
  int low[3];
  double part[3];
  for (int a = 0; a < 3; ++a) {
    const double floor = std::floor(at[a]);
    low[a] = static_cast<int>(floor);
    part[a] = at[a] - floor;
    if (low[a] < -1 || low[a] >= size[a]) return 0.0;
  }
  const auto value = [&](int x, int y, int z) -> double {
    if (x < 0 || y < 0 || z < 0 || x >= size.x() || y >= size.y() || z >= size.z()) return 0.0;
    return values[(static_cast<std::size_t>(x) * size.y() + y) * size.z() + z];
  };
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner >> 2, dy = corner >> 1 & 1, dz = corner & 1;
    const double weight =
        (dx ? part[0] : 1 - part[0]) * (dy ? part[1] : 1 - part[1]) * (dz ? part[2] : 1 - part[2]);
    if (weight > 0.0) sum += weight * value(low[0] + dx, low[1] + dy, low[2] + dz);
  }
  return sum;
}

std::uint32_t packed(const Vector3d& linear) {
  const auto byte = [](double c) {
    const double x = std::clamp(c, 0.0, 1.0);
    return static_cast<std::uint32_t>(
        (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1.0 / 2.4) - 0.055) * 255.0 + 0.5);
  };
  return 0xff000000u | byte(linear.x()) << 16 | byte(linear.y()) << 8 | byte(linear.z());
}

}  // namespace

FogScene::FogScene(const LevelSet& fog, const RunContext& context) {
  const openvdb::FloatGrid& grid = *fog.grid().grid;
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (box.empty()) throw Error("a fog without active samples cannot be drawn");
  const openvdb::Vec3d world = grid.transform().indexToWorld(box.min());
  lower_ = {world.x(), world.y(), world.z()};
  voxel_ = fog.voxel_size();
  const openvdb::Coord size = box.dim();
  size_ = {size.x(), size.y(), size.z()};
  values_.resize(static_cast<std::size_t>(size.x()) * size.y() * size.z());
  parallel_blocks(static_cast<std::size_t>(size.x()), context, [&](std::size_t x) {
    const auto accessor = grid.getConstAccessor();
    float* to = &values_[x * size.y() * size.z()];
    for (int y = 0; y < size.y(); ++y)
      for (int z = 0; z < size.z(); ++z)
        *to++ = accessor.getValue(box.min().offsetBy(static_cast<int>(x), y, z));
  });
}

double FogScene::density(const Vector3d& index) const { return trilinear(values_, size_, index); }

std::pair<double, double> FogScene::stretch(const Vector3d& index, const Vector3d& direction) const {
  double first = -std::numeric_limits<double>::infinity(), last = -first;
  for (int a = 0; a < 3; ++a) {
    const double low = -1.0, high = size_[a];
    if (direction[a] == 0.0) {
      if (index[a] < low || index[a] > high) return {1.0, 0.0};
      continue;
    }
    const double t = (low - index[a]) / direction[a], u = (high - index[a]) / direction[a];
    first = std::max(first, std::min(t, u));
    last = std::min(last, std::max(t, u));
  }
  return {first, last};
}

double FogScene::transmittance(const Vector3d& point, const Vector3d& direction, double extinction) const {
  const Vector3d along = direction.normalized(), from = to_index(point);
  const auto [first, last] = stretch(from, along);
  double depth = 0.0;
  for (double t = first + 0.5 * kStep; t < last; t += kStep) depth += density(from + t * along);
  return std::exp(-extinction * depth * kStep * voxel_);
}

std::vector<float> FogScene::shadows(const FogLook& look, RunContext& context) const {
  const Vector3d light = look.towards_light.normalized();
  const Vector3i size = (size_.array() + kShadowEvery - 1) / kShadowEvery + 1;
  std::vector<float> result(static_cast<std::size_t>(size.x()) * size.y() * size.z(), 1.0f);
  parallel_blocks(static_cast<std::size_t>(size.x()), context, [&](std::size_t x) {
    for (int y = 0; y < size.y(); ++y)
      for (int z = 0; z < size.z(); ++z) {
        const Vector3d from = kShadowEvery * Vector3d(double(x), y, z);
        const double last = stretch(from, light).second;
        double depth = 0.0;
        for (double t = 0.5 * kShadowStep; t < last; t += kShadowStep) depth += density(from + t * light);
        result[(x * size.y() + y) * size.z() + z] =
            static_cast<float>(std::exp(-look.extinction * depth * kShadowStep * voxel_));
      }
  });
  return result;
}

Image FogScene::render(const Camera& camera, const View& view, const FogLook& look,
                       RunContext& context) const {
  const Stage stage(context, "fog");
  const std::vector<float> light = shadows(look, context);
  const Vector3i light_size = (size_.array() + kShadowEvery - 1) / kShadowEvery + 1;
  Image image;
  image.width = view.width;
  image.height = view.height;
  image.pixels.resize(static_cast<std::size_t>(view.width) * view.height);
  const double pixel = view.world_width / view.width;
  // A blue sky that whitens downwards, so that white fog stands out from it.
  const Vector3d top(0.16, 0.33, 0.62), bottom(0.50, 0.66, 0.84), white(0.98, 0.98, 1.0);
  parallel_blocks(static_cast<std::size_t>(view.height), context, [&](std::size_t row) {
    const double down = (double(row) + 0.5) / view.height;
    for (int column = 0; column < view.width; ++column) {
      const Vector3d place = view.centre + (column + 0.5 - 0.5 * view.width) * pixel * camera.right +
                             (0.5 * view.height - double(row) - 0.5) * pixel * camera.up;
      const Vector3d from = to_index(place), along = -camera.towards;
      const auto [first, last] = stretch(from, along);
      double passes = 1.0, scattered = 0.0;
      for (double t = first + 0.5 * kStep; t < last && passes > kOpaque; t += kStep) {
        const Vector3d at = from + t * along;
        const double here = density(at);
        if (here <= 0.0) continue;
        const double kept = std::exp(-look.extinction * here * kStep * voxel_);
        const double lit =
            look.ambient + (1.0 - look.ambient) * trilinear(light, light_size, at / kShadowEvery);
        scattered += passes * (1.0 - kept) * lit;
        passes *= kept;
      }
      const Vector3d sky = top + down * (bottom - top);
      image.pixels[row * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(column)] =
          packed(passes * sky + scattered * white);
    }
  });
  return image;
}

}  // namespace hermesh
