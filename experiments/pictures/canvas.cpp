#include "experiments/pictures/canvas.h"

#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <sstream>

#include "algorithms/io/atomic_file.h"

namespace hermesh {
namespace {

/// Drops a UTF-8 character, which may have several bytes.
void drop_last_letter(std::string& words) {
  while (!words.empty() && (static_cast<unsigned char>(words.back()) & 0xc0) == 0x80) words.pop_back();
  if (!words.empty()) words.pop_back();
}

}  // namespace

Canvas::Canvas(int width, int height)
    : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height), cairo_surface_destroy),
      cairo_(cairo_create(surface_.get()), cairo_destroy) {
  if (cairo_status(cairo_.get()) != CAIRO_STATUS_SUCCESS)
    throw Error("a picture of " + std::to_string(width) + " by " + std::to_string(height) +
                " pixels cannot be made; show fewer variants");
  tone(kPaper);
  cairo_paint(cairo_.get());
}

void Canvas::text(double x, double y, std::string words, double size, Tone colour, double room, bool bold) {
  tone(colour);
  font(size, bold);
  if (width_of(words) > room) {
    while (!words.empty() && width_of(words + "…") > room) drop_last_letter(words);
    words += "…";
  }
  cairo_move_to(cairo_.get(), x, y);
  cairo_show_text(cairo_.get(), words.c_str());
}

std::vector<std::string> Canvas::lines(const std::string& text, double size, double room) {
  font(size, false);
  std::vector<std::string> lines;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!lines.empty() && width_of(lines.back() + " " + word) <= room)
      lines.back() += " " + word;
    else
      lines.push_back(word);
  }
  return lines;
}

void Canvas::captions(double x, double y, const std::string& label, const std::vector<std::string>& lines,
                      double room) {
  text(x, y + kLabelSize, label, kLabelSize, kInk, room, true);
  double line = y + kLabelSize + 8 + kCaptionSize;
  for (const std::string& caption : lines) {
    text(x, line, caption, kCaptionSize, kQuiet, room);
    line += kCaptionSize + 5;
  }
}

void Canvas::image(double x, double y, const Image& picture) {
  const int stride = cairo_format_stride_for_width(CAIRO_FORMAT_RGB24, picture.width);
  const std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> source(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, picture.width, picture.height), cairo_surface_destroy);
  unsigned char* rows = cairo_image_surface_get_data(source.get());
  if (!rows) throw Error("a picture of " + std::to_string(picture.width) + " pixels across cannot be made");
  for (int row = 0; row < picture.height; ++row)
    std::copy_n(picture.pixels.data() + static_cast<std::size_t>(row) * picture.width, picture.width,
                reinterpret_cast<std::uint32_t*>(rows + static_cast<std::size_t>(row) * stride));
  cairo_surface_mark_dirty(source.get());
  cairo_set_source_surface(cairo_.get(), source.get(), x, y);
  cairo_paint(cairo_.get());
}

void Canvas::frame(double x, double y, double width, double height, Tone colour, double line) {
  tone(colour);
  cairo_set_line_width(cairo_.get(), line);
  cairo_rectangle(cairo_.get(), x, y, width, height);
  cairo_stroke(cairo_.get());
}

void Canvas::box(double x, double y, double width, double height, Tone colour) {
  tone(colour);
  cairo_rectangle(cairo_.get(), x, y, width, height);
  cairo_fill(cairo_.get());
}

void Canvas::write(const std::filesystem::path& png) const {
  AtomicFile file(png);
  const cairo_status_t status = cairo_surface_write_to_png(surface_.get(), file.path().c_str());
  if (status != CAIRO_STATUS_SUCCESS)
    throw Error("cannot write the picture " + png.string() + ": " + cairo_status_to_string(status));
  file.commit();
}

void Canvas::font(double size, bool bold) {
  cairo_select_font_face(cairo_.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                         bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(cairo_.get(), size);
}

void Canvas::tone(Tone t) { cairo_set_source_rgb(cairo_.get(), t.red, t.green, t.blue); }

double Canvas::width_of(const std::string& words) const {
  cairo_text_extents_t extents;
  cairo_text_extents(cairo_.get(), words.c_str(), &extents);
  return extents.x_advance;
}

std::vector<std::string> broken_captions(const std::vector<std::string>& captions, double room) {
  Canvas ruler(1, 1);
  std::vector<std::string> broken;
  for (const std::string& caption : captions)
    std::ranges::move(ruler.lines(caption, kCaptionSize, room), std::back_inserter(broken));
  return broken;
}

double captions_height(std::size_t lines) {
  return kLabelSize + 8 + static_cast<double>(lines) * (kCaptionSize + 5) + 4;
}

SheetGrid sheet_grid(std::size_t pictures, int most_columns) {
  const int count = std::max(1, static_cast<int>(pictures));
  const int rows = (count + most_columns - 1) / most_columns;
  return {rows, (count + rows - 1) / rows};
}

void draw_panels(const std::filesystem::path& png, PanelSheet sheet) {
  // Narrower panels would leave no room for captions.
  int cell_width = 260, cell_height = 1;
  for (const Panel& panel : sheet.panels) {
    cell_width = std::max(cell_width, panel.image.width);
    cell_height = std::max(cell_height, panel.image.height);
  }
  std::size_t caption_lines = 0;
  for (Panel& panel : sheet.panels) {
    panel.captions = broken_captions(panel.captions, cell_width);
    caption_lines = std::max(caption_lines, panel.captions.size());
  }
  const auto [blocks, columns] = sheet_grid(sheet.panels.size(), sheet.columns);
  const double text_height = captions_height(caption_lines);
  const double block_height = text_height + cell_height + kGap;
  const int width = static_cast<int>(2 * kMargin + columns * cell_width + (columns - 1) * kGap);
  const double room = width - 2 * kMargin;
  const std::vector<std::string> subtitle = Canvas(1, 1).lines(sheet.subtitle, kSubtitleSize, room);
  const double header = kMargin + kTitleSize + 10 +
                        static_cast<double>(subtitle.size()) * (kSubtitleSize + 5) +
                        (sheet.legend.empty() ? 0 : kCaptionSize + 14) + 8;
  Canvas canvas(width, static_cast<int>(header + blocks * block_height + kMargin));
  canvas.text(kMargin, kMargin + kTitleSize, sheet.title, kTitleSize, kInk, room, true);
  double y = kMargin + kTitleSize + 10;
  for (const std::string& line : subtitle) {
    canvas.text(kMargin, y + kSubtitleSize, line, kSubtitleSize, kQuiet, room);
    y += kSubtitleSize + 5;
  }
  const double share = room / static_cast<double>(std::max<std::size_t>(1, sheet.legend.size()));
  for (std::size_t i = 0; i < sheet.legend.size(); ++i) {
    const double x = kMargin + static_cast<double>(i) * share;
    canvas.box(x, y + 6, kCaptionSize, kCaptionSize, sheet.legend[i].colour);
    canvas.frame(x, y + 6, kCaptionSize, kCaptionSize, kQuiet, 0.8);
    canvas.text(x + kCaptionSize + 6, y + 6 + kCaptionSize - 1.5, sheet.legend[i].meaning, kCaptionSize, kInk,
                share - kCaptionSize - 12);
  }
  for (std::size_t i = 0; i < sheet.panels.size(); ++i) {
    const Panel& panel = sheet.panels[i];
    // Whole pixels, so that the pictures are not blurred.
    const double x = kMargin + static_cast<double>(static_cast<int>(i) % columns) * (cell_width + kGap);
    const double top = header + static_cast<double>(static_cast<int>(i) / columns) * block_height;
    const double picture = std::ceil(top + text_height);
    canvas.captions(x, top, panel.label, panel.captions, cell_width);
    canvas.image(x, picture, panel.image);
    canvas.frame(x, picture, panel.image.width, panel.image.height, kQuiet, 0.8);
  }
  canvas.write(png);
}

}  // namespace hermesh
