#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "waymark/families/family.hpp"

namespace waymark {

/// Two tags, and how many frames show both.
struct TagLink {
  TagId first{};
  TagId second{};
  int frames = 0;
};

/// Which tags were seen together: what holds a map together. A tag that is joined to the others by few frames
/// hangs loosely, and everything behind it with it.
class TagLinks {
 public:
  /// The tags of one frame, in any order, each once.
  void add(std::span<const TagId> tags) { add(tags, {}); }
  /// `beside`: what another camera showed at the same moment, and was added already.
  void add(std::span<const TagId> tags, std::span<const TagId> beside);

  /// The weakest links that the map cannot do without: those of the maximum spanning forest (Kruskal, "On the
  /// shortest spanning subtree of a graph", Proc. AMS 7, 1956) with fewer than `frames` frames, the weakest
  /// first. O(links log links).
  [[nodiscard]] std::vector<TagLink> weak(int frames) const;
  /// Tags that were seen but are joined to `anchor` through no chain of frames, in order.
  [[nodiscard]] std::vector<TagId> unreachable(const TagId& anchor) const;

 private:
  [[nodiscard]] std::vector<TagLink> forest() const;

  std::map<TagId, int> seen_{};
  std::map<std::pair<TagId, TagId>, int> together_{};
};

}  // namespace waymark
