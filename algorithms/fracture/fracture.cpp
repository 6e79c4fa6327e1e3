#include "algorithms/fracture/fracture.h"

#include <algorithm>

#include "algorithms/core/parallel.h"
#include "algorithms/fracture/joint_decimation.h"

namespace hermesh {
namespace {

/// Splits, merges and repairs in turn until a repair finds nothing to do: changed labels may leave new
/// slivers and new pieces that fall apart, and giving slivers away or parting pieces may call for a repair.
/// Should the turns not end soon, the last slivers stay pieces; should they still not end, the last pieces
/// that fall apart stay one.
void settle(LabelledSolid& solid, const Cutters& cutters, const FractureOptions& options,
            LabelledFracture& result, RunContext& context) {
  // The end is certain: from pass 2 * kPasses on pieces only get other numbers, which leaves simple cells
  // simple (label_components.h), so that the next repair finds none.
  constexpr int kPasses = 5;
  const auto value = [&](std::uint32_t code) { return solid.code_values[code - 1]; };
  for (int pass = 0;; ++pass) {
    const ComponentReport found = settle_components(
        solid, {options.split && pass < 2 * kPasses, pass < kPasses ? options.least_samples : 0}, context);
    for (const MergedSliver& sliver : found.merged)
      result.merged.push_back({value(sliver.code), value(sliver.into_code),
                               cutters.name_of(value(sliver.code)), cutters.name_of(value(sliver.into_code)),
                               sliver.samples});
    result.split_off += found.split_off;
    // Repair is the last step of a pass, so that all cells are simple when this function returns.
    const RepairReport repaired = repair_labels(solid, context, options.from_voxels.has_value());
    result.repair.cells += repaired.cells;
    result.repair.changed_samples += repaired.changed_samples;
    result.repair.forced_changes += repaired.forced_changes;
    if (repaired.cells == 0) return;
  }
}

/// Counts the samples of each of the numbers 0 to `numbers` − 1 in a field of labels or codes.
std::vector<std::uint64_t> count_samples(const LabelledSolid& solid, const LabelField& field,
                                         std::size_t numbers) {
  std::vector<std::uint64_t> result(numbers);
  for (std::size_t b = 0; b < solid.blocks.size(); ++b) {
    const auto block = static_cast<std::int32_t>(b);
    if (field.is_uniform(block))
      result[field(block, 0)] += 512;
    else
      for (int i = 0; i < 512; ++i) ++result[field(block, i)];
  }
  return result;
}

/// Returns true if the cutter contains a sample of the object, even one that another cutter has taken; false
/// for a cutter that is not a solid of its own.
bool meets(const LabelledSolid& solid, const Cutters& cutters, std::size_t cutter) {
  for (const HermiteView::Block& block : solid.blocks) {
    const std::optional<BlockMask> mask = cutters.signs(cutter, block.lower);
    if (!mask) return false;
    for (int word = 0; word < 8; ++word)
      if ((*mask)[word] & block.inside[word]) return true;
  }
  return false;
}

/// Returns true if a lattice edge leads from the solid into the cutter, or from the cutter into the solid.
bool lies_beside(const LabelledSolid& solid, const Cutters& cutters, std::size_t cutter) {
  for (const HermiteView::Block& block : solid.blocks) {
    const auto own = cutters.signs(cutter, block.lower);
    if (!own) return false;
    // An edge belongs to its first sample, which may be outside, but lies in one of the solid's blocks if the
    // second is inside, for these include the ones below (LabelledSolid::blocks): each edge is seen once.
    for (int axis = 0; axis < 3; ++axis) {
      const auto step = [axis](int a) { return a == axis ? 1 : 0; };
      const std::int32_t next = block.neighbours[neighbour_slot(step(0), step(1), step(2))];
      Cutters::At lower = block.lower;
      lower[axis] += 8;
      const BlockMask upper_cutter = *cutters.signs(cutter, lower);
      const BlockMask upper_solid =
          next < 0 ? BlockMask{} : solid.blocks[static_cast<std::size_t>(next)].inside;
      const auto shifted = [&](const BlockMask& mask, const BlockMask& upper) {
        return shifted_mask(step(0), step(1), step(2), [&](int x, int y, int z) -> const BlockMask& {
          return x + y + z > 0 ? upper : mask;
        });
      };
      const BlockMask after = shifted(*own, upper_cutter), solid_after = shifted(block.inside, upper_solid);
      for (int word = 0; word < 8; ++word)
        if ((block.inside[word] & after[word]) | ((*own)[word] & solid_after[word])) return true;
    }
  }
  return false;
}

/// Marks the cutters that took nothing but slivers. A plane then has no edge left, and some sliver
/// lay on its other side than the piece that it joined; any other cutter has no piece of its code left.
std::vector<char> merged_cutters(const LabelledSolid& solid, const Cutters& cutters,
                                 const std::vector<CutterRecord>& records,
                                 const std::vector<MergedPiece>& merged) {
  std::vector<char> result(records.size(), 0);
  if (cutters.plane_sides()) {
    for (std::size_t k = 0; k < records.size(); ++k)
      result[k] = records[k].edges == 0 &&
                  std::any_of(merged.begin(), merged.end(),
                              [&](const MergedPiece& m) { return ((m.code ^ m.into_code) >> k & 1) != 0; });
    return result;
  }
  for (const MergedPiece& m : merged)
    if (m.code < result.size()) result[m.code] = 1;
  for (std::uint32_t piece = 1; piece <= solid.piece_count(); ++piece)
    if (const CutCode code = solid.code_values[solid.code_of[piece] - 1]; code < result.size())
      result[code] = 0;
  return result;
}

/// The state of a cutter that merged_cutters() does not mark: the first that fits.
CutterRecord::State state_of(const LabelledSolid& solid, const Cutters& cutters, std::size_t cutter,
                             const CutterRecord& record) {
  using State = CutterRecord::State;
  if (cutters.is_empty(cutter)) return State::empty;
  if (record.edges > 0) return State::cuts;
  if (record.samples > 0) return record.samples == solid.samples ? State::swallows : State::takes;
  if (meets(solid, cutters, cutter)) return State::covered;
  return lies_beside(solid, cutters, cutter) ? State::touches : State::misses;
}

/// The record of each cutter, for a grid made from the solid's final labels.
std::vector<CutterRecord> records_of(const LabelledSolid& solid, const LabelledGrid& grid,
                                     const Cutters& cutters, const std::vector<MergedPiece>& merged) {
  std::vector<CutterRecord> records(cutters.count());
  for (std::size_t e = 0; e < grid.edge_count(); ++e)
    if (const std::int32_t cutter = grid.sides(e).cutter; cutter >= 0)
      ++records[static_cast<std::size_t>(cutter)].edges;
  const bool codes_are_cutters = !cutters.plane_sides();
  // Codes are never changed after the cutters assign them, so the samples that a cutter took can be
  // distinguished from those that remain after repairs and merges.
  const std::vector<std::uint64_t> taken = count_samples(solid, solid.codes, solid.code_values.size() + 1);
  if (codes_are_cutters)
    for (std::size_t i = 0; i < solid.code_values.size(); ++i)
      if (solid.code_values[i] < records.size()) records[solid.code_values[i]].samples = taken[i + 1];
  const std::vector<char> was_merged = merged_cutters(solid, cutters, records, merged);
  for (std::size_t k = 0; k < records.size(); ++k) {
    records[k].name = cutters.name(k);
    // A wall between two cells carries the lower one's number, so a cell may cut without an edge of its own.
    const bool cell = codes_are_cutters && !cutters.signs(k, {});
    if (was_merged[k])
      records[k].state = CutterRecord::State::merged;
    else if (cell && records[k].samples > 0 && records[k].samples < solid.samples)
      records[k].state = CutterRecord::State::cuts;
    else
      records[k].state = state_of(solid, cutters, k, records[k]);
  }
  return records;
}

/// Counts the faces across which two pieces are connected, but have no seam, and adds a note about those that
/// leave a gap. Parts that touch in an edge leave none.
void count_gaps(const LabelledSolid& solid, LabelledFracture& result, RunContext& context) {
  for (const LabelledSolid::JoinedFace& face : solid.joined_faces)
    if (solid.label(face.samples[0]) != solid.label(face.samples[1]))
      ++(face.touches ? result.touches : result.gaps);
  if (result.gaps == 0) return;
  context.note("At " + std::to_string(result.gaps) + (result.gaps == 1 ? " place" : " places") +
               " the object is too thin for a seam: pieces come apart there with a gap of less than a voxel. "
               "Smaller voxels leave fewer.");
}

}  // namespace

const char* to_string(CutterRecord::State state) {
  static constexpr const char* kNames[] = {"cuts",    "takes",  "swallows", "covered",
                                           "touches", "misses", "merged",   "empty"};
  return kNames[static_cast<std::size_t>(state)];
}

const char* in_words(CutterRecord::State state) {
  static constexpr const char* kWords[] = {"cuts the object",
                                           "takes whole parts of the object and cuts none",
                                           "swallows the object: it takes all of it in one piece",
                                           "takes nothing: the cutters before it took all that it holds",
                                           "takes nothing: it only touches the object",
                                           "takes nothing: it misses the object",
                                           "leaves no piece: its pieces were slivers and were merged into a "
                                           "neighbour",
                                           "takes nothing: it is empty, or too thin to hold a sample"};
  return kWords[static_cast<std::size_t>(state)];
}

LabelledFracture labelled_fracture(const FloatHermite& object, const Cutters& cutters,
                                   const FractureOptions& options, RunContext& context) {
  LabelledSolid solid = whole_solid(object, context);
  if (solid.samples == 0)
    throw Error("the object has no sample inside, so there is nothing to break: use smaller voxels");
  LabelledFracture result;
  // While the solid is still one piece, no cell is a joint, so the sheets found here are those of the surface
  // of the whole solid; settle_components() needs them to find samples that are connected across faces.
  if (options.split || options.least_samples > 0) find_joined_faces(solid, object, cutters, context);
  label_by_codes(solid, cutters, context);
  // Every further round has more joints of one sheet, so they end; hardly ever is there a second one.
  do {
    for (const LabelledSolid::Place& cell : result.mesh.meeting_joints)
      solid.one_sheet.insert(LabelledSolid::key(cell));
    settle(solid, cutters, options, result, context);
    // Crossings and sheets depend on the labels, so each round recomputes the grid, the records and the mesh.
    const LabelledGrid grid(solid, object, cutters, context);
    result.made_up_crossings = grid.made_up();
    result.grid_bytes = grid.memory_bytes();
    result.cut_edges = 0;
    for (std::size_t e = 0; e < grid.edge_count(); ++e) result.cut_edges += grid.sides(e).front > 0;
    result.cutters = records_of(solid, grid, cutters, result.merged);
    result.mesh = joint_mesh(grid, options.placement, context, options.from_voxels);
  } while (!result.mesh.meeting_joints.empty());
  count_gaps(solid, result, context);
  // Decimation is the last step, because its patches depend on the final labels. The counts above refer to
  // the lattice, before decimation.
  decimate_joint_mesh(result.mesh, options.tolerance, context);
  result.met_joints = solid.one_sheet.size();
  result.pieces = std::make_unique<PieceTriangles>(result.mesh, solid.piece_count());
  result.samples = count_samples(solid, solid.labels, solid.piece_count() + 1);
  result.small_kept = static_cast<std::uint64_t>(
      std::count_if(result.samples.begin() + 1, result.samples.end(),
                    [&](std::uint64_t samples) { return samples < options.least_samples; }));
  // Label 0 is the outside: only its samples within the solid's blocks were counted, so its count is
  // meaningless.
  result.samples[0] = 0;
  result.names.resize(1);
  result.codes.resize(1);
  for (std::uint32_t piece = 1; piece <= solid.piece_count(); ++piece) {
    result.codes.push_back(solid.code_values[solid.code_of[piece] - 1]);
    result.names.push_back(cutters.name_of(result.codes.back()));
  }
  return result;
}

}  // namespace hermesh
