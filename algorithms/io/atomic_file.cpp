#include "algorithms/io/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <mutex>
#include <set>
#include <string>
#include <system_error>
#include <thread>

#include "algorithms/core/error.h"

namespace hermesh {

namespace {

namespace fs = std::filesystem;

/// The temporary files of this process.
struct Unfinished {
  std::timed_mutex mutex;  ///< locked briefly, so that the thread that ends the process can lock it, too
  std::set<std::string> paths;
  std::mutex ending;  ///< locked by the thread that removes all of them
};

/// Never destroyed: the thread that ends the process may run during the destruction of static objects.
Unfinished& unfinished() {
  static Unfinished* const files = new Unfinished;
  return *files;
}

/// Removes a file or directory. Another thread may be writing into the directory, so it is renamed first.
/// Another thread may be removing it, whose progress makes this call fail, so it is retried.
void remove_for_good(const fs::path& path) {
  std::error_code ignored;
  const fs::path renamed = path.string() + "~";
  constexpr int kTries = 1000;
  for (int i = 0; i < kTries; ++i) {
    fs::rename(path, renamed, ignored);
    fs::remove_all(renamed, ignored);
    if (!fs::exists(renamed, ignored) && !fs::exists(path, ignored)) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// Creates a file or directory in the directory of `target` (a rename does not cross file systems) by calling
/// `make` with unused hidden names. A killed process may have left files with the same process number, which
/// is common in containers. The names keep the extension, by which some libraries choose their format.
/// Returns the name; `error` is 0 on success.
template <class Make>
fs::path make_beside(const fs::path& target, int& error, Make&& make) {
  static std::atomic<unsigned> counter = 0;
  const std::string name = target.filename().string();
  const std::string tail = name.substr(name.size() - std::min<std::size_t>(name.size(), 100));
  while (true) {
    fs::path temporary = target.parent_path() / (".hermesh-" + std::to_string(getpid()) + "-" +
                                                 std::to_string(counter++) + "-" + tail);
    error = make(temporary) ? 0 : errno;
    if (error != EEXIST) return temporary;
  }
}

/// Returns the file to replace: the target of a link, which a rename would replace itself.
fs::path checked_file(const fs::path& target) {
  std::error_code error;
  const fs::file_status status = fs::status(target, error);
  if (!target.has_filename() || fs::is_directory(status))
    throw Error("cannot write '" + target.string() + "': it is a folder; name a file in it");
  if (!fs::exists(status)) return target;
  // A rename would replace a device.
  if (!fs::is_regular_file(status))
    throw Error("cannot write '" + target.string() + "': it is not a regular file");
  const fs::path real = fs::canonical(target, error);
  return error ? target : real;
}

fs::path checked_folder(fs::path target) {
  if (!target.has_filename()) target = target.parent_path();  // "out/" is the directory "out"
  std::error_code error;
  const fs::file_status status = fs::status(target, error);
  if (!target.has_filename() ||
      (fs::exists(status) && !(fs::is_directory(status) && fs::is_empty(target, error))))
    throw Error("cannot write '" + target.string() +
                "': it exists and is not an empty folder; name a new one");
  return target;
}

}  // namespace

AtomicPath::AtomicPath(fs::path target, Make make) : target_(std::move(target)) {
  const std::lock_guard lock(unfinished().mutex);
  int error = 0;
  temporary_ = make_beside(target_, error, make);
  if (error != 0) throw Error("cannot write '" + target_.string() + "': " + std::strerror(error));
  unfinished().paths.insert(temporary_.string());
}

AtomicPath::~AtomicPath() {
  if (committed_) return;
  // Without the lock, since a thousand files take seconds on a busy disk. Until all are removed, the
  // directory stays on the list.
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);
  const std::lock_guard lock(unfinished().mutex);
  unfinished().paths.erase(temporary_.string());
}

void AtomicPath::commit() {
  const std::lock_guard lock(unfinished().mutex);
  rename();
}

void AtomicPath::rename() {
  if (::rename(temporary_.c_str(), target_.c_str()) != 0)
    throw Error("cannot write '" + target_.string() + "': " + std::strerror(errno));
  unfinished().paths.erase(temporary_.string());
  committed_ = true;
}

AtomicFile::AtomicFile(const fs::path& target)
    : AtomicPath(checked_file(target), [](const fs::path& name) {
        const int file = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        return file >= 0 && ::close(file) == 0;
      }) {}

AtomicFolder::AtomicFolder(fs::path target)
    : AtomicPath(checked_folder(std::move(target)),
                 [](const fs::path& name) { return ::mkdir(name.c_str(), 0777) == 0; }) {}

void commit_together(AtomicFile& first, AtomicFile& second) {
  // Locked throughout, so that the process ends by a signal before or after both renames.
  const std::lock_guard lock(unfinished().mutex);
  // A hard link, or a copy if the file system has none, preserves the old first file until both are renamed.
  const bool replaces = fs::exists(first.target_);
  fs::path older;
  if (replaces) {
    int no_links = 0;
    older = make_beside(first.target_, no_links, [&](const fs::path& name) {
      return ::link(first.target_.c_str(), name.c_str()) == 0;
    });
    if (no_links != 0) fs::copy_file(first.target_, older);
  }
  try {
    first.rename();
    second.rename();
  } catch (...) {
    if (replaces)
      ::rename(older.c_str(), first.target_.c_str());
    else if (first.committed_)
      ::unlink(first.target_.c_str());
    throw;
  }
  if (replaces) ::unlink(older.c_str());
}

void remove_unfinished_files() noexcept {
  // Exceptions of a lock are useless to a process that is ending.
  try {
    // A second thread that ends the process waits until the first has removed all.
    const std::lock_guard ending(unfinished().ending);
    const std::unique_lock lock(unfinished().mutex, std::chrono::seconds(1));
    if (!lock.owns_lock()) return;
    for (const std::string& path : unfinished().paths) remove_for_good(path);
  } catch (...) {
  }
}

}  // namespace hermesh
