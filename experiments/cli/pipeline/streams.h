// Standard input and output in place of files, for pipes.
#pragma once

#include <memory>

#include "algorithms/io/atomic_file.h"
#include "experiments/cli/session.h"

namespace hermesh::cli {

/// Where a command reads or writes "-": the standard input is taken into a temporary file before the command
/// runs, and what the command wrote goes to the standard output behind it, whole. So a command sees files
/// alone, half of a stream is refused as half of a file is, and nothing goes out when the command fails.
/// While this lives, what anybody prints goes to the standard error if the standard output is taken.
class Streams {
 public:
  /// Takes the standard input in, and names the temporary files in `files` and for Session::named().
  /// @throws UsageError where streams cannot be meant so; Error if the standard input is empty or cannot be
  /// read.
  Streams(CommandFiles& files, Session& session);
  ~Streams();
  Streams(const Streams&) = delete;
  Streams& operator=(const Streams&) = delete;

  /// Writes what the command made to the standard output, if that was asked for.
  /// @throws Error if the reader has gone away.
  void deliver();

 private:
  void take_input(std::string& input);
  void take_output();

  CommandFiles& files_;
  Session& session_;
  std::unique_ptr<AtomicFolder> folder_;  ///< never committed, so that all in it goes away
  int standard_output_ = -1;
};

/// Opens /dev/null in place of each standard stream that is closed, so that no file or pipe gets its number.
/// It is opened the wrong way round: reading from the input and writing to the outputs fail as on a closed
/// stream.
void occupy_closed_streams() noexcept;

/// Name ending of the format that the first bytes of a mesh, a .vdb or a NIfTI file tell, unpacked, such as
/// ".ply". What nothing else claims is ".obj".
std::string ending_of(std::string_view first_bytes);

}  // namespace hermesh::cli
