// Messages about an extraction: options without effect, surfaces cut off by the end of the data, reasons for
// an empty mesh.
#pragma once

#include <string>

#include "algorithms/core/variant.h"
#include "algorithms/extraction/volume_ends.h"

namespace hermesh {

/// @throws Error if the extractor is not adaptive, so a mask or a tolerance grid would have no effect
void check_adaptive(const Extractor& extractor);

/// @throws Error if the extractor would ignore the source polygons
void check_source_has_effect(const Extractor& extractor, const Options& options, double isovalue);

/// Returns a note on where a surface reaches the end of the data; empty if it does not.
std::string ends_note(const DataEnds& ends, Ends treatment);

/// Returns the reason why the mesh that the named extractor made from a volume is empty. `of_polygons` is
/// true if the volume was made from polygons in the same run.
std::string no_surface(const LevelSet& volume, double isovalue, bool of_polygons,
                       const std::string& extractor);

}  // namespace hermesh
