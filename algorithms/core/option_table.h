// Options of a variant, each bound to the member that it sets, with its name, default, range and meaning in a
// single entry.
#pragma once

#include <charconv>
#include <cmath>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/core/options.h"

namespace hermesh {

/// The options that set members of `Settings`. The default of an option is its member's default.
template <class Settings>
class OptionTable {
 public:
  struct Range {
    double minimum = 0.0, maximum = 1e300;  ///< 1e300: no limit
  };

  /// Declares a number, which must be an integer if its member is one. `only_with` is that of OptionSpec.
  template <class Number>
  OptionTable&& number(const std::string& name, Number Settings::*member, Range range, std::string help,
                       std::vector<std::string> only_with = {}) && {
    char buffer[32];
    const auto fallback = std::to_chars(buffer, buffer + sizeof buffer, Settings{}.*member).ptr;
    entries_.push_back({{.name = name,
                         .fallback = {buffer, fallback},
                         .help = std::move(help),
                         .minimum = range.minimum,
                         .maximum = range.maximum,
                         .only_with = std::move(only_with)},
                        [=](Settings& settings, const Options& options) {
                          const double value = options.number(name);
                          if (std::is_integral_v<Number> && value != std::floor(value))
                            throw Error("option '" + name + "' takes whole numbers, not " +
                                        options.text(name));
                          settings.*member = static_cast<Number>(value);
                        }});
    return std::move(*this);
  }

  /// Declares a choice among named values. @throws std::logic_error if the member's default has no name.
  template <class Value>
  OptionTable&& choice(const std::string& name, Value Settings::*member,
                       std::vector<std::pair<std::string, Value>> values, std::string help,
                       std::vector<std::string> only_with = {}) && {
    OptionSpec spec{.name = name, .fallback = "", .help = std::move(help), .only_with = std::move(only_with)};
    for (const auto& [word, value] : values) {
      spec.choices.push_back(word);
      if (value == Settings{}.*member) spec.fallback = word;
    }
    if (spec.fallback.empty()) throw std::logic_error("the default of option " + name + " has no name");
    entries_.push_back(
        {std::move(spec), [=, named = std::map<std::string, Value>(values.begin(), values.end())](
                              Settings& settings, const Options& options) {
           settings.*member = named.at(options.text(name));
         }});
    return std::move(*this);
  }

  /// Returns the declarations in order, for the variant's entry in the table.
  std::vector<OptionSpec> specs() const {
    std::vector<OptionSpec> specs;
    for (const Entry& entry : entries_) specs.push_back(entry.spec);
    return specs;
  }

  /// Returns the settings that checked options specify; options of other tables are ignored. @throws Error
  /// for a fraction where an integer is required; std::logic_error if an option is missing.
  Settings read(const Options& options) const {
    Settings settings{};
    for (const Entry& entry : entries_) entry.set(settings, options);
    return settings;
  }

  /// Returns a table of all options except one, whose member retains its default.
  OptionTable without(const std::string& name) const {
    OptionTable others = *this;
    std::erase_if(others.entries_, [&](const Entry& entry) { return entry.spec.name == name; });
    return others;
  }

 private:
  struct Entry {
    OptionSpec spec;
    std::function<void(Settings&, const Options&)> set;
  };
  std::vector<Entry> entries_;
};

}  // namespace hermesh
