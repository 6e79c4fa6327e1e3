#include "experiments/pictures/viewpoint.h"

#include <algorithm>
#include <cmath>

#include "experiments/pictures/ray_scene.h"

namespace hermesh {
namespace {

constexpr int kPixels = 160;  // of a look, enough for the share of a surface that is seen, and quick

View look(const Bounds& box) {
  return {.centre = 0.5 * (box.lower + box.upper),
          .world_width = std::max(box.size().norm(), 1e-30),
          .width = kPixels,
          .height = kPixels};
}

}  // namespace

Viewpoint open_viewpoint(const PolygonMesh& mesh, RunContext& context) {
  Viewpoint best;
  if (mesh.empty()) return best;
  const RayScene scene(mesh);
  const View view = look(bounds(mesh));
  double most = 0.0;
  for (const double elevation : {10.0, 25.0, 45.0})
    for (int turn = 0; turn < 12; ++turn) {
      // Half a step off the axes: a box seen straight from a side looks flat.
      const double azimuth = 30.0 * turn + 15.0;
      const Camera camera = make_camera(azimuth, elevation);
      const Eigen::Vector3f towards = camera.towards.cast<float>();
      double area = 0.0;
      for (const Glimpse& glimpse : scene.glimpses(camera, view, context))
        if (glimpse.hit) area += 1.0 / std::max(0.25, double(glimpse.normal.dot(towards)));
      // What differs by less than the pixels tell is equal.
      if (area > 1.002 * most) {
        most = area;
        best = {azimuth, elevation};
      }
    }
  return best;
}

CloseUp busy_close_up(const PolygonMesh& mesh, const Bounds& frame, const Viewpoint& viewpoint, double size,
                      RunContext& context) {
  CloseUp close_up;
  close_up.size = size;
  if (mesh.empty() || frame.empty()) return close_up;
  const View view = look(frame);
  const Camera camera = make_camera(viewpoint.azimuth, viewpoint.elevation);
  const std::vector<Glimpse> seen = RayScene(mesh).glimpses(camera, view, context);
  const auto at = [&](int x, int y) -> const Glimpse& {
    return seen[static_cast<std::size_t>(y) * kPixels + x];
  };
  const int side = std::max(2, static_cast<int>(size * frame.size().maxCoeff() / view.world_width * kPixels));
  double most = -1.0;
  for (int top = 0; top + side <= kPixels; ++top)
    for (int left = 0; left + side <= kPixels; ++left) {
      if (!at(left + side / 2, top + side / 2).hit) continue;
      double turning = 0.0;
      int empty = 0;
      for (int y = top; y < top + side; ++y)
        for (int x = left; x < left + side; ++x) {
          if (!at(x, y).hit) {
            ++empty;
            continue;
          }
          for (const Glimpse* other : {x > left ? &at(x - 1, y) : nullptr, y > top ? &at(x, y - 1) : nullptr})
            if (other && other->hit)
              turning += std::acos(std::clamp(double(at(x, y).normal.dot(other->normal)), -1.0, 1.0));
        }
      if (10 * empty > side * side || turning <= most) continue;
      most = turning;
      const Eigen::Vector3d fraction = (at(left + side / 2, top + side / 2).place - frame.lower)
                                           .cwiseQuotient(frame.size().cwiseMax(1e-30));
      close_up.centre = {fraction.x(), fraction.y(), fraction.z()};
    }
  return close_up;
}

}  // namespace hermesh
