#include "waymark/pipeline/tag_links.hpp"

#include <algorithm>

namespace waymark {
namespace {

/// Who belongs together (union-find with path halving).
class Groups {
 public:
  TagId root(TagId tag) {
    auto it = parent_.try_emplace(tag, tag).first;
    while (!(it->second == it->first)) {
      it->second = parent_.at(it->second);
      it = parent_.find(it->second);
    }
    return it->first;
  }
  /// False when they were together already.
  bool join(const TagId& a, const TagId& b) {
    const TagId root_a = root(a);
    const TagId root_b = root(b);
    if (root_a == root_b) return false;
    parent_.at(root_b) = root_a;
    return true;
  }

 private:
  std::map<TagId, TagId> parent_;
};

}  // namespace

void TagLinks::add(std::span<const TagId> tags, std::span<const TagId> beside) {
  for (std::size_t i = 0; i < tags.size(); ++i) {
    ++seen_[tags[i]];
    for (std::size_t k = 0; k < i; ++k) {
      if (tags[i] == tags[k]) continue;
      ++together_[std::minmax(tags[i], tags[k])];
    }
    for (const TagId& other : beside) {
      if (tags[i] != other) ++together_[std::minmax(tags[i], other)];
    }
  }
}

std::vector<TagLink> TagLinks::forest() const {
  std::vector<TagLink> links;
  for (const auto& [pair, frames] : together_) links.push_back({pair.first, pair.second, frames});
  std::ranges::stable_sort(links, std::ranges::greater(), &TagLink::frames);
  Groups groups;
  std::erase_if(links, [&](const TagLink& link) { return !groups.join(link.first, link.second); });
  return links;
}

std::vector<TagLink> TagLinks::weak(int frames) const {
  std::vector<TagLink> links = forest();
  std::erase_if(links, [&](const TagLink& link) { return link.frames >= frames; });
  std::ranges::reverse(links);
  return links;
}

std::vector<TagId> TagLinks::unreachable(const TagId& anchor) const {
  Groups groups;
  for (const TagLink& link : forest()) groups.join(link.first, link.second);
  std::vector<TagId> tags;
  for (const auto& [tag, frames] : seen_) {
    if (!(groups.root(tag) == groups.root(anchor))) tags.push_back(tag);
  }
  return tags;
}

}  // namespace waymark
