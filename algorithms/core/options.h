// Options of a variant: declared in its table entry, given by the user as key=value, checked before the work
// starts.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hermesh {

/// Declaration of one option. Where `choices` is empty, the value is a number from `minimum` to `maximum`.
struct OptionSpec {
  std::string name;
  std::string fallback;  ///< value when the user gives none
  std::string help;      ///< meaning, unit, and what a larger value does
  std::vector<std::string> choices = {};
  double minimum = 0.0;
  double maximum = 1e300;
  /// Settings of the variant's other options, each "name=value" or "name=value|value…", without any one of
  /// which this option has no effect, so that to give it is an error.
  std::vector<std::string> only_with = {};
};

/// Values of a variant's options: all that it declares, checked.
class Options {
 public:
  Options() = default;
  /// Checks `given` against the declarations and fills in what is missing.
  /// @throws Error naming the variant, the option and what would be allowed; also for an option that has no
  /// effect beside the others.
  Options(std::string_view variant, std::span<const OptionSpec> declared,
          const std::map<std::string, std::string>& given);

  /// The value of a declared option as a number. @throws std::logic_error if it was not declared or is none.
  double number(std::string_view name) const;
  /// The value of a declared option as text, numbers in their shortest form. @throws std::logic_error if it
  /// was not declared.
  const std::string& text(std::string_view name) const;
  /// Whether the option was declared and has this value.
  bool is(std::string_view name, std::string_view value) const;
  /// All options as "key=value key=value" in alphabetical order, the defaults included: equal for equal
  /// settings.
  std::string canonical() const;

 private:
  std::map<std::string, std::string, std::less<>> values_;
};

/// Splits "key=value". @throws Error if there is no '=' or no key.
std::pair<std::string, std::string> parse_option(std::string_view text);

}  // namespace hermesh
