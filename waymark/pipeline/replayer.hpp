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

/// Controller that follows the route.
enum class ReplayController : std::uint8_t {
  Follower,  ///< curvature feed-forward with error feedback
  Pursuit,   ///< pure pursuit
  Pose,      ///< go-to-pose from goal to goal
};

/// The names of the controllers: follower, pursuit, pose.
[[nodiscard]] std::vector<std::string> replay_controllers();
[[nodiscard]] std::string_view to_string(ReplayController controller);
/// Fails (InvalidArgument, with a suggestion) on a name that is not one of replay_controllers().
[[nodiscard]] Result<ReplayController> parse_controller(std::string_view name);

enum class ReplayState : std::uint8_t {
  Waiting,     ///< for the first estimate
  Refused,     ///< the start gate refused the pose of the robot
  Driving,     ///< along the route
  AtStation,   ///< stopped at a station; continues when the dwell time is over
  Stopped,     ///< by the limiter; continues when the reason is gone, after a lasting reason only with Resume
  Finished,    ///< the whole route was driven
  Incomplete,  ///< at the end of the route, with parts of it not driven
};

/// Findings of a step, in order of evaluation.
enum class ReplayEvent : std::uint8_t {
  GateOpen,        ///< near the route and pointing along it
  GateShut,        ///< too far from the route, or heading away from it
  GoalReached,     ///< at the end of the route, or of its last lap, with all of it driven
  EndReached,      ///< at the end, with a part of the route not driven
  LimiterStops,    ///< there is a reason to stop
  LimiterAllows,   ///< no reason to stop, and no station is being served
  StationReached,  ///< no reason to stop, and a station is being served
  Resume,          ///< a person asks to continue
};

enum class ReplayAction : std::uint8_t {
  Nothing,
  BeginRoute,  ///< distances to stations count from here
  CountStop,   ///< count one more stop
};

struct ReplayTransition {
  ReplayState to = ReplayState::Waiting;
  ReplayAction action = ReplayAction::Nothing;

  friend bool operator==(const ReplayTransition&, const ReplayTransition&) = default;
};

/// The replay phase as a state table: the result of an event in a state; none if it has no effect. Pure.
[[nodiscard]] std::optional<ReplayTransition> transition(ReplayState from, ReplayEvent event);

/// Whether commands may be sent at all; false after a refusal and at the end.
[[nodiscard]] constexpr bool is_live(ReplayState state) {
  return state != ReplayState::Refused && state != ReplayState::Finished && state != ReplayState::Incomplete;
}

/// "driving", "stopped", …
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
  std::optional<std::string> reason{};  ///< of a refusal, a stop, or the dwell time at a station
  bool lasting = false;                 ///< a stop that only resume() ends
  std::optional<Station> station{};     ///< at which the robot is stopped
  std::optional<LocalizationEstimate> estimate{};
  std::vector<NisRecord> compared{};  ///< observations and their predictions since the last step
  std::optional<RouteProgress> progress{};
  double driven_m = 0;   ///< along the route since the start
  double turn_gain = 1;  ///< actual over commanded turn, as learned so far
};

/// The replay phase: estimate, follow, limit. Each finding of a step is an event, and transition() defines
/// its effect. Add samples in stamp order; call step() at the rate of commands, at least 20 Hz.
class Replayer {
 public:
  /// `map`: for the clearance around tags.
  Replayer(std::unique_ptr<LocalizationMethod> method, Route route, TagMap map, RobotModel robot,
           const ReplayOptions& options);

  void add(const TagFrame& frame);
  void add(const TagPoseFrame& frame);
  void add(const Odometry& odometry);
  void add(const ImuSample& imu);
  void add(const LaserScan& scan);
  /// Tags expected in a current image. (The camera reports those that were not found, with reasons.)
  [[nodiscard]] std::vector<ExpectedTag> expected(const MountedCamera& camera, SensorTime stamp) const {
    return expected_tags(map_, camera, method_->estimate(), stamp);
  }
  void add(std::vector<MissedTag> missed) { missed_ = std::move(missed); }
  /// The command for `now`, against which the age of the newest odometry is measured.
  [[nodiscard]] ReplayStep step(SensorTime now);

  /// Pauses the replay: the robot brakes and stays stopped with this reason until resume().
  void pause(std::string reason);
  /// Call after the operator checked the robot. Clears lasting alarms and pauses. The robot continues from
  /// the nearest point of the route that it has not passed yet, if the start gate permits.
  void resume();

  /// Sets the pose of the robot. The robot brakes and stays stopped, as after pause(), until resume(). It
  /// then continues from this pose, if tags observed in the meantime agree with it.
  void restart_from(const GivenPose& given);

  [[nodiscard]] int stops() const { return stops_; }
  /// Findings about map and observations: LocalizationMethod::problems().
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
  /// Arc length, increasing over the laps of a closed route.
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
  std::string contradiction_{};  ///< between two sources of motion; lasting
  ReplayState state_ = ReplayState::Waiting;
  std::optional<RouteProgress> progress_{};
  std::optional<SensorTime> newest_odometry_{};
  std::optional<SensorTime> newest_gyro_{};
  std::optional<SensorTime> newest_picture_{};
  bool reports_accepted_ = false;                ///< the method reports which observations it accepted
  std::optional<SensorTime> newest_accepted_{};  ///< observation of a tag
  std::optional<SensorTime> newest_fix_{};       ///< pose from the tags of one image
  double accepted_path_m_ = 0;                   ///< distance by the wheels at newest_accepted_
  std::vector<MissedTag> missed_{};              ///< in the newest image with expected tags
  std::optional<LaserScan> scan_{};
  double start_way_m_ = 0;
  double driven_m_ = 0;
  double skipped_m_ = 0;   ///< length of the route skipped by resume()
  bool received_ = false;  ///< any sensor since the last step
  double silent_s_ = 0;    ///< time since the last sample of any sensor
  std::string silence_{};  ///< reason of a stop after a silence; lasting
  VelocityCommand last_command_{};
  std::optional<SensorTime> last_step_{};
  std::string refusal_{};
  std::string pause_{};
  bool was_certain_ = false;     ///< a certain estimate existed
  bool lost_certainty_ = false;  ///< a certain estimate existed, but no longer does
  bool given_ = false;           ///< a pose was given and is not confirmed yet
  bool unsure_ = false;          ///< stopped for position uncertainty
  bool find_ahead_ = false;      ///< after resume()
  int stops_ = 0;
};

}  // namespace waymark
