#pragma once

#include <chrono>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// The tags in view of all cameras on a robot: the newest frame from each camera, as long as it is recent.
class TagsInView {
 public:
  void add(const std::string& camera, SensorTime stamp, std::vector<TagId> tags) {
    views_[camera] = {stamp, std::move(tags)};
  }

  /// The number of tags in frames about as old as `stamp`; a tag seen by two cameras counts twice.
  [[nodiscard]] std::size_t count(SensorTime stamp) const {
    std::size_t tags = 0;
    for (const auto& [camera, view] : views_) {
      const Duration apart = stamp - view.stamp;
      if (apart <= kApart && -apart <= kApart) tags += view.tags.size();
    }
    return tags;
  }
  /// The tags in frames from the other cameras with the same stamp. Synchronised cameras capture them from
  /// the same robot pose.
  [[nodiscard]] std::vector<TagId> beside(const std::string& camera, SensorTime stamp) const {
    std::vector<TagId> tags;
    for (const auto& [name, view] : views_) {
      if (name != camera && view.stamp == stamp) tags.insert(tags.end(), view.tags.begin(), view.tags.end());
    }
    return tags;
  }

 private:
  static constexpr Duration kApart = std::chrono::milliseconds(150);
  struct View {
    SensorTime stamp{};
    std::vector<TagId> tags{};
  };
  std::map<std::string, View> views_{};
};

}  // namespace waymark
