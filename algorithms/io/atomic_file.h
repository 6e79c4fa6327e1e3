// Atomic writes: a reader sees the old file or the complete new one.
#pragma once

#include <filesystem>

namespace hermesh {

/// A temporary file or directory next to its target, removed by the destructor unless commit() has renamed
/// it, and by remove_unfinished_files().
class AtomicPath {
 public:
  AtomicPath(const AtomicPath&) = delete;
  AtomicPath& operator=(const AtomicPath&) = delete;

  /// Returns the temporary file or directory, to be written by the caller.
  const std::filesystem::path& path() const { return temporary_; }
  /// Renames it to the target. @throws Error if that fails.
  void commit();

 protected:
  using Make = bool (*)(const std::filesystem::path&);
  AtomicPath(std::filesystem::path target, Make make);
  ~AtomicPath();

 private:
  friend void commit_together(class AtomicFile& first, class AtomicFile& second);
  void rename();
  std::filesystem::path target_, temporary_;
  bool committed_ = false;
};

class AtomicFile : public AtomicPath {
 public:
  /// @throws Error if the directory does not exist or cannot be written.
  explicit AtomicFile(const std::filesystem::path& target);
};

class AtomicFolder : public AtomicPath {
 public:
  /// @throws Error if the parent directory does not exist or cannot be written, or if `target` exists and is
  /// not an empty directory.
  explicit AtomicFolder(std::filesystem::path target);
};

/// Commits both files or neither: if the second cannot be renamed, the first target is restored or removed.
/// @throws Error like commit().
void commit_together(AtomicFile& first, AtomicFile& second);

/// Removes all temporary files and directories, just before the process ends itself.
void remove_unfinished_files() noexcept;

}  // namespace hermesh
