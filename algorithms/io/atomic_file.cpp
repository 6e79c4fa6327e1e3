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

/// The open temporary files of this process. Held for instants only, so that a thread that is about to end
/// the process gets it even while another one is deep in its work.
struct Unfinished {
  std::timed_mutex mutex;
  std::set<std::string> paths;
  std::mutex ending;  ///< held for as long as it takes by the thread that removes all of them
};

/// Never destroyed: the thread that ends the process may run while static objects are being taken down.
Unfinished& unfinished() {
  static Unfinished* const files = new Unfinished;
  return *files;
}

/// Removes a file or folder whatever other threads do meanwhile. One may be filling a folder: that is moved
/// aside first, so that no more files get into it. One may be removing it, and what that one takes away first
/// is an error to this one: so it tries until nothing is left.
void remove_for_good(const fs::path& path) {
  std::error_code ignored;
  const fs::path aside = path.string() + "~";
  constexpr int kTries = 1000;
  for (int i = 0; i < kTries; ++i) {
    fs::rename(path, aside, ignored);
    fs::remove_all(aside, ignored);
    if (!fs::exists(aside, ignored) && !fs::exists(path, ignored)) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// A name that is hidden, in the same folder (a rename does not cross file systems), and with the same
/// ending, which some libraries choose their format by.
fs::path temporary_name(const fs::path& target) {
  static std::atomic<unsigned> counter = 0;
  const std::string name = target.filename().string();
  const std::string tail = name.substr(name.size() - std::min<std::size_t>(name.size(), 100));
  return target.parent_path() /
         (".hermesh-" + std::to_string(getpid()) + "-" + std::to_string(counter++) + "-" + tail);
}

/// Makes something new beside `target`: calls `make` with one name after the other until there was nothing of
/// that name. What a killed process left stands in the way of another one with its number, and in a container
/// all have the same.
/// @returns the name; `error` is why there is nothing, if it is not 0.
template <class Make>
fs::path make_beside(const fs::path& target, int& error, Make&& make) {
  while (true) {
    const fs::path name = temporary_name(target);
    error = make(name) ? 0 : errno;
    if (error != EEXIST) return name;
  }
}

/// What to write instead of `target`: where it is a link, the file behind it, for a rename would replace the
/// link itself.
fs::path checked_target(const fs::path& target) {
  std::error_code error;
  const fs::file_status status = fs::status(target, error);
  if (!target.has_filename() || fs::is_directory(status))
    throw Error("cannot write '" + target.string() + "': it is a folder; name a file in it");
  if (!fs::exists(status)) return target;
  // Renaming over a device would replace the device.
  if (!fs::is_regular_file(status))
    throw Error("cannot write '" + target.string() + "': it is not a regular file");
  const fs::path real = fs::canonical(target, error);
  return error ? target : real;
}

}  // namespace

AtomicFile::AtomicFile(fs::path target) : target_(checked_target(target)) {
  const std::lock_guard lock(unfinished().mutex);
  int error = 0;
  temporary_ = make_beside(target_, error, [](const fs::path& name) {
    const int file = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    return file >= 0 && ::close(file) == 0;
  });
  if (error != 0) throw Error("cannot write '" + target.string() + "': " + std::strerror(error));
  unfinished().paths.insert(temporary_.string());
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  const std::lock_guard lock(unfinished().mutex);
  ::unlink(temporary_.c_str());
  unfinished().paths.erase(temporary_.string());
}

void AtomicFile::commit() {
  const std::lock_guard lock(unfinished().mutex);
  rename();
}

void AtomicFile::rename() {
  if (::rename(temporary_.c_str(), target_.c_str()) != 0)
    throw Error("cannot write '" + target_.string() + "': " + std::strerror(errno));
  unfinished().paths.erase(temporary_.string());
  committed_ = true;
}

AtomicFolder::AtomicFolder(fs::path target) : target_(std::move(target)) {
  if (!target_.has_filename()) target_ = target_.parent_path();  // "out/" is the folder "out"
  std::error_code error;
  const fs::file_status status = fs::status(target_, error);
  if (!target_.has_filename() ||
      (fs::exists(status) && !(fs::is_directory(status) && fs::is_empty(target_, error))))
    throw Error("cannot write to '" + target_.string() +
                "': it is there already and no empty folder; name a new one");
  const std::lock_guard lock(unfinished().mutex);
  int failure = 0;
  temporary_ =
      make_beside(target_, failure, [](const fs::path& name) { return ::mkdir(name.c_str(), 0777) == 0; });
  if (failure != 0) throw Error("cannot write to '" + target_.string() + "': " + std::strerror(failure));
  unfinished().paths.insert(temporary_.string());
}

AtomicFolder::~AtomicFolder() {
  if (committed_) return;
  // A thousand files take seconds on a busy disk, for which nobody is to wait who ends the process: so
  // without the lock, and it is on the list until all of it is gone.
  std::error_code ignored;
  fs::remove_all(temporary_, ignored);
  const std::lock_guard lock(unfinished().mutex);
  unfinished().paths.erase(temporary_.string());
}

void AtomicFolder::commit() {
  const std::lock_guard lock(unfinished().mutex);
  if (::rename(temporary_.c_str(), target_.c_str()) != 0)  // over an empty folder, if there is one
    throw Error("cannot write to '" + target_.string() + "': " + std::strerror(errno));
  unfinished().paths.erase(temporary_.string());
  committed_ = true;
}

void commit_together(AtomicFile& first, AtomicFile& second) {
  // Held all the time, so that a signal's end of the process comes before or after both.
  const std::lock_guard lock(unfinished().mutex);
  // A second name, or where the file system knows no hard links a copy, keeps the old first file until both
  // are renamed.
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
  // The exceptions of a lock that cannot be had are of no use to a process that is ending.
  try {
    // Of two threads that end the process the second one must not do so while the first one is still
    // removing.
    const std::lock_guard ending(unfinished().ending);
    const std::unique_lock lock(unfinished().mutex, std::chrono::seconds(1));
    if (!lock.owns_lock()) return;
    for (const std::string& path : unfinished().paths) remove_for_good(path);
  } catch (...) {
  }
}

}  // namespace hermesh
