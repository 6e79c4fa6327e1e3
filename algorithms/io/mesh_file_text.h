// The lexer that the text formats share: words, numbers and lines as programs really write them. Private to
// algorithms/io/mesh_file*.cpp.
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

/// The text in quotation marks, for sentences.
inline std::string in_quotes(std::string_view text) {
  std::string result = "'";
  result += text;
  return result += "'";
}
/// A word of a file for a sentence: in quotation marks, short, with '?' for all that is not printable ASCII,
/// so that no file can write to the terminal.
std::string quoted_word(std::string_view word);
/// The name with '?' in place of control characters, cut to 100 bytes.
std::string clean_name(std::string_view name);

inline bool is_line_end(char c) { return c == '\n' || c == '\r'; }
inline bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
inline bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }  // both of these
/// What may follow the data of a file without being data: white space, zeros up to the end of a block, and
/// Ctrl-Z, with which CP/M and DOS end a text.
inline bool is_padding(char c) { return is_space(c) || c == '\0' || c == '\x1a'; }

/// The text without the padding at its end.
inline std::string_view without_padding(std::string_view text) {
  while (!text.empty() && is_padding(text.back())) text.remove_suffix(1);
  return text;
}
/// Whether the padding at the end of the text is more than white space.
bool has_odd_padding(std::string_view text);
/// The text without the byte order mark that some editors put before UTF-8.
inline std::string_view without_byte_order_mark(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  return text;
}

/// Reads text from front to back; independent of the locale. Lines end in "\n", "\r\n" or "\r", mixed as they
/// come. The text ends before the padding at its end. Complaints name the line.
class TextCursor {
 public:
  /// `comment` and `continuation` are characters that end a number as white space does, where the format has
  /// them.
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
  /// Whether a number may end here.
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
  /// Passes over blanks and tells whether the line goes on behind them. For the innermost loops: mostly one
  /// blank, then a word.
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
  /// Passes over white space, and over comments from `#` to the end of the line, whose text goes to
  /// `comment`.
  template <class Comment>
  void skip_to_word(Comment&& comment) {
    for (skip_space(); peek() == '#'; skip_space()) {
      advance();
      comment(rest_of_line());
    }
  }
  /// Passes over blanks, and over line ends behind a character that continues the line on the next one.
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
  /// Moves behind the end of the line, if the cursor stands before it.
  void skip_line_end() {
    if (at_ != end_ && *at_ == '\r') ++at_;
    if (at_ != end_ && *at_ == '\n') ++at_;
  }
  /// What is left of the line, without its end and the blanks before that; the cursor moves behind it.
  std::string_view rest_of_line() {
    const char* const start = at_;
    if (at_ == end_ || *at_ != '\n') at_ = end_of_line();
    const char* stop = at_;
    skip_line_end();
    while (stop != start && is_blank(stop[-1])) --stop;
    return {start, static_cast<std::size_t>(stop - start)};
  }

  /// The number that starts here; what ends it is not looked at.
  template <class T>
  [[gnu::always_inline]] T leading_number(const char* what) {
    T value{};
    if (!take(value)) fail_number(what);
    return value;
  }
  /// The number that starts here, if there is one and a slash or the end of the word follows. All up to these
  /// is passed over in any case.
  template <class T>
  std::optional<T> leading_number_if_any() {
    T value{};
    const bool good = take(value) && (peek() == '/' || ends_word());
    while (peek() != '/' && !ends_word()) ++at_;
    return good ? std::optional(value) : std::nullopt;
  }
  /// The number that is the next word. Inlined by order: a seventh of the time that text takes.
  template <class T>
  [[gnu::always_inline]] T number(const char* what) {
    const char* const start = at_;
    T value{};
    if (!take(value) || !(at_ == end_ || is_space(*at_) || take_odd_end(value))) {
      at_ = start;
      fail_number(what);
    }
    return value;
  }
  /// The number that is the next word, or nothing if that is something else, which is passed over. There must
  /// be a word.
  template <class T>
  std::optional<T> number_if_any() {
    const char* const start = at_;
    T value{};
    if (take(value) && (at_ == end_ || is_space(*at_) || take_odd_end(value))) return value;
    at_ = start + 1;
    while (!ends_word()) ++at_;
    return std::nullopt;
  }

  [[noreturn]] void fail(const std::string& what) const { fail_at(offset(), what); }
  /// @throws Error that names the line of `offset`, the place that is complained about.
  [[noreturn]] void fail_at(std::size_t offset, const std::string& what) const;
  /// Number of the line at `offset`, counting from 1. It looks at all lines before, so it is for complaints
  /// only.
  std::size_t line_at(std::size_t offset) const;

 private:
  template <class T>
  [[gnu::always_inline]] bool take(T& value) {
    const char* start = at_;
    if (start != end_ && *start == '+') ++start;
    auto [stop, status] = std::from_chars(start, end_, value);
    if constexpr (std::is_floating_point_v<T>) {
      // Too large and too small look the same here; long double tells them apart, and its overflow is
      // infinity.
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
  /// Whether what stands behind a number ends it although it is no space: another character that may end a
  /// word, or the rest of a name that old C libraries of Windows give to what is not finite, such as
  /// `1.#IND`.
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
  /// End of the line that the cursor is in. The next "\n" is remembered, or each line of a text without any
  /// would be searched to the end of the text.
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
