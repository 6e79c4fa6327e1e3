#include "algorithms/fracture/label_repair.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/cell_sheets.h"

namespace hermesh {
namespace {

using Place = LabelledSolid::Place;

/// Corners of each corner's three edges.
constexpr std::array<std::array<int, 3>, 8> kBeside = [] {
  std::array<std::array<int, 3>, 8> result{};
  for (int c = 0; c < 8; ++c)
    for (int a = 0; a < 3; ++a) result[c][a] = c ^ (1 << a);
  return result;
}();

int signs_of(const CornerLabels& labels, std::uint32_t label) {
  int signs = 0;
  for (int c = 0; c < 8; ++c) signs |= (labels[c] == label) << c;
  return signs;
}

/// Inside corners that hang together with `corner` by edges of the cell.
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

class Repair {
 public:
  Repair(LabelledSolid& solid, RunContext& context) : solid_(solid), context_(context) {}

  RepairReport run() {
    std::vector<Place> cells = find_cells();
    report_.cells = cells.size();
    // What cannot be bettered waits, and is tried again when something beside it has changed.
    std::vector<Place> waiting = run_rounds(cells, [&](const Place& cell) { return better(cell); });
    run_rounds(waiting, [&](const Place& cell) { return lower(cell); });
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

  CornerLabels labels(const Place& cell) const {
    CornerLabels result;
    for (int c = 0; c < 8; ++c) result[c] = solid_.label(corner(cell, c));
    return result;
  }
  Place corner(const Place& cell, int c) const {
    return solid_.locate(cell.block, (cell.sample >> 6) + (c & 1), ((cell.sample >> 3) & 7) + ((c >> 1) & 1),
                         (cell.sample & 7) + (c >> 2));
  }

  Cells find_cells() {
    std::vector<Cells> found(solid_.blocks.size());
    parallel_blocks(found.size(), context_, [&](std::size_t b) {
      LabelCube cube;
      if (!gather_labels(solid_, solid_.labels, static_cast<std::int32_t>(b), cube)) return;
      for (int cell = 0; cell < 512; ++cell) {
        const int at = 81 * (cell >> 6) + 9 * ((cell >> 3) & 7) + (cell & 7);
        CornerLabels corners;
        for (int c = 0; c < 8; ++c)
          corners[c] = cube[static_cast<std::size_t>(at + 81 * (c & 1) + 9 * ((c >> 1) & 1) + (c >> 2))];
        if (!is_simple(corners)) found[b].push_back({static_cast<std::int32_t>(b), cell});
      }
    });
    Cells all;
    for (const Cells& list : found) all.insert(all.end(), list.begin(), list.end());
    return all;
  }

  /// Visits cells, and those around what has changed, until nothing changes any more. Returns what is left.
  template <class Visit>
  Cells run_rounds(Cells cells, Visit&& visit) {
    Cells left;
    while (!cells.empty()) {
      context_.check();
      changed_.clear();
      for (const Place& cell : cells)
        if (!is_simple(labels(cell)) && !visit(cell)) left.push_back(cell);
      cells = around(changed_);
      std::erase_if(cells, [&](const Place& cell) { return is_simple(labels(cell)); });
    }
    std::erase_if(left, [&](const Place& cell) { return is_simple(labels(cell)); });
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

  /// The cells that have one of these samples at a corner; an inside sample has all eight of them.
  Cells around(const Cells& samples) const {
    Cells cells;
    for (const Place& s : samples)
      for (int c = 0; c < 8; ++c)
        cells.push_back(solid_.locate(s.block, (s.sample >> 6) - (c & 1),
                                      ((s.sample >> 3) & 7) - ((c >> 1) & 1), (s.sample & 7) - (c >> 2)));
    sort(cells);
    return cells;
  }

  int count_bad(const Cells& cells) const {
    int bad = 0;
    for (const Place& cell : cells) bad += !is_simple(labels(cell));
    return bad;
  }

  /// How many more cells would not be simple; leaves the labels as they are.
  int effect(const Place& cell, const Change& change) {
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
    const int then = count_bad(cells);
    for (std::size_t i = 0; i < samples.size(); ++i)
      solid_.labels.set(samples[i].block, samples[i].sample, old[i]);
    return then - bad;
  }

  void apply(const Place& cell, const Change& change) {
    for (int c = 0; c < 8; ++c) {
      if (!((change.corners >> c) & 1)) continue;
      const Place at = corner(cell, c);
      const std::uint32_t label = solid_.label(at);
      if (label == change.label) continue;
      before_.emplace(static_cast<std::uint64_t>(at.block) << 9 | static_cast<std::uint64_t>(at.sample),
                      label);
      solid_.labels.set(at.block, at.sample, change.label);
      changed_.push_back(at);
    }
  }

  /// One corner to another label of the cell, or a part of the corners to one of its labels.
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

  /// The change that leaves the fewest cells not simple, if it is an improvement; of equals the first.
  bool better(const Place& cell) {
    std::optional<Change> best;
    int least = 0;
    for (const Change& change : changes(labels(cell)))
      if (const int more = effect(cell, change); more < least) least = more, best = change;
    if (best) apply(cell, *best);
    return best.has_value();
  }

  /// A change that makes the cell simple and only lowers labels; of those the one that spoils the fewest
  /// others.
  bool lower(const Place& cell) {
    const CornerLabels corners = labels(cell);
    std::optional<Change> best;
    int least = std::numeric_limits<int>::max();
    for (const Change& change : changes(corners)) {
      CornerLabels then = corners;
      bool lowers = true;
      for (int c = 0; c < 8; ++c)
        if ((change.corners >> c) & 1) lowers = lowers && change.label <= corners[c], then[c] = change.label;
      if (!lowers || !is_simple(then)) continue;
      if (const int more = effect(cell, change); more < least) least = more, best = change;
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

bool has_cut(const CornerLabels& labels) {
  for (int c = 0; c < 8; ++c)
    for (const int d : kBeside[c])
      if (d > c && labels[c] != labels[d] && labels[c] != 0 && labels[d] != 0) return true;
  return false;
}

bool is_simple(const CornerLabels& labels) {
  if (!has_cut(labels)) return true;
  int done = 0;
  for (int c = 0; c < 8; ++c) {
    if ((done >> c) & 1) continue;
    const int signs = signs_of(labels, labels[c]);
    done |= signs;
    const CellSheets& cell = kCellSheets[static_cast<std::size_t>(signs)];
    if (cell.sheets != 1 || cell.ambiguous_faces != 0) return false;
  }
  return true;
}

RepairReport repair_labels(LabelledSolid& solid, RunContext& context) {
  const Stage stage(context, "repair labels");
  return Repair(solid, context).run();
}

}  // namespace hermesh
