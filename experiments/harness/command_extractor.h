// Anybody's method as an extractor: a program that reads a mesh or a volume from a file and writes a mesh, in whatever
// language, judged and timed like ours.
#pragma once

#include <string>
#include <string_view>

#include "algorithms/core/variant.h"

namespace hermesh {

/// Figures that such an extractor leaves in its context: the program's own time, and the peak of its resident memory, it and
/// what it started counted each by itself.
inline constexpr std::string_view kCommandSeconds = "command_seconds", kCommandPeakBytes = "command_peak_bytes";

/// An extractor that promises nothing and runs `command` by the shell, with these words replaced:
///   {in}      the input's polygons as a PLY file; {in.obj}, {in.stl}, {in.off} in these formats
///   {volume}  the level set as a .vdb file, grid `sdf`
///   {out}     the PLY file that the program has to write; {out.obj} and so on in these formats
///   {voxel}   voxel size, world units
///   {threads} number of threads
/// A program that ends with another exit code than 0, or writes no mesh, is a failure whose sentence ends with the last line
/// that it printed.
/// @throws Error if the command has no {out}, or a word in braces that is none of these.
Extractor command_extractor(const std::string& name, const std::string& command);

}  // namespace hermesh
