// The lexer of the text formats: words, numbers and lines as programs really write them. Private to
// algorithms/io.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

namespace hermesh::mesh_formats {

inline std::string in_quotes(std::string_view text) { return "'" + std::string(text) + "'"; }
/// Returns a word of a file for a message: in quotation marks, short, with '?' for all that is not printable
/// ASCII, so that no file can control the terminal.
std::string quoted_word(std::string_view word);
/// Returns the name with '?' instead of control characters, cut to 100 bytes.
std::string clean_name(std::string_view name);
inline std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

/// Concatenates texts and numbers.
template <class... Parts>
std::string joined(const Parts&... parts) {
  std::string text;
  const auto append = [&](const auto& part) {
    if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(part)>>)
      text += std::to_string(part);
    else
      text += part;
  };
  (append(parts), ...);
  return text;
}

/// Text of a number: the shortest that reads back as the same number, or as to_chars() formats it.
class NumberText {
 public:
  template <class... Arguments>
  explicit NumberText(Arguments... arguments)
      : end_(std::to_chars(digits_, digits_ + sizeof digits_, arguments...).ptr) {}
  NumberText(const NumberText&) = delete;
  NumberText& operator=(const NumberText&) = delete;
  operator std::string_view() const { return {digits_, end_}; }

 private:
  char digits_[32];
  const char* end_;
};
/// Returns the number with three significant digits, for messages.
inline std::string three_digits(double value) {
  return std::string(std::string_view(NumberText(value, std::chars_format::general, 3)));
}

inline bool is_line_end(char c) { return c == '\n' || c == '\r'; }
inline bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
inline bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

/// Returns the text without the padding that may follow the data of a file: white space, zeros up to the end
/// of a block, and Ctrl-Z, with which CP/M and DOS end a text.
inline std::string_view without_padding(std::string_view text) {
  while (!text.empty() && (is_space(text.back()) || text.back() == '\0' || text.back() == '\x1a'))
    text.remove_suffix(1);
  return text;
}
/// Returns the text without the byte order mark that some editors put before UTF-8.
inline std::string_view without_byte_order_mark(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  return text;
}

/// Reads text from front to back, independent of the locale, up to its padding. Lines end in "\n", "\r\n" or
/// "\r", even mixed. Errors name the line.
class TextCursor {
 public:
  /// `comment` and `continuation` are characters of the format that end a number like white space.
  TextCursor(std::string_view text, std::string file, std::size_t start = 0, char comment = '\n',
             char continuation = '\n')
      : begin_(text.data()),
        at_(begin_ + start),
        end_(at_ + without_padding(text.substr(start)).size()),
        comment_(comment),
        continuation_(continuation),
        file_(std::move(file)) {
    if (start == 0) at_ = end_ - without_byte_order_mark({at_, remaining()}).size();
  }

  bool at_end() const { return at_ == end_; }
  bool at_line_end() const { return at_ == end_ || is_line_end(*at_); }
  /// Returns true if a number may end here.
  bool ends_word() const {
    return at_ == end_ || is_space(*at_) || *at_ == comment_ || *at_ == continuation_;
  }
  char peek() const { return at_ == end_ ? '\0' : *at_; }
  void advance() { ++at_; }
  std::size_t offset() const { return static_cast<std::size_t>(at_ - begin_); }
  std::size_t remaining() const { return static_cast<std::size_t>(end_ - at_); }

  void skip_space() {
    while (at_ != end_ && is_space(*at_)) ++at_;
  }
  void skip_blanks() {
    while (at_ != end_ && is_blank(*at_)) ++at_;
  }
  /// Skips blanks and returns true if a word follows on the line. For the innermost loops: mostly one blank,
  /// then a word.
  [[gnu::always_inline]] bool skip_blanks_to_word() {
    for (; at_ != end_; ++at_) {
      if (*at_ > ' ') return true;
      if (*at_ == ' ') continue;
      if (is_line_end(*at_)) return false;
      if (!is_blank(*at_)) return true;
    }
    return false;
  }
  void skip_word() {
    while (at_ != end_ && !is_space(*at_)) ++at_;
  }
  /// Skips white space, and comments from `#` to the end of the line, with whose text it calls `comment`.
  template <class Comment>
  void skip_to_word(Comment&& comment) {
    for (skip_space(); peek() == '#'; skip_space()) {
      advance();
      comment(rest_of_line());
    }
  }
  /// Skips blanks, and line ends behind the continuation character.
  void skip_blanks_and_continuations() {
    for (skip_blanks(); at_ != end_ && *at_ == continuation_; skip_blanks()) {
      const char* const start = at_++;
      skip_blanks();
      if (!at_line_end()) {
        at_ = start;
        return;
      }
      skip_line_end();
    }
  }
  std::string_view word() {
    const char* const start = at_;
    skip_word();
    return {start, static_cast<std::size_t>(at_ - start)};
  }
  /// Skips the end of the line, if the cursor is there.
  void skip_line_end() {
    if (at_ != end_ && *at_ == '\r') ++at_;
    if (at_ != end_ && *at_ == '\n') ++at_;
  }
  /// Returns the rest of the line without trailing blanks and its end, which the cursor skips.
  std::string_view rest_of_line() {
    const char* const start = at_;
    if (at_ == end_ || *at_ != '\n') at_ = end_of_line();
    const char* stop = at_;
    skip_line_end();
    while (stop != start && is_blank(stop[-1])) --stop;
    return {start, static_cast<std::size_t>(stop - start)};
  }

  /// Reads the number that starts here, followed by anything.
  template <class T>
  [[gnu::always_inline]] T leading_number(const char* what) {
    T value{};
    if (!take(value)) fail_number(what);
    return value;
  }
  /// Reads the number that starts here, if there is one and a slash or the end of the word follows. Skips all
  /// up to these in any case.
  template <class T>
  std::optional<T> leading_number_if_any() {
    T value{};
    const bool good = take(value) && (peek() == '/' || ends_word());
    while (peek() != '/' && !ends_word()) ++at_;
    return good ? std::optional(value) : std::nullopt;
  }
  /// Reads the number that is the next word. Inlining saves a seventh of the time of reading text.
  template <class T>
  [[gnu::always_inline]] T number(const char* what) {
    const char* const start = at_;
    T value{};
    if (!take_word(value)) {
      at_ = start;
      fail_number(what);
    }
    return value;
  }
  /// Reads the next word, which must exist, and returns it if it is a number.
  template <class T>
  std::optional<T> number_if_any() {
    const char* const start = at_;
    T value{};
    if (take_word(value)) return value;
    at_ = start + 1;
    while (!ends_word()) ++at_;
    return std::nullopt;
  }

  template <class... Parts>
  [[noreturn]] void fail(const Parts&... what) const {
    fail_at(offset(), joined(what...));
  }
  /// @throws Error that names the line of `offset`.
  [[noreturn]] void fail_at(std::size_t offset, const std::string& what) const;
  /// Returns the number of the line at `offset`, counting from 1. Slow: it scans all lines before.
  std::size_t line_at(std::size_t offset) const;

 private:
  template <class T>
  [[gnu::always_inline]] bool take(T& value) {
    const char* start = at_;
    if (start != end_ && *start == '+') ++start;
    auto [stop, status] = std::from_chars(start, end_, value);
    if constexpr (std::is_floating_point_v<T>) {
      // Too large and too small numbers give the same status. A long double distinguishes them.
      long double wide = HUGE_VALL;
      if (status == std::errc::result_out_of_range) {
        std::from_chars(start, end_, wide);
        value = static_cast<T>(wide);
        status = std::errc();
      }
    }
    if (status != std::errc()) return false;
    at_ = stop;
    return true;
  }
  template <class T>
  [[gnu::always_inline]] bool take_word(T& value) {
    return take(value) && (at_ == end_ || is_space(*at_) || take_odd_end(value));
  }
  /// Returns true if the number ends here although no space follows: at another character that ends a word,
  /// or behind a name of old C libraries of Windows for a number that is not finite, such as `1.#IND`.
  template <class T>
  [[gnu::noinline]] bool take_odd_end(T& value) {
    if constexpr (std::is_floating_point_v<T>)
      if (const std::optional<double> named = take_windows_name(value < T(0))) {
        value = static_cast<T>(*named);
        return true;
      }
    return ends_word();
  }
  std::optional<double> take_windows_name(bool negative);
  /// Returns the end of the current line. Caches the next "\n", or each line of a text without any would be
  /// searched to the end of the text.
  const char* end_of_line() {
    if (!newline_ || newline_ < at_) {
      const void* const found = std::memchr(at_, '\n', remaining());
      newline_ = found ? static_cast<const char*>(found) : end_;
    }
    const void* const found = std::memchr(at_, '\r', static_cast<std::size_t>(newline_ - at_));
    return found ? static_cast<const char*>(found) : newline_;
  }
  [[noreturn]] void fail_number(const char* what);

  const char *begin_, *at_, *end_, *newline_ = nullptr;
  char comment_, continuation_;
  std::string file_;
};

}  // namespace hermesh::mesh_formats
