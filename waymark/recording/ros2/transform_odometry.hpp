#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "waymark/recording/odometry_frames.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark::ros2 {

/// Whether transforms from this frame are odometry: it is called odom, in any namespace.
[[nodiscard]] bool is_odometry_frame(std::string_view parent);
/// Whether the frame is called base_link or base_footprint, in any namespace.
[[nodiscard]] bool is_usual_base(std::string_view child);

/// Converts the transforms of one robot to odometry, for robots that publish it only on /tf. Transforms
/// contain no velocities, so these are the means over the interval before each transform; zero at the first
/// one and after a jump.
class TransformOdometry {
 public:
  /// Without a link, uses the first one to a frame that is_usual_base().
  explicit TransformOdometry(std::optional<OdometryFrames> link) : link_(std::move(link)) {}

  /// The odometry in a transform on this topic. `nullopt` if it belongs to another link or has the stamp of
  /// the last one, because some publishers repeat transforms. Fails (Unreadable) if its numbers are invalid.
  [[nodiscard]] Result<std::optional<waymark::Odometry>> add(std::string_view topic,
                                                             const TransformStamped& transform);

 private:
  std::optional<OdometryFrames> link_;
  std::optional<waymark::Odometry> last_{};
};

}  // namespace waymark::ros2
