// Packing, unpacking and negating 16-bit normals, per normal. A code whose error is not the one that is known
// is not timed, and the program then ends with 1.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "algorithms/hermite/normal_code.h"
#include "algorithms/hermite/normal_codes.h"
#include "experiments/bench/failures.h"

namespace hermesh {
namespace {

using Normal = std::array<float, 3>;

/// Normals and codes of a chunk are 224 KiB, so they stay in the second-level cache while a chunk is worked
/// on several times in a row.
constexpr std::size_t kNormals = 1'000'000, kChunk = 16'384;
constexpr int kRounds = 8;

const std::vector<Normal>& random_normals() {
  static const std::vector<Normal> normals = [] {
    std::mt19937 generator(1);
    std::normal_distribution<float> coordinate;
    std::vector<Normal> made(kNormals);
    for (Normal& n : made) {
      for (float& c : n) c = coordinate(generator);
      const float length = std::hypot(n[0], n[1], n[2]);
      for (float& c : n) c /= length;
    }
    return made;
  }();
  return normals;
}

template <NormalCode Code>
std::vector<std::uint16_t> codes() {
  std::vector<std::uint16_t> packed;
  for (const Normal& n : random_normals()) packed.push_back(Code::pack(n));
  return packed;
}

/// The largest error of the worst code is 2.58°, a chord of 0.04503.
template <NormalCode Code>
bool is_right() {
  return std::ranges::all_of(random_normals(), [](const Normal& n) {
    const Normal back = Code::unpack(Code::pack(n));
    return std::hypot(n[0] - back[0], n[1] - back[1], n[2] - back[2]) < 0.0451f;
  });
}

/// Times `work(from, to)` for every element, a chunk a round.
template <NormalCode Code, class From, class To, class Work>
void time_elements(benchmark::State& state, const std::vector<From>& from, std::vector<To> to, Work work) {
  if (!is_right<Code>()) {
    ++failures;
    return state.SkipWithError("a normal comes back from its code with a larger error than the code has");
  }
  std::size_t begin = 0;
  std::size_t elements = 0;
  for ([[maybe_unused]] auto iteration : state) {
    const std::size_t end = std::min(begin + kChunk, from.size());
    for (int round = 0; round < kRounds; ++round) {
      for (std::size_t i = begin; i < end; ++i) to[i] = work(from[i]);
      benchmark::ClobberMemory();
    }
    elements += kRounds * (end - begin);
    begin = end == from.size() ? 0 : end;
  }
  state.counters["s/normal"] =
      benchmark::Counter(double(elements), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

template <NormalCode Code>
void pack(benchmark::State& state) {
  time_elements<Code>(state, random_normals(), std::vector<std::uint16_t>(kNormals),
                      [](const Normal& n) { return Code::pack(n); });
}

template <NormalCode Code>
void unpack(benchmark::State& state) {
  time_elements<Code>(state, codes<Code>(), std::vector<Normal>(kNormals),
                      [](std::uint16_t code) { return Code::unpack(code); });
}

template <NormalCode Code>
void negate(benchmark::State& state) {
  time_elements<Code>(state, codes<Code>(), std::vector<std::uint16_t>(kNormals),
                      [](std::uint16_t code) { return Code::negate(code); });
}

template <NormalCode Code>
bool registered(Code) {
  const std::string prefix = std::string("normal-code/") + Code::name + "/";
  benchmark::RegisterBenchmark((prefix + "pack").c_str(), pack<Code>);
  benchmark::RegisterBenchmark((prefix + "unpack").c_str(), unpack<Code>);
  benchmark::RegisterBenchmark((prefix + "negate").c_str(), negate<Code>);
  return true;
}

/// This file is linked as an object of the program, so that the linker does not leave it out.
const bool all_registered = std::ranges::all_of(kNormalCodes, [](NormalCodeId id) {
  return with_normal_code(id, [](auto code) { return registered(code); });
});

}  // namespace
}  // namespace hermesh
