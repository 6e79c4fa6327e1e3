#include "algorithms/io/scenes/scene_files.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

namespace hermesh::mesh_formats {

std::optional<Eigen::Vector3d> stated_origin(const PolygonMesh& mesh) {
  // As in to_mesh_file(): left out only at 0, if a reader would choose 0 by default.
  if (mesh.origin.isZero(0.0) && choose_origin(bounds(mesh)).isZero(0.0)) return std::nullopt;
  return mesh.origin;
}

void PartPlacer::spend(double bytes) {
  // In double precision, where sums and products of counts cannot overflow.
  spent_ += bytes;
  if (!(spent_ <= double(memory_limit())))
    builder_.fail("its parts, with all their repetitions, take more than half of the memory");
}

void PartPlacer::place(const ScenePart& part, const Placement& placement) {
  if (!placement.linear.allFinite() || !placement.translation.allFinite())
    builder_.fail("a transform of it holds a number that is not finite, or too large");
  const double determinant = placement.linear.determinant();
  // Scenes hide parts by a scale of zero. The sheets that would remain enclose nothing.
  if (determinant == 0.0) {
    flattened_ += !part.triangles.empty();
    return;
  }
  // Copies share no points: two of them that touch are still two surfaces.
  const std::int64_t first = static_cast<std::int64_t>(builder_.mesh.points.size());
  for (const Eigen::Vector3d& point : part.points) builder_.mesh.points.push_back(placement(point));
  std::size_t done = 0;
  for (const auto& [a, b, c] : part.triangles) {
    if (a == ScenePart::kLeftOut) continue;
    builder_.tick(++done, part.triangles.size());
    std::array<std::int64_t, 3> corners = {first + a, first + b, first + c};
    if (determinant < 0.0) std::swap(corners[1], corners[2]);
    builder_.add_polygon(corners);
  }
  if (builder_.attributes()) place_attributes(part, determinant < 0.0);
}

void PartPlacer::place_attributes(const ScenePart& part, bool mirrored) {
  AttributeTable& table = *builder_.attributes();
  // The column of each kind of value that the part has.
  const auto number_of = [this](bool has_values, const char* name) { return has_values ? column(name) : 0; };
  const std::size_t colour = number_of(!part.colours.empty(), "colour"),
                    material = number_of(!part.materials.empty(), "material"),
                    uv = number_of(!part.texture_coordinates.empty(), "uv");
  for (std::size_t i = 0; i < part.points.size(); ++i) {
    table.begin(AttributeDomain::point);
    if (i >= part.colours.size() || std::isnan(part.colours[i][0])) continue;
    for (int k = 0; k < colour_components_; ++k) table.set(colour, k, part.colours[i][std::size_t(k)]);
  }
  for (std::size_t t = 0; t < part.triangles.size(); ++t) {
    if (part.triangles[t][0] == ScenePart::kLeftOut) continue;
    table.begin(AttributeDomain::polygon);
    if (t < part.materials.size() && part.materials[t] >= 0) table.set(material, 0, part.materials[t]);
    for (const std::size_t corner : {0, mirrored ? 2 : 1, mirrored ? 1 : 2}) {
      table.begin(AttributeDomain::corner);
      const std::size_t at = 3 * t + corner;
      if (at >= part.texture_coordinates.size() || std::isnan(part.texture_coordinates[at][0])) continue;
      for (int k = 0; k < 2; ++k) table.set(uv, k, part.texture_coordinates[at][std::size_t(k)]);
    }
  }
}

std::size_t PartPlacer::column(const std::string& name) {
  const auto [at, is_new] = columns_.try_emplace(name);
  if (is_new) {
    const bool material = name == "material", uv = name == "uv";
    at->second = builder_.attributes()->add(name,
                                            material ? AttributeDomain::polygon
                                            : uv     ? AttributeDomain::corner
                                                     : AttributeDomain::point,
                                            material ? 1
                                            : uv     ? 2
                                                     : colour_components_,
                                            material);
  }
  return at->second;
}

void PartPlacer::name_materials(const std::vector<std::string>& names) {
  if (const auto at = columns_.find("material"); at != columns_.end())
    builder_.attributes()->set_labels(at->second, names);
}

void PartPlacer::leave_out_attribute(const std::string& name, const std::string& reason) {
  builder_.attributes()->spoil(column(name), reason);
}

bool ScenePart::set_colour(std::uint32_t point, const std::array<float, 4>& colour) {
  if (point >= colours.size())
    colours.resize(point + 1, std::array<float, 4>{std::numeric_limits<float>::quiet_NaN(), 0, 0, 1});
  if (std::isnan(colours[point][0])) colours[point] = colour;
  return colours[point] == colour;
}

NamedAttributes named_attributes(const std::vector<MeshAttribute>& attributes, std::string_view stored,
                                 const char* format, const std::string& file, RunContext& context) {
  NamedAttributes result;
  std::string lost;
  for (const MeshAttribute& attribute : attributes) {
    const auto is = [&](const char* name, AttributeDomain domain, int least, int most, std::size_t kind) {
      return attribute.name == name && attribute.domain == domain && attribute.components >= least &&
             attribute.components <= most && attribute.values.index() == kind &&
             stored.find(name) != std::string_view::npos;
    };
    if (is("colour", AttributeDomain::point, 3, stored.find("alpha") == std::string_view::npos ? 3 : 4, 0))
      result.colour = &attribute;
    else if (is("normal", AttributeDomain::point, 3, 3, 0))
      result.normal = &attribute;
    else if (is("uv", AttributeDomain::point, 2, 2, 0) || is("uv", AttributeDomain::corner, 2, 2, 0))
      result.uv = &attribute;
    else if (is("material", AttributeDomain::polygon, 1, 1, 1) && !attribute.labels.empty())
      result.material = &attribute;
    else
      lost += (lost.empty() ? "" : ", ") + attribute.name;
  }
  if (!lost.empty())
    context.note(joined(in_quotes(file), ": ", format,
                        " file cannot store these attributes, which were left out: ", lost));
  return result;
}

void PartPlacer::note_left_out() {
  if (flattened_ > 0) builder_.note(flattened_, " parts that a transform flattens were left out");
}

}  // namespace hermesh::mesh_formats
