// Sheets with text and pictures, drawn by Cairo.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "experiments/pictures/ray_scene.h"

struct _cairo_surface;
struct _cairo;

namespace hermesh {

/// A colour, 0 to 1 each.
struct Tone {
  double red, green, blue;
};
inline constexpr Tone kPaper{1.0, 1.0, 1.0}, kInk{0.11, 0.13, 0.17}, kQuiet{0.38, 0.41, 0.46},
    kMark{0.85, 0.33, 0.16};

/// Distances and font sizes of all sheets, in pixels.
inline constexpr double kMargin = 24, kGap = 14, kTitleSize = 22, kSubtitleSize = 13, kLabelSize = 15,
                        kCaptionSize = 12.5;

/// A Cairo surface with its context; text is drawn from its base line. Positions and sizes are in pixels, y
/// down.
class Canvas {
 public:
  /// Creates a white canvas. @throws Error for a size that Cairo does not support.
  Canvas(int width, int height);

  /// Shortens the text with an ellipsis if it is wider than `room` pixels.
  void text(double x, double y, std::string words, double size, Tone colour, double room, bool bold = false);
  /// Breaks a text between words into lines of at most `room` pixels, or a single longer word.
  std::vector<std::string> lines(const std::string& text, double size, double room);
  /// Draws a bold label and caption lines below it.
  void captions(double x, double y, const std::string& label, const std::vector<std::string>& lines,
                double room);
  void image(double x, double y, const Image& picture);
  /// Draws the outline of a rectangle, with the line centred on it.
  void frame(double x, double y, double width, double height, Tone colour, double line);
  void box(double x, double y, double width, double height, Tone colour);
  /// Writes the file atomically. @throws Error if the path cannot be written.
  void write(const std::filesystem::path& png) const;

 private:
  void font(double size, bool bold);
  void tone(Tone t);
  double width_of(const std::string& words) const;

  std::unique_ptr<_cairo_surface, void (*)(_cairo_surface*)> surface_;
  std::unique_ptr<_cairo, void (*)(_cairo*)> cairo_;
};

/// Returns the captions broken into lines of at most `room` pixels.
std::vector<std::string> broken_captions(const std::vector<std::string>& captions, double room);
/// Returns the height of a label with this number of caption lines.
double captions_height(std::size_t lines);
/// Returns as few rows as the widest sheet needs, and the evenly filled columns: seven pictures are 4 + 3.
struct SheetGrid {
  int rows, columns;
};
SheetGrid sheet_grid(std::size_t pictures, int most_columns);

/// A picture with a bold label and captions, one or more lines each.
struct Panel {
  std::string label;
  std::vector<std::string> captions;
  Image image;
};

/// The meaning of a colour of the panels.
struct LegendEntry {
  Tone colour;
  std::string meaning;
};

struct PanelSheet {
  std::string title, subtitle;
  std::vector<LegendEntry> legend = {};  ///< on one line above the panels
  std::vector<Panel> panels;
  int columns = 4;  ///< panels side by side before the next row begins
};

/// Draws the panels on one sheet, a PNG file that is written atomically. Equal sheets give equal pixels.
/// @throws Error if the path cannot be written.
void draw_panels(const std::filesystem::path& png, PanelSheet sheet);

}  // namespace hermesh
