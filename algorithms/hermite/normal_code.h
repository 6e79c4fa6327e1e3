// Codes of unit normals in 16 bits: the thesis's (Aldén 2011, §4.1), the one that it is derived from, and
// better ones of the same size. A code is a type with static functions, used as a template parameter of loops
// over normals; with_normal_code() of normal_codes.h selects it by name outside of the loop.
//
//               mean / max error   codes in use
//   thesis         1.32° / 2.58°         64,008   as printed
//   baptista       0.81° / 1.93°         64,008   reconstructs with the 126 that it quantised with
//   rounded        0.34° / 0.96°         63,506   rounds instead of flooring
//   octahedral     0.34° / 0.96°         64,518   the usual octahedral map
//   nearest        0.32° / 0.64°         64,518   rounds to the nearest point of its lattice
//
// The two that floor have 1,016 more codes, for normals that lie exactly in the plane z = 0.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>

namespace hermesh {

/// pack() takes any vector, of unit length or not; one without a direction (NaN, infinite, shorter than
/// 1e-30) gets the code 0, which is that of +z. It returns the same code on every machine. unpack() returns
/// unit length for all 65,536 codes. For codes that pack() returns, negate() is an involution without a fixed
/// point, it returns only such codes, and unpack(negate(c)) is exactly -unpack(c). pack(-n) equals
/// negate(pack(n)) for all normals with `rounded` and `nearest`; with `octahedral` it does not for some
/// normals of the plane z = 0, and with the two that floor it does not for normals with a component that is
/// exactly zero.
template <class Code>
concept NormalCode = requires(const std::array<float, 3>& normal, std::uint16_t code) {
  { Code::pack(normal) } -> std::same_as<std::uint16_t>;
  { Code::unpack(code) } -> std::same_as<std::array<float, 3>>;
  { Code::negate(code) } -> std::same_as<std::uint16_t>;
  { Code::name } -> std::convertible_to<std::string_view>;
};

/// Returns a rank of codes such that negating both of a pair reverses their order: order(negate(c)) = -1 -
/// order(c). If two normals are otherwise equally good, taking the lower one in a union and the higher one in
/// an intersection then obeys De Morgan's laws.
template <NormalCode Code>
int order(std::uint16_t code) {
  const std::uint16_t opposite = Code::negate(code);
  return code < opposite ? int(code) : -1 - int(opposite);
}

enum class NormalCodeId { thesis, baptista, rounded, octahedral, nearest };
inline constexpr std::array kNormalCodes = {NormalCodeId::thesis, NormalCodeId::baptista,
                                            NormalCodeId::rounded, NormalCodeId::octahedral,
                                            NormalCodeId::nearest};

std::string_view name(NormalCodeId id);

/// Returns the code of a name. @throws Error that lists the valid names.
NormalCodeId parse_normal_code(std::string_view text);

}  // namespace hermesh
