#include "experiments/cli/output_path.h"

#include <algorithm>
#include <cctype>
#include <string>

#include "algorithms/core/error.h"
#include "algorithms/io/atomic_file.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/cli/session.h"

namespace hermesh::cli {
namespace {

std::string lower_case_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

}  // namespace

void check_mesh_output(const std::filesystem::path& path) {
  if (!is_mesh_path(path))
    throw Error("cannot write a mesh to '" + path.string() + "': its name must end in " + kMeshEndings);
  check_writable(path);
}

void check_keeps_attributes(const std::filesystem::path& path) {
  const bool packed = lower_case_extension(path) == ".gz";
  if (lower_case_extension(packed ? path.stem() : path) != ".ply")
    throw UsageError("'" + path.string() + "' would lose the attributes: only .ply keeps them");
}

void check_volume_output(const std::filesystem::path& path) {
  if (lower_case_extension(path) != ".vdb")
    throw Error("cannot write a level set to '" + path.string() + "': its name must end in .vdb");
  check_writable(path);
}

void check_writable(const std::filesystem::path& path) { const AtomicFile reserved(path); }

}  // namespace hermesh::cli
