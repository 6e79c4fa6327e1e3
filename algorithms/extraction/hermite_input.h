// What the extractors share that work on Hermite data: where it comes from and how it is kept, as options.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/variant.h"
#include "algorithms/hermite/dense/dense_hermite.h"
#include "algorithms/hermite/representation.h"

namespace hermesh {

/// `hermite` (exact, level-set or auto), `representation` and `normals` (the code of 16 bits).
std::vector<OptionSpec> hermite_options();

/// Whether crossings are to come from polygons, or from Hermite data that did. `auto` takes them at the
/// isovalue 0 alone, for nowhere else does the surface that is asked for lie on the polygons.
bool wants_polygons(const ExtractionInput& input);

/// The polygons, where a variant `asked` for what only they have; `instead` is the option to do without.
/// @throws Error if they are not there, or if they do not lie at the isovalue, which is so only at 0.
const PolygonMesh& polygons_at_isovalue(const ExtractionInput& input, const std::string& asked,
                                        const std::string& instead);

/// With the representation 'sparse': sampled as those options say, and never there as floats if from a level
/// set. Its figures go to the run's context. None with another representation.
/// @throws Error for exact data where there are no polygons at the isovalue.
std::optional<PackedHermite> packed_hermite_input(const ExtractionInput& input, const std::string& variant);

/// Samples as those options say and packs the data into the thesis's voxels, whatever `representation` is.
/// The bytes go to the run's context as figures, but for the crossings that are lost: who reads the voxels
/// counts them.
/// @throws Error for exact data where there are no polygons at the isovalue.
ThesisDense thesis_hermite_input(const ExtractionInput& input, const std::string& variant);

/// Samples as those options say and passes the data through the representation; its figures go to the run's
/// context, and a note says how many crossing edges no polygon was found for. `variant` is who asks, for the
/// sentences.
/// @throws Error for exact data where there are no polygons at the isovalue, and where `needs_normals` but
/// the representation has none.
FloatHermite hermite_input(const ExtractionInput& input, const std::string& variant, bool needs_normals);

/// True where those options ask for the level set's own crossings as they are computed, so that an extractor
/// may take them from the samples without keeping them.
bool from_level_set_alone(const ExtractionInput& input);

}  // namespace hermesh
