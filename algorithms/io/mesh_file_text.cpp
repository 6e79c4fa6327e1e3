#include "algorithms/io/mesh_file_text.h"

#include <algorithm>
#include <limits>

#include "algorithms/core/error.h"

namespace hermesh::mesh_formats {

std::string quoted_word(std::string_view word) {
  // Enough to find the word in the file.
  constexpr std::size_t most = 40;
  std::string text(word.substr(0, most));
  for (char& c : text)
    if (c < ' ' || c > '~') c = '?';
  if (word.size() > most) text += "...";
  return in_quotes(text);
}

std::string clean_name(std::string_view name) {
  std::string text(name.substr(0, 100));
  for (char& c : text)
    // Bytes of UTF-8 stay, for names in other scripts.
    if ((c >= '\0' && c < ' ') || c == '\x7f') c = '?';
  return text;
}

std::size_t TextCursor::line_at(std::size_t offset) const {
  // "\r\n" counts once, at its second character.
  std::size_t line = 1;
  for (const char* at = begin_; at != begin_ + offset; ++at)
    line += *at == '\n' || (*at == '\r' && (at + 1 == end_ || at[1] != '\n'));
  return line;
}

void TextCursor::fail_at(std::size_t offset, const std::string& what) const {
  throw Error(joined(in_quotes(file_), ", line ", line_at(offset), ": ", what));
}

void TextCursor::fail_number(const char* what) {
  if (at_end()) fail("the file is truncated: it ends where ", what, " should be");
  if (at_line_end()) fail("the line ends where ", what, " should be");
  const std::size_t here = offset();
  const std::string_view found = word();
  // A decimal comma, as many countries use it, is the likeliest reason.
  const std::size_t comma = found.find(',');
  const bool decimal = comma != std::string_view::npos && comma + 1 < found.size() &&
                       found[comma + 1] >= '0' && found[comma + 1] <= '9' &&
                       found.find('.') == std::string_view::npos;
  fail_at(here, quoted_word(found) + " is not " + what + (decimal ? "; decimals need a point" : ""));
}

std::optional<double> TextCursor::take_windows_name(bool negative) {
  constexpr double infinity = std::numeric_limits<double>::infinity(),
                   nan = std::numeric_limits<double>::quiet_NaN();
  // printf() of old Windows libraries: 1.#INF, -1.#IND, 1.#QNAN. take() has read the "1." before.
  constexpr std::pair<std::string_view, double> names[] = {
      {"#INF", infinity}, {"#IND", nan}, {"#QNAN", nan}, {"#SNAN", nan}, {"#NAN", nan}};
  const std::string_view rest(at_, remaining());
  for (const auto& [name, value] : names)
    if (rest.starts_with(name)) {
      skip_word();  // printf() may have put digits behind the name
      return negative ? -value : value;
    }
  return std::nullopt;
}

}  // namespace hermesh::mesh_formats
