// Rendering of a mesh with parallel rays by Embree.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// A parallel projection. `right`, `up` and `towards` (from the object to the viewer) are orthonormal; x and
/// y are world units along right and up.
struct Camera {
  Eigen::Vector3d right, up, towards;
};

/// Returns the camera in a direction in degrees, with the y axis up: azimuth 0 looks at the +z side, 90 at
/// the +x side; elevation within ±89.
Camera make_camera(double azimuth, double elevation);

struct View {
  Eigen::Vector3d centre;         ///< world units; the middle of the image
  double world_width = 1.0;       ///< world units across the image
  int width = 400, height = 400;  ///< pixels
  bool edges = false;             ///< draw the polygons' edges
  double occlusion_radius = 0.1;  ///< world units; distance up to which a surface darkens
};

/// An opaque picture: rows from the top, pixels 0xffrrggbb (CAIRO_FORMAT_RGB24).
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;
};

/// The first hit of the ray through the middle of a pixel.
struct Glimpse {
  bool hit = false;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< of unit length, turned to the viewer
  Eigen::Vector3d place = Eigen::Vector3d::Zero();   ///< world units
};

class RayScene {
 public:
  /// Refers to the mesh. @throws Error if Embree cannot be started or runs out of memory.
  explicit RayScene(const PolygonMesh& mesh);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Renders each face in one tone under a key light and one at the viewer, with ambient occlusion and 2×2
  /// samples per pixel. Deterministic at any number of threads. @throws Cancelled.
  Image render(const Camera& camera, const View& view, RunContext& context) const;

  /// Returns the hits of the pixels, rows from the top. Deterministic at any number of threads. @throws
  /// Cancelled.
  std::vector<Glimpse> glimpses(const Camera& camera, const View& view, RunContext& context) const;

 private:
  struct Machinery;
  std::unique_ptr<Machinery> machinery_;
};

}  // namespace hermesh
