#include "algorithms/fracture/label_repair.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "algorithms/core/parallel.h"
#include "algorithms/fracture/label_sheets.h"

namespace hermesh {
namespace {

using Place = LabelledSolid::Place;

/// For each corner of a cell the other ends of its three edges.
constexpr std::array<std::array<int, 3>, 8> kBeside = [] {
  std::array<std::array<int, 3>, 8> result{};
  for (int c = 0; c < 8; ++c)
    for (int a = 0; a < 3; ++a) result[c][a] = c ^ (1 << a);
  return result;
}();

/// The corners of a label, a bit a corner.
int signs_of(const CornerLabels& labels, std::uint32_t label) {
  int signs = 0;
  for (int c = 0; c < 8; ++c) signs |= (labels[c] == label) << c;
  return signs;
}

/// The inside corners that edges of the cell connect to `corner`, regardless of their labels, as a bit mask.
int part_of(const CornerLabels& labels, int corner) {
  int part = 1 << corner;
  for (int before = 0; before != part;) {
    before = part;
    for (int c = 0; c < 8; ++c)
      if ((part >> c) & 1)
        for (const int d : kBeside[c])
          if (labels[d] > 0) part |= 1 << d;
  }
  return part;
}

/// New labels for some corners of a cell.
struct Change {
  int corners = 0;  ///< a bit a corner
  std::uint32_t label = 0;
};

/// Returns the number of samples that a change concerns.
int size_of(const Change& change) { return std::popcount(static_cast<unsigned>(change.corners)); }

/// The phases of label_repair.h, "Termination". Everything runs in one thread except for the search for the
/// first cells, whose result is put in order of blocks, because the result depends on the order of changes.
class Repair {
 public:
  Repair(LabelledSolid& solid, bool near_boundary, RunContext& context)
      : solid_(solid), context_(context), near_boundary_(near_boundary) {}

  RepairReport run() {
    std::vector<Place> cells = find_cells();
    report_.cells = cells.size();
    // Changes away from the boundary come last, because the repair of adjacent cells may make them
    // unnecessary.
    if (near_boundary_) {
      cells = run_phases(std::move(cells));
      near_boundary_ = false;
    }
    run_phases(std::move(cells));
    // A sample that was changed and later changed back does not count.
    for (const auto& [key, before] : before_)
      report_.changed_samples +=
          solid_.labels(static_cast<std::int32_t>(key >> 9), static_cast<int>(key & 511)) != before;
    return report_;
  }

 private:
  using Cells = std::vector<Place>;
  static bool before(const Place& a, const Place& b) {
    return std::pair(a.block, a.sample) < std::pair(b.block, b.sample);
  }

  /// Repairs the given cells. Returns those that are not simple afterwards: none, unless only changes near
  /// the boundary are allowed.
  Cells run_phases(Cells cells) {
    // The first phase makes only changes that reduce the number of cells that are not simple. A cell that no
    // change improves waits, and is tried again when a cell next to it has changed.
    Cells waiting = run_rounds(std::move(cells), [&](const Place& cell) { return better(cell); });
    // The second phase lowers labels. Without `near_boundary_`, lower() always succeeds, so no cell is left.
    return run_rounds(std::move(waiting), [&](const Place& cell) { return lower(cell); });
  }

  CornerLabels labels(const Place& cell) const { return corner_labels(solid_, cell); }
  Place corner(const Place& cell, int c) const { return moved(cell, c & 1, (c >> 1) & 1, c >> 2); }
  Place moved(const Place& at, int x, int y, int z) const {
    return solid_.locate(at.block, (at.sample >> 6) + x, ((at.sample >> 3) & 7) + y, (at.sample & 7) + z);
  }
  bool simple(const Place& cell) const { return is_simple(solid_, cell); }

  /// All cells that are not simple, by block and cell. A block whose samples, with those one step beyond,
  /// have one label holds no cut, hence no such cell.
  Cells find_cells() {
    std::vector<Cells> found(solid_.blocks.size());
    parallel_blocks(found.size(), context_, [&](std::size_t b) {
      LabelCube cube;
      if (!gather_labels(solid_, solid_.labels, static_cast<std::int32_t>(b), cube)) return;
      for (int cell = 0; cell < 512; ++cell) {
        const Place at = {static_cast<std::int32_t>(b), cell};
        if (has_cut(labels_in(cube, cell)) && !simple(at)) found[b].push_back(at);
      }
    });
    Cells all;
    for (const Cells& list : found) all.insert(all.end(), list.begin(), list.end());
    return all;
  }

  /// Visits the given cells that are not simple, then those around the samples that `visit` changed, until no
  /// sample changes any more. Returns the cells that are not simple at the end, in order.
  template <class Visit>
  Cells run_rounds(Cells cells, Visit&& visit) {
    Cells left;
    while (!cells.empty()) {
      context_.check();
      changed_.clear();
      for (const Place& cell : cells)
        // A cell may have become simple by a change made earlier in this round.
        if (!simple(cell) && !visit(cell)) left.push_back(cell);
      cells = around(changed_);
      std::erase_if(cells, [&](const Place& cell) { return simple(cell); });
    }
    // A remaining cell may likewise have become simple through a change at a cell next to it.
    std::erase_if(left, [&](const Place& cell) { return simple(cell); });
    sort(left);
    return left;
  }

  static void sort(Cells& cells) {
    std::sort(cells.begin(), cells.end(), before);
    cells.erase(std::unique(cells.begin(), cells.end(),
                            [](const Place& a, const Place& b) {
                              return a.block == b.block && a.sample == b.sample;
                            }),
                cells.end());
  }

  /// All cells whose simplicity may depend on these samples: those that have one of them at a corner (all
  /// eight of them are in blocks, for an inside sample), and those that share a face with such a cell. In
  /// order.
  Cells around(const Cells& samples) const {
    Cells cells;
    for (const Place& s : samples)
      for (int x = -2; x <= 1; ++x)
        for (int y = -2; y <= 1; ++y)
          for (int z = -2; z <= 1; ++z) {
            // Steps −1 and 0 lead to cells with the sample at a corner, −2 and 1 to those beyond their faces;
            // two such steps at once lead across an edge, where is_simple() does not look.
            const auto is_beside = [](int d) { return d == -2 || d == 1; };
            if (is_beside(x) + is_beside(y) + is_beside(z) > 1) continue;
            if (const Place cell = moved(s, x, y, z); cell.block >= 0) cells.push_back(cell);
          }
    sort(cells);
    return cells;
  }

  /// How many of the cells are not simple.
  int count_bad(const Cells& cells) const {
    int bad = 0;
    for (const Place& cell : cells) bad += !simple(cell);
    return bad;
  }

  struct Effect {
    int more;    ///< cells that are not simple after the change, less those before it
    bool mends;  ///< true if the changed cell itself is simple after it
  };
  /// Tries a change and undoes it: the labels are unchanged afterwards.
  Effect effect(const Place& cell, const Change& change) {
    Cells samples;
    std::array<std::uint32_t, 8> old{};
    for (int c = 0; c < 8; ++c)
      if ((change.corners >> c) & 1) samples.push_back(corner(cell, c));
    const Cells cells = around(samples);
    const int bad = count_bad(cells);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      old[i] = solid_.label(samples[i]);
      solid_.labels.set(samples[i].block, samples[i].sample, change.label);
    }
    const Effect result{count_bad(cells) - bad, simple(cell)};
    for (std::size_t i = 0; i < samples.size(); ++i)
      solid_.labels.set(samples[i].block, samples[i].sample, old[i]);
    return result;
  }

  /// Makes a change, and keeps the samples that differ after it for the next round.
  void apply(const Place& cell, const Change& change) {
    for (int c = 0; c < 8; ++c) {
      if (!((change.corners >> c) & 1)) continue;
      const Place at = corner(cell, c);
      const std::uint32_t label = solid_.label(at);
      if (label == change.label) continue;
      before_.emplace(solid_.key(at), label);
      solid_.labels.set(at.block, at.sample, change.label);
      changed_.push_back(at);
    }
  }

  /// Returns true if a sample and its six neighbours have one code, so that the sample is more than half a
  /// voxel away from the boundary between the voxels of different codes.
  bool is_away(const Place& at) const {
    const std::uint32_t code = solid_.codes(at.block, at.sample);
    for (const int step : {-1, 1})
      for (const Place& next : {moved(at, step, 0, 0), moved(at, 0, step, 0), moved(at, 0, 0, step)})
        if (next.block < 0 || solid_.codes(next.block, next.sample) != code) return false;
    return true;
  }

  /// Returns the changes near the boundary: any inside corners of other labels take a label of the cell, but
  /// those away from the boundary only the one of their code. The changes of the fewest samples come first.
  std::vector<Change> changes_near_boundary(const Place& cell, const CornerLabels& corners,
                                            const std::vector<std::uint32_t>& present) const {
    std::vector<Change> result;
    int near = 0;
    for (int c = 0; c < 8; ++c) near |= (corners[c] > 0 && !is_away(corner(cell, c))) << c;
    for (const std::uint32_t label : present) {
      int free = 0;
      for (int c = 0; c < 8; ++c) {
        if (corners[c] == 0 || corners[c] == label) continue;
        const Place at = corner(cell, c);
        free |= (((near >> c) & 1) || solid_.code_of[label] == solid_.codes(at.block, at.sample)) << c;
      }
      for (int set = free; set > 0; set = (set - 1) & free) result.push_back({set, label});
    }
    std::ranges::stable_sort(result, {}, size_of);
    return result;
  }

  /// The changes that are tried at a cell, if they need not be near the boundary: one inside corner takes
  /// another label of the cell, or all inside corners of a connected set take a label of one of them. None
  /// changes the outside or introduces a label that the cell does not have.
  std::vector<Change> changes(const Place& cell, const CornerLabels& corners) const {
    std::vector<Change> result;
    std::vector<std::uint32_t> present(corners.begin(), corners.end());
    std::sort(present.begin(), present.end());
    present.erase(std::unique(present.begin(), present.end()), present.end());
    std::erase(present, 0u);
    if (near_boundary_) return changes_near_boundary(cell, corners, present);
    int seen = 0;
    for (int c = 0; c < 8; ++c) {
      if (corners[c] == 0) continue;
      for (const std::uint32_t label : present)
        if (label != corners[c]) result.push_back({1 << c, label});
      const int part = part_of(corners, c);
      if ((seen & part) == 0)
        for (const std::uint32_t label : present)
          if (signs_of(corners, label) & part) result.push_back({part, label});
      seen |= part;
    }
    return result;
  }

  /// Makes the change that leaves the fewest cells not simple (of several equal ones, the first), if it
  /// reduces their number; near the boundary, the best of those that change the fewest samples. Returns true
  /// if it made a change.
  bool better(const Place& cell) {
    std::optional<Change> best;
    int least = 0;
    for (const Change& change : changes(cell, labels(cell))) {
      if (near_boundary_ && best && size_of(change) > size_of(*best)) break;
      if (const int more = effect(cell, change).more; more < least) least = more, best = change;
    }
    if (best) apply(cell, *best);
    return best.has_value();
  }

  /// Makes the cell simple by a change that raises no label; of those the one that spoils the fewest others.
  /// If there is none, every part of the inside corners takes its lowest label, unless only changes near the
  /// boundary are allowed. Returns true if it made a change.
  bool lower(const Place& cell) {
    const CornerLabels corners = labels(cell);
    std::optional<Change> best;
    int least = std::numeric_limits<int>::max();
    for (const Change& change : changes(cell, corners)) {
      bool lowers = true;
      for (int c = 0; c < 8; ++c)
        if ((change.corners >> c) & 1) lowers = lowers && change.label <= corners[c];
      // Only such changes are allowed here, so that the sum of all labels falls: nothing else ends this
      // phase.
      if (!lowers) continue;
      if (near_boundary_ && best && size_of(change) > size_of(*best)) break;
      if (const Effect then = effect(cell, change); then.mends && then.more < least)
        least = then.more, best = change;
    }
    if (!best && near_boundary_) return false;
    ++report_.forced_changes;
    if (best) {
      apply(cell, *best);
      return true;
    }
    for (int c = 0; c < 8; ++c) {
      if (corners[c] == 0) continue;
      const int part = part_of(corners, c);
      std::uint32_t lowest = corners[c];
      for (int d = 0; d < 8; ++d)
        if ((part >> d) & 1) lowest = std::min(lowest, corners[d]);
      apply(cell, {part, lowest});
    }
    return true;
  }

  LabelledSolid& solid_;
  RunContext& context_;
  bool near_boundary_;  ///< true as long as only changes near the boundary are allowed
  RepairReport report_;
  std::vector<Place> changed_;                     ///< samples, in this round
  std::map<std::uint64_t, std::uint32_t> before_;  ///< first labels of changed samples, by block and sample
};

}  // namespace

CornerLabels corner_labels(const LabelledSolid& solid, const LabelledSolid::Place& cell) {
  CornerLabels labels;
  for (int c = 0; c < 8; ++c)
    labels[c] = solid.label(cell.block, (cell.sample >> 6) + (c & 1),
                            ((cell.sample >> 3) & 7) + ((c >> 1) & 1), (cell.sample & 7) + (c >> 2));
  return labels;
}

bool is_simple(const LabelledSolid& solid, const LabelledSolid::Place& cell) {
  const CornerLabels labels = corner_labels(solid, cell);
  if (!has_cut(labels)) return true;
  // The three conditions of label_repair.h. A pinched face counts only if the cell beyond it is a joint in
  // which it is also pinched: at a cell without a cut the surface can be constrained to the segments.
  const JointSheets own = joint_sheets(labels);
  if (!own.single_loops || (own.sheets.sheets > 1 && solid.one_sheet.contains(solid.key(cell)))) return false;
  for (int face = 0; face < 6; ++face) {
    if (!((own.pinched >> face) & 1)) continue;
    int at[3] = {cell.sample >> 6, (cell.sample >> 3) & 7, cell.sample & 7};
    at[face >> 1] += face & 1 ? 1 : -1;
    const CornerLabels beside = corner_labels(solid, solid.locate(cell.block, at[0], at[1], at[2]));
    if (has_cut(beside) && ((joint_sheets(beside).pinched >> (face ^ 1)) & 1)) return false;
  }
  return true;
}

RepairReport repair_labels(LabelledSolid& solid, RunContext& context, bool near_boundary) {
  const Stage stage(context, "repair labels");
  return Repair(solid, near_boundary, context).run();
}

}  // namespace hermesh
