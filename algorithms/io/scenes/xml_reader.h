// XML element by element, by expat, without a tree in memory. Private to algorithms/io.
#pragma once

#include <expat.h>

#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/io/mesh_file_formats.h"
#include "algorithms/io/scenes/zip_archive.h"

namespace hermesh::mesh_formats {

/// Goes through the elements of a text while it is unpacked, and calls those who asked for them. Comments and
/// processing instructions are passed over, and so is what follows the first element. A document type is
/// refused, as formats on top of XML do: its entities can make a few bytes into millions. Complaints name the
/// line; but where the archive is damaged, that is the complaint.
class XmlReader {
 public:
  using Visit = std::function<void()>;

  /// `what` names the text in complaints.
  XmlReader(ZipMember text, std::string what, MeshBuilder& builder);
  XmlReader(const XmlReader&) = delete;
  XmlReader& operator=(const XmlReader&) = delete;

  /// Goes through all of the text, and calls `visit` at the start of its first element. @throws Error where
  /// the text is not well-formed or the archive is damaged, and whatever is thrown by who is called.
  void read(const Visit& visit);

  // For who is called, about the element that has just started.

  /// Has `visit` called at the start of each of its children, once whoever asks has returned: what is named
  /// in `visit` must live until then.
  void for_each_child(Visit visit) { visits_.back() = std::move(visit); }
  /// Has `visit` called with its text, or the first thousand bytes or so, once it ends.
  void for_text(std::function<void(std::string_view)> visit);
  /// Its name, without the prefix of its namespace.
  std::string_view name() const;
  /// The prefix of the name; empty where it has none.
  std::string_view prefix() const;
  /// Whether it has this name, and the prefix that the first element has.
  bool is(std::string_view name) const { return this->name() == name && prefix() == root_prefix_; }
  /// Value of an attribute, by its whole name.
  std::optional<std::string_view> attribute(std::string_view name) const;
  /// The prefix that it declares for a namespace whose address holds `part`; none where it declares none.
  std::optional<std::string_view> prefix_for(std::string_view part) const;
  /// @throws Error about the place that was reached.
  [[noreturn]] void fail(const std::string& what);

 private:
  struct Free {
    void operator()(XML_Parser parser) const { XML_ParserFree(parser); }
  };
  void start(const char* name, const char** attributes);
  void end();
  template <class Work>
  void guard(Work&& work);
  void read_rest();
  [[noreturn]] void fail_by(XML_Error error);

  ZipMember text_;
  std::string what_;
  MeshBuilder& builder_;
  std::unique_ptr<XML_ParserStruct, Free> parser_;
  std::exception_ptr thrown_;
  std::vector<Visit>
      visits_;  ///< of the children of each element that is open; the first one is for the root
  std::function<void(std::string_view)> text_visit_;
  std::size_t text_level_ = 0;
  std::string passed_text_;
  std::string_view name_;
  const char** attributes_ = nullptr;  ///< keys and values in turn, then null
  std::string root_prefix_;
};

}  // namespace hermesh::mesh_formats
