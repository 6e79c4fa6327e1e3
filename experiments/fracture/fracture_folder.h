// The folder that a fracture is written to: one PLY a piece, pieces.json, exploded.png.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/io/atomic_file.h"
#include "experiments/fracture/fracture_run.h"
#include "validation/fracture_ledger.h"

namespace hermesh {

/// Made aside and renamed by commit(), so that the folder is there with all of its files or not at all. No
/// time and no path of the machine goes into it: the same fracture gives the same bytes.
class FractureFolder {
 public:
  /// @throws Error if the folder cannot be made, or is there already and not empty.
  FractureFolder(const std::filesystem::path& target, const Bounds& object);

  /// Writes piece_0001.ply, …
  void add(PieceOutput&& piece, RunContext& context);

  /// `head` is what pieces.json begins with: how the fracture was made.
  void commit(nlohmann::ordered_json head, const FractureSummary& summary, bool picture, RunContext& context);

  /// The pieces' files read back, judged, also against the volumes recorded of them and that of the uncut
  /// object's mesh if it is given. @throws Error; Cancelled
  validation::FractureLedger judge(RunContext& context, std::optional<double> uncut_volume = {}) const;

  static std::string file_name(std::uint32_t piece);

 private:
  void draw(const std::string& title, RunContext& context) const;

  AtomicFolder folder_;
  Bounds object_;
  nlohmann::ordered_json pieces_ = nlohmann::ordered_json::array();
  double volume_ = 0.0;
  /// Where there are many triangles, with points snapped to half a pixel of the picture.
  struct Sketch {
    PolygonMesh mesh;
    Eigen::Vector3d centre;
  };
  std::vector<Sketch> sketches_;
  std::size_t drawn_triangles_ = 0;
};

}  // namespace hermesh
