// Files that a command reads and writes, known by the variables that the command line fills.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace hermesh::cli {

enum class FileKind {
  mesh,
  volume,
  mesh_or_volume,
  imported,  ///< a volume of another program, such as .nii
  folder,
};

/// What a batch adds to a command: more inputs, and what their outputs are called.
struct BatchArguments {
  std::vector<std::string> more;  ///< inputs behind the first two
  std::string out_dir, pattern;   ///< empty: not given
  int jobs = 1;
};

struct CommandFiles {
  std::vector<std::string*> inputs;
  std::string* output = nullptr;  ///< null: the command writes no file
  FileKind in = FileKind::mesh, out = FileKind::mesh;
  bool takes_many = false;  ///< whether the command can be run on many inputs, as BatchArguments say
  BatchArguments batch = {};
  std::string format = {}, input_format = {};  ///< of standard streams; empty: not given
  bool overwrite_input = false;                ///< whether the output may be one of the inputs
};

/// Metres in a unit that --units takes; none for another word.
std::optional<double> metres_in(const std::string& unit);

}  // namespace hermesh::cli
