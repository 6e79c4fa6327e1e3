// A sheet of paper to put text and pictures on, by Cairo, and sheets of pictures side by side.
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

/// Distances and sizes of type that all sheets share, in pixels.
inline constexpr double kMargin = 24, kGap = 14, kTitleSize = 22, kSubtitleSize = 13, kLabelSize = 15,
                        kCaptionSize = 12.5;

/// A Cairo surface with its context; text is drawn from its base line. Positions and sizes are in pixels, y
/// downwards.
class Canvas {
 public:
  /// White paper. @throws Error for a size that Cairo does not take.
  Canvas(int width, int height);

  /// Shortens the text with an ellipsis where it is wider than `room` pixels.
  void text(double x, double y, std::string words, double size, Tone colour, double room, bool bold = false);
  /// Lines no wider than `room` pixels, broken between words; a word that is wider has one to itself.
  std::vector<std::string> lines(const std::string& text, double size, double room);
  void image(double x, double y, const Image& picture);
  /// The outline of a rectangle, its line centred on it.
  void frame(double x, double y, double width, double height, Tone colour, double line);
  void box(double x, double y, double width, double height, Tone colour);
  /// Written aside and renamed. @throws Error if the path cannot be written.
  void write(const std::filesystem::path& png) const;

 private:
  void font(double size, bool bold);
  void tone(Tone t);
  double width_of(const std::string& words) const;

  std::unique_ptr<_cairo_surface, void (*)(_cairo_surface*)> surface_;
  std::unique_ptr<_cairo, void (*)(_cairo*)> cairo_;
};

/// A picture with what is to be said of it.
struct Panel {
  std::string label;                  ///< bold
  std::vector<std::string> captions;  ///< a few figures below it, a line each, or more where one is too wide
  Image image;
};

/// What a colour of the panels means.
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

/// Draws the panels on one sheet, a PNG file. The same sheet gives the same pixels. Written aside and
/// renamed.
/// @throws Error if the path cannot be written.
void draw_panels(const std::filesystem::path& png, PanelSheet sheet);

}  // namespace hermesh
