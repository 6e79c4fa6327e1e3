#include "experiments/pictures/render.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "experiments/pictures/canvas.h"
#include "experiments/pictures/ray_scene.h"

namespace hermesh {
namespace {

/// Positions on the sheet, in pixels, and the two views that all pictures share.
struct Layout {
  int columns, blocks, width, height;
  double header, text_height, block_height;
  View whole, close;
  double close_x, close_y, close_side;  ///< the close-up's outline inside the whole view
};

/// Returns the extent of a box along a direction.
std::pair<double, double> extent(const Bounds& box, const Eigen::Vector3d& direction) {
  double lower = std::numeric_limits<double>::infinity(), upper = -lower;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner(i & 1 ? box.upper.x() : box.lower.x(), i & 2 ? box.upper.y() : box.lower.y(),
                                 i & 4 ? box.upper.z() : box.lower.z());
    lower = std::min(lower, corner.dot(direction));
    upper = std::max(upper, corner.dot(direction));
  }
  return {lower, upper};
}

void set_views(Layout& layout, const Sheet& sheet, const Camera& camera) {
  const double longest = std::max(sheet.frame.size().maxCoeff(), 1e-30);
  const auto [left, right] = extent(sheet.frame, camera.right);
  const auto [bottom, top] = extent(sheet.frame, camera.up);
  const int pixels = sheet.cell_pixels;
  // A flat object gets a flat picture; a tall one is fitted into a square.
  const double aspect = std::clamp((top - bottom) / std::max(right - left, 1e-30), 0.6, 1.0);
  View& whole = layout.whole;
  whole.width = pixels;
  whole.height = static_cast<int>(std::lround(pixels * aspect));
  whole.world_width = 1.05 * std::max(right - left, (top - bottom) / aspect);
  whole.centre = 0.5 * (sheet.frame.lower + sheet.frame.upper);
  whole.occlusion_radius = 0.12 * longest;

  View& close = layout.close;
  close.width = close.height = pixels;
  close.world_width = sheet.close_up.size * longest;
  const Eigen::Vector3d fraction(sheet.close_up.centre[0], sheet.close_up.centre[1],
                                 sheet.close_up.centre[2]);
  close.centre = sheet.frame.lower + sheet.frame.size().cwiseProduct(fraction);
  close.occlusion_radius = 0.06 * longest;
  close.edges = sheet.close_up.edges;

  const double pixel = whole.world_width / pixels;
  const Eigen::Vector3d offset = close.centre - whole.centre;
  layout.close_side = close.world_width / pixel;
  layout.close_x = 0.5 * whole.width + offset.dot(camera.right) / pixel - 0.5 * layout.close_side;
  layout.close_y = 0.5 * whole.height - offset.dot(camera.up) / pixel - 0.5 * layout.close_side;
}

Layout plan(const Sheet& sheet, const Camera& camera) {
  Layout layout{};
  set_views(layout, sheet, camera);
  const SheetGrid grid = sheet_grid(sheet.pictures.size(), sheet.columns);
  layout.blocks = grid.rows, layout.columns = grid.columns;
  std::size_t lines = 0;
  for (const Picture& picture : sheet.pictures) lines = std::max(lines, picture.captions.size());
  layout.header = kMargin + kTitleSize + (sheet.subtitle.empty() ? 0 : kSubtitleSize + 10) + 18;
  layout.text_height = captions_height(lines);
  layout.block_height = layout.text_height + layout.whole.height + kGap / 2 + layout.close.height + 2 * kGap;
  layout.width =
      static_cast<int>(2 * kMargin + layout.columns * sheet.cell_pixels + (layout.columns - 1) * kGap);
  layout.height = static_cast<int>(layout.header + layout.blocks * layout.block_height + kMargin - kGap);
  return layout;
}

void draw_picture(Canvas& canvas, const Picture& picture, const Layout& layout, const Camera& camera,
                  double x, double y, RunContext& context) {
  const int pixels = layout.whole.width;
  canvas.captions(x, y, picture.label, picture.captions, pixels);
  const PolygonMesh mesh = picture.load();
  const RayScene scene(mesh);
  const double top = y + layout.text_height, middle = top + layout.whole.height + kGap / 2;
  canvas.image(x, top, scene.render(camera, layout.whole, context));
  canvas.image(x, middle, scene.render(camera, layout.close, context));
  if (mesh.empty())
    canvas.text(x + 0.5 * pixels - 24, top + 0.5 * layout.whole.height, "empty", 18, kMark, pixels, true);
  canvas.frame(x + layout.close_x, top + layout.close_y, layout.close_side, layout.close_side, kMark, 1.5);
  canvas.frame(x + 0.75, middle + 0.75, pixels - 1.5, layout.close.height - 1.5, kMark, 1.5);
}

}  // namespace

void render_sheet(const std::filesystem::path& png, Sheet sheet, RunContext& context) {
  const Stage stage(context, "picture");
  for (Picture& picture : sheet.pictures)
    picture.captions = broken_captions(picture.captions, sheet.cell_pixels);
  const Camera camera = make_camera(sheet.viewpoint.azimuth, sheet.viewpoint.elevation);
  const Layout layout = plan(sheet, camera);
  Canvas canvas(layout.width, layout.height);
  const double room = layout.width - 2 * kMargin;
  canvas.text(kMargin, kMargin + kTitleSize, sheet.title, kTitleSize, kInk, room, true);
  canvas.text(kMargin, kMargin + kTitleSize + kSubtitleSize + 10, sheet.subtitle, kSubtitleSize, kQuiet,
              room);
  for (std::size_t i = 0; i < sheet.pictures.size(); ++i) {
    const double column = static_cast<double>(i % layout.columns),
                 block = static_cast<double>(i / layout.columns);
    draw_picture(canvas, sheet.pictures[i], layout, camera, kMargin + column * (sheet.cell_pixels + kGap),
                 layout.header + block * layout.block_height, context);
    context.progress("picture", static_cast<double>(i + 1) / static_cast<double>(sheet.pictures.size()));
  }
  canvas.write(png);
}

}  // namespace hermesh
