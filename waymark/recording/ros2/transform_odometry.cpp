#include "waymark/recording/ros2/transform_odometry.hpp"

#include <utility>

#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/frame_tree.hpp"
#include "waymark/samples/odometry_jump.hpp"

namespace waymark::ros2 {
namespace {

bool is_called(std::string_view frame, std::string_view name) {
  if (!frame.ends_with(name)) return false;
  frame.remove_suffix(name.size());
  return frame.empty() || frame.ends_with('/');
}

/// Sets the mean velocities since the last sample.
void set_velocities(const waymark::Odometry& last, waymark::Odometry& now) {
  const double dt_s = to_seconds(now.stamp - last.stamp);
  if (!(dt_s > 0) || odometry_jumped(last, now)) return;
  const SE2 step = last.odom_T_base.inverse() * now.odom_T_base;
  now.speed_m_s = step.x() / dt_s;
  now.yaw_rate_rad_s = step.yaw() / dt_s;
}

}  // namespace

bool is_odometry_frame(std::string_view parent) { return is_called(parent, "odom"); }

bool is_usual_base(std::string_view child) {
  return is_called(child, "base_link") || is_called(child, "base_footprint");
}

Result<std::optional<waymark::Odometry>> TransformOdometry::add(std::string_view topic,
                                                                const TransformStamped& transform) {
  if (!is_odometry_frame(transform.header.frame_id)) return std::nullopt;
  const OdometryFrames link{std::string(topic), frame_name(transform.header.frame_id),
                            frame_name(transform.child_frame_id)};
  if (!link_ && is_usual_base(link.child)) link_ = link;
  if (link != link_) return std::nullopt;
  if (!sound(transform))
    return fail(ErrorCode::Unreadable, "non-finite numbers or a zero quaternion in the message");
  waymark::Odometry now{.stamp = from_ros(transform.header.stamp),
                        .odom_T_base = project_to_plane(from_ros(transform))};
  if (last_ && last_->stamp == now.stamp) return std::nullopt;
  if (last_) set_velocities(*last_, now);
  last_ = now;
  return std::optional(now);
}

}  // namespace waymark::ros2
