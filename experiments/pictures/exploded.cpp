#include "experiments/pictures/exploded.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "algorithms/io/mesh_file.h"
#include "experiments/pictures/ray_scene.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

constexpr int kSheetPixels = 900;
/// Up to this number of triangles a smaller picture shows the details in half the time.
constexpr std::size_t kFewTriangles = 20'000;
constexpr int kSmallSheetPixels = 640;
/// Number of triangles that are drawn unchanged; further pieces are simplified to limit the memory.
constexpr std::size_t kExact = 3'000'000;
/// Pieces move away from the object's middle by this share of their distance.
constexpr double kExplosion = 0.5;
constexpr double kExplodedCloseUp = 0.07;  // of the box, so that polygons at a few hundred voxels are visible

struct Piece {
  PolygonMesh mesh;
  Vector3d middle;
};

/// Returns the mesh with the points of each cube of that size merged, without the triangles that lose their
/// area.
PolygonMesh sketched(const PolygonMesh& mesh, double size) {
  PolygonMesh result;
  result.origin = mesh.origin;
  std::vector<std::pair<std::array<std::int64_t, 3>, std::uint32_t>> cells(mesh.points.size());
  for (std::uint32_t p = 0; p < cells.size(); ++p) {
    for (int a = 0; a < 3; ++a) cells[p].first[a] = std::llround(double(mesh.points[p][a]) / size);
    cells[p].second = p;
  }
  std::ranges::sort(cells);
  std::vector<std::uint32_t> number(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto& [cell, point] = cells[i];
    if (i == 0 || cells[i - 1].first < cell) result.points.push_back(mesh.points[point]);
    number[point] = static_cast<std::uint32_t>(result.points.size() - 1);
  }
  for (const Triangle& t : triangulated(mesh)) {
    const Triangle moved{number[t[0]], number[t[1]], number[t[2]]};
    if (moved[0] != moved[1] && moved[1] != moved[2] && moved[2] != moved[0])
      result.triangles.push_back(moved);
  }
  return result;
}

/// Returns the pieces with their middles: the centre of mass, or that of the box if the centre of mass is
/// missing or outside of it.
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

constexpr int kPixels = 160;  // of a view to measure the visible area, enough and quick

View look(const Bounds& box) {
  return {.centre = 0.5 * (box.lower + box.upper),
          .world_width = std::max(box.size().norm(), 1e-30),
          .width = kPixels,
          .height = kPixels};
}

}  // namespace

Viewpoint open_viewpoint(const PolygonMesh& mesh, RunContext& context) {
  Viewpoint best;
  if (mesh.empty()) return best;
  const RayScene scene(mesh);
  const View view = look(bounds(mesh));
  double most = 0.0;
  for (const double elevation : {10.0, 25.0, 45.0})
    for (int turn = 0; turn < 12; ++turn) {
      // Half a step off the axes, since a box seen from a side looks flat.
      const double azimuth = 30.0 * turn + 15.0;
      const Camera camera = make_camera(azimuth, elevation);
      const Eigen::Vector3f towards = camera.towards.cast<float>();
      double area = 0.0;
      for (const Glimpse& glimpse : scene.glimpses(camera, view, context))
        if (glimpse.hit) area += 1.0 / std::max(0.25, double(glimpse.normal.dot(towards)));
      // Differences below the accuracy of the pixels are ignored.
      if (area > 1.002 * most) {
        most = area;
        best = {azimuth, elevation};
      }
    }
  return best;
}

CloseUp busy_close_up(const PolygonMesh& mesh, const Bounds& frame, const Viewpoint& viewpoint, double size,
                      RunContext& context) {
  CloseUp close_up;
  close_up.size = size;
  if (mesh.empty() || frame.empty()) return close_up;
  const View view = look(frame);
  const Camera camera = make_camera(viewpoint.azimuth, viewpoint.elevation);
  const std::vector<Glimpse> seen = RayScene(mesh).glimpses(camera, view, context);
  const auto at = [&](int x, int y) -> const Glimpse& {
    return seen[static_cast<std::size_t>(y) * kPixels + x];
  };
  const int side = std::max(2, static_cast<int>(size * frame.size().maxCoeff() / view.world_width * kPixels));
  double most = -1.0;
  for (int top = 0; top + side <= kPixels; ++top)
    for (int left = 0; left + side <= kPixels; ++left) {
      if (!at(left + side / 2, top + side / 2).hit) continue;
      double turning = 0.0;
      int empty = 0;
      for (int y = top; y < top + side; ++y)
        for (int x = left; x < left + side; ++x) {
          if (!at(x, y).hit) {
            ++empty;
            continue;
          }
          for (const Glimpse* other : {x > left ? &at(x - 1, y) : nullptr, y > top ? &at(x, y - 1) : nullptr})
            if (other && other->hit)
              turning += std::acos(std::clamp(double(at(x, y).normal.dot(other->normal)), -1.0, 1.0));
        }
      if (10 * empty > side * side || turning <= most) continue;
      most = turning;
      const Eigen::Vector3d fraction = (at(left + side / 2, top + side / 2).place - frame.lower)
                                           .cwiseQuotient(frame.size().cwiseMax(1e-30));
      close_up.centre = {fraction.x(), fraction.y(), fraction.z()};
    }
  return close_up;
}

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
