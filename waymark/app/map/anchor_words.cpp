#include "waymark/app/map/anchor_words.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

Result<SE3> anchor_pose_of(const std::vector<double>& p) {
  if (p.size() != 6)
    return fail(ErrorCode::InvalidArgument, fmt::format("{} numbers instead of six", p.size()),
                {.key = "--anchor-pose"}, "X Y Z in metres, then roll, pitch and yaw in degrees.");
  if (!std::ranges::all_of(p, [](double x) { return std::isfinite(x); }))
    return fail(ErrorCode::InvalidArgument, "a number that is not finite", {.key = "--anchor-pose"});
  constexpr double kFarthest_m = 1e4;
  if (std::ranges::any_of(p.begin(), p.begin() + 3, [](double x) { return std::abs(x) > kFarthest_m; }))
    return fail(ErrorCode::InvalidArgument, "the anchor stands more than 10 km from where the map begins",
                {.key = "--anchor-pose"}, "X Y Z in metres, then roll, pitch and yaw in degrees.");
  return SE3(SO3::from_rpy(to_radians(p[3]), to_radians(p[4]), to_radians(p[5])),
             Eigen::Vector3d(p[0], p[1], p[2]));
}

}  // namespace

Result<SetupOverrides> overrides_of(const AnchorWords& words) {
  SetupOverrides overrides;
  if (!words.anchor.empty()) overrides.anchor = words.anchor;
  if (!words.anchor_pose.empty()) {
    const Result<SE3> pose = anchor_pose_of(words.anchor_pose);
    if (!pose) return tl::unexpected(pose.error());
    overrides.map_T_anchor = *pose;
  }
  if (words.tag_size_m && !(*words.tag_size_m > 0 && *words.tag_size_m < 100))
    return fail(ErrorCode::InvalidArgument, fmt::format("{} is not a size in metres", *words.tag_size_m),
                {.key = "--tag-size-m"},
                "Measure the side of the black square, for example --tag-size-m 0.16.");
  overrides.tag_size_m = words.tag_size_m;
  return overrides;
}

}  // namespace waymark
