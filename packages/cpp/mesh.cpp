// Meshes of arrays, their files, and contexts.
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "algorithms/core/quad_diagonals.h"
#include "algorithms/io/mesh_file.h"
#include "hermesh/version.h"
#include "packages/cpp/inside.h"

namespace hermesh::v1 {

// ---- Errors, version, threads.

Error::~Error() = default;
Cancelled::~Cancelled() = default;
const char* Cancelled::what() const noexcept { return "cancelled"; }

const char* version() noexcept { return HERMESH_VERSION_STRING; }

struct ThreadLimit::Limit {
  tbb::global_control control;
};

ThreadLimit::ThreadLimit(int threads) {
  if (threads < 1) throw Error("the number of threads must be at least 1, not " + std::to_string(threads));
  limit_.reset(new Limit{{tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)}});
}
ThreadLimit::~ThreadLimit() = default;

MethodInfo method_info(const std::string& name, const std::string& summary,
                       const std::vector<OptionSpec>& options) {
  MethodInfo info{.name = name, .summary = summary, .options = {}};
  for (const OptionSpec& option : options)
    info.options.push_back(
        {option.name, option.fallback, option.help, option.choices, option.minimum, option.maximum});
  return info;
}

// ---- From arrays.

namespace {

template <std::size_t N, class Polygons>
void take(std::span<const std::uint32_t> corners, std::size_t points, const char* what, Polygons& polygons) {
  require(corners.size() % N == 0, "the array of " + std::string(what) + "s holds " +
                                       std::to_string(corners.size()) + " numbers, which is no multiple of " +
                                       std::to_string(N));
  polygons.resize(corners.size() / N);
  static_assert(sizeof(polygons[0]) == N * sizeof(std::uint32_t));
  if (!corners.empty()) std::memcpy(polygons.data(), corners.data(), corners.size_bytes());
  const auto wrong = std::ranges::find_if(corners, [&](std::uint32_t corner) { return corner >= points; });
  if (wrong != corners.end())
    throw hermesh::Error(std::string(what) + " number " +
                         std::to_string((wrong - corners.begin()) / std::ptrdiff_t(N)) + " refers to point " +
                         std::to_string(*wrong) + ", but there are " + std::to_string(points) +
                         " points (both count from 0)");
}

template <class Number>
Eigen::Vector3d point_of(std::span<const Number> points, std::size_t i) {
  return {double(points[3 * i]), double(points[3 * i + 1]), double(points[3 * i + 2])};
}

/// Copies points relative to the origin that a reader of files would choose for them.
template <class Number>
void take_points(std::span<const Number> points, PolygonMesh& mesh) {
  Bounds box;
  const auto add = [&](const auto& polygons) {
    for (const auto& polygon : polygons)
      for (const std::uint32_t corner : polygon) box.add(point_of(points, corner));
  };
  add(mesh.triangles);
  add(mesh.quads);
  mesh.origin = choose_origin(box);
  mesh.points.resize(points.size() / 3);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const Eigen::Vector3d point = point_of(points, i);
    if (!point.allFinite())
      throw hermesh::Error("point " + std::to_string(i) +
                           " (counting from 0) has a coordinate that is not a finite number");
    mesh.points[i] = (point - mesh.origin).cast<float>();
    if (!mesh.points[i].allFinite())
      throw hermesh::Error("the mesh has coordinates that are too large for single precision; scale it down");
  }
}

std::size_t elements_of(AttributeDomain domain, const PolygonMesh& mesh) {
  if (domain == AttributeDomain::point) return mesh.points.size();
  if (domain == AttributeDomain::corner) return 3 * mesh.triangles.size() + 4 * mesh.quads.size();
  return mesh.triangles.size() + mesh.quads.size();
}

MeshAttribute attribute_of(const Attribute& given, const PolygonMesh& mesh) {
  const std::string what = "the attribute '" + given.name + "'";
  require(!given.name.empty(), "an attribute has no name");
  require(given.components >= 1 && given.components <= 4 && (given.integers.empty() || given.components == 1),
          what + " must have 1 to 4 components, and whole numbers 1");
  require(given.floats.empty() || given.integers.empty(), what + " has values of both kinds");
  const std::size_t expected = elements_of(given.domain, mesh) * std::size_t(given.components);
  const std::size_t values = given.floats.size() + given.integers.size();
  require(values == expected, what + " has " + std::to_string(values) + " values, but the mesh needs " +
                                  std::to_string(expected));
  MeshAttribute attribute;
  attribute.name = given.name;
  attribute.domain = static_cast<hermesh::AttributeDomain>(given.domain);
  attribute.components = given.components;
  if (given.integers.empty())
    attribute.values = std::vector<float>(given.floats.begin(), given.floats.end());
  else
    attribute.values = std::vector<std::int32_t>(given.integers.begin(), given.integers.end());
  attribute.labels = given.labels;
  return attribute;
}

void take_attributes(std::span<const Attribute> attributes, PolygonMesh& mesh) {
  for (const Attribute& given : attributes) {
    require(std::ranges::find(mesh.attributes, given.name, &MeshAttribute::name) == mesh.attributes.end(),
            "there are two attributes of the name '" + given.name + "'");
    mesh.attributes.push_back(attribute_of(given, mesh));
  }
}

template <class Number>
PolygonMesh polygons_of(std::span<const Number> points, std::span<const std::uint32_t> triangles,
                        std::span<const std::uint32_t> quads, std::span<const Attribute> attributes) {
  require(points.size() % 3 == 0, "the array of points holds " + std::to_string(points.size()) +
                                      " numbers, which is no multiple of 3");
  PolygonMesh mesh;
  take<3>(triangles, points.size() / 3, "triangle", mesh.triangles);
  take<4>(quads, points.size() / 3, "quad", mesh.quads);
  take_points(points, mesh);
  take_attributes(attributes, mesh);
  return mesh;
}

template <class Polygons>
std::span<const std::uint32_t> flat(const Polygons& polygons) {
  return {reinterpret_cast<const std::uint32_t*>(polygons.data()),
          polygons.size() * sizeof(polygons[0]) / sizeof(std::uint32_t)};
}

}  // namespace

Mesh::Mesh() : arrays_(std::make_shared<const Arrays>()) {}

Mesh::Mesh(std::span<const float> points, std::span<const std::uint32_t> triangles,
           std::span<const std::uint32_t> quads, std::span<const Attribute> attributes)
    : Mesh(run([&] { return Inside::mesh(polygons_of(points, triangles, quads, attributes)); })) {}

Mesh::Mesh(std::span<const double> points, std::span<const std::uint32_t> triangles,
           std::span<const std::uint32_t> quads, std::span<const Attribute> attributes)
    : Mesh(run([&] { return Inside::mesh(polygons_of(points, triangles, quads, attributes)); })) {}

// ---- To arrays.

std::span<const float> Mesh::points() const noexcept {
  const std::vector<Eigen::Vector3f>& points = arrays_->mesh.points;
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  return {reinterpret_cast<const float*>(points.data()), 3 * points.size()};
}

std::array<double, 3> Mesh::origin() const noexcept {
  const Eigen::Vector3d& origin = arrays_->mesh.origin;
  return {origin.x(), origin.y(), origin.z()};
}

std::vector<double> Mesh::world_points() const {
  const PolygonMesh& mesh = arrays_->mesh;
  std::vector<double> world;
  world.reserve(3 * mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    for (const double x : mesh.world(i)) world.push_back(x);
  return world;
}

std::span<const std::uint32_t> Mesh::triangles() const noexcept { return flat(arrays_->mesh.triangles); }
std::span<const std::uint32_t> Mesh::quads() const noexcept { return flat(arrays_->mesh.quads); }

std::vector<Attribute> Mesh::attributes() const {
  std::vector<Attribute> views;
  for (const MeshAttribute& attribute : arrays_->mesh.attributes) {
    Attribute view;
    view.name = attribute.name;
    view.domain = static_cast<AttributeDomain>(attribute.domain);
    view.components = attribute.components;
    if (const auto* floats = std::get_if<std::vector<float>>(&attribute.values))
      view.floats = *floats;
    else
      view.integers = std::get<std::vector<std::int32_t>>(attribute.values);
    view.labels = attribute.labels;
    views.push_back(std::move(view));
  }
  return views;
}

Mesh Mesh::with_attributes(std::span<const Attribute> attributes) const {
  return run([&] {
    const PolygonMesh& own = arrays_->mesh;
    PolygonMesh mesh;
    mesh.origin = own.origin;
    mesh.points = own.points;
    mesh.triangles = own.triangles;
    mesh.quads = own.quads;
    take_attributes(attributes, mesh);
    return Inside::mesh(std::move(mesh));
  });
}

const PolygonMesh& Inside::sampled(const Mesh& mesh, PolygonMesh& copy) {
  const PolygonMesh& polygons = Inside::polygons(mesh);
  if (polygons.quads.empty()) return polygons;
  copy = polygons;
  choose_diagonals(copy);
  return copy;
}

// ---- Files.

Mesh read_mesh(const std::filesystem::path& path, Context& context, bool attributes) {
  return run(context, [&](RunContext& inner) {
    return Inside::mesh(hermesh::read_mesh(path, inner, {.attributes = attributes}));
  });
}

void write_mesh(const std::filesystem::path& path, const Mesh& mesh, Context& context) {
  run(context, [&](RunContext& inner) {
    require(!mesh.empty(), "'" + path.string() + "': a mesh file cannot hold a mesh without polygons");
    hermesh::write_mesh(path, Inside::polygons(mesh), inner);
    return true;
  });
}

}  // namespace hermesh::v1
