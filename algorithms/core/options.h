// Options of a variant: declared in its table entry, given by the user as key=value, checked before the work
// starts.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hermesh {

/// Declaration of one option. Without `choices`, the value is a number from `minimum` to `maximum`.
struct OptionSpec {
  std::string name;
  std::string fallback;  ///< default value
  std::string help;      ///< meaning, unit, and the effect of a larger value
  std::vector<std::string> choices = {};
  double minimum = 0.0;
  double maximum = 1e300;
  /// Settings of the variant's other options, each "name=value" or "name=value|value…". This option has no
  /// effect unless all of them hold, so giving it is then an error.
  std::vector<std::string> only_with = {};
};

/// Checked values of all options that a variant declares.
class Options {
 public:
  Options() = default;
  /// Checks `given` against the declarations and fills in defaults. @throws Error naming the variant, the
  /// option and the allowed values; also for an option that has no effect with the others.
  Options(std::string_view variant, std::span<const OptionSpec> declared,
          const std::map<std::string, std::string>& given);

  /// Returns the value of a declared option as a number. @throws std::logic_error if it was not declared or
  /// is not a number.
  double number(std::string_view name) const;
  /// Returns the value of a declared option as text, numbers in their shortest form. @throws std::logic_error
  /// if it was not declared.
  const std::string& text(std::string_view name) const;
  /// Returns true if the option was declared and has this value.
  bool is(std::string_view name, std::string_view value) const;
  /// Returns all options, defaults included, as "key=value key=value" in alphabetical order: equal for equal
  /// settings.
  std::string canonical() const;

 private:
  std::map<std::string, std::string, std::less<>> values_;
};

/// Splits "key=value". @throws Error if there is no '=' or no key.
std::pair<std::string, std::string> parse_option(std::string_view text);

}  // namespace hermesh
