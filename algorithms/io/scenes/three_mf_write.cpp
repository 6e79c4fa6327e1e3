// 3MF out: one object, one item of the build.
#include "algorithms/io/scenes/scene_files.h"
#include "algorithms/io/scenes/zip_archive.h"

namespace hermesh::mesh_formats {

namespace {

constexpr std::string_view kTypes =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>
)";
constexpr std::string_view kRelationships =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel" Target="/3D/3dmodel.model"/></Relationships>
)";
// The format has one unit for all; its own default is what slicers take the numbers of other formats for.
constexpr std::string_view kHead =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<metadata name="Application">hermesh</metadata>
)";
constexpr std::size_t kPiece = std::size_t(1) << 16;

/// Gathers text and hands it to the archive in large pieces.
// A call of the archive for each number would cost more than the number.
class ModelWriter {
 public:
  explicit ModelWriter(ZipWriter& archive) : archive_(archive) {}

  ModelWriter& text(std::string_view text) {
    piece_ += text;
    if (piece_.size() >= kPiece) flush();
    return *this;
  }
  /// Adds the shortest text that reads back as the same number. Text is read in double precision, so points
  /// are written as doubles: the few digits that would identify a float among floats are another double.
  template <class T>
  ModelWriter& number(T value) {
    char digits[32];
    return text({digits, std::to_chars(digits, digits + sizeof digits, value).ptr});
  }
  void flush() {
    archive_.add(piece_);
    piece_.clear();
  }

 private:
  ZipWriter& archive_;
  std::string piece_;
};

/// Writes the object's triangles. @returns how many were left out
std::size_t write_triangles(ModelWriter& out, const PolygonMesh& mesh) {
  std::size_t left_out = 0;
  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (a == b || b == c || c == a) return void(++left_out);
    out.text("<triangle v1=\"")
        .number(a)
        .text("\" v2=\"")
        .number(b)
        .text("\" v3=\"")
        .number(c)
        .text("\"/>\n");
  };
  for (const auto& [a, b, c] : mesh.triangles) triangle(a, b, c);
  for (const auto& [a, b, c, d] : mesh.quads) triangle(a, b, c), triangle(a, c, d);
  return left_out;
}

/// Writes the model: the object, and the build with it. @returns how many triangles were left out
std::size_t write_model(ModelWriter& out, const PolygonMesh& mesh) {
  out.text(kHead);
  std::size_t left_out = 0;
  if (mesh.empty()) {
    out.text("<resources/>\n<build/>\n</model>\n");
  } else {
    out.text("<resources>\n<object id=\"1\" type=\"model\"><mesh><vertices>\n");
    for (const Eigen::Vector3f& point : mesh.points) {
      out.text("<vertex x=\"").number(double(point.x())).text("\" y=\"").number(double(point.y()));
      out.text("\" z=\"").number(double(point.z())).text("\"/>\n");
    }
    out.text("</vertices><triangles>\n");
    left_out = write_triangles(out, mesh);
    out.text("</triangles></mesh></object>\n</resources>\n<build><item objectid=\"1\"");
    // The origin is the item's place. Readers in single precision then lose no more of the shape than there
    // is to lose.
    if (const std::optional<Eigen::Vector3d> origin = stated_origin(mesh)) {
      out.text(" transform=\"1 0 0 0 1 0 0 0 1");
      for (const double x : *origin) out.text(" ").number(x);
      out.text("\"");
    }
    out.text("/></build>\n</model>\n");
  }
  out.flush();
  return left_out;
}

}  // namespace

void write_three_mf(const ByteSink& out, const PolygonMesh& mesh, const std::string& file,
                    RunContext& context) {
  // The order is that in which readers look for them: what kinds of files there are, where the model is, the model.
  ZipWriter archive;
  std::size_t left_out = 0;
  try {
    archive.begin("[Content_Types].xml");
    archive.add(kTypes);
    archive.begin("_rels/.rels");
    archive.add(kRelationships);
    archive.begin("3D/3dmodel.model");
    ModelWriter model(archive);
    left_out = write_model(model, mesh);
  } catch (const Error& error) {
    throw Error("cannot write " + in_quotes(file) + ": " + error.what() + "; write .ply");
  }
  if (left_out > 0)
    context.note(in_quotes(file) + ": " + std::to_string(left_out) +
                 " triangles with a corner twice were left out, which 3MF forbids");
  for (const std::string& piece : archive.finish()) out(piece);
}

}  // namespace hermesh::mesh_formats
