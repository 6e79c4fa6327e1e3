// Text from outside within messages.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace hermesh {

/// Returns the length in bytes of the UTF-8 character that `text` begins with, or 0 if it is invalid (RFC
/// 3629).
inline std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const unsigned first = byte(0);
  if (text.empty()) return 0;
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xc2 && first < 0xe0   ? 2
                             : first >= 0xe0 && first < 0xf0 ? 3
                             : first >= 0xf0 && first < 0xf5 ? 4
                                                             : 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  // Overlong forms, halves of UTF-16 pairs, and values beyond the last character.
  if ((first == 0xe0 && byte(1) < 0xa0) || (first == 0xed && byte(1) > 0x9f) ||
      (first == 0xf0 && byte(1) < 0x90) || (first == 0xf4 && byte(1) > 0x8f))
    return 0;
  return length;
}

/// Returns the text for one line of a terminal: control characters and invalid UTF-8 become question marks,
/// runs of blanks and line breaks one blank. Beyond `limit` bytes it is shortened, in the middle if
/// `keep_end`, with "..." instead.
inline std::string shown(std::string_view text, std::size_t limit = 60, bool keep_end = false) {
  std::string clean;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(text.substr(at));
    const auto first = static_cast<unsigned char>(text[at]);
    const bool blank = first == ' ' || (first >= '\t' && first <= '\r');
    // U+0080 to U+009F control terminals, too.
    const bool controls = first < 0x20 || first == 0x7f ||
                          (first == 0xc2 && length == 2 && static_cast<unsigned char>(text[at + 1]) < 0xa0);
    if (blank)
      clean += clean.empty() || clean.back() != ' ' ? " " : "";
    else if (length == 0 || controls)
      clean += '?';
    else
      clean += text.substr(at, length);
    at += length == 0 ? 1 : length;
  }
  if (clean.size() <= limit) return clean;
  const auto starts_character = [&](std::size_t at) {
    return (static_cast<unsigned char>(clean[at]) & 0xc0) != 0x80;
  };
  std::size_t head = keep_end ? limit / 2 : limit, tail = keep_end ? clean.size() - limit / 2 : clean.size();
  while (head > 0 && !starts_character(head)) --head;
  while (tail < clean.size() && !starts_character(tail)) ++tail;
  return clean.substr(0, head) + "..." + clean.substr(tail);
}

}  // namespace hermesh
