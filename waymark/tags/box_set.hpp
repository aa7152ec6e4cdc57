#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "waymark/tags/run_components.hpp"

namespace waymark::search {

/// The boxes of components that were looked at, by open addressing. No allocation once it has grown.
class BoxSet {
 public:
  void clear() {
    std::ranges::fill(slots_, kFree);
    count_ = 0;
  }

  /// False where a component with the same box was there already.
  bool insert(const Component& component) {
    if (2 * count_ >= slots_.size()) grow();
    return insert_key(key_of(component));
  }

 private:
  static constexpr std::uint64_t kFree = 0;  // no box: x1 and y1 are at least 1

  static std::uint64_t key_of(const Component& c) {
    const auto part = [](std::int16_t value) {
      return static_cast<std::uint64_t>(static_cast<std::uint16_t>(value));
    };
    return part(c.x0) | part(c.x1) << 16U | part(c.y0) << 32U | part(c.y1) << 48U;
  }

  bool insert_key(std::uint64_t key) {
    constexpr std::uint64_t kMix = 0x9e3779b97f4a7c15U;
    std::size_t at = (key * kMix >> 32U) & (slots_.size() - 1);
    while (slots_[at] != kFree) {
      if (slots_[at] == key) return false;
      at = (at + 1) & (slots_.size() - 1);
    }
    slots_[at] = key;
    ++count_;
    return true;
  }

  void grow() {
    std::vector<std::uint64_t> before(2 * slots_.size(), kFree);
    before.swap(slots_);
    count_ = 0;
    for (const std::uint64_t key : before) {
      if (key != kFree) insert_key(key);
    }
  }

  std::vector<std::uint64_t> slots_ = std::vector<std::uint64_t>(1024, kFree);  // a power of two
  std::size_t count_ = 0;
};

}  // namespace waymark::search
