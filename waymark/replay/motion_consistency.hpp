#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "waymark/replay/motion_pairs.hpp"
#include "waymark/replay/motion_sums.hpp"
#include "waymark/replay/picture_delay.hpp"

namespace waymark {

/// Holds what the sources say against each other, by find_contradiction(). A robot that stands is judged at
/// its next motion. Poses by the tags of one picture each are held against the other sources as well: wheels
/// that slip do not move them as they move an estimate.
class MotionConsistency {
 public:
  MotionConsistency(const ConsistencyOptions& options, const ActuatorOptions& actuators,
                    const OdometryPrior& odometry = {});

  void add(const Odometry& odometry);
  void add(const ImuSample& imu) { sums_.add(imu); }
  /// The command that acted since the last step.
  void command(const VelocityCommand& sent, double dt_s) { sums_.command(sent, dt_s); }
  /// The estimate of now; `tags`: a tag was accepted a moment ago.
  void observe(const SE2& map_T_base, const Eigen::Matrix3d& covariance, bool tags);
  /// A pose by the tags of one picture alone. `accepted`: the estimate follows them.
  void observe_picture(SensorTime stamp, const SE2& map_T_base, const Eigen::Matrix3d& covariance,
                       bool accepted);
  /// No estimate now.
  void observe_nothing();

  [[nodiscard]] std::optional<Contradiction> contradiction() const;
  [[nodiscard]] double path_m() const { return sums_.path_m(); }
  [[nodiscard]] MotionScales scales() const { return sums_.scales(); }
  /// After a person looked: what was before is not held against what comes.
  void forget();

 private:
  /// The pose by the tags of one picture, and the estimate of the same moment.
  struct Picture {
    MotionSample seen{};
    MotionSample estimated{};
  };
  using PictureIterator = std::deque<Picture>::const_iterator;

  void notice(const Standing& standing);
  [[nodiscard]] std::optional<PictureIterator> picture_before(double moving_s) const;
  [[nodiscard]] std::optional<Contradiction> contradiction_of_pictures() const;
  [[nodiscard]] std::optional<Contradiction> push_of_pictures() const;
  void forget_pictures();
  void add_heading(SensorTime stamp, double yaw_rad);
  void look_for_delay();

  ConsistencyOptions options_;
  MotionSums sums_;
  std::optional<Contradiction> carried_{};  ///< over the last standstill
  std::vector<HeadingAt> headings_{};       ///< of pictures, since the first sample of odometry
  std::optional<Contradiction> late_{};
  std::deque<Picture> pictures_{};  ///< moving_s is since picture_zero_
  SensorTime picture_zero_{};
  std::optional<std::size_t> suspected_ago_{};  ///< pictures since the newest that contradicted
  std::optional<Contradiction> pictured_{};     ///< by two of the newest pictures
};

}  // namespace waymark
