#include "algorithms/extraction/explain.h"

#include <algorithm>

#include "algorithms/core/level_set.h"
#include "algorithms/core/number_text.h"

namespace hermesh {

void check_adaptive(const Extractor& extractor) {
  // Every adaptive extractor has a bound of one of these names.
  for (const OptionSpec& option : extractor.options)
    if (option.name == "threshold" || option.name == "tolerance") return;
  throw Error("the extractor " + extractor.name +
              " keeps no bound that a mask or a tolerance grid could change; use adaptive-dual-contouring or "
              "manifold-dual-contouring");
}

void check_source_has_effect(const Extractor& extractor, const Options& options, double isovalue) {
  if (options.is("hermite", "exact") || options.is("crossings", "exact")) return;
  // Polygons lie where the distance is 0, and have no edge crossings at any other value.
  const bool automatic = options.is("hermite", "auto");
  if (automatic && isovalue == 0.0) return;
  throw Error("--source has no effect: " +
              (automatic ? "the polygons lie at the isovalue 0"
                         : extractor.name + " with these options takes nothing from polygons"));
}

std::string ends_note(const DataEnds& ends, Ends treatment) {
  if (!ends.any()) return {};
  if (!ends.in_a_box)
    return "the level set breaks off beside its surface (it was clipped by a mask, or has wrong signs) and "
           "was closed "
           "there";
  return "the surface runs into the end of the data (" + ends.text() + ") and was " +
         (treatment == Ends::open ? "cut off at its last samples"
                                  : "closed half a voxel beyond its last samples; see --ends");
}

std::string no_surface(const LevelSet& volume, double isovalue, bool of_polygons,
                       const std::string& extractor) {
  const auto [lowest, highest] = value_range(volume);
  const std::string values = "its values go from " + exact_text(lowest) + " to " + exact_text(highest) +
                             ", and " + exact_text(static_cast<float>(volume.background())) + " beyond";
  const std::string nothing =
      "there is no surface at the isovalue " + text(isovalue) + ", nothing was written: ";
  // With samples on both sides, the extractor and not the volume is the reason.
  if (double(lowest) < isovalue && isovalue < std::max(double(highest), volume.background()))
    return nothing + extractor + " found none, although the volume has samples on both sides (" + values +
           "); try another --extractor or smaller voxels";
  if (of_polygons && isovalue == 0.0 && lowest >= 0.0f)
    return nothing +
           "no voxel is inside, for the polygons enclose nothing, cancel one another, or are thinner than a "
           "voxel; " +
           "give a sheet a thickness with --signs unsigned and an --isovalue above 0";
  return nothing + "the volume has no sample inside, or none outside; " + values;
}

}  // namespace hermesh
