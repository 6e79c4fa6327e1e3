#include "experiments/cli/streams.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iostream>
#include <utility>

#include "experiments/cli/signals.h"

namespace hermesh::cli {
namespace {

constexpr std::size_t kChunk = std::size_t(1) << 16;
constexpr const char* kInputName = "the standard input";
constexpr const char* kOutputName = "the standard output";
const std::array<std::string, 7> kMeshFormats = {"ply", "obj", "off", "stl", "glb", "gltf", "3mf"};

/// Refuses a format that files of the kind do not have. @throws UsageError
void check_format(const std::string& option, const std::string& format, FileKind kind) {
  const std::string bare = format.ends_with(".gz") ? format.substr(0, format.size() - 3) : format;
  const bool mesh = std::ranges::find(kMeshFormats, bare) != kMeshFormats.end();
  const bool volume = format == "vdb";
  const bool fits = kind == FileKind::mesh             ? mesh
                    : kind == FileKind::volume         ? volume
                    : kind == FileKind::mesh_or_volume ? mesh || volume
                                                       : format == "nii";
  if (fits) return;
  const std::string meshes = "ply, obj, off, stl, glb, gltf or 3mf (.gz may follow)";
  throw UsageError(option + " " + format + " is invalid for this command: it takes " +
                   (kind == FileKind::volume           ? "vdb"
                    : kind == FileKind::imported       ? "nii"
                    : kind == FileKind::mesh_or_volume ? meshes + ", or vdb"
                                                       : meshes));
}

/// Copies a stream to its end into a file; returns the number of bytes.
std::uint64_t copy_in(int from, const std::filesystem::path& file) {
  std::ofstream out(file, std::ios::binary);
  std::array<char, kChunk> chunk;
  std::uint64_t bytes = 0;
  for (ssize_t size; (size = ::read(from, chunk.data(), chunk.size())) != 0;) {
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) throw Error(std::string(kInputName) + " cannot be read: " + std::strerror(errno));
    out.write(chunk.data(), size);
    bytes += std::uint64_t(size);
  }
  out.close();
  if (!out)
    throw Error(std::string(kInputName) + " cannot be copied to '" +
                file.parent_path().parent_path().string() +
                "': it is full or cannot be written; set TMPDIR to a directory with more space");
  return bytes;
}

/// Returns true if a standard stream was closed when the program started (occupy_closed_streams()).
bool is_closed(int stream) {
  const int flags = fcntl(stream, F_GETFL);
  return flags < 0 || (flags & O_ACCMODE) == (stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

std::string first_bytes_of(const std::filesystem::path& file) {
  std::string bytes(512, '\0');
  // It returns the bytes of a file that is not gzipped unchanged.
  if (const gzFile in = gzopen(file.c_str(), "rb")) {
    const int size = gzread(in, bytes.data(), unsigned(bytes.size()));
    gzclose(in);
    bytes.resize(std::size_t(std::max(size, 0)));
  }
  return bytes;
}

}  // namespace

void occupy_closed_streams() noexcept {
  // In ascending order, because open() returns the smallest free number.
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0) ::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

std::string ending_of(std::string_view bytes) {
  // Byte order marks and blanks may precede a keyword.
  std::string_view text = bytes;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  const std::size_t start = text.find_first_not_of(" \t\r\n");
  text.remove_prefix(start == std::string_view::npos ? text.size() : start);
  if (bytes.starts_with(std::string_view(" BDV\0\0\0\0", 8))) return ".vdb";
  if (text.starts_with("ply")) return ".ply";
  if (text.starts_with("OFF") || text.starts_with("COFF") || text.starts_with("NOFF") ||
      text.starts_with("STOFF"))
    return ".off";
  if (bytes.starts_with("glTF")) return ".glb";
  if (bytes.starts_with("PK\3\4")) return ".3mf";
  if (text.starts_with('{')) return ".gltf";
  // The length of the header, in either order of bytes.
  if (bytes.starts_with(std::string_view("\x5c\x01\0\0", 4)) ||
      bytes.starts_with(std::string_view("\0\0\x01\x5c", 4)))
    return ".nii";
  if (text.starts_with("solid")) return ".stl";
  // A binary STL file has no keyword, but zeros, unlike text: in the count of its triangles, and after each
  // of them.
  if (bytes.find('\0') != std::string_view::npos) return ".stl";
  return ".obj";
}

Streams::Streams(CommandFiles& files, Session& session) : files_(files), session_(session) {
  const auto streamed = [](const std::string* name) { return name && *name == "-"; };
  const auto streams = std::ranges::count_if(files.inputs, streamed);
  const bool reads = streams > 0, writes = streamed(files.output);
  if (streams > 1) throw UsageError("only one input can be the standard input");
  if (!reads && !files.input_format.empty())
    throw UsageError("--input-format has no effect: no input is the standard input, -");
  if (!reads && !writes && !files.format.empty())
    throw UsageError("--format has no effect: neither input nor output is a standard stream, -");
  if (!reads && !writes) return;
  if (writes && files.out == FileKind::folder)
    throw UsageError(
        "the output is a folder of files, which the standard output cannot hold; name a directory");
  if (writes && std::exchange(session.json, false))
    throw UsageError(
        "--json would mix with what goes to the standard output: give it a file, --json FILE.json");
  std::error_code error;
  const std::filesystem::path temporary = std::filesystem::temp_directory_path(error);
  if (error) throw Error("there is no directory for temporary files: set TMPDIR to one");
  folder_ = std::make_unique<AtomicFolder>(temporary / "stream");
  if (writes) take_output();
  for (std::string* input : files.inputs)
    if (streamed(input)) take_input(*input);
}

void Streams::take_input(std::string& input) {
  if (isatty(STDIN_FILENO))
    throw UsageError(std::string(kInputName) +
                     " is a terminal: add '< FILE' after the command, or a program and '|' before it");
  if (is_closed(STDIN_FILENO))
    throw Error(std::string(kInputName) +
                " is closed: add '< FILE' after the command, or name a file instead of -");
  // If the output is a mesh, too, --format is its format.
  const bool about_output = session_.writes_stream && files_.out == FileKind::mesh;
  const std::string option = files_.input_format.empty() ? "--format" : "--input-format";
  const std::string format = !files_.input_format.empty() ? files_.input_format
                             : about_output               ? ""
                                                          : files_.format;
  if (!format.empty()) check_format(option, format, files_.in);
  const std::filesystem::path raw = folder_->path() / "input";
  const std::uint64_t size = copy_in(STDIN_FILENO, raw);
  if (size == 0)
    throw Error(std::string(kInputName) +
                " is empty: the program that should write to it failed or wrote nothing");
  std::string ending = format.empty() ? ending_of(first_bytes_of(raw)) : "." + format;
  if (files_.in == FileKind::volume) ending = ".vdb";
  if (files_.in == FileKind::imported) ending = ".nii";
  const std::filesystem::path file = folder_->path() / ("input" + ending);
  std::filesystem::rename(raw, file);
  input = file.string();
  session_.stream_names.emplace_back(input, kInputName);
}

void Streams::take_output() {
  if (isatty(STDOUT_FILENO))
    throw UsageError(std::string(kOutputName) +
                     " is a terminal: add '> FILE' or '|' and a program after the command");
  std::string format = files_.out == FileKind::volume ? "vdb" : "ply";
  if (files_.out == FileKind::mesh && !files_.format.empty()) format = files_.format;
  check_format("--format", format, files_.out);
  standard_output_ = is_closed(STDOUT_FILENO) ? -1 : fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
  if (standard_output_ < 0) throw Error(std::string(kOutputName) + " is closed");
  // Nothing that is printed, by libraries included, may mix with the bytes of the file.
  std::cout.flush();
  dup2(STDERR_FILENO, STDOUT_FILENO);
  session_.writes_stream = true;
  hold_the_end(true);
  *files_.output = (folder_->path() / ("output." + format)).string();
  session_.stream_names.emplace_back(*files_.output, kOutputName);
}

void Streams::deliver() {
  if (standard_output_ < 0) return;
  std::cout.flush();
  // A closed output pipe is reported as an error, not by the signal.
  std::signal(SIGPIPE, SIG_IGN);
  std::ifstream in(*files_.output, std::ios::binary);
  if (!in) throw Error("there is nothing to write to the standard output");
  std::array<char, kChunk> chunk;
  std::uint64_t written = 0;
  const std::uint64_t size = std::filesystem::file_size(*files_.output);
  while (in.read(chunk.data(), chunk.size()), in.gcount() > 0)
    for (std::streamsize at = 0; at < in.gcount();) {
      const ssize_t step = ::write(standard_output_, chunk.data() + at, std::size_t(in.gcount() - at));
      if (step < 0 && errno == EINTR) continue;
      if (step < 0)
        throw Error(std::string(kOutputName) + " took only " + std::to_string(written) + " of " +
                    std::to_string(size) + " bytes: " +
                    (errno == EPIPE ? "the program that reads it has ended" : std::strerror(errno)));
      at += step;
      written += std::uint64_t(step);
    }
  if (close(standard_output_) != 0)
    throw Error(std::string(kOutputName) + " cannot be written: " + std::strerror(errno));
  standard_output_ = -1;
  hold_the_end(false);
  work_is_finished();
}

Streams::~Streams() {
  if (standard_output_ >= 0) close(standard_output_);
  if (session_.writes_stream) hold_the_end(false);
}

}  // namespace hermesh::cli
