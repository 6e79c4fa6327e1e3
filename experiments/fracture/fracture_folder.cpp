#include "experiments/fracture/fracture_folder.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "algorithms/fracture/mass_properties.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/pictures/render.h"
#include "experiments/pictures/viewpoint.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Json = nlohmann::ordered_json;

constexpr int kPixels = 900;
/// Up to this number of triangles the pieces have few details, and a smaller picture shows them in half the time.
constexpr std::size_t kFewTriangles = 20'000;
constexpr int kFewPixels = 640;
/// How many triangles are drawn as they are; the pieces beyond are sketched, so that a picture takes little
/// memory.
constexpr std::size_t kExact = 3'000'000;
/// Pieces move this part of their way from the object's middle, away from it.
constexpr double kExplosion = 0.5;
constexpr double kCloseUp = 0.07;  // of the box, so that polygons of some hundred voxels a side are told apart

Json json_of(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Json json_of(const Eigen::Matrix3d& m) {
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back(json_of(Vector3d(m.row(i).transpose())));
  return rows;
}

Json json_of(const PieceOutput& piece, const std::string& file) {
  Json json{{"piece", piece.number}, {"file", file}, {"name", piece.name}};
  if (piece.samples) json["samples"] = *piece.samples;
  json["points"] = piece.mesh.points.size();
  json["triangles"] = piece.mesh.triangle_count();
  json["volume"] = piece.mass.volume;
  json["area"] = piece.mass.area;
  json["centre_of_mass"] = json_of(piece.mass.centre);
  json["inertia"] = json_of(piece.mass.inertia);
  std::uint64_t seams = 0;
  Json neighbours = Json::array();
  for (const auto& [number, seam] : piece.neighbours) {
    neighbours.push_back({{"piece", number}, {"triangles", seam.first}, {"area", seam.second}});
    seams += seam.first;
  }
  json["seam_triangles"] = seams;
  json["neighbours"] = std::move(neighbours);
  return json;
}

Json json_of(const LabelledFracture& fracture) {
  Json merged = Json::array();
  for (const MergedPiece& sliver : fracture.merged)
    merged.push_back({{"samples", sliver.samples},
                      {"code", sliver.code},
                      {"name", sliver.name},
                      {"into_code", sliver.into_code},
                      {"into", sliver.into_name}});
  return {{"cut_edges", fracture.cut_edges},          {"made_up_crossings", fracture.made_up_crossings},
          {"repaired_cells", fracture.repair.cells},  {"changed_samples", fracture.repair.changed_samples},
          {"met_joints", fracture.met_joints},        {"split_off", fracture.split_off},
          {"small_pieces_kept", fracture.small_kept}, {"merged_slivers", std::move(merged)}};
}

/// The mesh with its points moved to the middles of cubes of that size, without the triangles that lose their area.
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

void write_text(const std::filesystem::path& path, const std::string& text) {
  AtomicFile file(path);
  std::ofstream out(file.path(), std::ios::binary);
  out << text;
  out.close();
  if (!out) throw Error("cannot write '" + path.filename().string() + "': the disk may be full");
  file.commit();
}

}  // namespace

FractureFolder::FractureFolder(const std::filesystem::path& target, const Bounds& object)
    : folder_(target), object_(object) {}

std::string FractureFolder::file_name(std::uint32_t piece) {
  std::string digits = std::to_string(piece);
  digits.insert(0, digits.size() < 4 ? 4 - digits.size() : 0, '0');
  return "piece_" + digits + ".ply";
}

void FractureFolder::add(PieceOutput&& piece, RunContext& context) {
  const std::string file = file_name(piece.number);
  write_mesh(folder_.path() / file, piece.mesh, context);
  pieces_.push_back(json_of(piece, file));
  volume_ += piece.mass.volume;
  drawn_triangles_ += piece.mesh.triangle_count();
  const double pixel = (1.0 + kExplosion) * object_.size().maxCoeff() / kPixels;
  if (drawn_triangles_ > kExact) piece.mesh = sketched(piece.mesh, 0.5 * pixel);
  piece.mesh.attributes.clear();
  // The centre of mass of a mesh that is not closed may lie anywhere; a picture has the piece where it belongs.
  const Bounds box = bounds(piece.mesh);
  const Vector3d& centre = piece.mass.centre;
  const bool within = !box.empty() && (centre - box.lower).minCoeff() >= 0.0 && (box.upper - centre).minCoeff() >= 0.0;
  const Vector3d place = within || box.empty() ? centre : Vector3d(0.5 * (box.lower + box.upper));
  sketches_.push_back({std::move(piece.mesh), place});
}

validation::FractureLedger FractureFolder::judge(RunContext& context, const PolygonMesh& uncut,
                                                 double reach) const {
  std::vector<MeshFile> files;
  for (std::uint32_t piece = 1; piece <= sketches_.size(); ++piece)
    files.push_back(read_mesh_file(folder_.path() / file_name(piece), context, {.attributes = true}));
  const MeshFile surface = to_mesh_file(uncut);
  validation::ExpectedVolumes expected{.whole = {}, .pieces = {}, .surface = &surface, .reach = reach};
  if (!uncut.empty()) expected.whole = mass_properties(uncut).volume;
  for (const Json& piece : pieces_) expected.pieces.push_back(piece.at("volume").get<double>());
  return validation::judge_fracture(files, context, expected);
}

void FractureFolder::commit(Json head, const FractureSummary& summary, bool picture, RunContext& context) {
  head["pieces_volume"] = volume_;
  if (summary.labelled) head["labels"] = json_of(*summary.labelled);
  Json cutters = Json::array();
  for (std::size_t k = 0; k < summary.cutters.size(); ++k) {
    const CutterRecord& record = summary.cutters[k];
    cutters.push_back({{"cutter", k},
                       {"name", record.name},
                       {"state", to_string(record.state)},
                       {"sentence", record.name + " " + in_words(record.state)},
                       {"samples", record.samples},
                       {"edges", record.edges}});
  }
  for (const std::string& name : summary.empty)
    cutters.push_back({{"name", name}, {"state", "nothing"}, {"sentence", name + ": nothing"}});
  head["cutters"] = std::move(cutters);
  head["pieces"] = std::move(pieces_);
  write_text(folder_.path() / "pieces.json", head.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
  if (picture) draw(std::to_string(summary.pieces) + " pieces", context);
  context.check();
  folder_.commit();
}

void FractureFolder::draw(const std::string& title, RunContext& context) const {
  const Vector3d middle = 0.5 * (object_.lower + object_.upper);
  Sheet sheet;
  sheet.title = title;
  sheet.cell_pixels = drawn_triangles_ <= kFewTriangles ? kFewPixels : kPixels;
  const auto shift = [&](const Sketch& sketch) { return Vector3d(kExplosion * (sketch.centre - middle)); };
  for (const Sketch& sketch : sketches_) {
    const Bounds box = bounds(sketch.mesh);
    if (box.empty()) continue;
    sheet.frame.add(box.lower + shift(sketch));
    sheet.frame.add(box.upper + shift(sketch));
  }
  PolygonMesh all;
  all.origin = middle;
  for (const Sketch& sketch : sketches_) {
    const auto first = static_cast<std::uint32_t>(all.points.size());
    for (std::size_t p = 0; p < sketch.mesh.points.size(); ++p)
      all.points.push_back(Vector3d(sketch.mesh.world(p) + shift(sketch) - middle).cast<float>());
    for (const Triangle& t : triangulated(sketch.mesh))
      all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  sheet.viewpoint = open_viewpoint(all, context);
  sheet.close_up = busy_close_up(all, sheet.frame, sheet.viewpoint, kCloseUp, context);
  sheet.pictures.push_back({"exploded", {}, [&all] { return std::move(all); }});
  render_sheet(folder_.path() / "exploded.png", sheet, context);
}

}  // namespace hermesh
