#include "algorithms/extraction/certified_collapse/merge_forest.h"

#include <utility>

namespace hermesh {

MergeForest::MergeForest(std::vector<Node> nodes, std::vector<std::uint32_t> node_of)
    : nodes_(std::move(nodes)), node_of_(std::move(node_of)), set_of_(node_of_.size()) {
  settle();
}

void MergeForest::join(std::uint32_t going, Node node) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  // The sets above the one that merges do not merge, so nothing is lost when the new node replaces them.
  for (const std::uint32_t point : {going, node.first}) {
    std::uint32_t& above = set_of_[point] == kNone ? node_of_[point] : nodes_[set_of_[point]].parent;
    above = number;
  }
  // Sufficient for further joins, which only read the set of a vertex that remains; settle() finds the
  // others.
  set_of_[node.first] = number;
  nodes_.push_back(std::move(node));
}

void MergeForest::settle() {
  const std::size_t n = nodes_.size();
  std::vector<std::uint32_t> top(n, kNone);
  // Parents follow their children, so downwards each node inherits from its parent the largest set that
  // merges.
  for (std::size_t i = n; i-- > 0;) {
    const std::uint32_t parent = nodes_[i].parent;
    if (parent != kNone) top[i] = top[parent];
    if (top[i] == kNone && nodes_[i].merges) top[i] = static_cast<std::uint32_t>(i);
  }
  count_.assign(n, 0);
  for (std::size_t p = 0; p < node_of_.size(); ++p) {
    set_of_[p] = node_of_[p] == kNone ? kNone : top[node_of_[p]];
    if (node_of_[p] != kNone) ++count_[node_of_[p]];
  }
  // Upwards, a set has the members of its children and its own.
  for (std::size_t i = 0; i < n; ++i)
    if (nodes_[i].parent != kNone) count_[nodes_[i].parent] += count_[i];
  // The members of each set are contiguous: those of its children, then its own.
  begin_.resize(n);
  std::vector<std::uint32_t> next(n);
  std::uint32_t total = 0;
  for (std::size_t i = n; i-- > 0;) {
    std::uint32_t& from = nodes_[i].parent == kNone ? total : next[nodes_[i].parent];
    begin_[i] = next[i] = from;
    from += count_[i];
  }
  members_.resize(total);
  for (std::uint32_t p = 0; p < node_of_.size(); ++p)
    if (node_of_[p] != kNone) members_[next[node_of_[p]]++] = p;
}

void MergeForest::split(std::uint32_t node) {
  nodes_[node].merges = false;
  // The largest set below the split one is the last that merges on the path up to it.
  for (const std::uint32_t p : members(node)) {
    set_of_[p] = kNone;
    for (std::uint32_t n = node_of_[p]; n != node; n = nodes_[n].parent)
      if (nodes_[n].merges) set_of_[p] = n;
  }
}

}  // namespace hermesh
