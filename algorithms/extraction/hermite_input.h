// Source and representation of the Hermite data of extractors, as options.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/variant.h"
#include "algorithms/thesis/voxels/dense_hermite.h"
#include "algorithms/thesis/voxels/representation.h"

namespace hermesh {

/// Returns the options `hermite` (exact, level-set or auto), `representation` and `normals` (16-bit code).
std::vector<OptionSpec> hermite_options();

/// Returns true if edge crossings are to be taken from polygons, or from Hermite data made from polygons.
/// `auto` uses them only at the isovalue 0, where the surface lies on the polygons.
bool wants_polygons(const ExtractionInput& input);

/// Returns the polygons. `asked` is the request that needs them, `instead` the option to avoid it, for
/// messages.
/// @throws Error if there are none, or the isovalue is not 0
const PolygonMesh& polygons_at_isovalue(const ExtractionInput& input, const std::string& asked,
                                        const std::string& instead);

/// Returns the data with the representation 'sparse', never stored as floats if from a level set; none with
/// another representation. Adds statistics to the run's context.
/// @throws Error for exact data without polygons at the isovalue
std::optional<PackedHermite> packed_hermite_input(const ExtractionInput& input, const std::string& variant);

/// Returns the data in the thesis's voxels, whatever `representation` is. Adds statistics to the run's
/// context, except the lost crossings, which the caller counts.
/// @throws Error for exact data without polygons at the isovalue
ThesisDense thesis_hermite_input(const ExtractionInput& input, const std::string& variant);

/// Returns the data after a round trip through the representation. Adds statistics, and a note on crossing
/// edges without a polygon, to the run's context. `variant` is the extractor's name, for messages.
/// @throws Error for exact data without polygons at the isovalue, and if `needs_normals` but the
/// representation has none
FloatHermite hermite_input(const ExtractionInput& input, const std::string& variant, bool needs_normals);

/// Returns true if the options select the level set's own crossings without loss, so an extractor may compute
/// them from the samples without storing them.
bool from_level_set_alone(const ExtractionInput& input);

}  // namespace hermesh
