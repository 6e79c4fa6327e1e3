#include "algorithms/fracture/label_repair.h"

#include <algorithm>
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

/// The two phases of label_repair.h, "Why it ends". Everything runs in one thread but the search for the
/// first cells, whose result is put in order of blocks: the order of changes decides the outcome.
class Repair {
 public:
  Repair(LabelledSolid& solid, RunContext& context) : solid_(solid), context_(context) {}

  RepairReport run() {
    std::vector<Place> cells = find_cells();
    report_.cells = cells.size();
    // The first phase makes only changes that reduce the number of cells that are not simple. A cell that no
    // change improves waits, and is tried again when a cell next to it has changed.
    std::vector<Place> waiting = run_rounds(cells, [&](const Place& cell) { return better(cell); });
    // The second phase lowers labels; lower() always succeeds, so no cell is left.
    run_rounds(waiting, [&](const Place& cell) { return lower(cell); });
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

  /// The changes that are tried at a cell: one inside corner takes another label of the cell, or all inside
  /// corners of a connected set take a label of one of them. None changes the outside or introduces a label
  /// that the cell does not have.
  static std::vector<Change> changes(const CornerLabels& corners) {
    std::vector<Change> result;
    std::vector<std::uint32_t> present(corners.begin(), corners.end());
    std::sort(present.begin(), present.end());
    present.erase(std::unique(present.begin(), present.end()), present.end());
    std::erase(present, 0u);
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
  /// reduces their number. Returns true if it made a change.
  bool better(const Place& cell) {
    std::optional<Change> best;
    int least = 0;
    for (const Change& change : changes(labels(cell)))
      if (const int more = effect(cell, change).more; more < least) least = more, best = change;
    if (best) apply(cell, *best);
    return best.has_value();
  }

  /// Makes the cell simple by a change that raises no label; of those the one that spoils the fewest others.
  /// If there is none, every part of the inside corners takes its lowest label. Returns true.
  bool lower(const Place& cell) {
    const CornerLabels corners = labels(cell);
    std::optional<Change> best;
    int least = std::numeric_limits<int>::max();
    for (const Change& change : changes(corners)) {
      bool lowers = true;
      for (int c = 0; c < 8; ++c)
        if ((change.corners >> c) & 1) lowers = lowers && change.label <= corners[c];
      // Only such changes are allowed here, so that the sum of all labels falls: nothing else ends this
      // phase.
      if (!lowers) continue;
      if (const Effect then = effect(cell, change); then.mends && then.more < least)
        least = then.more, best = change;
    }
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

RepairReport repair_labels(LabelledSolid& solid, RunContext& context) {
  const Stage stage(context, "repair labels");
  return Repair(solid, context).run();
}

}  // namespace hermesh
