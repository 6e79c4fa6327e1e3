// Standard input and output instead of files, for pipes.
#pragma once

#include <memory>

#include "algorithms/io/atomic_file.h"
#include "experiments/cli/session.h"

namespace hermesh::cli {

/// Copies the standard input to a temporary file before the command runs, and the finished output to the
/// standard output afterwards, if the command reads or writes "-". So a command sees only files, a truncated
/// stream is rejected like a truncated file, and a command that fails writes nothing. During the lifetime of
/// the object everything that is printed goes to the standard error if the standard output is taken.
class Streams {
 public:
  /// Copies the standard input, and names the temporary files in `files` and for Session::named().
  /// @throws UsageError for an impossible use of streams; Error if the standard input is empty or cannot be
  /// read.
  Streams(CommandFiles& files, Session& session);
  ~Streams();
  Streams(const Streams&) = delete;
  Streams& operator=(const Streams&) = delete;

  /// Writes the output of the command to the standard output, if requested. @throws Error if the reader has
  /// closed it.
  void deliver();

 private:
  void take_input(std::string& input);
  void take_output();

  CommandFiles& files_;
  Session& session_;
  std::unique_ptr<AtomicFolder> folder_;  ///< never committed, so that it is removed
  int standard_output_ = -1;
};

/// Opens /dev/null instead of each closed standard stream, so that no file or pipe gets its number. It is
/// opened in the opposite direction, so that reading from the input and writing to the outputs fail as on a
/// closed stream.
void occupy_closed_streams() noexcept;

/// Returns the file extension of the format that the unpacked first bytes of a mesh, a .vdb or a NIfTI file
/// indicate, such as ".ply"; ".obj" if they indicate no other.
std::string ending_of(std::string_view first_bytes);

}  // namespace hermesh::cli
