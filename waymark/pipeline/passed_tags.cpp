#include "waymark/pipeline/passed_tags.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr Duration kKept = std::chrono::seconds(2);
constexpr std::size_t kMaxWaiting = 100;
constexpr double kForget_m = 5;  // odometry is accurate over this distance

bool is_finite(const SE2& pose) { return pose.translation().allFinite() && std::isfinite(pose.yaw()); }

}  // namespace

void PassedTags::add(SensorTime stamp, std::vector<TagBesideRobot> seen) {
  if (seen.empty()) return;
  Image image{stamp, std::move(seen)};
  if (const auto odom_T_base = at(stamp)) {
    place(*odom_T_base, image);
  } else if (recent_.empty() || stamp > recent_.back().stamp) {
    waiting_.push_back(std::move(image));
    if (waiting_.size() > kMaxWaiting) waiting_.pop_front();
  }
}

void PassedTags::add(const Odometry& odometry) {
  if (!is_finite(odometry.odom_T_base)) return;
  if (!recent_.empty()) {
    if (odometry.stamp <= recent_.back().stamp) return;
    driven_m_ += (recent_.back().odom_T_base.inverse() * odometry.odom_T_base).translation().norm();
  }
  recent_.push_back(odometry);
  while (odometry.stamp - recent_.front().stamp > kKept) recent_.pop_front();
  while (!waiting_.empty() && waiting_.front().stamp <= odometry.stamp) {
    if (const auto odom_T_base = at(waiting_.front().stamp)) place(*odom_T_base, waiting_.front());
    waiting_.pop_front();
  }
  measure();
}

void PassedTags::forget() {
  recent_.clear();
  waiting_.clear();
  placed_.clear();
}

std::optional<SE2> PassedTags::at(SensorTime stamp) const {
  const auto after = std::ranges::lower_bound(recent_, stamp, {}, &Odometry::stamp);
  if (after == recent_.end()) return std::nullopt;
  if (after->stamp == stamp) return after->odom_T_base;
  if (after == recent_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double share = to_seconds(stamp - before->stamp) / to_seconds(after->stamp - before->stamp);
  return interpolate(before->odom_T_base, after->odom_T_base, share);
}

/// Keeps the nearest observation of each tag until odometry has drifted.
void PassedTags::place(const SE2& odom_T_base, const Image& image) {
  for (const TagBesideRobot& seen : image.seen) {
    const double range_m = seen.base_T_tag.translation().norm();
    if (!(range_m <= kMaxRange_m) || seen.ambiguity_ratio > kMaxAmbiguity) continue;
    const auto [known, is_new] = placed_.try_emplace(seen.tag);
    Placed& tag = known->second;
    if (!is_new && range_m >= tag.range_m && driven_m_ - tag.driven_m < kForget_m) continue;
    tag = {lift(odom_T_base) * seen.base_T_tag, seen.size_m, range_m, driven_m_};
  }
}

void PassedTags::measure() {
  const SE2& odom_T_base = recent_.back().odom_T_base;
  for (const auto& [id, tag] : placed_) {
    if (driven_m_ - tag.driven_m > kForget_m) continue;
    const double away_m = (tag.odom_T_tag.translation().head<2>() - odom_T_base.translation()).norm();
    if (away_m > kMaxRange_m) continue;
    const double distance_m = clearance_m(hull_, lift(odom_T_base), {tag.odom_T_tag, tag.size_m, {}});
    const double limit_m = nearest_ ? nearest_->clearance_m : std::numeric_limits<double>::infinity();
    if (!(distance_m < limit_m)) continue;  // not finite if the pose of the tag is not
    nearest_ = {id, distance_m, driven_m_, odom_T_base};
  }
}

}  // namespace waymark
