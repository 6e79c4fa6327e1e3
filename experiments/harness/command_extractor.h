// External programs as extractors: they read a mesh or a volume from a file and write a mesh, which is
// validated and timed like ours.
#pragma once

#include <string>
#include <string_view>

#include "algorithms/core/error.h"
#include "algorithms/core/variant.h"

namespace hermesh {

/// Values that such an extractor leaves in its context: the time and the peak of memory that count, as
/// reported by the program (see below) or else those of its whole process; and always these two of the
/// process with its children.
inline constexpr std::string_view kCommandSeconds = "command_seconds",
                                  kCommandPeakBytes = "command_peak_bytes",
                                  kProcessSeconds = "process_seconds",
                                  kProcessPeakBytes = "process_peak_bytes";

/// Thrown if the program of a command is not installed.
class ProgramAbsent : public Error {
 public:
  using Error::Error;
};

/// Returns an extractor without guarantees that runs `command` by the shell, with these words replaced:
///   {in}      the input's polygons as a PLY file; {in.obj}, {in.stl}, {in.off} in these formats
///   {volume}  the level set as a .vdb file, grid `sdf`
///   {uniform} our uniform mesh of that level set, by marching cubes, as a PLY file ({uniform.obj} and so
///             on): the input of methods that simplify meshes. The time to make it does not count
///   {out}     the PLY file that the program has to write; {out.obj} and so on in these formats
///   {voxel}   voxel size, world units; {0.25 voxel} and so on is a multiple of it
///   {threads} number of threads
///   {source}  the directory of the project's sources, {build} that of its build
/// A program may print lines "seconds NUMBER" and "bytes NUMBER": the time of its work from a mesh in memory
/// to a mesh in memory, and the peak of its memory beyond what was resident before that work, as our own
/// methods are measured. They replace those of the process, which include the start of an interpreter and the
/// reading of files. An exit code other than 0 or a missing mesh is a failure whose message ends with the
/// last printed line. Exit code 77 means that a dependency is not installed, with the last line as the
/// reason, and 127 that the shell did not find the program; both throw ProgramAbsent.
/// @throws Error if the command has no {out}, or an unknown word in braces.
Extractor command_extractor(const std::string& name, const std::string& command);

}  // namespace hermesh
