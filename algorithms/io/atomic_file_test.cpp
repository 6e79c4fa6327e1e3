#include "algorithms/io/atomic_file.h"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <thread>

#include "algorithms/core/error.h"

namespace hermesh {
namespace atomic_file_test {

namespace fs = std::filesystem;

class CommitTogetherTest : public testing::Test {
 protected:
  CommitTogetherTest() {
    std::string pattern = (fs::temp_directory_path() / "hermesh-test-XXXXXX").string();
    folder = mkdtemp(pattern.data());
  }
  ~CommitTogetherTest() override { fs::remove_all(folder); }

  static void write(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }
  /// Names of all plain files, hidden ones among them.
  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      std::ostringstream text;
      text << std::ifstream(entry.path()).rdbuf();
      all[entry.path().filename().string()] = text.str();
    }
    return all;
  }
  /// Commits two files while a folder takes the name of the second one before it is renamed.
  void fail_to_commit() {
    AtomicFile first(folder / "first"), second(folder / "second");
    write(first.path(), "new");
    write(second.path(), "new");
    fs::create_directory(folder / "second");
    EXPECT_THROW(commit_together(first, second), Error);
  }
  fs::path folder;
};

TEST_F(CommitTogetherTest, Both) {
  write(folder / "first", "older");
  {
    AtomicFile first(folder / "first"), second(folder / "second");
    write(first.path(), "new first");
    write(second.path(), "new second");
    commit_together(first, second);
  }
  EXPECT_EQ(files(), (std::map<std::string, std::string>{{"first", "new first"}, {"second", "new second"}}));
}

TEST_F(CommitTogetherTest, NeitherWhereThereWasNone) {
  fail_to_commit();
  EXPECT_TRUE(files().empty());
}

TEST_F(CommitTogetherTest, TheOlderFirstComesBack) {
  write(folder / "first", "older");
  fail_to_commit();
  EXPECT_EQ(files(), (std::map<std::string, std::string>{{"first", "older"}}));
}

class AtomicFileTest : public CommitTogetherTest {};

TEST_F(AtomicFileTest, TheTargetAppearsOnCommitOnly) {
  {
    AtomicFile file(folder / "a.txt");
    std::ofstream(file.path()) << "new";
    EXPECT_FALSE(fs::exists(folder / "a.txt"));
    EXPECT_EQ(file.path().parent_path(), folder);
    EXPECT_EQ(file.path().extension(), ".txt");
    file.commit();
  }
  EXPECT_EQ(files().at("a.txt"), "new");
  { AtomicFile file(folder / "a.txt"); }
  EXPECT_EQ(files().at("a.txt"), "new");
  EXPECT_EQ(files().size(), 1u);
}

/// A process that was killed may have had the number of this one, as in a container, where all have the same.
TEST_F(AtomicFileTest, WhatAKilledProcessLeftIsNotInTheWay) {
  std::string name;
  { name = AtomicFile(folder / "a.txt").path().filename().string(); }
  const std::string head = ".hermesh-" + std::to_string(getpid()) + "-";
  ASSERT_TRUE(name.starts_with(head)) << name;
  const unsigned long next = std::stoul(name.substr(head.size())) + 1;
  for (unsigned long i = next; i < next + 5; ++i)
    write(folder / (head + std::to_string(i) + "-a.txt"), "left");
  for (unsigned long i = next + 6; i < next + 9; ++i)
    fs::create_directory(folder / (head + std::to_string(i) + "-out"));
  AtomicFile file(folder / "a.txt");
  std::ofstream(file.path()) << "new";
  file.commit();
  EXPECT_EQ(files().at("a.txt"), "new");
  AtomicFolder open(folder / "out");
  write(open.path() / "b.txt", "b");
  open.commit();
  EXPECT_TRUE(fs::exists(folder / "out" / "b.txt"));
  EXPECT_EQ(files().size(), 6u);  // existing leftovers must not be removed
}

TEST_F(AtomicFileTest, UnfinishedFilesAreRemovedFromAnotherThread) {
  AtomicFile one(folder / "a.txt"), two(folder / "b.txt");
  AtomicFile done(folder / "c.txt");
  done.commit();
  EXPECT_EQ(files().size(), 3u);
  std::thread(remove_unfinished_files).join();
  EXPECT_EQ(files().size(), 1u);
  EXPECT_EQ(files().count("c.txt"), 1u);
  EXPECT_THROW(one.commit(), Error);
}

/// Removing a directory of a thousand files takes a while. The process must not end before that, nor leave
/// files that another thread still creates.
TEST_F(AtomicFileTest, UnfinishedFoldersAreRemovedWhileOthersFillOrRemoveThem) {
  for (const bool fills : {true, false}) {
    auto open = std::make_unique<AtomicFolder>(folder / "pieces");
    const fs::path inside = open->path();
    for (int i = 0; i < 1000; ++i) write(inside / std::to_string(i), "piece");
    std::atomic<bool> begun = false, ended = false;
    std::thread other([&] {
      begun = true;
      if (!fills) return open.reset();
      for (int i = 1000; !ended; ++i) write(inside / std::to_string(i), "piece");
    });
    while (!begun) std::this_thread::yield();
    remove_unfinished_files();
    EXPECT_TRUE(fs::is_empty(folder));  // at once: here the process ends
    ended = true;
    other.join();
    open.reset();
    EXPECT_TRUE(fs::is_empty(folder));
  }
}

TEST_F(AtomicFileTest, WritesThroughLinksAndNotOverDevices) {
  write(folder / "real.txt", "old");
  fs::create_symlink("real.txt", folder / "link.txt");
  AtomicFile file(folder / "link.txt");
  std::ofstream(file.path()) << "new";
  file.commit();
  EXPECT_TRUE(fs::is_symlink(folder / "link.txt"));
  EXPECT_EQ(files().at("real.txt"), "new");
  EXPECT_THROW(AtomicFile("/dev/null"), Error);
  EXPECT_THROW(AtomicFile(folder / ""), Error);
}

TEST_F(AtomicFileTest, AFolderComesWholeOrNotAtAll) {
  {
    AtomicFolder given_up(folder / "out");
    write(given_up.path() / "a.txt", "a");
    EXPECT_FALSE(fs::exists(folder / "out"));
  }
  EXPECT_TRUE(fs::is_empty(folder));
  {
    AtomicFolder ended(folder / "out");
    write(ended.path() / "a.txt", "a");
    std::thread(remove_unfinished_files).join();
    EXPECT_TRUE(fs::is_empty(folder));
    EXPECT_THROW(ended.commit(), Error);
  }
  AtomicFolder kept((folder / "out").string() + "/");
  write(kept.path() / "a.txt", "a");
  kept.commit();
  EXPECT_TRUE(fs::exists(folder / "out" / "a.txt"));
  EXPECT_THROW(AtomicFolder(folder / "out"), Error);  // it is not empty
  EXPECT_THROW(AtomicFolder(folder / "missing" / "out"), Error);
}

}  // namespace atomic_file_test
}  // namespace hermesh
