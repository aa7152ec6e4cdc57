#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/replay/route_checks.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A tag relative to the robot, as observed in one image.
struct TagBesideRobot {
  TagId tag{};
  double size_m = 0;
  SE3 base_T_tag{};
  double ambiguity_ratio = 0;  ///< as in TagPose; near 1 if the other pose fits almost as well
};

/// Estimates how closely the hull passes the tags while a lap is taught, when there is no map yet. The pose
/// of a tag relative to odometry is that of its nearest observation, which is accurate to one or two
/// centimetres.
class PassedTags {
 public:
  /// Observations from farther away are not needed, because a tag that is passed is seen from nearby before.
  static constexpr double kMaxRange_m = 1.2;

  /// Observations with a larger ambiguity are not used, because the tag may lean the other way.
  static constexpr double kMaxAmbiguity = 0.8;

  explicit PassedTags(const Hull& hull) : hull_(hull) {}

  /// Tags within kMaxRange_m in an image. Images may be up to two seconds late, or newer than odometry. Poses
  /// that are not finite are ignored, here and in odometry.
  void add(SensorTime stamp, std::vector<TagBesideRobot> seen);
  void add(const Odometry& odometry);
  /// Forgets all observations, after a reset of the odometry.
  void forget();

  /// The tag that the hull passed most closely. Its arc length and pose are those of odometry. `nullopt` if
  /// no tag was near.
  [[nodiscard]] const std::optional<NearestTag>& nearest() const { return nearest_; }

 private:
  struct Placed {
    SE3 odom_T_tag{};
    double size_m = 0;
    double range_m = 0;   ///< distance from which it was observed
    double driven_m = 0;  ///< distance driven before that observation
  };
  struct Image {
    SensorTime stamp{};
    std::vector<TagBesideRobot> seen{};
  };

  void place(const SE2& odom_T_base, const Image& image);
  [[nodiscard]] std::optional<SE2> at(SensorTime stamp) const;
  void measure();

  Hull hull_;
  std::deque<Odometry> recent_{};
  std::deque<Image> waiting_{};  ///< images that are newer than the odometry
  std::map<TagId, Placed> placed_{};
  double driven_m_ = 0;
  std::optional<NearestTag> nearest_{};
};

}  // namespace waymark
