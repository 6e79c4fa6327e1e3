// Shaded pictures of meshes from one camera, with wireframe close-ups. Embree traces the rays, Cairo draws.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Direction of the camera in degrees. The y axis points up in every picture.
struct Viewpoint {
  double azimuth = 29.0;    ///< 0 looks at the box's +z side, 90 at its +x side
  double elevation = 20.0;  ///< above the horizon
};

/// The square region that the close-up shows.
struct CloseUp {
  std::array<double, 3> centre{0.5, 0.5, 0.5};  ///< along x, y and z of the box, 0 to 1
  double size = 0.12;  ///< side of the square, as a fraction of the box's longest side
  bool edges = true;   ///< true if the polygons' edges are drawn
};

struct Picture {
  std::string label;                  ///< bold
  std::vector<std::string> captions;  ///< one or more lines each
  std::function<PolygonMesh()> load;  ///< called once, so that only one mesh at a time is in memory
};

struct Sheet {
  std::string title, subtitle;
  Bounds frame;  ///< world units; the camera looks at this box
  CloseUp close_up;
  Viewpoint viewpoint;
  std::vector<Picture> pictures;
  int cell_pixels = 400;  ///< width of one picture
  int columns = 5;        ///< pictures side by side before the next row begins
};

/// Draws all meshes from one camera on one sheet, a PNG file that is written atomically: for each, the whole
/// object shaded and a close-up with the polygons' edges (without the diagonals of quads). Faces seen from
/// behind are red, an empty mesh is labelled "empty". Equal sheets give equal pixels at any number of
/// threads.
/// @throws Error if the path cannot be written; Cancelled.
void render_sheet(const std::filesystem::path& png, Sheet sheet, RunContext& context);

}  // namespace hermesh
