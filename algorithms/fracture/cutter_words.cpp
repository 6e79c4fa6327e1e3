#include "algorithms/fracture/cutter_words.h"

#include <openvdb/tools/Interpolation.h>

#include <Eigen/Geometry>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "algorithms/core/level_set.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/quad_diagonals.h"
#include "algorithms/fracture/noise.h"
#include "algorithms/fracture/scatter.h"
#include "algorithms/io/mesh_file.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

[[noreturn]] void refuse(const std::string& word) {
  throw Error("'" + word +
              "' is no choice of cutters: say voronoi:N, chunks:N, planes:N, planes:NX,NY,NZ,D;…, " +
              "mesh:FILE,… or mesh:FILE*N, N being a whole number of at least 1");
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

std::optional<std::size_t> whole_number(const std::string& text) {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value == 0 || value > 1'000'000)
    return std::nullopt;
  return value;
}

CuttingPlane plane_of(const std::string& text, const std::string& word) {
  const std::vector<std::string> parts = split(text, ',');
  if (parts.size() != 4) refuse(word);
  double numbers[4];
  for (int i = 0; i < 4; ++i) {
    const std::string& part = parts[static_cast<std::size_t>(i)];
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), numbers[i]);
    if (error != std::errc() || end != part.data() + part.size() || !std::isfinite(numbers[i])) refuse(word);
  }
  const Vector3d normal(numbers[0], numbers[1], numbers[2]);
  if (!(normal.norm() > 0)) throw Error("the plane '" + text + "' has a normal of no length");
  return {normal, numbers[3]};
}

std::function<double(const Vector3d&)> density_of(const CutterChoices& choices, const FloatHermite& object,
                                                  RunContext& context) {
  context.check();
  if (choices.density) {
    const double greatest = value_range(choices.density).second;
    if (!(greatest > 0)) throw Error("the density is nowhere above 0");
    return [grid = choices.density.grid().grid, greatest](const Vector3d& x) {
      const openvdb::Vec3d index = grid->worldToIndex(openvdb::Vec3d(x.x(), x.y(), x.z()));
      return double(openvdb::tools::BoxSampler::sample(grid->tree(), index)) / greatest;
    };
  }
  if (!choices.impact) return {};
  double radius = choices.impact_radius;
  if (!(radius > 0)) {
    // A box of samples is a voxel smaller than the object, and that of a single sample has no size at all.
    const double voxel = std::cbrt(std::abs(object.placement.linear.determinant()));
    radius = 0.25 * (bounds_of(object).size().maxCoeff() + voxel);
  }
  return density_about(*choices.impact, radius);
}

/// Distance between neighbouring seeds (world units) if each has an equal share of the solid.
double spacing(const LabelledSolid& solid, std::size_t count) {
  const double volume = double(solid.samples) * std::abs(solid.placement.linear.determinant());
  return std::cbrt(volume / double(count));
}

MadeCutters made_meshes(const CutterSpec& spec, const LabelledSolid& solid, const ScatterOptions& scattering,
                        const CutterChoices& choices, RunContext& context) {
  MadeCutters made;
  Random random(choices.seed + 0x6d657368);
  for (const CutterSpec::File& file : spec.files) {
    PolygonMesh mesh = file.mesh ? *file.mesh : read_mesh(file.path, context);
    choose_diagonals(mesh);
    const std::string name = std::filesystem::path(file.path).filename().string();
    if (file.copies == 0) {
      made.meshes.push_back({name, std::move(mesh)});
      continue;
    }
    const Bounds box = bounds(mesh);
    const Vector3d centre = 0.5 * (box.lower + box.upper);
    std::size_t number = 0;
    for (const Vector3d& place : scatter(solid, file.copies, scattering, context)) {
      const double angle = 2.0 * M_PI * random.uniform();
      const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, random.direction()).matrix();
      made.meshes.push_back(
          {name + " #" + std::to_string(++number), placed(mesh, turn, choices.mesh_scale, centre, place)});
    }
  }
  made.cutters = mesh_cutters(made.meshes, solid.placement, context);
  return made;
}

}  // namespace

CutterSpec parse_cutters(const std::string& word) {
  const std::size_t colon = word.find(':');
  if (colon == std::string::npos || colon + 1 == word.size()) refuse(word);
  const std::string kind = word.substr(0, colon), rest = word.substr(colon + 1);
  CutterSpec spec;
  if (kind == "mesh") {
    spec.kind = CutterSpec::Kind::meshes;
    for (const std::string& part : split(rest, ',')) {
      const std::size_t star = part.rfind('*');
      const auto copies =
          star == std::string::npos ? std::optional<std::size_t>(0) : whole_number(part.substr(star + 1));
      if (!copies || part.empty() || star == 0) refuse(word);
      spec.files.push_back({part.substr(0, star), *copies});
    }
    return spec;
  }
  if (kind == "planes" && rest.find(',') != std::string::npos) {
    spec.kind = CutterSpec::Kind::planes;
    for (const std::string& part : split(rest, ';')) spec.planes.push_back(plane_of(part, word));
    return spec;
  }
  if (kind != "planes" && kind != "voronoi" && kind != "chunks") refuse(word);
  spec.kind = kind == "planes"    ? CutterSpec::Kind::planes
              : kind == "voronoi" ? CutterSpec::Kind::voronoi
                                  : CutterSpec::Kind::chunks;
  const auto count = whole_number(rest);
  if (!count) refuse(word);
  spec.count = *count;
  return spec;
}

std::string without_folders(const std::string& word) {
  const std::size_t colon = word.find(':');
  if (word.substr(0, colon) != "mesh") return word;
  std::string result;
  for (const std::string& part : split(word.substr(colon + 1), ','))
    result += (result.empty() ? "mesh:" : ",") + std::filesystem::path(part).filename().string();
  return result;
}

Bounds bounds_of(const FloatHermite& hermite) {
  Bounds box;
  for (const SignLeaf& leaf : hermite.leaves)
    for_each_bit(leaf.inside, [&](int i) {
      const Vector3d index(leaf.lower[0] + (i >> 6) - hermite.placement.base[0],
                           leaf.lower[1] + ((i >> 3) & 7) - hermite.placement.base[1],
                           leaf.lower[2] + (i & 7) - hermite.placement.base[2]);
      box.add(hermite.placement.local(index) + hermite.placement.origin);
    });
  return box;
}

MadeCutters make_cutters(const CutterSpec& spec, const FloatHermite& object, const CutterChoices& choices,
                         RunContext& context) {
  const LabelledSolid solid = whole_solid(object, context);
  const ScatterOptions scattering{choices.seed, density_of(choices, object, context)};
  if (spec.kind == CutterSpec::Kind::meshes) return made_meshes(spec, solid, scattering, choices, context);
  MadeCutters made;
  if (spec.kind == CutterSpec::Kind::planes) {
    std::vector<CuttingPlane> planes = spec.planes;
    Random random(choices.seed + 0x706c616e);
    if (planes.empty())
      for (const Vector3d& place : scatter(solid, spec.count, scattering, context)) {
        const Vector3d normal = random.direction();
        planes.push_back({normal, normal.dot(place)});
      }
    made.cutters = plane_cutters(std::move(planes), object.placement);
    return made;
  }
  Displacement displacement;
  if (spec.kind == CutterSpec::Kind::chunks) {
    const double between = spacing(solid, spec.count);
    displacement = {choices.roughness * between, 0.5 * between, hashed(choices.seed)};
  }
  made.seeds = scatter(solid, spec.count, scattering, context);
  made.cutters = voronoi_cutters(made.seeds, displacement, object.placement);
  return made;
}

}  // namespace hermesh
