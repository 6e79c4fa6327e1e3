// Write aside, then rename: a reader sees the old file or the whole new one, never half of it.
#pragma once

#include <filesystem>

namespace hermesh {

/// A temporary file beside `target`, reserved by the constructor. The destructor removes it unless commit()
/// renamed it; remove_unfinished_files() does so when the process is being cancelled.
class AtomicFile {
 public:
  /// @throws Error if the folder does not exist or cannot be written.
  explicit AtomicFile(std::filesystem::path target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The temporary file, to be written by the caller.
  const std::filesystem::path& path() const { return temporary_; }
  /// Renames what was written to the target. @throws Error if that fails.
  void commit();

 private:
  friend void commit_together(AtomicFile& first, AtomicFile& second);
  void rename();
  std::filesystem::path target_, temporary_;
  bool committed_ = false;
};

/// A folder of files that is there whole or not at all: write into path(), then commit().
class AtomicFolder {
 public:
  /// @throws Error if the parent folder does not exist or cannot be written, or if `target` is there and is
  /// no empty folder.
  explicit AtomicFolder(std::filesystem::path target);
  ~AtomicFolder();
  AtomicFolder(const AtomicFolder&) = delete;
  AtomicFolder& operator=(const AtomicFolder&) = delete;

  const std::filesystem::path& path() const { return temporary_; }
  /// Renames what was written to the target. @throws Error if that fails.
  void commit();

 private:
  std::filesystem::path target_, temporary_;
  bool committed_ = false;
};

/// Commits both files or neither: if the second cannot be renamed, the first target holds again what it held,
/// or nothing. @throws Error as commit() does.
void commit_together(AtomicFile& first, AtomicFile& second);

/// Removes the temporary files of every AtomicFile and AtomicFolder that is still open: for the moment before
/// a process ends itself.
void remove_unfinished_files() noexcept;

}  // namespace hermesh
