// 3MF out: one object, one item of the build.
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
// The format has one unit for all; its own default is what slicers take the numbers of other formats for.
constexpr std::string_view kHeadToUnit =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<model unit=")";
constexpr std::string_view kHeadBehindUnit =
    R"(" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<metadata name="Application">hermesh</metadata>
)";
constexpr std::string_view kObject = "<resources>\n<object id=\"1\" type=\"model\"><mesh><vertices>\n";
constexpr std::size_t kModelPiece = std::size_t(1) << 16;

/// The text of a model: the object, and the build with it. It is made piece by piece, and may be gone through
/// more than once. It must stay where it is.
class ModelText {
 public:
  ModelText(const PolygonMesh& mesh, std::string_view unit)
      : mesh_(mesh), head_(std::string(kHeadToUnit) + std::string(unit) + std::string(kHeadBehindUnit)) {
    if (mesh.empty()) {
      parts_ = {{1, [this](std::size_t) { text(head_).text("<resources/>\n<build/>\n</model>\n"); }}};
      return;
    }
    parts_ = {{1, [this](std::size_t) { text(head_).text(kObject); }},
              {mesh.points.size(), [this](std::size_t i) { add_point(mesh_.points[i]); }},
              {1, [this](std::size_t) { text("</vertices><triangles>\n"); }},
              {mesh.triangles.size(), [this](std::size_t i) { add_triangle(mesh_.triangles[i]); }},
              {mesh.quads.size(), [this](std::size_t i) { add_quad(mesh_.quads[i]); }},
              {1, [this](std::size_t) { add_build(); }}};
  }

  /// The next piece, which stays until the next call; an empty one at the end, behind which the text begins
  /// anew.
  std::string_view next() {
    piece_.clear();
    if (part_ == 0) left_out_ = 0;
    while (part_ < parts_.size() && piece_.size() < kModelPiece) {
      if (element_ < parts_[part_].elements)
        parts_[part_].add(element_++);
      else
        element_ = 0, ++part_;
    }
    if (piece_.empty()) part_ = 0;
    return piece_;
  }
  /// Triangles that were left out of the text that was gone through last.
  std::size_t left_out() const { return left_out_; }

 private:
  struct Part {
    std::size_t elements;
    std::function<void(std::size_t)> add;
  };

  ModelText& text(std::string_view text) { return piece_ += text, *this; }
  /// Adds the shortest text that reads back as the same number. Text is read in double precision, so points
  /// are written as doubles: the few digits that would identify a float among floats are another double.
  template <class T>
  ModelText& number(T value) {
    char digits[32];
    return text({digits, std::to_chars(digits, digits + sizeof digits, value).ptr});
  }
  void add_point(const Eigen::Vector3f& point) {
    text("<vertex x=\"").number(double(point.x())).text("\" y=\"").number(double(point.y()));
    text("\" z=\"").number(double(point.z())).text("\"/>\n");
  }
  void add_triangle(const Triangle& corners) {
    const auto [a, b, c] = corners;
    if (a == b || b == c || c == a) return void(++left_out_);
    text("<triangle v1=\"").number(a).text("\" v2=\"").number(b).text("\" v3=\"").number(c).text("\"/>\n");
  }
  void add_quad(const Quad& corners) {
    const auto [a, b, c, d] = corners;
    add_triangle({a, b, c}), add_triangle({a, c, d});
  }
  void add_build() {
    text("</triangles></mesh></object>\n</resources>\n<build><item objectid=\"1\"");
    // The origin is the item's place. Readers in single precision then lose no more of the shape than there
    // is to lose.
    if (const std::optional<Eigen::Vector3d> origin = stated_origin(mesh_)) {
      text(" transform=\"1 0 0 0 1 0 0 0 1");
      for (const double x : *origin) text(" ").number(x);
      text("\"");
    }
    text("/></build>\n</model>\n");
  }

  const PolygonMesh& mesh_;
  std::string head_;
  std::vector<Part> parts_;
  std::string piece_;
  std::size_t part_ = 0, element_ = 0, left_out_ = 0;
};

}  // namespace

void write_three_mf(const ByteSink& out, const PolygonMesh& mesh, std::string_view unit,
                    const std::string& file, RunContext& context) {
  ModelText model(mesh, unit);
  const auto next = [&] {
    context.check();
    return model.next();
  };
  // The archive wants the length first. To make the text is quick beside packing it, and it may be too long
  // to be kept.
  std::uint64_t size = 0;
  for (std::string_view piece = next(); !piece.empty(); piece = next()) size += piece.size();
  if (model.left_out() > 0)
    context.note(in_quotes(file) + ": " + std::to_string(model.left_out()) +
                 " triangles with a corner twice were left out, which 3MF forbids");
  // The order is that in which readers look for them: what kinds of files there are, where the model is, the
  // model.
  ZipWriter archive;
  archive.add("[Content_Types].xml", std::string(kContentTypes));
  archive.add("_rels/.rels", std::string(kRelationships));
  archive.add("3D/3dmodel.model", size, next);
  archive.write(out);
}

}  // namespace hermesh::mesh_formats
