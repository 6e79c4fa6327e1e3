// 3MF out: one object, one item of the build.
#include <algorithm>

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
    R"(" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<metadata name="Application">hermesh</metadata>
)";

/// Writes the text of a model: the object and the build.
class ModelWriter {
 public:
  ModelWriter(ZipWriter& archive, const RunContext& context) : archive_(archive), context_(context) {}

  /// Writes the model and returns the number of triangles that were left out.
  std::size_t write(const PolygonMesh& mesh, double metres) {
    const auto known = std::ranges::find(kThreeMfUnits, metres, &std::pair<std::string_view, double>::second);
    const bool stated = known != std::end(kThreeMfUnits);
    const double scale = stated || !(metres > 0.0) ? 1.0 : 1000.0 * metres;
    text(kHeadToUnit).text(stated ? known->first : "millimeter").text(kHeadBehindUnit);
    if (mesh.empty()) {
      text("<resources/>\n<build/>\n</model>\n").flush();
      return 0;
    }
    text("<resources>\n<object id=\"1\" type=\"model\"><mesh><vertices>\n");
    // As doubles, which is how text is read: the few digits that identify a float are another double.
    for (const Eigen::Vector3f& point : mesh.points) {
      text("<vertex x=\"").number(double(point.x())).text("\" y=\"").number(double(point.y()));
      text("\" z=\"").number(double(point.z())).text("\"/>\n");
    }
    text("</vertices><triangles>\n");
    for_each_triangle(mesh, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      if (a == b || b == c || c == a) return void(++left_out_);
      text("<triangle v1=\"").number(a).text("\" v2=\"").number(b).text("\" v3=\"").number(c).text("\"/>\n");
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
  // Bounds of a line: three doubles of 24 characters, three indices of 10.
  archive.begin("3D/3dmodel.model",
                1000.0 + 110.0 * double(mesh.points.size()) + 70.0 * double(mesh.triangle_count()));
  const std::size_t left_out = ModelWriter(archive, context).write(mesh, metres);
  if (left_out > 0)
    context.note(joined(in_quotes(file), ": ", left_out,
                        " triangles with a corner twice were left out, which 3MF forbids"));
  out(archive.finish());
}

}  // namespace hermesh::mesh_formats
