// Cases that are volumes: CT, MRI, fog, level sets.
#pragma once

#include <string>
#include <vector>

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

struct LoadedVolume {
  std::string name;
  LevelSet volume;
  std::string origin;  ///< as in LoadedCase
  std::string sha256;  ///< hash of the file's bytes; empty for a stand-in
};

/// Loads a volume from its file, which is looked for as load_case() does, or else makes the stand-in. @throws
/// Error for an unknown name, a case that is no volume, or a file that cannot be read.
LoadedVolume load_volume(const std::string& name, RunContext& context);

/// Names of the cases that are volumes.
std::vector<std::string> volume_choices();

/// Procedural volumes, of basic arithmetic and square roots alone, so that they are the same on every
/// machine: "scan", 96 x 96 x 64 whole numbers from 0 to 999, a head-like shell around noise that the box
/// cuts off below; "fog", a sparse ball of density with noise; "cube", the level set of a cube.
bool is_volume_stand_in(const std::string& name);
/// Makes the stand-in of that name, for which is_volume_stand_in() must hold.
LevelSet make_volume_stand_in(const std::string& name);

}  // namespace hermesh
