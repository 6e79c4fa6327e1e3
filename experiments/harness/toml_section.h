// A table of a TOML file that is read strictly: every key is known and asked for, and a complaint names its
// line.
#pragma once

#include <toml++/toml.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/core/shown.h"

namespace hermesh {

/// With commas between them, as many as fit a sentence, and the number of those that do not.
inline std::string joined(const std::vector<std::string>& names) {
  constexpr std::size_t kLongest = 120;
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (text.size() + names[i].size() > kLongest && i > 0) return text + " and " + std::to_string(names.size() - i) + " more";
    text += (text.empty() ? "" : ", ") + shown(names[i]);
  }
  return text;
}

/// The names, those most like `name` first (by the number of letters to change, insert or leave out).
inline std::vector<std::string> likest_first(std::vector<std::string> names, const std::string& name) {
  const auto distance = [&](const std::string& other) {
    std::vector<std::size_t> row(other.size() + 1);
    for (std::size_t j = 0; j < row.size(); ++j) row[j] = j;
    for (std::size_t i = 0; i < std::min<std::size_t>(name.size(), 100); ++i) {
      std::size_t diagonal = row[0]++;
      for (std::size_t j = 1; j < row.size(); ++j) {
        const std::size_t changed = diagonal + (name[i] != other[j - 1]);
        diagonal = row[j];
        row[j] = std::min({changed, row[j] + 1, row[j - 1] + 1});
      }
    }
    return row.back();
  };
  std::ranges::stable_sort(names, {}, distance);
  return names;
}

/// A table of the file that insists on every key being known and asked for. Its messages begin with
/// "file:line: ".
class Section {
 public:
  Section(std::string file, const toml::table& table, std::string what, std::vector<std::string> known)
      : file_(std::move(file)), table_(table), what_(std::move(what)) {
    for (const auto& [key, value] : table_)
      if (std::find(known.begin(), known.end(), key.str()) == known.end())
        fail(key.source().begin.line,
             "unknown key \"" + shown(key.str()) + "\" in " + what_ + "; it takes " +
                 joined(likest_first(known, std::string(key.str()))));
  }

  [[noreturn]] void fail(toml::source_index line, const std::string& sentence) const {
    throw Error(file_ + ":" + std::to_string(std::max<toml::source_index>(line, 1)) + ": " + sentence);
  }
  [[noreturn]] void fail_at(const std::string& key, const std::string& sentence) const {
    const toml::node* node = table_.get(key);
    fail(node ? node->source().begin.line : line(), sentence);
  }
  toml::source_index line() const { return table_.source().begin.line; }
  const std::string& file() const { return file_; }
  bool has(const std::string& key) const { return table_.contains(key); }

  std::string text(const std::string& key) const {
    const toml::node& node = required(key);
    // What is in a file is printed, and so must not control a terminal.
    if (const auto* value = node.as_string(); value && !value->get().empty() && is_plain(value->get())) return value->get();
    fail(node.source().begin.line, "\"" + key + "\" must be a text that is not empty and holds no control characters");
  }
  std::string text_or(const std::string& key, const std::string& fallback) const {
    return has(key) ? text(key) : fallback;
  }
  bool is_text(const std::string& key) const { return has(key) && table_.get(key)->is_string(); }
  /// Which of the texts it is.
  std::size_t choice(const std::string& key, const std::vector<std::string>& choices) const {
    const auto found = std::find(choices.begin(), choices.end(), text(key));
    if (found != choices.end()) return static_cast<std::size_t>(found - choices.begin());
    fail_at(key, "\"" + key + "\" must be one of " + joined(choices));
  }
  bool flag_or(const std::string& key, bool fallback) const {
    if (!has(key)) return fallback;
    if (const auto* value = table_.get(key)->as_boolean()) return value->get();
    fail_at(key, "\"" + key + "\" must be true or false");
  }
  double number_or(const std::string& key, double fallback, double lower, double upper) const {
    return has(key) ? number(*table_.get(key), key, lower, upper) : fallback;
  }
  std::int64_t integer_or(const std::string& key, std::int64_t fallback, std::int64_t lower,
                          std::int64_t upper) const {
    return has(key) ? integer(*table_.get(key), key, lower, upper) : fallback;
  }

  double number(const toml::node& node, const std::string& key, double lower, double upper) const {
    const std::optional<double> value = node.is_number() ? node.value<double>() : std::nullopt;
    if (value && *value >= lower && *value <= upper) return *value;
    std::ostringstream range;
    range << "\"" << key << "\" must be a number from " << lower << " to " << upper;
    fail(node.source().begin.line, range.str());
  }
  std::int64_t integer(const toml::node& node, const std::string& key, std::int64_t lower,
                       std::int64_t upper) const {
    if (const auto* value = node.as_integer(); value && value->get() >= lower && value->get() <= upper)
      return value->get();
    fail(node.source().begin.line, "\"" + key + "\" must be a whole number from " + std::to_string(lower) +
                                       " to " + std::to_string(upper));
  }

  const toml::array& list(const std::string& key) const {
    const toml::node& node = required(key);
    if (const auto* array = node.as_array(); array && !array->empty()) return *array;
    fail(node.source().begin.line, "\"" + key + "\" must be a list [ … ] that is not empty");
  }
  /// Names out of `known`, each at most once.
  std::vector<std::string> names(const std::string& key, const std::string& kind,
                                 const std::vector<std::string>& known) const {
    std::vector<std::string> result;
    for (const toml::node& node : list(key)) {
      const auto* value = node.as_string();
      if (!value) fail(node.source().begin.line, "\"" + key + "\" must be a list of texts");
      const std::string name = value->get();
      if (std::find(known.begin(), known.end(), name) == known.end())
        fail(node.source().begin.line,
             "there is no " + kind + " \"" + shown(name) + "\"; there are " + joined(likest_first(known, name)));
      if (std::find(result.begin(), result.end(), name) != result.end())
        fail(node.source().begin.line, "the " + kind + " \"" + shown(name) + "\" is named twice");
      result.push_back(name);
    }
    return result;
  }
  const toml::table& table(const toml::node& node, const std::string& what) const {
    if (const auto* value = node.as_table()) return *value;
    fail(node.source().begin.line, what + " must be a table");
  }
  const toml::table* optional_table(const std::string& key) const {
    const toml::node* node = table_.get(key);
    return node ? &table(*node, "\"" + key + "\"") : nullptr;
  }

 private:
  const toml::node& required(const std::string& key) const {
    const toml::node* node = table_.get(key);
    if (!node) fail(line(), what_ + " needs the key \"" + key + "\"");
    return *node;
  }

  static bool is_plain(const std::string& text) {
    return std::ranges::none_of(text, [](unsigned char c) { return (c < 0x20 && c != '\n' && c != '\t') || c == 0x7f; });
  }

  std::string file_;
  const toml::table& table_;
  std::string what_;
};

/// @throws Error for a file that is not there or has a syntax error.
inline toml::table parse_toml(const std::filesystem::path& path) {
  const std::string file = path.filename().string();
  if (!std::filesystem::is_regular_file(path))
    throw Error("there is no experiment file " + path.string() +
                "; `hermesh list` names those that there are");
  try {
    return toml::parse_file(path.string());
  } catch (const toml::parse_error& error) {
    throw Error(file + ":" + std::to_string(std::max<toml::source_index>(error.source().begin.line, 1)) +
                ": " + shown(error.description(), 150));
  }
}

}  // namespace hermesh
