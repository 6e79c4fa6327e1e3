// What few blocks have, by block.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace hermesh {

/// Memory only for the blocks that have one; reading another's gives an empty one. Blocks may be written side by
/// side, but none may be read meanwhile that another thread may write.
template <class T>
class ByBlock {
 public:
  explicit ByBlock(std::size_t blocks) : made_(blocks) {}
  std::size_t size() const { return made_.size(); }
  bool has(std::size_t block) const { return made_[block] != nullptr; }
  const T& operator[](std::size_t block) const { return made_[block] ? *made_[block] : kEmpty; }
  /// Made where there was none.
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
