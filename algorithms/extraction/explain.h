// Sentences for the user about an extraction: what has no effect, where a surface ends, why there is none.
#pragma once

#include <string>

#include "algorithms/core/variant.h"
#include "algorithms/extraction/volume_ends.h"

namespace hermesh {

/// Refuses an extractor that is not adaptive where a mask or a tolerance grid is given: it would make its
/// usual mesh and leave the user in the belief that it did not. @throws Error
void check_adaptive(const Extractor& extractor);

/// Refuses polygons that the extractor would not look at: they would leave the user in the belief that it
/// did.
/// @throws Error
void check_source_has_effect(const Extractor& extractor, const Options& options, double isovalue);

/// A sentence that says where a surface runs into the end of the data; empty where it does not.
std::string ends_note(const DataEnds& ends, Ends treatment);

/// A sentence that says why the mesh that the extractor of that name made of a volume is empty; `of_polygons`
/// is whether the volume was made of polygons in the same run.
std::string no_surface(const LevelSet& volume, double isovalue, bool of_polygons,
                       const std::string& extractor);

}  // namespace hermesh
