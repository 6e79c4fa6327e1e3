// 3MF (3MF Consortium, core specification 1.3, production extension 1.1): XML in a ZIP archive, by expat and
// minizip.
#include <algorithm>
#include <map>
#include <memory>

#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/scenes/xml_reader.h"
#include "algorithms/io/scenes/zip_archive.h"

namespace hermesh::mesh_formats {

namespace {

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
    placer_.name_materials(material_names_);
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
        if (builder_.attributes()) read_properties(xml, model);
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

  /// Reads a list of colours (of the materials extension) or of materials, to which triangles refer.
  void read_properties(XmlReader& xml, const std::string& model) {
    const std::optional<std::uint32_t> id = whole_number_if_any(xml, "id");
    if (!id) return;
    const ObjectKey key{model, *id};
    if (xml.name() == "colorgroup")
      xml.for_each_child([this, &xml, key] {
        if (xml.name() == "color")
          properties_[key].push_back({colour_of(xml.attribute("color").value_or("")), -1});
      });
    if (xml.is("basematerials"))
      xml.for_each_child([this, &xml, key] {
        if (!xml.is("base")) return;
        properties_[key].push_back({std::nullopt, static_cast<std::int32_t>(material_names_.size())});
        material_names_.emplace_back(xml.attribute("name").value_or(""));
      });
  }

  /// Parses a colour #RRGGBB or #RRGGBBAA; nothing if it is none.
  static std::optional<std::array<float, 4>> colour_of(std::string_view text) {
    text = trimmed(text);
    std::array<float, 4> colour = {0, 0, 0, 1};
    if (!text.starts_with('#') || (text.size() != 7 && text.size() != 9)) return std::nullopt;
    for (std::size_t k = 0; 2 * k + 1 < text.size(); ++k) {
      unsigned value = 0;
      const char* const digits = text.data() + 1 + 2 * k;
      if (std::from_chars(digits, digits + 2, value, 16).ptr != digits + 2) return std::nullopt;
      colour[k] = static_cast<float>(value) / 255.0f;
    }
    return colour;
  }

  /// A triangle's properties: those of its own, or else of its object.
  struct Property {
    std::optional<std::array<float, 4>> colour;
    std::int32_t material;  ///< number of its name, -1 for none
  };

  /// Takes the colours or the material of the part's last triangle, which has just started.
  void take_properties(XmlReader& xml, const std::string& model, std::optional<std::uint32_t> group,
                       std::optional<std::uint32_t> index, ScenePart& part) {
    if (const auto own = whole_number_if_any(xml, "pid")) group = own;
    if (const auto own = whole_number_if_any(xml, "p1")) index = own;
    if (!group || !index) return;
    const auto found = properties_.find({model, *group});
    if (found == properties_.end()) return;  // of another kind, such as textures
    const Triangle& triangle = part.triangles.back();
    for (std::size_t k = 0; k < 3; ++k) {
      const char* const keys[] = {"p1", "p2", "p3"};
      const std::uint32_t at = k == 0 ? *index : whole_number_if_any(xml, keys[k]).value_or(*index);
      if (at >= found->second.size())
        return placer_.leave_out_attribute(
            "colour", "a triangle refers to property " + std::to_string(at) + " of a group of " +
                          std::to_string(found->second.size()) + " (counting from 0)");
      const Property& property = found->second[at];
      if (property.colour) {
        if ((*property.colour)[3] < 1.0f) placer_.keep_alpha();
        other_colours_ += !part.set_colour(triangle[k], *property.colour);
      } else if (property.material >= 0 && k == 0) {
        part.materials.resize(part.triangles.size(), -1);
        part.materials.back() = property.material;
      }
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
    const auto group = whole_number_if_any(xml, "pid"), index = whole_number_if_any(xml, "pindex");
    xml.for_each_child([this, &xml, &model, &object, group, index] {
      if (xml.is("mesh")) read_mesh(xml, model, group, index, object.part);
      if (xml.is("components"))
        xml.for_each_child([this, &xml, &model, &object] {
          if (xml.is("component")) object.components.push_back(read_component(xml, model));
        });
    });
  }

  /// Reads a mesh and merges points with equal coordinates: the format wants them shared, but some programs
  /// write each triangle with points of its own.
  void read_mesh(XmlReader& xml, const std::string& model, std::optional<std::uint32_t> group,
                 std::optional<std::uint32_t> index, ScenePart& part) {
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
    const auto add_triangle = [this, &xml, &model, &part, points, group, index] {
      const std::vector<std::uint32_t>& numbers = points->numbers;
      if (!xml.is("triangle")) return;
      part.triangles.push_back(
          {corner(xml, "v1", numbers), corner(xml, "v2", numbers), corner(xml, "v3", numbers)});
      if (builder_.attributes()) take_properties(xml, model, group, index, part);
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
    if (other_colours_ > 0)
      builder_.note("corners with another colour than their point elsewhere, which has one, the first: ",
                    other_colours_);
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

  /// Parses an attribute as above, for what must not cost the mesh: nothing if it is none.
  static std::optional<std::uint32_t> whole_number_if_any(XmlReader& xml, const char* key) {
    const std::string_view digits = trimmed(xml.attribute(key).value_or(""));
    std::uint32_t value = 0;
    const auto [rest, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || rest != digits.data() + digits.size()) return std::nullopt;
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
  std::map<ObjectKey, std::vector<Property>> properties_;  ///< groups, by their file and number there
  std::vector<std::string> material_names_;
  std::string path_attribute_;
  bool by_hermesh_ = false;
  // Numbers of what was left out: objects, or placements of them, and parts that a slicer subtracts or uses
  // to change settings.
  std::size_t not_printed_ = 0, lattices_ = 0, negative_ = 0, modifiers_ = 0, other_colours_ = 0;
};

}  // namespace

void read_three_mf(std::string_view bytes, MeshBuilder& builder) { ThreeMfReader(bytes, builder).read(); }

}  // namespace hermesh::mesh_formats
