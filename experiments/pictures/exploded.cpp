#include "experiments/pictures/exploded.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "algorithms/io/mesh_file.h"
#include "experiments/pictures/render.h"
#include "experiments/pictures/viewpoint.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

constexpr int kSheetPixels = 900;
/// Up to this number of triangles the pieces have few details, and a smaller picture shows them in half the
/// time.
constexpr std::size_t kFewTriangles = 20'000;
constexpr int kSmallSheetPixels = 640;
/// How many triangles are drawn as they are; the pieces beyond are sketched, so that a picture takes little
/// memory.
constexpr std::size_t kExact = 3'000'000;
/// Pieces move this part of their way from the object's middle, away from it.
constexpr double kExplosion = 0.5;
constexpr double kExplodedCloseUp =
    0.07;  // of the box, so that polygons of some hundred voxels a side are told apart

struct Piece {
  PolygonMesh mesh;
  Vector3d middle;
};

/// The mesh with its points moved to the middles of cubes of that size, without the triangles that lose their
/// area.
PolygonMesh sketched(const PolygonMesh& mesh, double size) {
  PolygonMesh result;
  result.origin = mesh.origin;
  struct Place {
    std::array<std::int64_t, 3> cell;
    std::uint32_t point;
    bool operator<(const Place& other) const { return cell < other.cell; }
  };
  std::vector<Place> places(mesh.points.size());
  for (std::uint32_t p = 0; p < places.size(); ++p) {
    for (int a = 0; a < 3; ++a) places[p].cell[a] = std::llround(double(mesh.points[p][a]) / size);
    places[p].point = p;
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return std::pair(a.cell, a.point) < std::pair(b.cell, b.point);
  });
  std::vector<std::uint32_t> number(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (i == 0 || places[i - 1] < places[i]) result.points.push_back(mesh.points[places[i].point]);
    number[places[i].point] = static_cast<std::uint32_t>(result.points.size() - 1);
  }
  for (const Triangle& t : triangulated(mesh)) {
    const Triangle moved{number[t[0]], number[t[1]], number[t[2]]};
    if (moved[0] != moved[1] && moved[1] != moved[2] && moved[2] != moved[0])
      result.triangles.push_back(moved);
  }
  return result;
}

/// Returns the pieces with their middles: the centre of mass, or that of the box if the mesh is not closed
/// and the centre of mass is outside of it.
std::vector<Piece> read_pieces(const std::filesystem::path& directory, Bounds& object, std::size_t& triangles,
                               RunContext& context) {
  std::ifstream file(directory / "pieces.json");
  const nlohmann::json document = nlohmann::json::parse(file, nullptr, false);
  if (!document.is_object() || !document.contains("pieces"))
    throw Error("'" + (directory / "pieces.json").string() + "' is not the description of a fracture");
  std::vector<Piece> pieces;
  for (const auto& entry : document.at("pieces")) {
    Piece piece{read_mesh(directory / entry.at("file").get<std::string>(), context), {}};
    const Bounds box = bounds(piece.mesh);
    if (box.empty()) continue;
    object.add(box.lower);
    object.add(box.upper);
    for (int a = 0; a < 3; ++a)
      piece.middle[a] = entry.at("centre_of_mass").at(std::size_t(a)).is_number()
                            ? entry.at("centre_of_mass").at(std::size_t(a)).get<double>()
                            : std::nan("");
    const Vector3d& centre = piece.middle;
    if (!((centre - box.lower).minCoeff() >= 0.0 && (box.upper - centre).minCoeff() >= 0.0))
      piece.middle = 0.5 * (box.lower + box.upper);
    triangles += piece.mesh.triangle_count();
    if (triangles > kExact)
      piece.mesh =
          sketched(piece.mesh, 0.5 * (1.0 + kExplosion) * (box.upper - box.lower).maxCoeff() / kSheetPixels);
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

}  // namespace

void draw_exploded(const std::filesystem::path& directory, RunContext& context) {
  Bounds object;
  std::size_t triangles = 0;
  const std::vector<Piece> pieces = read_pieces(directory, object, triangles, context);
  const Vector3d middle = 0.5 * (object.lower + object.upper);
  Sheet sheet;
  sheet.title = std::to_string(pieces.size()) + " pieces";
  sheet.cell_pixels = triangles <= kFewTriangles ? kSmallSheetPixels : kSheetPixels;
  PolygonMesh all;
  all.origin = middle;
  for (const Piece& piece : pieces) {
    const Vector3d shift = kExplosion * (piece.middle - middle);
    const Bounds box = bounds(piece.mesh);
    sheet.frame.add(box.lower + shift);
    sheet.frame.add(box.upper + shift);
    const auto first = static_cast<std::uint32_t>(all.points.size());
    for (std::size_t p = 0; p < piece.mesh.points.size(); ++p)
      all.points.push_back(Vector3d(piece.mesh.world(p) + shift - middle).cast<float>());
    for (const Triangle& t : triangulated(piece.mesh))
      all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  sheet.viewpoint = open_viewpoint(all, context);
  sheet.close_up = busy_close_up(all, sheet.frame, sheet.viewpoint, kExplodedCloseUp, context);
  sheet.pictures.push_back({"exploded", {}, [&all] { return std::move(all); }});
  render_sheet(directory / "exploded.png", sheet, context);
}

}  // namespace hermesh
