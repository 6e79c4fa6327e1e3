// Options of the extractors and voxelizers, by the names of the command line.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "hermesh/export.h"

namespace hermesh::HERMESH_V1 {

/// Options of an extractor or a voxelizer, name to value, as `-o name=value` gives them to the program.
/// Names, values and defaults are those of extractors() and voxelizers(). The functions that take them throw
/// Error for an unknown name or value, and for an option without effect.
using Options = std::map<std::string, std::string>;

/// An option of a method.
struct OptionInfo {
  std::string name = {}, fallback = {}, help = {};  ///< `fallback` is the value when none is given
  std::vector<std::string> choices = {};            ///< empty: a number from minimum to maximum
  double minimum = 0.0, maximum = 0.0;
};

/// A method, by the name that `--extractor` or `--voxelizer` takes.
struct MethodInfo {
  std::string name = {}, summary = {};
  /// Guarantees of an extractor for every input.
  bool closed = false, manifold = false, oriented = false, free_of_self_intersection = false;
  std::vector<OptionInfo> options = {};
};

}  // namespace hermesh::HERMESH_V1
