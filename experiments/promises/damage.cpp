#include "experiments/promises/damage.h"

#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstring>
#include <fstream>
#include <limits>

#include "algorithms/core/error.h"

namespace hermesh::damage {
namespace {

constexpr std::size_t kLongestSentence = 300;  ///< bytes
constexpr double kLongestSeconds = 5.0;
constexpr long kMostGrowth = 1 << 20;  ///< KiB

/// A line of /proc/self/status in KiB.
long status_of(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    long value = 0;
    if (word == name + ":" && status >> value) return value;
  }
  return 0;
}

/// What a child process leaves behind.
struct Shared {
  int current;
  char wrong[600];
};

/// What is wrong with the way in which attempt(i) ends; empty if nothing is.
std::string verdict(int i, const std::function<void(int)>& attempt) {
  std::ofstream("/proc/self/clear_refs") << "5";  // the peak starts anew
  const long before = status_of("VmRSS");
  const auto start = std::chrono::steady_clock::now();
  std::string wrong;
  try {
    attempt(i);
  } catch (const Error& error) {
    const std::string said = error.what();
    if (said.empty() || said.size() > kLongestSentence)
      wrong = "a sentence of " + std::to_string(said.size()) + " bytes: " + said;
    if (std::ranges::any_of(said, [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
      wrong = "control characters: " + said;
  } catch (const std::exception& other) {
    wrong = std::string("an exception of another kind: ") + other.what();
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  if (seconds.count() > kLongestSeconds) wrong += " " + std::to_string(seconds.count()) + " seconds";
  const long growth = status_of("VmHWM") - before;
  if (growth > kMostGrowth) wrong += " " + std::to_string(growth) + " KiB more memory";
  return wrong;
}

[[noreturn]] void work(int first, int count, const std::function<void(int)>& attempt, Shared& shared) {
  for (int i = first; i < count; ++i) {
    shared.current = i;
    alarm(30);
    const std::string wrong = verdict(i, attempt);
    if (wrong.empty()) continue;
    wrong.copy(shared.wrong, sizeof shared.wrong - 1);
    _exit(1);
  }
  _exit(0);
}

}  // namespace

std::vector<std::string> failures(int count, const std::function<void(int)>& attempt) {
  auto* const shared = static_cast<Shared*>(
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  std::vector<std::string> found;
  constexpr std::size_t kEnough = 10;
  for (int next = 0; next < count && found.size() < kEnough; next = shared->current + 1) {
    *shared = {next, ""};
    const pid_t child = fork();
    if (child == 0) work(next, count, attempt, *shared);
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) break;
    const std::string at = "attempt " + std::to_string(shared->current) + ": ";
    found.push_back(at + (WIFSIGNALED(status) ? "signal " + std::to_string(WTERMSIG(status))
                                              : std::string(shared->wrong)));
  }
  munmap(shared, sizeof(Shared));
  return found;
}

void Mutator::change_bytes(std::string& bytes) {
  for (std::size_t left = 1 + below(8); left > 0; --left) {
    char& byte = bytes[below(bytes.size())];
    byte = below(2) ? static_cast<char>(byte ^ (1 << below(8))) : static_cast<char>(random_());
  }
}

void Mutator::cut(std::string& bytes) {
  const std::size_t at = below(bytes.size());
  if (below(2))
    bytes.resize(at);
  else
    bytes.erase(at, 1 + below(below(4) ? 16 : bytes.size()));
}

void Mutator::put_number(std::string& bytes) {
  constexpr std::array<std::uint64_t, 14> kNumbers = {0,
                                                      1,
                                                      2,
                                                      4,
                                                      6,
                                                      16,
                                                      255,
                                                      4096,
                                                      0x7fffffff,
                                                      0x80000000,
                                                      0xffffffff,
                                                      0x7ff8000000000000,
                                                      0x8000000000000000,
                                                      0xffffffffffffffff};
  std::uint64_t number = below(4) ? kNumbers[below(kNumbers.size())] : random_() >> below(64);
  if (below(5) == 0)
    number = std::bit_cast<std::uint32_t>(below(2) ? std::numeric_limits<float>::quiet_NaN() : 1e38f);
  if (below(4) == 0) number = ~number + 1;
  const std::size_t size = std::size_t{1} << below(4), at = below(bytes.size());
  for (std::size_t i = 0; i < size && at + i < bytes.size(); ++i)
    bytes[at + i] = static_cast<char>(number >> (8 * i));
}

void Mutator::put_written_number(std::string& bytes) {
  constexpr std::array<const char*, 12> kNumbers = {
      "0",      "-1", "1e308",           "nan", "inf", "99999999999999999999", "2147483648", "0.5",
      "1e-320", "[]", "\"\\u001b[31m\"", "{}"};
  std::size_t at = below(bytes.size());
  while (at < bytes.size() && !std::isdigit(static_cast<unsigned char>(bytes[at]))) ++at;
  std::size_t end = at;
  while (end < bytes.size() && std::isdigit(static_cast<unsigned char>(bytes[end]))) ++end;
  bytes.replace(at, end - at, kNumbers[below(kNumbers.size())]);
}

void Mutator::exchange(std::string& bytes) {
  const std::size_t size = std::size_t{1} << below(4);
  if (bytes.size() < 2 * size) return;
  const std::size_t a = below(bytes.size() - size), b = below(bytes.size() - size);
  for (std::size_t i = 0; i < size; ++i) std::swap(bytes[a + i], bytes[b + i]);
}

void Mutator::splice(std::string& bytes, const std::string& other) {
  const std::size_t from = below(other.size()), length = 1 + below(below(3) ? 64 : other.size());
  const std::string part = other.substr(from, length);
  const std::size_t at = below(bytes.size());
  bytes.replace(at, below(2) ? part.size() : 0, part);
}

std::string Mutator::operator()(const std::vector<std::string>& whole, bool text) {
  std::string bytes = whole[below(whole.size())];
  for (std::size_t left = 1 + below(3); left > 0 && !bytes.empty(); --left) switch (below(6)) {
      case 0:
        change_bytes(bytes);
        break;
      case 1:
        cut(bytes);
        break;
      case 2:
        exchange(bytes);
        break;
      case 3:
        splice(bytes, whole[below(whole.size())]);
        break;
      default:
        text ? put_written_number(bytes) : put_number(bytes);
    }
  return bytes;
}

}  // namespace hermesh::damage
