#include "experiments/fracture/fracture_folder.h"

#include <algorithm>
#include <fstream>

#include "algorithms/fracture/mass_properties.h"
#include "algorithms/io/mesh_file.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Json = nlohmann::ordered_json;

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

void write_text(const std::filesystem::path& path, const std::string& text) {
  AtomicFile file(path);
  std::ofstream out(file.path(), std::ios::binary);
  out << text;
  out.close();
  if (!out) throw Error("cannot write '" + path.filename().string() + "': the disk may be full");
  file.commit();
}

}  // namespace

FractureFolder::FractureFolder(const std::filesystem::path& target) : folder_(target) {}

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
}

validation::FractureReport FractureFolder::judge(RunContext& context, const PolygonMesh& uncut,
                                                 double reach) const {
  std::vector<MeshFile> files;
  for (std::uint32_t piece = 1; piece <= pieces_.size(); ++piece)
    files.push_back(read_mesh_file(folder_.path() / file_name(piece), context, {.attributes = true}));
  const MeshFile surface = to_mesh_file(uncut);
  validation::ExpectedVolumes expected{.whole = {}, .pieces = {}, .surface = &surface, .reach = reach};
  if (!uncut.empty()) expected.whole = mass_properties(uncut).volume;
  for (const Json& piece : pieces_) expected.pieces.push_back(piece.at("volume").get<double>());
  return validation::check_fracture(files, context, expected);
}

void FractureFolder::commit(Json head, const FractureSummary& summary, const Draw& draw,
                            RunContext& context) {
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
  if (draw) draw(folder_.path());
  context.check();
  folder_.commit();
}

}  // namespace hermesh
