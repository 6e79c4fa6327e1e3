// 3MF out: one object, one item of the build.
#include <algorithm>
#include <cmath>
#include <map>

#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/scenes/zip_archive.h"

namespace hermesh::mesh_formats {

namespace {

constexpr std::string_view kContentTypes =
    R"(<?xml version="1.0" encoding="UTF-8"?>)"
    "\n"
    R"(<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">)"
    R"(<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>)"
    R"(<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>)"
    "</Types>\n";
constexpr std::string_view kRelationships =
    R"(<?xml version="1.0" encoding="UTF-8"?>)"
    "\n"
    R"(<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">)"
    R"(<Relationship Id="model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel")"
    " Target=\"/3D/3dmodel.model\"/></Relationships>\n";
constexpr std::string_view kHeadToUnit =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<model unit=")";
constexpr std::string_view kHeadBehindUnit =
    R"(" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02")";
constexpr std::string_view kColours =
    R"( xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02")";
constexpr std::string_view kHeadEnd = R"(>
<metadata name="Application">hermesh</metadata>
)";

/// Returns the text with the characters that XML reserves, and those that it forbids, replaced.
std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += static_cast<unsigned char>(c) < ' ' ? '?' : c;
  }
  return result;
}

/// Returns a colour of 0 to 1 as #RRGGBB or, if it has four components, #RRGGBBAA.
std::string hexadecimal(const float* colour, std::size_t components) {
  std::string text = "#";
  for (std::size_t k = 0; k < components; ++k) {
    const long level = std::lround(255.0f * std::clamp(colour[k], 0.0f, 1.0f));
    for (const long digit : {level / 16, level % 16}) text += "0123456789ABCDEF"[digit];
  }
  return text;
}

/// Writes the text of a model: the object and the build.
class ModelWriter {
 public:
  ModelWriter(ZipWriter& archive, const RunContext& context) : archive_(archive), context_(context) {}

  /// Writes the model and returns the number of triangles that were left out.
  std::size_t write(const PolygonMesh& mesh, double metres, const NamedAttributes& named) {
    const auto known = std::ranges::find(kThreeMfUnits, metres, &std::pair<std::string_view, double>::second);
    const bool stated = known != std::end(kThreeMfUnits);
    const double scale = stated || !(metres > 0.0) ? 1.0 : 1000.0 * metres;
    text(kHeadToUnit).text(stated ? known->first : "millimeter").text(kHeadBehindUnit);
    text(named.colour ? kColours : "").text(kHeadEnd);
    if (mesh.empty()) {
      text("<resources/>\n<build/>\n</model>\n").flush();
      return 0;
    }
    text("<resources>\n");
    write_properties(mesh, named);
    text("<object id=\"1\" type=\"model\"");
    if (!colours_.empty() || !materials_.empty()) text(" pid=\"2\" pindex=\"0\"");
    text("><mesh><vertices>\n");
    // As doubles, which is how text is read: the few digits that identify a float are another double.
    for (const Eigen::Vector3f& point : mesh.points) {
      text("<vertex x=\"").number(double(point.x())).text("\" y=\"").number(double(point.y()));
      text("\" z=\"").number(double(point.z())).text("\"/>\n");
    }
    text("</vertices><triangles>\n");
    std::size_t number_of_triangle = 0;
    for_each_triangle(mesh, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      const std::size_t t = number_of_triangle++;
      if (a == b || b == c || c == a) return void(++left_out_);
      text("<triangle v1=\"").number(a).text("\" v2=\"").number(b).text("\" v3=\"").number(c);
      if (!colours_.empty()) {
        text("\" p1=\"").number(colours_[a]).text("\" p2=\"").number(colours_[b]);
        text("\" p3=\"").number(colours_[c]);
      }
      if (!materials_.empty()) text("\" p1=\"").number(material(t, mesh.triangles.size()));
      text("\"/>\n");
    });
    text("</triangles></mesh></object>\n</resources>\n<build><item objectid=\"1\"");
    // The origin is the translation of the item, so that readers in single precision lose least of the shape.
    const std::optional<Eigen::Vector3d> origin = stated_origin(mesh);
    if (origin || scale != 1.0) {
      text(" transform=\"");
      for (int i = 0; i < 9; ++i) number(i % 4 == 0 ? scale : 0.0).text(" ");
      for (int a = 0; a < 3; ++a) number(origin ? scale * (*origin)[a] : 0.0).text(a < 2 ? " " : "\"");
    }
    text("/></build>\n</model>\n").flush();
    return left_out_;
  }

 private:
  /// Writes a group of the different colours of the points, or of the names of materials, which then are
  /// property group 2.
  void write_properties(const PolygonMesh& mesh, const NamedAttributes& named) {
    if (named.colour) {
      const std::vector<float>& values = std::get<0>(named.colour->values);
      const auto components = static_cast<std::size_t>(named.colour->components);
      std::map<std::string, std::uint32_t> numbers;
      text("<m:colorgroup id=\"2\">\n");
      for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        const std::string colour = hexadecimal(&values[components * i], components);
        const auto [at, is_new] = numbers.try_emplace(colour, static_cast<std::uint32_t>(numbers.size()));
        if (is_new) text("<m:color color=\"").text(colour).text("\"/>\n");
        colours_.push_back(at->second);
      }
      text("</m:colorgroup>\n");
    } else if (named.material) {
      materials_ = std::get<1>(named.material->values);
      none_ = static_cast<std::int32_t>(named.material->labels.size());
      text("<basematerials id=\"2\">\n");
      for (const std::string& label : named.material->labels)
        text("<base name=\"").text(escaped(label)).text("\" displaycolor=\"#808080\"/>\n");
      if (std::ranges::any_of(materials_, [this](std::int32_t m) { return m < 0 || m >= none_; }))
        text("<base name=\"none\" displaycolor=\"#808080\"/>\n");
      text("</basematerials>\n");
    }
  }
  /// Returns the property of a triangle; two of them are one quad.
  std::int32_t material(std::size_t triangle, std::size_t triangles) const {
    const std::size_t polygon = triangle < triangles ? triangle : triangles + (triangle - triangles) / 2;
    const std::int32_t number = materials_[polygon];
    return number < 0 || number >= none_ ? none_ : number;
  }

  ModelWriter& text(std::string_view text) {
    piece_ += text;
    if (piece_.size() >= kPiece) flush();
    return *this;
  }
  /// Writes the shortest text that reads back as the same number.
  template <class T>
  ModelWriter& number(T value) {
    return text(NumberText(value));
  }
  void flush() {
    context_.check();
    archive_.write(piece_);
    piece_.clear();
  }

  static constexpr std::size_t kPiece = std::size_t(1) << 16;
  ZipWriter& archive_;
  const RunContext& context_;
  std::string piece_;
  std::size_t left_out_ = 0;
  std::vector<std::uint32_t> colours_;   ///< of points, by their number in the group
  std::vector<std::int32_t> materials_;  ///< of polygons
  std::int32_t none_ = 0;                ///< number of the material of polygons that have none
};

}  // namespace

void write_three_mf(const ByteSink& out, const PolygonMesh& mesh, double metres, const std::string& file,
                    RunContext& context) {
  // In the order in which readers look for them: the types of the files, the position of the model, the
  // model.
  ZipWriter archive;
  for (const auto& [name, text] :
       {std::pair("[Content_Types].xml", kContentTypes), std::pair("_rels/.rels", kRelationships)}) {
    archive.begin(name, 0.0);
    archive.write(text);
  }
  // Bounds of a line: three doubles of 24 characters, three indices of 10; a colour and three more indices.
  double of_properties = 0.0;
  for (const MeshAttribute& attribute : mesh.attributes) {
    for (const std::string& label : attribute.labels) of_properties += 50.0 + 6.0 * double(label.size());
    of_properties += 35.0 * double(mesh.points.size()) + 55.0 * double(mesh.triangle_count());
  }
  archive.begin("3D/3dmodel.model", 1000.0 + 110.0 * double(mesh.points.size()) +
                                        70.0 * double(mesh.triangle_count()) + of_properties);
  // A triangle has properties of one group only.
  const bool colour = std::ranges::any_of(mesh.attributes, [](const MeshAttribute& attribute) {
    return attribute.name == "colour" && attribute.domain == AttributeDomain::point;
  });
  const NamedAttributes named =
      named_attributes(mesh.attributes, colour ? "colour alpha" : "material", "a 3MF", file, context);
  const std::size_t left_out = ModelWriter(archive, context).write(mesh, metres, named);
  if (left_out > 0)
    context.note(joined(in_quotes(file), ": ", left_out,
                        " triangles with a corner twice were left out, which 3MF forbids"));
  out(archive.finish());
}

}  // namespace hermesh::mesh_formats
