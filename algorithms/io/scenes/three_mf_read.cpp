// 3MF (3MF Consortium, core specification 1.3, production extension 1.1): XML in a ZIP archive.
#include <map>
#include <memory>

#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/scenes/scene_part.h"
#include "algorithms/io/scenes/xml_reader.h"
#include "algorithms/io/scenes/zip_archive.h"

namespace hermesh::mesh_formats {

namespace {

/// How deeply components may be nested; a file that goes deeper is damaged, or contains itself.
constexpr int kDeepestObject = 100;
/// Bytes that the work on one component counts for, so that components of nothing cannot keep it busy for
/// ever.
constexpr double kVisit = 1024.0;

/// Extensions that a file may require although nothing is known of them here: none changes where a triangle
/// is.
bool address_leaves_shapes_alone(std::string_view address) {
  for (const char* part : {"/3dmanufacturing/production/", "/3dmanufacturing/material/",
                           "/3dmanufacturing/slice/", "/3dmanufacturing/trianglesets/"})
    if (address.find(part) != std::string_view::npos) return true;
  return false;
}

/// The text without white space about it, which XML allows in values of numbers.
std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

/// An object by its file within the archive and its number there.
using ObjectKey = std::pair<std::string, std::uint32_t>;

/// An object in a place: a component of another one, or an item of the build.
struct Component {
  ObjectKey object;
  Placement placement;
  bool is_placed = false;  ///< whether the file states the placement
};

struct SceneObject {
  ScenePart part;
  std::vector<Component> components;
  double cost = -1.0;  ///< of the object with all its components; negative until it was summed up
  int height = 0;      ///< levels of components beneath it
};

/// Reads one file. Models are gone through once, element by element; what the build places is put together
/// afterwards, since an object may be composed of others.
class ThreeMfReader {
 public:
  ThreeMfReader(std::string_view bytes, MeshBuilder& builder)
      : builder_(builder), placer_(builder), archive_(bytes, builder) {}

  void read() {
    const std::string root = root_model();
    read_model(root, true);
    if (items_.empty()) builder_.fail("its build places no object, so there is nothing to read");
    // What all copies take is known before the first one is made.
    for (const Component& item : items_) placer_.spend(cost_of(item.object, 0));
    for (const Component& item : items_) place(item, Placement());
    placer_.note_left_out();
    if (by_hermesh_ && items_.size() == 1 && items_[0].is_placed)
      builder_.mesh.origin = items_[0].placement.translation;
  }

 private:
  /// Name of the member that the package calls its model.
  std::string root_model() {
    constexpr const char* relationships = "_rels/.rels";
    // Where every writer puts it, although the format leaves the name open.
    constexpr const char* usual = "3D/3dmodel.model";
    std::string result;
    if (archive_.has(relationships)) {
      XmlReader xml(archive_.open(relationships), relationships, builder_);
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

  /// Reads the objects of a model, and the items of its build where it is the root.
  void read_model(const std::string& name, bool root) {
    models_.push_back(name);
    XmlReader xml(archive_.open(name), "model", builder_);
    xml.read([&] {
      if (xml.name() != "model")
        xml.fail("the first element is no model; the file is damaged or of another kind");
      check_extensions(xml);
      if (root) note_unit(xml.attribute("unit").value_or("millimeter"));
      // Names of files stand in attributes of the production extension, under the prefix that this model
      // gives it.
      path_attribute_ = std::string(xml.prefix_for("/3dmanufacturing/production/").value_or("p")) + ":path";
      xml.for_each_child([&] { read_part(xml, name, root); });
    });
  }

  /// Reads what stands directly in a model.
  void read_part(XmlReader& xml, const std::string& model, bool root) {
    if (xml.is("resources"))
      xml.for_each_child([&] {
        if (xml.is("object")) read_object(xml, model);
      });
    else if (root && xml.is("metadata") && xml.attribute("name") == "Application")
      xml.for_text([this](std::string_view text) { by_hermesh_ = trimmed(text) == "hermesh"; });
    else if (root && xml.is("build"))
      xml.for_each_child([&] {
        if (xml.is("item")) items_.push_back(read_component(xml, model));
      });
  }

  /// Refuses a model that says itself that it cannot be read without knowing an extension by which shapes
  /// change.
  void check_extensions(XmlReader& xml) {
    // A list of prefixes, which stand for addresses that the same element declares.
    std::string_view required = trimmed(xml.attribute("requiredextensions").value_or(""));
    while (!required.empty()) {
      const std::size_t end = std::min(required.find_first_of(" \t\r\n"), required.size());
      const std::string prefix(required.substr(0, end));
      const std::string_view address = xml.attribute("xmlns:" + prefix).value_or(prefix);
      if (!address_leaves_shapes_alone(address))
        builder_.fail("it requires the extension " + quoted_word(address) +
                      ", which is not read; export it without");
      required = trimmed(required.substr(end));
    }
  }

  void note_unit(std::string_view unit) {
    // By far the most files are in millimetres, which is what slicers take the numbers of STL for, too.
    if (unit != "millimeter")
      builder_.note("its lengths are of the unit " + quoted_word(unit) +
                    "; the numbers were taken as they are");
  }

  /// Reads an object, which is a mesh or is composed of others. What else it may be belongs to extensions.
  void read_object(XmlReader& xml, const std::string& model) {
    const ObjectKey key{model, whole_number(xml, "id")};
    if (objects_.contains(key))
      xml.fail("the second object with the id " + std::to_string(key.second) + "; the file is damaged");
    // The entry stays in its place while its components are read, whatever they refer to.
    SceneObject& object = objects_[key];
    xml.for_each_child([&] {
      if (xml.is("mesh")) read_mesh(xml, object.part);
      if (xml.is("components"))
        xml.for_each_child([&] {
          if (xml.is("component")) object.components.push_back(read_component(xml, model));
        });
    });
  }

  /// Reads a mesh, and makes points with equal coordinates one: the format wants them shared, and some
  /// programs write each triangle with points of its own.
  void read_mesh(XmlReader& xml, ScenePart& part) {
    struct Points {
      PointMerger merger;
      std::vector<std::uint32_t> numbers;
    };
    // It lives as long as somebody may be called who adds to it.
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
    xml.for_each_child([&xml, add_point, add_triangle] {
      if (xml.is("vertices")) xml.for_each_child(add_point);
      if (xml.is("triangles")) xml.for_each_child(add_triangle);
    });
  }

  /// Reads what a component and an item have in common: an object, and the transform of it.
  Component read_component(XmlReader& xml, const std::string& model) {
    const std::optional<std::string_view> path = xml.attribute(path_attribute_);
    Component result;
    result.object = {path ? model_named(xml, std::string(*path)) : model, whole_number(xml, "objectid")};
    const std::optional<std::string_view> transform = xml.attribute("transform");
    if (transform) result.placement = placement_of(xml, *transform), result.is_placed = true;
    return result;
  }

  /// A name of a model as it is first seen, since names differ in capitals and in the slash in front.
  std::string model_named(XmlReader& xml, std::string path) {
    if (path.starts_with('/')) path.erase(0, 1);
    if (!archive_.has(path))
      xml.fail("its archive has no file " + quoted_word(path) + ", to which it refers; the file is damaged");
    return path;
  }

  /// A transform of twelve numbers, which multiplies rows from the right: three rows of the linear part, then
  /// the translation.
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

  /// A number of XML Schema, independent of the locale.
  static double number(XmlReader& xml, std::string_view text, const char* what) {
    std::string_view digits = trimmed(text);
    // XML's numbers may have a plus in front, which the library refuses.
    if (digits.starts_with('+') && !digits.starts_with("+-")) digits.remove_prefix(1);
    double value = 0.0;
    const auto [rest, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || rest != digits.data() + digits.size() || !std::isfinite(value))
      xml.fail(std::string(what) + " has " + quoted_word(text) + ", which is not a finite number");
    return value;
  }

  static double coordinate(XmlReader& xml, const char* axis) {
    const std::optional<std::string_view> text = xml.attribute(axis);
    if (!text) xml.fail("a vertex without " + std::string(axis) + "; the file is damaged");
    return number(xml, *text, axis);
  }

  /// An attribute that is an index or the number of an object.
  static std::uint32_t whole_number(XmlReader& xml, const char* key) {
    const std::optional<std::string_view> text = xml.attribute(key);
    if (!text) xml.fail("the attribute " + std::string(key) + " is missing; the file is damaged");
    const std::string_view digits = trimmed(*text);
    std::uint32_t value = 0;
    const auto [rest, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc() || rest != digits.data() + digits.size())
      xml.fail(std::string(key) + " is " + quoted_word(*text) +
               ", which is no whole number that an index can be");
    return value;
  }

  /// A corner of a triangle. The points stand before the triangles, so it is checked at once, with the line
  /// at hand.
  static std::uint32_t corner(XmlReader& xml, const char* key, const std::vector<std::uint32_t>& numbers) {
    const std::uint32_t value = whole_number(xml, key);
    if (value >= numbers.size())
      xml.fail("a triangle refers to point " + std::to_string(value) + ", but there are " +
               std::to_string(numbers.size()) + " (counting from 0)");
    return numbers[value];
  }

  SceneObject& object(const ObjectKey& key) {
    // Models beside the root are read when an object of theirs is asked for.
    if (std::ranges::find(models_, key.first) == models_.end()) read_model(key.first, false);
    const auto found = objects_.find(key);
    if (found == objects_.end())
      builder_.fail("it refers to the object " + std::to_string(key.second) +
                    ", which it does not have; the file is damaged");
    return found->second;
  }

  /// Bytes of the object with all that it is composed of, each as often as it occurs. Sums in double
  /// precision: ten levels of ten components each are no overflow.
  double cost_of(const ObjectKey& key, int depth) {
    SceneObject& whole = object(key);
    double cost = kVisit + whole.part.cost();
    if (whole.cost >= 0.0) return whole.cost;
    for (const Component& component : whole.components) {
      // On the way down for those that contain themselves, on the way up for those that were summed up
      // before.
      if (depth < kDeepestObject) cost += cost_of(component.object, depth + 1);
      whole.height = std::max(whole.height, 1 + object(component.object).height);
      if (depth >= kDeepestObject || whole.height > kDeepestObject)
        builder_.fail(
            "its components are nested more than 100 deep, or contain themselves; the file is damaged");
    }
    return whole.cost = cost;
  }

  /// Puts an object with all its components in its place. The recursion is no deeper than cost_of() allows.
  void place(const Component& component, const Placement& outer) {
    const SceneObject& whole = object(component.object);
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
};

}  // namespace

void read_three_mf(std::string_view bytes, MeshBuilder& builder) { ThreeMfReader(bytes, builder).read(); }

}  // namespace hermesh::mesh_formats
