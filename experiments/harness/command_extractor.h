// Anybody's method as an extractor: a program that reads a mesh or a volume from a file and writes a mesh, in
// whatever language, judged and timed like ours.
#pragma once

#include <string>
#include <string_view>

#include "algorithms/core/error.h"
#include "algorithms/core/variant.h"

namespace hermesh {

/// Figures that such an extractor leaves in its context: the time and the peak of memory that count, as the
/// program says them (see below) or else those of its whole process; and these two of the process in any
/// case, it and what it started counted each by itself.
inline constexpr std::string_view kCommandSeconds = "command_seconds",
                                  kCommandPeakBytes = "command_peak_bytes",
                                  kProcessSeconds = "process_seconds",
                                  kProcessPeakBytes = "process_peak_bytes";

/// Thrown where the program that a command names is not installed, which is nobody's failure.
class ProgramAbsent : public Error {
 public:
  using Error::Error;
};

/// An extractor that promises nothing and runs `command` by the shell, with these words replaced:
///   {in}      the input's polygons as a PLY file; {in.obj}, {in.stl}, {in.off} in these formats
///   {volume}  the level set as a .vdb file, grid `sdf`
///   {uniform} our uniform mesh of that level set, by marching cubes, as a PLY file (and {uniform.obj} and so
///   on): what a
///             method that simplifies meshes starts from. The time to make it does not count
///   {out}     the PLY file that the program has to write; {out.obj} and so on in these formats
///   {voxel}   voxel size, world units; {0.25 voxel} and so on is a multiple of it
///   {threads} number of threads
///   {source}  the folder of the project's sources, {build} that of its build
/// A program may print lines "seconds NUMBER" and "bytes NUMBER": the time of its work from a mesh in memory
/// to a mesh in memory, and the peak of its memory beyond what was resident before that work, which is how
/// our own variants are measured. They count in place of those of the process, where the start of an
/// interpreter and the reading of files would count too. A program that ends with another exit code than 0,
/// or writes no mesh, is a failure whose sentence ends with the last line that it printed. One that ends with
/// 77 says that something it needs is not installed; its last line is the reason. 127 is the shell's word for
/// a program that it does not find. Both are ProgramAbsent.
/// @throws Error if the command has no {out}, or a word in braces that is none of these.
Extractor command_extractor(const std::string& name, const std::string& command);

}  // namespace hermesh
