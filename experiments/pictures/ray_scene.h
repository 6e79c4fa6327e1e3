// A mesh seen by parallel rays: the part of the pictures that needs Embree.
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

/// The camera that looks at the scene from a direction in degrees, the y axis pointing up: azimuth 0 looks at
/// the +z side, 90 at the +x side; elevation within ±89.
Camera make_camera(double azimuth, double elevation);

struct View {
  Eigen::Vector3d centre;         ///< world units; the middle of the image
  double world_width = 1.0;       ///< world units across the image
  int width = 400, height = 400;  ///< pixels
  bool edges = false;             ///< draw the polygons' edges
  double occlusion_radius = 0.1;  ///< world units; how far away a surface still darkens
};

/// An opaque picture: rows from the top, pixels 0xffrrggbb, which Cairo calls CAIRO_FORMAT_RGB24.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;
};

/// What a ray through the middle of a pixel meets first.
struct Glimpse {
  bool hit = false;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< of unit length, turned to the viewer
  Eigen::Vector3d place = Eigen::Vector3d::Zero();   ///< world units
};

class RayScene {
 public:
  /// Keeps a reference to the mesh. @throws Error if Embree cannot be started or runs out of memory.
  explicit RayScene(const PolygonMesh& mesh);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// The picture of the mesh: each face in one tone (so that facets show) under a key light and one at the
  /// viewer, with ambient occlusion, 2×2 samples a pixel. Deterministic at any thread count. @throws
  /// Cancelled.
  Image render(const Camera& camera, const View& view, RunContext& context) const;

  /// What the pixels of the view see, rows from the top. Deterministic at any thread count. @throws
  /// Cancelled.
  std::vector<Glimpse> glimpses(const Camera& camera, const View& view, RunContext& context) const;

 private:
  struct Machinery;
  std::unique_ptr<Machinery> machinery_;
};

}  // namespace hermesh
