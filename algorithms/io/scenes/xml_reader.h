// XML element by element, without a tree in memory. Private to algorithms/io.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

/// Goes through the elements of a text in UTF-8, and checks that they are nested as XML wants it. Text
/// between tags, comments and processing instructions are passed over. A document type is refused, as formats
/// on top of XML do: its entities can make a few bytes into millions. Complaints name the line.
class XmlReader {
 public:
  /// `what` names the text in complaints.
  XmlReader(std::string_view text, std::string what, MeshBuilder& builder);

  /// Goes to the first element. @throws Error if there is none.
  void open_root();
  /// Calls `visit` at the start of each child of the element that was started last; what it leaves of the
  /// child is passed over. @throws Error where the text is not well-formed.
  template <class Visit>
  void for_each_child(Visit&& visit) {
    const std::size_t level = names_.size();
    while (true) {
      const bool start = next();
      if (!start && names_.size() < level) return;
      if (start && names_.size() == level + 1) visit();
    }
  }

  /// Name of the element that was started last, without the prefix of its namespace.
  std::string_view name() const { return local(names_.back()); }
  /// The prefix of the name; empty where it has none.
  std::string_view prefix() const { return prefix_of(names_.back()); }
  /// Whether the element that was started last has this name, and the prefix that the root has.
  bool is(std::string_view name) const { return this->name() == name && prefix() == root_prefix_; }
  /// The text behind the tag that was read last, up to the next one.
  std::string_view text() const { return text_.substr(at_, text_.find('<', at_) - at_); }
  /// Value of an attribute of the element that was started last as it stands in the text, by its whole name;
  /// good until another element starts.
  std::optional<std::string_view> attribute(std::string_view name) const;
  /// The prefix that this element declares for a namespace whose address holds `part`; none where it declares
  /// none.
  std::optional<std::string_view> prefix_for(std::string_view part) const;
  /// @throws Error about the place that was reached.
  [[noreturn]] void fail(const std::string& what) const;
  MeshBuilder& builder() { return builder_; }

 private:
  static std::string_view local(std::string_view name);
  static std::string_view prefix_of(std::string_view name);
  bool next();
  bool read_start();
  void read_end();
  void pass(std::string_view end);
  void pass_space();
  std::string_view read_name();
  [[noreturn]] void fail_truncated() const;

  std::string_view text_;
  std::string what_;
  MeshBuilder& builder_;
  std::size_t at_ = 0;
  std::string_view root_prefix_;
  std::vector<std::string_view> names_;  ///< of the elements that are open
  std::vector<std::pair<std::string_view, std::string_view>> attributes_;
  bool ends_at_once_ = false;  ///< whether the last tag was <…/>
};

/// The value with the five entities of XML and numbers of characters below 128 put in place.
std::string xml_text(std::string_view value);

}  // namespace hermesh::mesh_formats
