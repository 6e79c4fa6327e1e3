// Damaged files for tests: seeded changes of whole ones, and a judge of what is said of them.
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace hermesh::damage {

/// Damages files by changes of bytes, cuts, exchanges of numbers, and parts of other files, alike for each
/// seed.
class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  /// A file of `whole`, changed once to three times; `text` changes numbers as they are written in digits.
  std::string operator()(const std::vector<std::string>& whole, bool text = false);

 private:
  std::size_t below(std::size_t end) { return end == 0 ? 0 : random_() % end; }
  void change_bytes(std::string& bytes);
  void cut(std::string& bytes);
  void put_number(std::string& bytes);
  void put_written_number(std::string& bytes);
  void exchange(std::string& bytes);
  void splice(std::string& bytes, const std::string& other);

  std::mt19937_64 random_;
};

/// Calls attempt(0) to attempt(count − 1), which read damaged files, in child processes that may crash. An
/// attempt ends as it should if it returns, or throws an Error of one short line without control characters;
/// within five seconds, and without taking a GiB. @returns what went wrong, at most ten
std::vector<std::string> failures(int count, const std::function<void(int)>& attempt);

}  // namespace hermesh::damage
