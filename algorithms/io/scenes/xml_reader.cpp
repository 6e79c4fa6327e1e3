#include "algorithms/io/scenes/xml_reader.h"

#include <algorithm>

namespace hermesh::mesh_formats {

namespace {

constexpr std::size_t kDeepest = 1000;
constexpr std::pair<std::string_view, char> kEntities[] = {
    {"amp", '&'}, {"lt", '<'}, {"gt", '>'}, {"quot", '"'}, {"apos", '\''}};

/// Whether a name ends before this character. Which characters a name may have is not checked: none that is asked for has others.
bool ends_name(char c) {
  return is_space(c) || c == '=' || c == '>' || c == '/' || c == '<' || c == '"' || c == '\'';
}

}  // namespace

XmlReader::XmlReader(std::string_view text, std::string what, MeshBuilder& builder)
    : text_(without_byte_order_mark(without_padding(text))), what_(std::move(what)), builder_(builder) {
  if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF"))
    fail("text in UTF-16, which is not read; save it as UTF-8");
}

void XmlReader::fail(const std::string& what) const {
  const auto line =
      1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size())),
                     '\n');
  builder_.fail("line " + std::to_string(line) + " of its " + what_ + ": " + what);
}

void XmlReader::fail_truncated() const { fail("the text breaks off; the file is truncated or damaged"); }

std::string_view XmlReader::local(std::string_view name) { return name.substr(name.find(':') + 1); }

std::string_view XmlReader::prefix_of(std::string_view name) {
  const std::size_t colon = name.find(':');
  return name.substr(0, colon == std::string_view::npos ? 0 : colon);
}

std::optional<std::string_view> XmlReader::attribute(std::string_view name) const {
  for (const auto& [key, value] : attributes_)
    if (key == name) return value;
  return std::nullopt;
}

std::optional<std::string_view> XmlReader::prefix_for(std::string_view part) const {
  for (const auto& [key, value] : attributes_)
    if (key.starts_with("xmlns:") && value.find(part) != std::string_view::npos) return local(key);
  return std::nullopt;
}

// Comments and the like end at a fixed word, whatever stands between.
void XmlReader::pass(std::string_view end) {
  const std::size_t found = text_.find(end, at_);
  if (found == std::string_view::npos) fail_truncated();
  at_ = found + end.size();
}

void XmlReader::pass_space() {
  while (at_ < text_.size() && is_space(text_[at_])) ++at_;
}

std::string_view XmlReader::read_name() {
  const std::size_t start = at_;
  while (at_ < text_.size() && !ends_name(text_[at_])) ++at_;
  if (at_ == start) fail("a name is missing; the file is damaged");
  return text_.substr(start, at_ - start);
}

void XmlReader::open_root() {
  if (!next()) fail("there is no element");
  root_prefix_ = prefix();
}

/// Goes to the next tag. @returns whether it starts an element, whose name is on top then; one that ends is
/// taken off.
bool XmlReader::next() {
  // An element without content begins and ends in one tag, and is told of in two steps.
  if (ends_at_once_) {
    ends_at_once_ = false;
    names_.pop_back();
    return false;
  }
  while (true) {
    builder_.tick(at_, text_.size());
    const std::size_t tag = text_.find('<', at_);
    if (tag == std::string_view::npos) {
      at_ = text_.size();
      fail_truncated();
    }
    at_ = tag;
    // From the longest beginning to the shortest, since some are the beginnings of others.
    const std::string_view rest = text_.substr(at_);
    if (rest.starts_with("<!--")) {
      at_ += 4;
      pass("-->");
    } else if (rest.starts_with("<![CDATA[")) {
      pass("]]>");
    } else if (rest.starts_with("<?")) {
      pass("?>");
    } else if (rest.starts_with("<!")) {
      fail("a document type, which files of this kind must not have");
    } else if (rest.starts_with("</")) {
      read_end();
      return false;
    } else {
      return read_start();
    }
  }
}

void XmlReader::read_end() {
  at_ += 2;
  const std::string_view name = read_name();
  pass_space();
  if (at_ == text_.size()) fail_truncated();
  if (names_.empty() || names_.back() != name || text_[at_] != '>')
    fail("an element ends that did not begin there; the file is damaged");
  ++at_;
  names_.pop_back();
}

bool XmlReader::read_start() {
  ++at_;
  const std::string_view name = read_name();
  // Only what is damaged, or made to do harm, nests deeper.
  if (names_.size() == kDeepest) fail("elements are nested too deeply; the file is damaged");
  attributes_.clear();
  for (pass_space(); at_ < text_.size() && text_[at_] != '>' && text_[at_] != '/'; pass_space()) {
    const std::string_view key = read_name();
    pass_space();
    if (at_ == text_.size()) fail_truncated();
    if (text_[at_] != '=') fail("an attribute without a value; the file is damaged");
    ++at_;
    pass_space();
    if (at_ == text_.size()) fail_truncated();
    const char quote = text_[at_];
    if (quote != '"' && quote != '\'')
      fail("an attribute's value without quotation marks; the file is damaged");
    const std::size_t end = text_.find(quote, ++at_);
    if (end == std::string_view::npos) fail_truncated();
    const std::string_view value = text_.substr(at_, end - at_);
    // A mark that was lost would make all up to the next one the value.
    if (value.find('<') != std::string_view::npos)
      fail("an attribute's value with a '<' in it; the file is damaged");
    attributes_.emplace_back(key, value);
    at_ = end + 1;
  }
  if (at_ == text_.size()) fail_truncated();
  ends_at_once_ = text_[at_] == '/';
  at_ += ends_at_once_;
  if (at_ >= text_.size()) fail_truncated();
  if (text_[at_] != '>') fail("a tag that does not end; the file is damaged");
  ++at_;
  names_.push_back(name);
  return true;
}

std::string xml_text(std::string_view value) {
  std::string result;
  for (std::size_t at = 0; at < value.size(); ++at) {
    const std::size_t end = value[at] == '&' ? value.find(';', at) : std::string_view::npos;
    const std::string_view entity = end == std::string_view::npos ? "" : value.substr(at + 1, end - at - 1);
    char c = value[at];
    bool known = false;
    for (const auto& [name, meaning] : kEntities)
      if (entity == name) c = meaning, known = true;
    if (entity.starts_with('#')) {
      const bool hexadecimal = entity.substr(1).starts_with('x');
      const char* const digits = entity.data() + (hexadecimal ? 2 : 1);
      int number = 0;
      const auto [rest, error] =
          std::from_chars(digits, entity.data() + entity.size(), number, hexadecimal ? 16 : 10);
      known = error == std::errc() && rest == entity.data() + entity.size() && number >= ' ' && number < 127;
      if (known) c = static_cast<char>(number);
    }
    // An entity that is not known stays as it is.
    result += c;
    if (known) at = end;
  }
  return result;
}

}  // namespace hermesh::mesh_formats
