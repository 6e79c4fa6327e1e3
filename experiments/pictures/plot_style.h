// How the curves of a plot are told apart: by colour and by mark.
#pragma once

#include <cstddef>
#include <string>

namespace hermesh {

/// Colours that the colour-blind tell apart (Okabe and Ito, 2008, with grey and black in place of yellow,
/// which white paper swallows). The page of results (page.css) has the same ones in the same order, lighter
/// where the page is dark.
inline constexpr std::size_t kPlotColours = 8;
/// gnuplot's marks of its Cairo and SVG terminals, full ones first.
inline constexpr std::size_t kPlotMarks = 15;
/// So many curves differ in their pair of colour and mark: the numbers of both have no common divisor.
inline constexpr std::size_t kPlotStyles = kPlotColours * kPlotMarks;

struct CurveStyle {
  std::string colour;  ///< "#rrggbb"
  int mark;            ///< gnuplot's number of a point type
};
/// The look of a curve by its number. @throws Error from kPlotStyles on, since a pair would come again.
CurveStyle curve_style(std::size_t number);

}  // namespace hermesh
