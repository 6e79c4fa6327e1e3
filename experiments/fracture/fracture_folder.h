// The folder that a fracture is written to: one PLY a piece, pieces.json, exploded.png.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/io/atomic_file.h"
#include "experiments/fracture/fracture_run.h"
#include "validation/fracture_report.h"

namespace hermesh {

/// The folder in the making: it is made aside and renamed by commit(), so that it is there with all of its
/// files or not at all. No time and no path of the machine goes into it: the same fracture gives the same
/// bytes.
class FractureFolder {
 public:
  /// @throws Error if the folder cannot be made, or is there already and not empty.
  explicit FractureFolder(const std::filesystem::path& target);

  /// Writes one piece as piece_0001.ply and so on, and notes it for pieces.json. @throws Error if it cannot
  /// be written.
  void add(PieceOutput&& piece, RunContext& context);

  /// Draws exploded.png into the directory that it is given.
  using Draw = std::function<void(const std::filesystem::path&)>;

  /// Writes pieces.json, calls `draw` if there is one, and renames the directory to its final name.
  /// pieces.json begins with `head`, which states how the fracture was made.
  void commit(nlohmann::ordered_json head, const FractureSummary& summary, const Draw& draw,
              RunContext& context);

  /// Reads the pieces' files back and validates them, also against the volumes that were recorded when they
  /// were added, and against the uncut object's mesh if it is given. `reach` is how far from that the
  /// original surface of the pieces may be. @throws Error for a file that cannot be read; Cancelled
  validation::FractureReport judge(RunContext& context, const PolygonMesh& uncut = {},
                                   double reach = 0.0) const;

  /// Returns the file name of piece number `piece`, counted from 1.
  static std::string file_name(std::uint32_t piece);

 private:
  AtomicFolder folder_;
  nlohmann::ordered_json pieces_ = nlohmann::ordered_json::array();
  double volume_ = 0.0;
};

}  // namespace hermesh
