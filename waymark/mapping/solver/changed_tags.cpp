#include "waymark/mapping/solver/changed_tags.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

std::string describe_missing(const MissingTag& missing) {
  const std::string since = missing.last_seen_s
                                ? fmt::format("after its last observation at {:.1f} s", *missing.last_seen_s)
                                : "of the recording";
  return fmt::format(
      "expected in {} images {} ({} pass{}), observed in none: it was taken away or hidden. The map still "
      "contains it; if it is gone, remove it with `waymark map convert` (`remove`)",
      missing.expected_images, since, missing.passes, missing.passes == 1 ? "" : "es");
}

}  // namespace

bool would_overlap(const SE3& body_T_tag, const SE3& body_T_other, double side_m) {
  const double apart_m = (body_T_tag.translation() - body_T_other.translation()).norm();
  const auto normal = [](const SE3& pose) { return pose.rotation().matrix().col(2).eval(); };
  return apart_m < side_m / 2 && normal(body_T_tag).dot(normal(body_T_other)) > 0;
}

bool is_misread(const ObservedPose& place, const ObservedPose& other, double side_m) {
  constexpr double kMaxMisreadShare = 0.2;
  return place.observations < kMaxMisreadShare * other.observations &&
         would_overlap(place.body_T_tag, other.body_T_tag, side_m);
}

std::string describe(const MovedTag& moved) {
  return fmt::format(
      "moved by {:.3f} m and {:.1f} deg between {:.1f} s and {:.1f} s of the recording; the map has its last "
      "pose",
      moved.distance_m, to_degrees(moved.angle_rad), moved.last_before_s, moved.first_after_s);
}

std::vector<std::string> describe(const std::vector<MissingTag>& missing,
                                  const std::function<std::string(const TagId&)>& name) {
  constexpr std::size_t kMaxSingle = 5;
  constexpr std::size_t kMaxNamed = 12;
  std::vector<std::string> warnings;
  if (missing.size() <= kMaxSingle) {
    for (const MissingTag& tag : missing)
      warnings.push_back(fmt::format("{}: {}", name(tag.tag), describe_missing(tag)));
    return warnings;
  }
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min(missing.size(), kMaxNamed); ++i) names.push_back(name(missing[i].tag));
  const int fewest = std::ranges::min(missing, {}, &MissingTag::expected_images).expected_images;
  warnings.push_back(fmt::format(
      "{} tags were each expected in at least {} images and observed in none of them: {}{}. They were taken "
      "away or hidden, or the camera or the detector changed. The map still contains them; remove those that "
      "are gone with `waymark map convert` (`remove`)",
      missing.size(), fewest, fmt::join(names, ", "), missing.size() > kMaxNamed ? ", ..." : ""));
  return warnings;
}

}  // namespace waymark
