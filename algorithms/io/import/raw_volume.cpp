// Raw samples; see import_volume.h.
#include <cmath>

#include "algorithms/io/import/stored_samples.h"

namespace hermesh {

LevelSet import_raw(const std::filesystem::path& path, const RawLayout& layout, const ImportOptions& options,
                    RunContext& context) {
  ByteSource source(path);
  StoredSamples stored{
      .file = path.string(), .dims = layout.dims, .format = layout.format, .offset = layout.offset};
  for (int axis = 0; axis < 3; ++axis) {
    // Negated, so that NaN is refused, too.
    if (!(std::isfinite(layout.spacing[axis]) && layout.spacing[axis] > 0.0))
      throw Error("the spacing of samples must be three finite numbers above 0");
    stored.to_world(axis, axis) = layout.spacing[axis];
  }
  const std::uint64_t bytes = check_stored(stored, source.at_most());
  const auto too_long = [&] {
    return Error(stored.file + " goes on behind " + std::to_string(layout.offset) + " + " +
                 std::to_string(bytes) +
                 " bytes, where the last sample should end; check --dims, --type and --offset");
  };
  // A plain file's size tells before anything is read; the length of gzip data is known only when they end.
  if (!source.gzipped() && source.at_most() != layout.offset + bytes) throw too_long();
  LevelSet volume = read_stored(source, stored, options, context);
  if (source.count_rest(1, context) > 0) throw too_long();
  return volume;
}

}  // namespace hermesh
