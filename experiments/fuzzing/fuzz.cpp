// The function that libFuzzer calls, of one target (HERMESH_FUZZ_TARGET).
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "experiments/fuzzing/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hermesh::fuzzing;
  for (const Target& target : HERMESH_FUZZ_TARGETS())
    if (target.name == HERMESH_FUZZ_TARGET) {
      expect_value_or_error(target, {reinterpret_cast<const char*>(data), size});
      return 0;
    }
  std::abort();
}
