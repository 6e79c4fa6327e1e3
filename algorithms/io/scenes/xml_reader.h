// XML in a ZIP archive, by expat and minizip. Private to algorithms/io.
#pragma once

#include <expat.h>
#include <malloc.h>

#include <cstdlib>
#include <exception>
#include <functional>
#include <memory>
#include <new>

#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/scenes/zip_archive.h"

namespace hermesh::mesh_formats {

namespace xml_memory {

/// Deepest nesting of elements in undamaged files.
inline constexpr std::size_t kDeepestElement = 1000;
inline constexpr std::size_t kParsedPiece = std::size_t(1) << 18;
/// Bytes of an element's text that are stored; only short words are needed.
inline constexpr std::size_t kMostText = 1000;
/// Memory that the parsers of a thread may take. They store each name once and the current tag as a whole,
/// which has millions of bytes only in malicious files.
inline constexpr std::size_t kMostTaken = std::size_t(1) << 23;
inline thread_local std::size_t taken = 0;

inline void* take_again(void* old, std::size_t size) {
  const std::size_t before = malloc_usable_size(old);
  if (size > kMostTaken - std::min(taken - before, kMostTaken)) return nullptr;
  void* const now = std::realloc(old, size);
  if (now) taken += malloc_usable_size(now) - before;
  return now;
}
inline void* take(std::size_t size) { return take_again(nullptr, size); }
inline void give_back(void* memory) {
  taken -= malloc_usable_size(memory);
  std::free(memory);
}
inline constexpr XML_Memory_Handling_Suite kMemory = {take, take_again, give_back};

}  // namespace xml_memory

/// Parses the XML of a member of an archive while it is unpacked, without a tree in memory, and calls the
/// visitors of its elements. Comments, processing instructions and everything behind the first element are
/// ignored. A document type is rejected, as formats based on XML do, since its entities can make a few bytes
/// into millions. Errors name the line; if the archive is damaged, that is the error.
class XmlReader {
 public:
  using Visit = std::function<void()>;

  /// Opens the member; `what` names the text in messages.
  XmlReader(ZipArchive& archive, const std::string& member, std::string what, MeshBuilder& builder)
      : archive_(archive),
        what_(std::move(what)),
        builder_(builder),
        parser_(XML_ParserCreate_MM(nullptr, &xml_memory::kMemory, nullptr)) {
    archive_.open(member);
    XML_Parser const parser = parser_.get();
    if (!parser) throw std::bad_alloc();
    XML_SetUserData(parser, this);
    XML_SetElementHandler(
        parser,
        [](void* user, const char* name, const char** attributes) { self(user).start(name, attributes); },
        [](void* user, const char*) { self(user).end(); });
    XML_SetCharacterDataHandler(parser, [](void* user, const char* piece, int size) {
      std::string& text = self(user).text_;
      if (self(user).text_visit_ && text.size() < xml_memory::kMostText)
        self(user).guard([&] { text.append(piece, static_cast<std::size_t>(size)); });
    });
    // Called before the first entity is declared.
    XML_SetStartDoctypeDeclHandler(parser, [](void* user, const char*, const char*, const char*, int) {
      self(user).guard([&] { self(user).fail("a document type, which files of this kind must not have"); });
    });
  }
  XmlReader(const XmlReader&) = delete;
  XmlReader& operator=(const XmlReader&) = delete;

  /// Parses the text and calls `visit` at the start of its first element. @throws Error if the text is not
  /// well-formed or the archive is damaged, and everything that a visitor throws.
  void read(const Visit& visit) {
    visits_ = {visit};
    XML_ParsingStatus state = {XML_INITIALIZED, XML_FALSE};
    while (state.parsing != XML_FINISHED) {
      builder_.context().check();
      void* const room = XML_GetBuffer(parser_.get(), xml_memory::kParsedPiece);
      if (!room) fail_by(XML_GetErrorCode(parser_.get()));
      const std::size_t size = archive_.read({static_cast<char*>(room), xml_memory::kParsedPiece});
      const XML_Status status = XML_ParseBuffer(parser_.get(), static_cast<int>(size), size == 0);
      if (thrown_) std::rethrow_exception(thrown_);
      XML_GetParsingStatus(parser_.get(), &state);
      // end() aborts at the end of the first element.
      const XML_Error error = XML_GetErrorCode(parser_.get());
      if (status != XML_STATUS_OK && error != XML_ERROR_ABORTED) fail_by(error);
    }
    read_rest();
  }

  // For visitors, about the element that has just started.

  /// Calls `visit` at the start of each child, after the caller has returned: references in `visit` must be
  /// valid until then.
  void for_each_child(Visit visit) { visits_.back() = std::move(visit); }
  /// Calls `visit` at the end of the element with its text, cut to about a thousand bytes.
  void for_text(std::function<void(std::string_view)> visit) {
    text_visit_ = std::move(visit);
    text_level_ = visits_.size();
    text_.clear();
  }
  /// Returns the name without the prefix of its namespace.
  std::string_view name() const { return name_.substr(name_.find(':') + 1); }
  /// True if the element has this name, and the prefix of the first element.
  bool is(std::string_view name) const { return this->name() == name && prefix() == root_prefix_; }
  /// Returns the value of an attribute by its whole name.
  std::optional<std::string_view> attribute(std::string_view name) const {
    for (const char** each = attributes_; *each; each += 2)
      if (each[0] == name) return each[1];
    return std::nullopt;
  }
  /// Returns the prefix that the element declares for a namespace whose address contains `part`.
  std::optional<std::string_view> prefix_for(std::string_view part) const {
    constexpr std::string_view declares = "xmlns:";
    for (const char** each = attributes_; *each; each += 2)
      if (std::string_view(each[0]).starts_with(declares) &&
          std::string_view(each[1]).find(part) != std::string_view::npos)
        return each[0] + declares.size();
    return std::nullopt;
  }
  /// @throws Error about the current line.
  template <class... Parts>
  [[noreturn]] void fail(const Parts&... what) {
    const std::size_t line = XML_GetCurrentLineNumber(parser_.get());
    // If the archive is damaged, that is the cause of a wrong text.
    read_rest();
    builder_.fail("line ", line, " of its ", what_, ": ", what...);
  }

 private:
  struct Free {
    void operator()(XML_Parser parser) const { XML_ParserFree(parser); }
  };
  static XmlReader& self(void* user) { return *static_cast<XmlReader*>(user); }

  /// Runs `work` for the parser, which calls from C, so no exception may leave it.
  template <class Work>
  void guard(Work&& work) {
    // The parser reports the end of an element even if it was stopped at its start.
    if (thrown_) return;
    try {
      work();
    } catch (...) {
      thrown_ = std::current_exception();
      XML_StopParser(parser_.get(), XML_FALSE);
    }
  }
  void start(const char* name, const char** attributes) {
    guard([&] {
      builder_.tick(archive_.done(), archive_.size());
      if (visits_.size() > xml_memory::kDeepestElement)
        fail("elements are nested too deeply; the file is damaged");
      name_ = name, attributes_ = attributes;
      if (visits_.size() == 1) root_prefix_ = prefix();
      visits_.emplace_back();
      if (const Visit& visit = visits_[visits_.size() - 2]) visit();
    });
  }
  void end() {
    guard([&] {
      if (text_visit_ && visits_.size() == text_level_) std::exchange(text_visit_, nullptr)(text_);
      visits_.pop_back();
      if (visits_.size() == 1) XML_StopParser(parser_.get(), XML_FALSE);
    });
  }
  std::string_view prefix() const {
    const std::size_t colon = name_.find(':');
    return name_.substr(0, colon == std::string_view::npos ? 0 : colon);
  }
  /// Reads the rest of the member, whose checksum is compared at its end.
  void read_rest() {
    std::string room(xml_memory::kParsedPiece, '\0');
    while (archive_.read(room) > 0) builder_.context().check();
  }
  [[noreturn]] void fail_by(XML_Error error) {
    switch (error) {
      case XML_ERROR_NO_ELEMENTS:
      case XML_ERROR_UNCLOSED_TOKEN:
      case XML_ERROR_PARTIAL_CHAR:
      case XML_ERROR_UNCLOSED_CDATA_SECTION:
        fail("the text breaks off; the file is truncated or damaged");
      case XML_ERROR_NO_MEMORY:
        fail("a tag of millions of bytes, or as many names; the file is damaged");
      default:
        fail(XML_ErrorString(error), "; the file is damaged");
    }
  }

  ZipArchive& archive_;
  std::string what_;
  MeshBuilder& builder_;
  std::unique_ptr<XML_ParserStruct, Free> parser_;
  std::exception_ptr thrown_;
  std::vector<Visit> visits_;  ///< of the children of each open element; the first one is for the root
  std::function<void(std::string_view)> text_visit_;
  std::size_t text_level_ = 0;
  std::string text_;
  std::string_view name_;
  const char** attributes_ = nullptr;  ///< keys and values in turn, then null
  std::string root_prefix_;
};

}  // namespace hermesh::mesh_formats
