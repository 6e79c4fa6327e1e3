// What a value of a row is, which decides how two of them are compared.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "experiments/harness/columns.h"

namespace hermesh {

enum class ValueClass {
  kExact,    ///< counts, texts, truth values, and figures that others printed: equal or not
  kError,    ///< floating point: equal within a tolerance
  kSlope,    ///< of a fit, with an interval beside: equal where the intervals overlap
  kTime,     ///< seconds of repetitions, on one machine alone
  kMemory,   ///< peaks of resident memory, on one machine alone
  kDerived,  ///< of times and of the machine: ratios, rates; says nothing that the times do not
};
const char* name(ValueClass value_class);

/// Which change of a value is for the worse.
enum class Worse { kLarger, kSmaller, kEither };

/// The class of a column's value in a row. A measurement's column says it by its header's unit ("[s]",
/// "[MiB]"), by its name (slope, order; peak; printed; speedup), and by whether the value is a whole number.
/// Null has the class of a number.
ValueClass class_of(const Column& column, const Json& value, const Json& row);

/// The words of the column's name tell: errors and losses are worse if larger, angles and hits if smaller, and
/// of anything else nobody knows.
Worse worse_of(const Column& column);

/// Whether a number stands for a count though it is kept as floating point: it is whole, and the column has
/// no unit.
bool is_count(const Column& column, double value);

/// Names of the columns that bound a slope.
std::string lower_bound_of(const std::string& slope);
std::string upper_bound_of(const std::string& slope);

}  // namespace hermesh
