#include "algorithms/io/scenes/xml_reader.h"

#include <malloc.h>

#include <algorithm>
#include <cstdlib>
#include <new>

namespace hermesh::mesh_formats {

namespace {

constexpr std::size_t kDeepestElement = 1000;
constexpr std::size_t kParsedPiece = std::size_t(1) << 18;
/// Bytes of an element's text that are kept; only short words are ever asked for.
constexpr std::size_t kMostText = 1000;
/// Memory that the parsers of a thread may take. They keep each name once, and the tag that they are in as a
/// whole, of which only what was made to do harm has millions of bytes.
constexpr std::size_t kMostTaken = std::size_t(1) << 23;
thread_local std::size_t taken = 0;

void* take_again(void* old, std::size_t size) {
  const std::size_t before = malloc_usable_size(old);
  if (size > kMostTaken - std::min(taken - before, kMostTaken)) return nullptr;
  void* const now = std::realloc(old, size);
  if (now) taken += malloc_usable_size(now) - before;
  return now;
}
void* take(std::size_t size) { return take_again(nullptr, size); }
void give_back(void* memory) {
  taken -= malloc_usable_size(memory);
  std::free(memory);
}
constexpr XML_Memory_Handling_Suite kMemory = {take, take_again, give_back};

XmlReader& reader(void* user) { return *static_cast<XmlReader*>(user); }

}  // namespace

XmlReader::XmlReader(ZipMember text, std::string what, MeshBuilder& builder)
    : text_(std::move(text)),
      what_(std::move(what)),
      builder_(builder),
      parser_(XML_ParserCreate_MM(nullptr, &kMemory, nullptr)) {
  XML_Parser const parser = parser_.get();
  if (!parser) throw std::bad_alloc();
  XML_SetUserData(parser, this);
  XML_SetElementHandler(
      parser,
      [](void* user, const char* name, const char** attributes) { reader(user).start(name, attributes); },
      [](void* user, const char*) { reader(user).end(); });
  XML_SetCharacterDataHandler(parser, [](void* user, const char* piece, int size) {
    std::string& kept = reader(user).passed_text_;
    if (reader(user).text_visit_ && kept.size() < kMostText)
      reader(user).guard([&] { kept.append(piece, static_cast<std::size_t>(size)); });
  });
  // It is told of before the first entity is declared.
  XML_SetStartDoctypeDeclHandler(parser, [](void* user, const char*, const char*, const char*, int) {
    reader(user).guard([&] { reader(user).fail("a document type, which files of this kind must not have"); });
  });
}

/// Work that the parser asks for is done within: the parser calls from C, which no exception may pass
/// through.
template <class Work>
void XmlReader::guard(Work&& work) {
  // It may tell of the end of an element even though it was stopped at its start.
  if (thrown_) return;
  try {
    work();
  } catch (...) {
    thrown_ = std::current_exception();
    XML_StopParser(parser_.get(), XML_FALSE);
  }
}

void XmlReader::read(const Visit& visit) {
  visits_ = {visit};
  XML_ParsingStatus state = {XML_INITIALIZED, XML_FALSE};
  while (state.parsing != XML_FINISHED) {
    builder_.context().check();
    void* const room = XML_GetBuffer(parser_.get(), kParsedPiece);
    if (!room) fail_by(XML_GetErrorCode(parser_.get()));
    const std::size_t size = text_.read({static_cast<char*>(room), kParsedPiece});
    const XML_Status status = XML_ParseBuffer(parser_.get(), static_cast<int>(size), size == 0);
    if (thrown_) std::rethrow_exception(thrown_);
    XML_GetParsingStatus(parser_.get(), &state);
    // Stopped at the end of the first element, which is the end of all that counts.
    const XML_Error error = XML_GetErrorCode(parser_.get());
    if (status != XML_STATUS_OK && error != XML_ERROR_ABORTED) fail_by(error);
  }
  read_rest();
}

/// Reads what is left of the archive's member, whose checksum is known at its end alone.
void XmlReader::read_rest() {
  std::string room(kParsedPiece, '\0');
  while (text_.read(room) > 0) builder_.context().check();
}

void XmlReader::start(const char* name, const char** attributes) {
  guard([&] {
    builder_.tick(text_.done(), text_.size());
    // Only what is damaged, or made to do harm, nests deeper.
    if (visits_.size() > kDeepestElement) fail("elements are nested too deeply; the file is damaged");
    name_ = name, attributes_ = attributes;
    if (visits_.size() == 1) root_prefix_ = prefix();
    visits_.emplace_back();
    if (const Visit& visit = visits_[visits_.size() - 2]) visit();
  });
}

void XmlReader::end() {
  guard([&] {
    if (text_visit_ && visits_.size() == text_level_) std::exchange(text_visit_, nullptr)(passed_text_);
    visits_.pop_back();
    if (visits_.size() == 1) XML_StopParser(parser_.get(), XML_FALSE);
  });
}

void XmlReader::for_text(std::function<void(std::string_view)> visit) {
  text_visit_ = std::move(visit);
  text_level_ = visits_.size();
  passed_text_.clear();
}

std::string_view XmlReader::name() const { return name_.substr(name_.find(':') + 1); }

std::string_view XmlReader::prefix() const {
  const std::size_t colon = name_.find(':');
  return name_.substr(0, colon == std::string_view::npos ? 0 : colon);
}

std::optional<std::string_view> XmlReader::attribute(std::string_view name) const {
  for (const char** each = attributes_; *each; each += 2)
    if (each[0] == name) return each[1];
  return std::nullopt;
}

std::optional<std::string_view> XmlReader::prefix_for(std::string_view part) const {
  constexpr std::string_view declares = "xmlns:";
  for (const char** each = attributes_; *each; each += 2)
    if (std::string_view(each[0]).starts_with(declares) &&
        std::string_view(each[1]).find(part) != std::string_view::npos)
      return each[0] + declares.size();
  return std::nullopt;
}

void XmlReader::fail(const std::string& what) {
  const std::string line = std::to_string(XML_GetCurrentLineNumber(parser_.get()));
  // Where the archive is damaged the text may say anything, and is not to blame.
  read_rest();
  builder_.fail("line " + line + " of its " + what_ + ": " + what);
}

/// Says what the parser found.
void XmlReader::fail_by(XML_Error error) {
  switch (error) {
    case XML_ERROR_NO_ELEMENTS:
    case XML_ERROR_UNCLOSED_TOKEN:
    case XML_ERROR_PARTIAL_CHAR:
    case XML_ERROR_UNCLOSED_CDATA_SECTION:
      fail("the text breaks off; the file is truncated or damaged");
    case XML_ERROR_NO_MEMORY:
      fail("a tag of millions of bytes, or as many names; the file is damaged");
    default:
      fail(std::string(XML_ErrorString(error)) + "; the file is damaged");
  }
}

}  // namespace hermesh::mesh_formats
