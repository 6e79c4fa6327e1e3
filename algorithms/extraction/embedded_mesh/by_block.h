// Values that few of a lattice's blocks have, by number of the block.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace hermesh {

/// Values of type T for the blocks of a lattice. Memory is taken only for blocks that have a value; reading
/// any other block gives an empty value. Different threads may write different blocks at once, but no block
/// may be read while another thread may write it.
template <class T>
class ByBlock {
 public:
  explicit ByBlock(std::size_t blocks) : made_(blocks) {}
  std::size_t size() const { return made_.size(); }
  bool has(std::size_t block) const { return made_[block] != nullptr; }
  const T& operator[](std::size_t block) const { return made_[block] ? *made_[block] : kEmpty; }
  /// The value of a block, for writing; an empty one is made where there was none.
  T& at(std::size_t block) {
    if (!made_[block]) made_[block] = std::make_unique<T>();
    return *made_[block];
  }
  void clear(std::size_t block) { made_[block].reset(); }

 private:
  inline static const T kEmpty{};
  std::vector<std::unique_ptr<T>> made_;
};

}  // namespace hermesh
