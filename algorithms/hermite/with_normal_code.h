// The normal codes themselves, and the choice of one by name.
#pragma once

#include "algorithms/hermite/normal_code.h"
#include "algorithms/hermite/normal_codes/baptista.h"
#include "algorithms/hermite/normal_codes/nearest.h"
#include "algorithms/hermite/normal_codes/octahedral.h"
#include "algorithms/hermite/normal_codes/rounded.h"
#include "algorithms/hermite/normal_codes/thesis.h"

namespace hermesh {

/// Calls f(code) with an empty object of the code's type: with_normal_code(id, [](auto code) { using Code =
/// decltype(code); … }).
template <class Function>
decltype(auto) with_normal_code(NormalCodeId id, Function&& f) {
  switch (id) {
    case NormalCodeId::thesis:
      return f(ThesisNormalCode{});
    case NormalCodeId::baptista:
      return f(BaptistaNormalCode{});
    case NormalCodeId::rounded:
      return f(RoundedNormalCode{});
    case NormalCodeId::octahedral:
      return f(OctahedralNormalCode{});
    case NormalCodeId::nearest:
      break;
  }
  return f(NearestNormalCode{});
}

static_assert(NormalCode<ThesisNormalCode> && NormalCode<BaptistaNormalCode> &&
              NormalCode<RoundedNormalCode> && NormalCode<OctahedralNormalCode> &&
              NormalCode<NearestNormalCode>);

}  // namespace hermesh
