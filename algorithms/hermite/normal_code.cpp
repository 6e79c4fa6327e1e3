#include "algorithms/hermite/normal_code.h"

#include "algorithms/core/error.h"
#include "algorithms/hermite/normal_codes.h"

namespace hermesh {

std::string_view name(NormalCodeId id) {
  return with_normal_code(id, [](auto code) { return std::string_view(decltype(code)::name); });
}

NormalCodeId parse_normal_code(std::string_view text) {
  std::string known;
  for (const NormalCodeId id : kNormalCodes) {
    if (name(id) == text) return id;
    known += (known.empty() ? "" : ", ") + std::string(name(id));
  }
  throw Error("there is no normal code \"" + std::string(text) + "\"; there are " + known);
}

}  // namespace hermesh
