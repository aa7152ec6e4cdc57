#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/localization/method.hpp"
#include "waymark/pipeline/expected_tags.hpp"
#include "waymark/replay/controllers.hpp"
#include "waymark/replay/motion_consistency.hpp"
#include "waymark/replay/motion_predictor.hpp"
#include "waymark/replay/replay_watch.hpp"
#include "waymark/replay/route_progress.hpp"
#include "waymark/replay/safety_limiter.hpp"
#include "waymark/replay/speed_profile.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// The controller that follows the route.
enum class ReplayController : std::uint8_t {
  Follower,  ///< curvature feed-forward with error feedback
  Pursuit,   ///< pure pursuit
  Pose,      ///< go-to-pose from goal to goal
};

/// The names of the controllers: follower, pursuit, pose.
[[nodiscard]] std::vector<std::string> replay_controllers();
[[nodiscard]] std::string_view to_string(ReplayController controller);
/// Fails (InvalidArgument, with a suggestion) if the name is not in replay_controllers().
[[nodiscard]] Result<ReplayController> parse_controller(std::string_view name);

enum class ReplayState : std::uint8_t {
  Waiting,     ///< waiting for the first estimate
  Refused,     ///< the start gate refused the robot's pose
  Driving,     ///< driving along the route
  AtStation,   ///< stopped at a station; continues once the dwell time is over
  Stopped,     ///< stopped by the limiter; continues once the reason no longer applies or, if the reason is
               ///< lasting, only after Resume
  Finished,    ///< the whole route has been driven
  Incomplete,  ///< at the end of the route, but parts of it have not been driven
};

/// Findings in a step, in the order of evaluation.
enum class ReplayEvent : std::uint8_t {
  GateOpen,        ///< the robot is near the route and points along it
  GateShut,        ///< the robot is too far from the route, or points away from it
  GoalReached,     ///< the robot is at the end of the route, or of its last lap, and has driven all of it
  EndReached,      ///< the robot is at the end, but part of the route has not been driven
  LimiterStops,    ///< there is a reason to stop
  LimiterAllows,   ///< there is no reason to stop, and the robot is not at a station
  StationReached,  ///< there is no reason to stop, and the robot is at a station
  Resume,          ///< a person requests to continue
};

enum class ReplayAction : std::uint8_t {
  Nothing,
  BeginRoute,  ///< measure distances to stations from here
  CountStop,   ///< count another stop
};

struct ReplayTransition {
  ReplayState to = ReplayState::Waiting;
  ReplayAction action = ReplayAction::Nothing;

  friend bool operator==(const ReplayTransition&, const ReplayTransition&) = default;
};

/// The replay phase as a state table: the result of an event in a state, or `nullopt` if the event has no
/// effect. A pure function.
[[nodiscard]] std::optional<ReplayTransition> transition(ReplayState from, ReplayEvent event);

/// Whether commands may be sent at all. False after a refusal and at the end.
[[nodiscard]] constexpr bool is_live(ReplayState state) {
  return state != ReplayState::Refused && state != ReplayState::Finished && state != ReplayState::Incomplete;
}

/// Returns "driving", "stopped", …
[[nodiscard]] std::string_view to_string(ReplayState state);
[[nodiscard]] std::string_view to_string(ReplayEvent event);

struct ReplayOptions {
  double laps = 1;  ///< number of laps of a closed route
  ReplayController controller = ReplayController::Follower;
  FollowerOptions follower{};
  ActuatorOptions actuators{};
  ProfileOptions profile{};
  PurePursuitOptions pursuit{};
  GoToPoseOptions goal{};
  WatchOptions watch{};
  ConsistencyOptions consistency{};
  OdometryPrior odometry{};
  SafetyOptions safety{};
  SE2 base_T_lidar{};
};

/// The command to send, with its reason.
struct ReplayStep {
  ReplayState state = ReplayState::Waiting;
  VelocityCommand command{};
  std::optional<std::string> reason{};  ///< reason for a refusal or a stop, or the dwell time at a station
  bool lasting = false;                 ///< whether only resume() ends the stop
  std::optional<Station> station{};     ///< the station at which the robot is stopped
  std::optional<LocalizationEstimate> estimate{};
  std::vector<NisRecord> compared{};  ///< observations since the last step, with their predictions
  std::optional<RouteProgress> progress{};
  double driven_m = 0;   ///< distance driven along the route since the start
  double turn_gain = 1;  ///< ratio of actual to commanded turn, as learned so far
};

/// The replay phase: localise, follow the route, limit the command. Each finding in a step is an event whose
/// effect is defined by transition(). Add samples in the order of their timestamps, and call step() at the
/// rate of commands, which must be at least 20 Hz.
class Replayer {
 public:
  /// `map` is used to keep clear of tags. The robot is driven along the route, facing its direction of motion
  /// (facing_along()); check_sideways() finds routes that were taught otherwise.
  Replayer(std::unique_ptr<LocalizationMethod> method, Route route, TagMap map, RobotModel robot,
           const ReplayOptions& options);

  void add(const TagFrame& frame);
  void add(const TagPoseFrame& frame);
  void add(const Odometry& odometry);
  void add(const ImuSample& imu);
  void add(const LaserScan& scan);
  /// The tags expected in the current image. The camera reports those that were not found, with reasons.
  [[nodiscard]] std::vector<ExpectedTag> expected(const MountedCamera& camera, SensorTime stamp) const {
    return expected_tags(map_, camera, method_->estimate(), stamp);
  }
  void add(std::vector<MissedTag> missed) { missed_ = std::move(missed); }
  /// The command for the time `now`, relative to which the age of the newest odometry is measured.
  [[nodiscard]] ReplayStep step(SensorTime now);

  /// Pauses the replay. The robot brakes and remains stopped for this reason until resume().
  void pause(std::string reason);
  /// Call after the operator has checked the robot. Clears lasting alarms and pauses. If the start gate
  /// permits, the robot continues from the nearest point on the route that has not been passed yet.
  void resume();

  /// Sets the pose of the robot. As after pause(), the robot brakes and remains stopped until resume(). It
  /// then continues from this pose, provided that tags observed in the meantime agree with it.
  void restart_from(const GivenPose& given);

  [[nodiscard]] int stops() const { return stops_; }
  /// Findings about the map and the observations, from LocalizationMethod::problems().
  [[nodiscard]] std::vector<std::string> problems() const { return method_->problems(); }
  [[nodiscard]] const Route& route() const { return route_; }

 private:
  void track(const LocalizationEstimate& estimate);
  void pass_start_gate();
  void handle(ReplayEvent event);
  [[nodiscard]] bool certain(const std::optional<LocalizationEstimate>& estimate) const;
  void follow_estimate(const LocalizationEstimate& estimate);
  void accept(SensorTime stamp);
  void compare_motion(const ReplayStep& step, double dt_s);
  [[nodiscard]] bool at_goal() const;
  [[nodiscard]] double left_out_m() const;
  void notice_silence(double dt_s);
  [[nodiscard]] double remaining_m(const RouteProgress& at) const;
  /// Arc length, which keeps increasing over the laps of a closed route.
  [[nodiscard]] double way_m() const { return start_way_m_ + driven_m_; }
  [[nodiscard]] VelocityCommand slow_for_station(VelocityCommand command) const;
  [[nodiscard]] VelocityCommand steer(SensorTime now, const LocalizationEstimate& estimate);
  [[nodiscard]] SafetyInputs inputs_of(SensorTime now, const std::optional<LocalizationEstimate>& estimate,
                                       const VelocityCommand& wanted) const;
  [[nodiscard]] std::string alarm() const;
  void drive(SensorTime now, double dt_s, ReplayStep& step);
  void serve_station(double dt_s, ReplayStep& step);

  std::unique_ptr<LocalizationMethod> method_;
  Route route_;
  TagMap map_;
  RobotModel robot_;
  ReplayOptions options_;
  MotionPredictor predictor_;
  PathFollower follower_;
  StationStops stations_;
  ReplayWatch watch_;
  MotionConsistency consistency_;
  std::string contradiction_{};  ///< contradiction between two sources of motion; lasting
  ReplayState state_ = ReplayState::Waiting;
  std::optional<RouteProgress> progress_{};
  std::optional<SensorTime> newest_odometry_{};
  std::optional<SensorTime> newest_gyro_{};
  std::optional<SensorTime> newest_image_{};
  bool reports_accepted_ = false;                ///< whether the method reports which observations it
                                                 ///< accepted
  std::optional<SensorTime> newest_accepted_{};  ///< newest accepted observation of a tag
  std::optional<SensorTime> newest_fix_{};       ///< newest pose computed from the tags in one image
  double accepted_path_m_ = 0;                   ///< distance measured by the wheels at newest_accepted_
  std::vector<MissedTag> missed_{};              ///< expected tags missed in the newest image
  std::optional<LaserScan> scan_{};
  double start_way_m_ = 0;
  double driven_m_ = 0;
  double skipped_m_ = 0;   ///< length of the route that resume() skipped
  bool received_ = false;  ///< whether any sensor sample has arrived since the last step
  double silent_s_ = 0;    ///< time since the last sample of any sensor
  std::string silence_{};  ///< reason for a stop after a silence; lasting
  VelocityCommand last_command_{};
  std::optional<SensorTime> last_step_{};
  std::string refusal_{};
  std::string pause_{};
  bool was_certain_ = false;     ///< whether a certain estimate has existed
  bool lost_certainty_ = false;  ///< whether a certain estimate has existed, but no longer does
  bool given_ = false;           ///< whether a pose was set that has not been confirmed yet
  bool unsure_ = false;          ///< whether the robot is stopped because its position is uncertain
  bool find_ahead_ = false;      ///< whether to search for the nearest point ahead, set by resume()
  int stops_ = 0;
};

}  // namespace waymark
