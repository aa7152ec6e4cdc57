#include "waymark/pipeline/expected_tags.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr double kBehind_m = 0.1;  // tags on the same wall do not occlude each other

/// The image area covered by a tag with a white margin of one eighth of its side.
struct Print {
  double distance_m = 0;
  Eigen::AlignedBox2d box_px;
};

/// All map tags that are entirely within the image and face the camera, regardless of size and angle of
/// incidence.
std::vector<Print> prints_before(const TagMap& map, const CameraModel& camera, const SE3& cam_T_map) {
  constexpr VisibilityLimits kAny = {.min_side_px = 4, .max_incidence_rad = 1.5, .margin_px = 0};
  constexpr double kWithMargin = 1.25;
  std::vector<Print> prints;
  for (const auto& [tag, mapped] : map.tags) {
    const SE3 cam_T_tag = cam_T_map * mapped.map_T_tag;
    const auto corners = visible_corners(camera, cam_T_tag, kWithMargin * mapped.size_m, kAny);
    if (corners) prints.push_back({cam_T_tag.translation().norm(), box_of(*corners)});
  }
  return prints;
}

}  // namespace

std::vector<ExpectedTag> expected_tags(const TagMap& map, const CameraModel& camera, const SE3& map_T_cam) {
  constexpr VisibilityLimits kReliable = {.min_side_px = 24, .max_incidence_rad = 1.05, .margin_px = 8};
  const SE3 cam_T_map = map_T_cam.inverse();
  const std::vector<Print> prints = prints_before(map, camera, cam_T_map);
  std::vector<ExpectedTag> expected;
  for (const auto& [tag, mapped] : map.tags) {
    const SE3 cam_T_tag = cam_T_map * mapped.map_T_tag;
    const auto corners = visible_corners(camera, cam_T_tag, mapped.size_m, kReliable);
    if (!corners) continue;
    const double distance_m = cam_T_tag.translation().norm();
    const bool covered = std::ranges::any_of(prints, [&](const Print& print) {
      return print.distance_m < distance_m - kBehind_m && print.box_px.intersects(box_of(*corners));
    });
    if (!covered) expected.push_back({tag, *corners});
  }
  return expected;
}

std::vector<ExpectedTag> expected_tags(const TagMap& map, const MountedCamera& camera,
                                       const std::optional<LocalizationEstimate>& estimate,
                                       SensorTime stamp) {
  constexpr double kMaxSigma_m = 0.1;
  constexpr double kMaxSigma_rad = 0.05;
  constexpr double kMaxAge_s = 0.5;
  if (!estimate || !estimate->certain || !(estimate->position_sigma_m() <= kMaxSigma_m) ||
      !(std::sqrt(estimate->covariance(2, 2)) <= kMaxSigma_rad) ||
      !(std::abs(to_seconds(stamp - estimate->stamp)) <= kMaxAge_s))
    return {};
  const SE3 map_T_base = map_T_floor(map.floor) * lift(estimate->map_T_base);
  return expected_tags(map, camera.camera, map_T_base * camera.base_T_cam);
}

std::string counted_reasons(const std::map<MissReason, int>& counts) {
  std::string words;
  for (const auto& [reason, count] : counts)
    words += fmt::format("{}{} {}", words.empty() ? "" : ", ", count, to_string(reason));
  return words;
}

std::string describe(std::span<const MissedTag> missed) {
  if (missed.empty()) return {};
  std::map<MissReason, int> reasons;
  for (const MissedTag& one : missed) ++reasons[one.why];
  return fmt::format("{} {} not found ({})", counted(missed.size(), "expected tag"),
                     missed.size() == 1 ? "was" : "were", counted_reasons(reasons));
}

}  // namespace waymark
