#include "algorithms/fracture/label_components.h"

#include <algorithm>
#include <map>
#include <memory>
#include <set>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/parallel.h"
#include "algorithms/fracture/label_repair.h"

namespace hermesh {
namespace {

constexpr std::uint16_t kNoComponent = 0xffff;

/// Connected sets of samples, as sets of components of blocks.
///
/// A component is a connected set of samples within one block. Components are numbered by block and, within
/// it, by first sample; DisjointSets preserves the lowest number of a set as its root. So every root
/// represents the set's first sample, regardless of the order of joins, and the result does not depend on the
/// number of threads.
class Components {
 public:
  Components(LabelledSolid& solid, RunContext& context) : solid_(solid), context_(context) {
    find_in_blocks();
    join_blocks();
    for (const auto& [a, b] : samples_of_joined_faces())
      if (solid_.label(a) == solid_.label(b)) sets_.join(component(a), component(b));
  }

  /// Makes one set of all components of a label, connected or not (ComponentOptions::split is false).
  void join_equal_labels() {
    std::map<std::uint32_t, std::uint32_t> first;
    for (std::uint32_t c = 0; c < label_.size(); ++c) {
      const auto [at, is_new] = first.emplace(label_[c], c);
      if (!is_new) sets_.join(at->second, c);
    }
  }

  /// Sums the samples of each set at its root; to be called when all joins but those of slivers are made.
  void sum_sizes() {
    total_.assign(label_.size(), 0);
    for (std::uint32_t c = 0; c < label_.size(); ++c) total_[sets_.find(c)] += size_[c];
  }
  std::size_t label_count() const { return std::set<std::uint32_t>(label_.begin(), label_.end()).size(); }
  std::size_t count() {
    std::size_t roots = 0;
    for (std::uint32_t c = 0; c < label_.size(); ++c) roots += sets_.find(c) == c;
    return roots;
  }

  /// Gives every set smaller than `least` to the neighbour with which it shares most contacts, the smallest
  /// first. Contacts are counted once, before the first merge, and are summed up by the neighbours' roots
  /// later.
  void merge_small(std::uint64_t least, ComponentReport& report) {
    std::map<std::uint32_t, Shared> shared = shared_contacts(least);
    std::set<std::pair<std::uint64_t, std::uint32_t>> small;  // by size
    for (const auto& [root, ignored] : shared) small.emplace(total_[root], root);
    while (!small.empty()) {
      const auto [samples, root] = *small.begin();
      small.erase(small.begin());
      // Neighbours may have become one set since contacts were counted, or have joined this one.
      const Shared sums = by_root(shared[root], root);
      if (sums.empty()) {
        ++report.small_kept;
        continue;
      }
      // max_element returns the first of equals, and the map ascends: ties go to the lowest root.
      const std::uint32_t into = std::max_element(sums.begin(), sums.end(), [](const auto& a, const auto& b) {
                                   return a.second < b.second;
                                 })->first;
      report.merged.push_back({code_of(root), samples, code_of(into)});
      // The set that receives keeps its label, though the lower of the two numbers becomes the root.
      const std::uint32_t label = label_[into];
      small.erase({total_[into], into});
      Shared others = shared.contains(into) ? std::move(shared[into]) : Shared{};
      for (const auto& [other, contacts] : sums) others[other] += contacts;
      const std::uint64_t sum = total_[root] + total_[into];
      const std::uint32_t joined = sets_.join(root, into);
      total_[joined] = sum;
      label_[joined] = label;
      // A set that is still too small goes back into the queue with the contacts of both; a large one needs
      // no contacts, for it is only ever merged into.
      if (sum < least) {
        shared[joined] = std::move(others);
        small.emplace(sum, joined);
      }
    }
  }

  /// Labels 1 … n in the order of code and first sample; the lowest component of a set has the first sample.
  void write_labels() {
    std::vector<std::uint32_t> roots;
    for (std::uint32_t c = 0; c < label_.size(); ++c)
      if (sets_.find(c) == c) roots.push_back(c);
    std::stable_sort(roots.begin(), roots.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return code_of(a) < code_of(b); });
    std::vector<std::uint32_t> number(label_.size()), codes{0};
    for (const std::uint32_t root : roots) {
      number[root] = static_cast<std::uint32_t>(codes.size());
      codes.push_back(code_of(root));
    }
    // find() shortens paths, that is, writes; so roots are looked up here, before threads read `number`.
    for (std::uint32_t c = 0; c < label_.size(); ++c) number[c] = number[sets_.find(c)];
    parallel_blocks(solid_.blocks.size(), context_, [&](std::size_t b) {
      LabelField::Values values{};
      for (int i = 0; i < 512; ++i)
        if (const std::uint16_t local = local_of(b, i); local != kNoComponent)
          values[static_cast<std::size_t>(i)] = number[first_[b] + local];
      solid_.labels.assign(static_cast<std::int32_t>(b), values);
    });
    solid_.code_of = std::move(codes);
  }

 private:
  using Shared = std::map<std::uint32_t, std::uint64_t>;  ///< contacts by the component on the other side
  using Locals = std::array<std::uint16_t, 512>;

  std::uint32_t code_of(std::uint32_t component) const { return solid_.code_of[label_[component]]; }

  /// The component of a sample within its block; kNoComponent outside. In a block without an array in
  /// `locals_` all samples are of the one component, or all are outside.
  std::uint16_t local_of(std::size_t b, int sample) const {
    if (locals_[b]) return (*locals_[b])[static_cast<std::size_t>(sample)];
    return solid_.labels(static_cast<std::int32_t>(b), 0) > 0 ? 0 : kNoComponent;
  }
  std::uint32_t component(const LabelledSolid::Place& at) const {
    return first_[static_cast<std::size_t>(at.block)] +
           local_of(static_cast<std::size_t>(at.block), at.sample);
  }

  /// The inside corners of the joined faces that count as contacts: faces of joints do not, for
  /// label_sheets.h cuts their inside corners off.
  std::vector<std::array<LabelledSolid::Place, 2>> samples_of_joined_faces() const {
    std::vector<std::array<LabelledSolid::Place, 2>> result;
    for (const auto& [samples, cells, touches] : solid_.joined_faces)
      if (std::ranges::none_of(
              cells, [&](const LabelledSolid::Place& cell) { return has_cut(corner_labels(solid_, cell)); }))
        result.push_back(samples);
    return result;
  }

  /// Labels and numbers of samples of a block's components, by their number within the block.
  struct InBlock {
    std::vector<std::uint32_t> labels;
    std::vector<std::uint32_t> sizes;
  };

  /// Finds the components of a block by lattice edges within it. Writes only this block's entry of `locals_`,
  /// so blocks may be numbered in parallel.
  InBlock number_block(std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    if (solid_.labels.is_uniform(block)) {
      const std::uint32_t label = solid_.labels(block, 0);
      return label > 0 ? InBlock{{label}, {512}} : InBlock{};
    }
    // Outside samples are joined, too; they are left out where components get their numbers.
    DisjointSets sets(512);
    const auto label = [&](int i) { return solid_.labels(block, i); };
    for (int i = 0; i < 512; ++i) {
      if (i & 7 && label(i) == label(i - 1))
        sets.join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i - 1));
      if (i & 56 && label(i) == label(i - 8))
        sets.join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i - 8));
      if (i >= 64 && label(i) == label(i - 64))
        sets.join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i - 64));
    }
    InBlock result;
    locals_[b] = std::make_unique<Locals>();
    locals_[b]->fill(kNoComponent);
    for (int i = 0; i < 512; ++i) {
      if (label(i) == 0) continue;
      std::uint16_t& root = (*locals_[b])[sets.find(static_cast<std::uint32_t>(i))];
      if (root == kNoComponent) {  // the root is the set's first sample, so it is met first
        root = static_cast<std::uint16_t>(result.labels.size());
        result.labels.push_back(label(i));
        result.sizes.push_back(0);
      }
      (*locals_[b])[static_cast<std::size_t>(i)] = root;
      ++result.sizes[root];
    }
    return result;
  }

  void find_in_blocks() {
    const std::size_t n = solid_.blocks.size();
    locals_.resize(n);
    std::vector<InBlock> found(n);
    parallel_blocks(n, context_, [&](std::size_t b) { found[b] = number_block(b); });
    // Blocks are numbered in parallel, but lined up in their own order, which makes the numbers independent
    // of the order of threads.
    first_.resize(n);
    for (std::size_t b = 0; b < n; ++b) {
      first_[b] = static_cast<std::uint32_t>(label_.size());
      label_.insert(label_.end(), found[b].labels.begin(), found[b].labels.end());
      size_.insert(size_.end(), found[b].sizes.begin(), found[b].sizes.end());
    }
    sets_ = DisjointSets(label_.size());
  }

  /// Joins components across the faces between blocks, upwards along each axis, which meets each face once.
  void join_blocks() {
    for (std::size_t b = 0; b < solid_.blocks.size(); ++b) {
      if (b % 1024 == 0) context_.check();
      const auto block = static_cast<std::int32_t>(b);
      for (int axis = 0; axis < 3; ++axis) {
        const std::int32_t there =
            solid_.blocks[b].neighbours[neighbour_slot(axis == 0, axis == 1, axis == 2)];
        if (there < 0) continue;
        // Between two blocks with one label each, all 64 edges give the same result, so one is enough.
        const bool plain = !locals_[b] && !locals_[static_cast<std::size_t>(there)];
        for (int i = 0; i < (plain ? 1 : 64); ++i) {
          const int u = i >> 3, v = i & 7;
          const int mine = axis == 0   ? sample_index(7, u, v)
                           : axis == 1 ? sample_index(u, 7, v)
                                       : sample_index(u, v, 7);
          const int other = axis == 0   ? sample_index(0, u, v)
                            : axis == 1 ? sample_index(u, 0, v)
                                        : sample_index(u, v, 0);
          const std::uint32_t label = solid_.labels(block, mine);
          if (label > 0 && label == solid_.labels(there, other))
            sets_.join(component({block, mine}), component({there, other}));
        }
      }
    }
  }

  /// The contacts of each set smaller than `least`, by its root; an empty map for a set that touches no
  /// other. Large sets have no entry: they contain most of the samples, and their contacts are never used.
  std::map<std::uint32_t, Shared> shared_contacts(std::uint64_t least) {
    std::map<std::uint32_t, Shared> result;
    std::vector<char> concerned(solid_.blocks.size());
    for (std::size_t b = 0, c = 0; b < solid_.blocks.size(); ++b)
      for (const std::size_t end = b + 1 < first_.size() ? first_[b + 1] : label_.size(); c < end; ++c) {
        const std::uint32_t root = sets_.find(static_cast<std::uint32_t>(c));
        if (total_[root] >= least) continue;
        // A set gets its entry even if it has no contact at all.
        result[root];
        concerned[b] = 1;
      }
    for (std::size_t b = 0; b < solid_.blocks.size(); ++b) {
      if (!concerned[b]) continue;
      for (int i = 0; i < 512; ++i) {
        if (local_of(b, i) == kNoComponent) continue;
        const std::uint32_t root = sets_.find(component({static_cast<std::int32_t>(b), i}));
        if (total_[root] >= least) continue;
        // Counted only from the small set, so an edge between two small sets counts once for each.
        for (int face = 0; face < 6; ++face) {
          int at[3] = {i >> 6, (i >> 3) & 7, i & 7};
          at[face >> 1] += face & 1 ? 1 : -1;
          const LabelledSolid::Place there = solid_.locate(static_cast<std::int32_t>(b), at[0], at[1], at[2]);
          if (solid_.label(there) == 0) continue;
          if (const std::uint32_t other = sets_.find(component(there)); other != root) ++result[root][other];
        }
      }
    }
    for (const auto& [a, b] : samples_of_joined_faces()) {
      const std::uint32_t one = sets_.find(component(a)), other = sets_.find(component(b));
      if (one == other) continue;
      if (total_[one] < least) ++result[one][other];
      if (total_[other] < least) ++result[other][one];
    }
    return result;
  }

  /// Contacts summed by the roots that the neighbours have by now, without the set of `self`.
  Shared by_root(const Shared& shared, std::uint32_t self) {
    Shared sums;
    for (const auto& [component, contacts] : shared)
      if (const std::uint32_t root = sets_.find(component); root != sets_.find(self)) sums[root] += contacts;
    return sums;
  }

  LabelledSolid& solid_;
  RunContext& context_;
  std::vector<std::unique_ptr<Locals>> locals_;  ///< each block's components, by sample
  std::vector<std::uint32_t> first_;             ///< number of each block's first component
  std::vector<std::uint32_t> label_,
      size_;  ///< label and samples of each component; of a root, the label of its set
  std::vector<std::uint64_t> total_;  ///< samples of a set, at its root
  DisjointSets sets_;
};

}  // namespace

ComponentReport settle_components(LabelledSolid& solid, const ComponentOptions& options,
                                  RunContext& context) {
  const Stage stage(context, "find pieces");
  ComponentReport report;
  Components components(solid, context);
  if (!options.split) components.join_equal_labels();
  components.sum_sizes();
  report.split_off = components.count() - components.label_count();
  if (options.least_samples > 0) components.merge_small(options.least_samples, report);
  components.write_labels();
  return report;
}

}  // namespace hermesh
