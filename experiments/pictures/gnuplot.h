// Scripts of gnuplot, drawn.
#pragma once

#include <filesystem>
#include <iosfwd>

namespace hermesh {

/// Runs the script STEM.gp in its folder, which draws STEM.png, STEM.pdf and STEM.svg. The PDF gets a fixed
/// date, so that the same script gives the same bytes. The stream is told what was drawn, or that gnuplot is
/// missing or failed.
/// @throws Error if the PDF cannot be written, or has no date.
void draw_with_gnuplot(const std::filesystem::path& stem, std::ostream& out);

}  // namespace hermesh
