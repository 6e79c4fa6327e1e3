// 3MF (3MF Consortium, core specification 1.3, production extension 1.1): XML in a ZIP archive, by expat and
// minizip.
#include <expat.h>
#include <malloc.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <map>
#include <memory>
#include <new>

#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/scenes/zip_archive.h"

namespace hermesh::mesh_formats {

namespace {

/// Deepest nesting of elements in undamaged files.
constexpr std::size_t kDeepestElement = 1000;
constexpr std::size_t kParsedPiece = std::size_t(1) << 18;
/// Bytes of an element's text that are stored; only short words are needed.
constexpr std::size_t kMostText = 1000;
/// Memory that the parsers of a thread may take. They store each name once and the current tag as a whole,
/// which has millions of bytes only in malicious files.
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
        parser_(XML_ParserCreate_MM(nullptr, &kMemory, nullptr)) {
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
      if (self(user).text_visit_ && text.size() < kMostText)
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
      void* const room = XML_GetBuffer(parser_.get(), kParsedPiece);
      if (!room) fail_by(XML_GetErrorCode(parser_.get()));
      const std::size_t size = archive_.read({static_cast<char*>(room), kParsedPiece});
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
      if (visits_.size() > kDeepestElement) fail("elements are nested too deeply; the file is damaged");
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
    std::string room(kParsedPiece, '\0');
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

/// Deepest nesting of components; a file beyond it is damaged, or contains itself.
constexpr int kDeepestObject = 100;
/// Bytes that the work on one component counts for, so that empty components cannot go on for ever.
constexpr double kVisit = 1024.0;

/// True for extensions that a file may require although they are unknown here: none moves a triangle.
bool address_leaves_shapes_alone(std::string_view address) {
  for (const char* part : {"/3dmanufacturing/production/", "/3dmanufacturing/material/",
                           "/3dmanufacturing/slice/", "/3dmanufacturing/trianglesets/"})
    if (address.find(part) != std::string_view::npos) return true;
  return false;
}

/// Returns the text without the surrounding white space that XML allows in values of numbers.
std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

/// An object by its file within the archive and its number there.
using ObjectKey = std::pair<std::string, std::uint32_t>;

/// A placed object: a component of another one, or an item of the build.
struct Component {
  ObjectKey object;
  Placement placement;
  bool is_placed = false;  ///< true if the file states the placement
};

struct SceneObject {
  ScenePart part;
  bool is_printed = true;  ///< false for support and other objects that are no part of the model
  std::vector<Component> components;
  double cost = -1.0;  ///< of the object with all its components; negative until it is known
  int height = 0;      ///< levels of components beneath it
};

/// Reads one file: parses its models once, then assembles the objects that the build lists, since an object
/// may be composed of others.
class ThreeMfReader {
 public:
  ThreeMfReader(std::string_view bytes, MeshBuilder& builder)
      : builder_(builder), placer_(builder), archive_(bytes, builder) {}

  void read() {
    const std::string root = root_model();
    read_model(root, true);
    for (const char* settings : {"Metadata/Slic3r_PE_model.config", "Metadata/model_settings.config"})
      if (archive_.has(settings)) leave_out_by(settings, root);
    if (items_.empty()) builder_.fail("its build places no object, so there is nothing to read");
    // The memory of all copies is checked before the first one is made.
    for (const Component& item : items_) placer_.spend(cost_of(item.object, 0));
    for (const Component& item : items_) place(item, Placement());
    placer_.note_left_out();
    note_left_out();
    if (by_hermesh_ && items_.size() == 1 && items_[0].is_placed)
      builder_.mesh.origin = items_[0].placement.translation;
  }

 private:
  /// Returns the name of the member that the package declares as its model.
  std::string root_model() {
    constexpr const char* relationships = "_rels/.rels";
    constexpr const char* usual = "3D/3dmodel.model";  // in practice; the format leaves the name open
    std::string result;
    if (archive_.has(relationships)) {
      XmlReader xml(archive_, relationships, relationships, builder_);
      const auto find_model = [&] {
        const auto type = xml.attribute("Type"), target = xml.attribute("Target");
        if (result.empty() && type && target && type->ends_with("/3dmodel")) result = *target;
      };
      xml.read([&] { xml.for_each_child(find_model); });
    }
    if (result.starts_with('/')) result.erase(0, 1);
    if (result.empty()) result = usual;
    if (!archive_.has(result))
      builder_.fail(
          "it is a ZIP archive without a model of 3MF in it; the file is damaged or of another kind");
    return result;
  }

  /// Reads the objects of a model, and the items of its build if it is the root.
  void read_model(const std::string& name, bool root) {
    models_.push_back(name);
    XmlReader xml(archive_, name, "model", builder_);
    xml.read([&] {
      if (xml.name() != "model")
        xml.fail("the first element is no model; the file is damaged or of another kind");
      check_extensions(xml);
      // Most files are in millimetres, the unit that slicers assume for STL, too.
      const std::string_view unit = xml.attribute("unit").value_or("millimeter");
      if (root) {
        const auto known =
            std::ranges::find(kThreeMfUnits, unit, &std::pair<std::string_view, double>::first);
        if (known != std::end(kThreeMfUnits))
          builder_.mesh.metres = known->second;
        else
          builder_.note("its lengths are of the unknown unit ", quoted_word(unit),
                        "; the numbers are unchanged");
      }
      // The production extension names files by attributes under the prefix that this model declares.
      path_attribute_ = std::string(xml.prefix_for("/3dmanufacturing/production/").value_or("p")) + ":path";
      xml.for_each_child([&] { read_part(xml, name, root); });
    });
  }

  /// Reads a child of the model.
  void read_part(XmlReader& xml, const std::string& model, bool root) {
    if (xml.is("resources"))
      xml.for_each_child([&] {
        if (xml.is("object")) read_object(xml, model);
      });
    else if (root && xml.is("metadata") && xml.attribute("name") == "Application")
      xml.for_text([this](std::string_view text) { by_hermesh_ = trimmed(text) == "hermesh"; });
    else if (root && xml.is("build"))
      xml.for_each_child([&] {
        if (!xml.is("item")) return;
        if (xml.attribute("printable") == "0")
          ++not_printed_;
        else
          items_.push_back(read_component(xml, model));
      });
  }

  /// Refuses a model that requires an extension by which shapes change: a list of prefixes, for which the
  /// same element declares addresses.
  void check_extensions(XmlReader& xml) {
    std::string_view required = trimmed(xml.attribute("requiredextensions").value_or(""));
    while (!required.empty()) {
      const std::size_t end = std::min(required.find_first_of(" \t\r\n"), required.size());
      const std::string prefix(required.substr(0, end));
      const std::string_view address = xml.attribute("xmlns:" + prefix).value_or(prefix);
      if (!address_leaves_shapes_alone(address))
        builder_.fail("it requires the extension ", quoted_word(address),
                      ", which is not read; export it without");
      required = trimmed(required.substr(end));
    }
  }

  /// Reads an object, which is a mesh or is composed of others; all else belongs to extensions.
  void read_object(XmlReader& xml, const std::string& model) {
    const ObjectKey key{model, whole_number(xml, "id")};
    if (objects_.contains(key))
      xml.fail("the second object with the id ", key.second, "; the file is damaged");
    // References to entries of a map stay valid while other objects are added.
    SceneObject& object = objects_[key];
    const std::string_view type = xml.attribute("type").value_or("model");
    object.is_printed = type == "model" || type == "surface";
    xml.for_each_child([&] {
      if (xml.is("mesh")) read_mesh(xml, object.part);
      if (xml.is("components"))
        xml.for_each_child([&] {
          if (xml.is("component")) object.components.push_back(read_component(xml, model));
        });
    });
  }

  /// Reads a mesh and merges points with equal coordinates: the format wants them shared, but some programs
  /// write each triangle with points of its own.
  void read_mesh(XmlReader& xml, ScenePart& part) {
    struct Points {
      PointMerger merger;
      std::vector<std::uint32_t> numbers;
    };
    // Shared by the visitors below, which are called after this function has returned.
    const auto points = std::make_shared<Points>(Points{PointMerger(part.points), {}});
    const auto add_point = [&xml, points] {
      if (xml.is("vertex"))
        points->numbers.push_back(
            points->merger.add({coordinate(xml, "x"), coordinate(xml, "y"), coordinate(xml, "z")}));
    };
    const auto add_triangle = [&xml, &part, points] {
      const std::vector<std::uint32_t>& numbers = points->numbers;
      if (xml.is("triangle"))
        part.triangles.push_back(
            {corner(xml, "v1", numbers), corner(xml, "v2", numbers), corner(xml, "v3", numbers)});
    };
    xml.for_each_child([this, &xml, add_point, add_triangle] {
      lattices_ += xml.name() == "beamlattice";
      if (xml.is("vertices")) xml.for_each_child(add_point);
      if (xml.is("triangles")) xml.for_each_child(add_triangle);
    });
  }

  /// Reads a component or an item: an object and its transform.
  Component read_component(XmlReader& xml, const std::string& model) {
    const std::optional<std::string_view> path = xml.attribute(path_attribute_);
    Component result;
    result.object = {path ? model_named(xml, std::string(*path)) : model, whole_number(xml, "objectid")};
    const std::optional<std::string_view> transform = xml.attribute("transform");
    if (transform) result.placement = placement_of(xml, *transform), result.is_placed = true;
    return result;
  }

  /// Leaves out the parts that the settings of PrusaSlicer or of Bambu Studio mark as negative, as modifiers
  /// or as support. The former name triangles of an object, the latter components.
  void leave_out_by(const char* settings, const std::string& root) {
    XmlReader xml(archive_, settings, settings, builder_);
    struct Part {
      SceneObject* object = nullptr;
      std::uint32_t first = 0, last = 0;
    } part;
    const auto count = [this](std::string_view type) {
      const bool is_negative = type == "NegativeVolume" || type == "negative_part";
      ++(is_negative ? negative_ : modifiers_);
    };
    const auto read_type = [&] {
      if (xml.attribute("key") != "volume_type" || xml.attribute("value") == "ModelPart") return;
      count(xml.attribute("value").value_or(""));
      std::vector<Triangle>& triangles = part.object->part.triangles;
      // They stay in their positions, because other parts are numbered, too; placing skips them.
      for (std::size_t t = part.first; t <= part.last && t < triangles.size(); ++t)
        triangles[t].fill(ScenePart::kLeftOut);
    };
    const auto read_part = [&] {
      if (!part.object) return;
      if (xml.name() == "volume") {
        part.first = whole_number(xml, "firstid"), part.last = whole_number(xml, "lastid");
        xml.for_each_child(read_type);
      }
      const std::string_view type = xml.attribute("subtype").value_or("normal_part");
      if (xml.name() != "part" || type == "normal_part") return;
      const std::uint32_t id = whole_number(xml, "id");
      if (std::erase_if(part.object->components, [&](const Component& c) { return c.object.second == id; }))
        count(type);
    };
    xml.read([&] {
      xml.for_each_child([&] {
        if (xml.name() != "object") return;
        const auto found = objects_.find({root, whole_number(xml, "id")});
        part.object = found == objects_.end() ? nullptr : &found->second;
        xml.for_each_child(read_part);
      });
    });
  }

  void note_left_out() {
    if (not_printed_ > 0)
      builder_.note("objects left out because they are support or not to be printed: ", not_printed_);
    if (negative_ > 0) builder_.note("parts left out that a slicer subtracts, as combine can: ", negative_);
    if (modifiers_ > 0) builder_.note("parts left out that only change a slicer's settings: ", modifiers_);
    if (lattices_ == 0) return;
    if (builder_.mesh.triangle_count() == 0)
      builder_.fail("it consists of beam lattices, which are not read; export it as triangles");
    builder_.note("beam lattices left out, because they are not read: ", lattices_);
  }

  /// Returns the name of a model without a leading slash.
  std::string model_named(XmlReader& xml, std::string path) {
    if (path.starts_with('/')) path.erase(0, 1);
    if (!archive_.has(path))
      xml.fail("its archive has no file ", quoted_word(path), ", to which it refers; the file is damaged");
    return path;
  }

  /// Parses a transform of twelve numbers, which multiplies row vectors from the right: three rows of the
  /// linear part, then the translation.
  static Placement placement_of(XmlReader& xml, std::string_view text) {
    Placement result;
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 3; ++column) {
        text = trimmed(text);
        const std::size_t end = std::min(text.find_first_of(" \t\r\n"), text.size());
        const double value = number(xml, text.substr(0, end), "transform");
        (row < 3 ? result.linear(column, row) : result.translation[column]) = value;
        text.remove_prefix(end);
      }
    if (!trimmed(text).empty()) xml.fail("a transform of more than twelve numbers; the file is damaged");
    return result;
  }

  /// Parses a number of XML Schema, independent of the locale.
  static double number(XmlReader& xml, std::string_view text, const char* what) {
    std::string_view digits = trimmed(text);
    // XML Schema allows a plus sign, from_chars() does not.
    if (digits.starts_with('+') && !digits.starts_with("+-")) digits.remove_prefix(1);
    double value = 0.0;
    const auto [rest, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || rest != digits.data() + digits.size() || !std::isfinite(value))
      xml.fail(what, " has ", quoted_word(text), ", which is not a finite number");
    return value;
  }

  static double coordinate(XmlReader& xml, const char* axis) {
    const std::optional<std::string_view> text = xml.attribute(axis);
    if (!text) xml.fail("a vertex without ", axis, "; the file is damaged");
    return number(xml, *text, axis);
  }

  /// Parses an attribute that is an index or the number of an object.
  static std::uint32_t whole_number(XmlReader& xml, const char* key) {
    const std::optional<std::string_view> text = xml.attribute(key);
    if (!text) xml.fail("the attribute ", key, " is missing; the file is damaged");
    const std::string_view digits = trimmed(*text);
    std::uint32_t value = 0;
    const auto [rest, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || rest != digits.data() + digits.size())
      xml.fail(key, " is ", quoted_word(*text), ", which is no whole number that an index can be");
    return value;
  }

  /// Parses a corner of a triangle. The points precede the triangles, so it can be checked at once.
  static std::uint32_t corner(XmlReader& xml, const char* key, const std::vector<std::uint32_t>& numbers) {
    const std::uint32_t value = whole_number(xml, key);
    if (value >= numbers.size())
      xml.fail("a triangle refers to point ", value, ", but there are ", numbers.size(),
               " (counting from 0)");
    return numbers[value];
  }

  SceneObject& object(const ObjectKey& key) {
    // Models other than the root are read when one of their objects is used.
    if (std::ranges::find(models_, key.first) == models_.end()) read_model(key.first, false);
    const auto found = objects_.find(key);
    if (found == objects_.end())
      builder_.fail("it refers to the object ", key.second, ", which it does not have; the file is damaged");
    return found->second;
  }

  /// Returns the bytes of the object with all its components, each as often as it occurs. In double
  /// precision, since ten levels of ten components each overflow integers.
  double cost_of(const ObjectKey& key, int depth) {
    SceneObject& whole = object(key);
    double cost = kVisit + whole.part.cost();
    if (whole.cost >= 0.0) return whole.cost;
    for (const Component& component : whole.components) {
      // The depth catches objects that contain themselves, the height those whose cost is known already.
      if (depth < kDeepestObject) cost += cost_of(component.object, depth + 1);
      whole.height = std::max(whole.height, 1 + object(component.object).height);
      if (depth >= kDeepestObject || whole.height > kDeepestObject)
        builder_.fail(
            "its components are nested more than 100 deep, or contain themselves; the file is damaged");
    }
    return whole.cost = cost;
  }

  /// Adds a copy of an object with all its components. The recursion is no deeper than cost_of() allows.
  void place(const Component& component, const Placement& outer) {
    const SceneObject& whole = object(component.object);
    if (!whole.is_printed) return void(++not_printed_);
    const Placement placement = outer * component.placement;
    placer_.place(whole.part, placement);
    for (const Component& inner : whole.components) place(inner, placement);
  }

  MeshBuilder& builder_;
  PartPlacer placer_;
  ZipArchive archive_;
  std::vector<std::string> models_;
  std::map<ObjectKey, SceneObject> objects_;
  std::vector<Component> items_;
  std::string path_attribute_;
  bool by_hermesh_ = false;
  // Numbers of what was left out: objects, or placements of them, and parts that a slicer subtracts or uses
  // to change settings.
  std::size_t not_printed_ = 0, lattices_ = 0, negative_ = 0, modifiers_ = 0;
};

}  // namespace

void read_three_mf(std::string_view bytes, MeshBuilder& builder) { ThreeMfReader(bytes, builder).read(); }

}  // namespace hermesh::mesh_formats
