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

/// How a replay follows its route.
enum class ReplayController : std::uint8_t {
  Follower,  ///< curvature fed forward, errors fed back
  Pursuit,   ///< pure pursuit
  Pose,      ///< from goal to goal
};

/// The names of the controllers: follower, pursuit, pose.
[[nodiscard]] std::vector<std::string> replay_controllers();
[[nodiscard]] std::string_view to_string(ReplayController controller);
/// Fails (InvalidArgument, with a suggestion) on a name that is none of replay_controllers().
[[nodiscard]] Result<ReplayController> parse_controller(std::string_view name);

enum class ReplayState : std::uint8_t {
  Waiting,     ///< for the first estimate
  Refused,     ///< the start gate is shut
  Driving,     ///< along the route
  AtStation,   ///< stands where the route says so, and continues when the dwell time is over
  Stopped,     ///< by the limiter; continues when the reason is gone, a lasting reason ends with Resume
  Finished,    ///< the whole route was driven
  Incomplete,  ///< at the end of the route, but not all of it was driven
};

/// What one step of a replay finds, in the order in which a step looks.
enum class ReplayEvent : std::uint8_t {
  GateOpen,        ///< near the route and pointing along it
  GateShut,        ///< too far from the route, or pointing away
  GoalReached,     ///< at the end of the route, or of its last lap, and all of it was driven
  EndReached,      ///< at the end, but a part of the route was left out
  LimiterStops,    ///< there is a reason to stop
  LimiterAllows,   ///< there is none, and no station is being served
  StationReached,  ///< there is none, and a station is being served
  Resume,          ///< a person asks to continue
};

enum class ReplayAction : std::uint8_t {
  Nothing,
  BeginRoute,  ///< stations count from here
  CountStop,   ///< one stop more
};

struct ReplayTransition {
  ReplayState to = ReplayState::Waiting;
  ReplayAction action = ReplayAction::Nothing;

  friend bool operator==(const ReplayTransition&, const ReplayTransition&) = default;
};

/// The replay phase as a table: what each event does in each state; nothing where it does nothing. Pure.
[[nodiscard]] std::optional<ReplayTransition> transition(ReplayState from, ReplayEvent event);

/// Whether commands may be sent at all: not once it is refused or over.
[[nodiscard]] constexpr bool is_live(ReplayState state) {
  return state != ReplayState::Refused && state != ReplayState::Finished && state != ReplayState::Incomplete;
}

/// "driving", "stopped", …
[[nodiscard]] std::string_view to_string(ReplayState state);
[[nodiscard]] std::string_view to_string(ReplayEvent event);

struct ReplayOptions {
  double laps = 1;  ///< how often a closed route is driven
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

/// What to send now, and why.
struct ReplayStep {
  ReplayState state = ReplayState::Waiting;
  VelocityCommand command{};
  std::optional<std::string> reason{};  ///< of a refusal, a stop, or a pause at a station
  bool lasting = false;                 ///< of a stop: only resume() ends it
  std::optional<Station> station{};     ///< at which it stands
  std::optional<LocalizationEstimate> estimate{};
  std::vector<NisRecord> compared{};  ///< observations beside what was expected, since the last step
  std::optional<RouteProgress> progress{};
  double driven_m = 0;   ///< along the route since the start
  double turn_gain = 1;  ///< share of the asked turn that the robot turns, as learnt so far
};

/// The replay phase: estimate, follow, limit. What a step finds becomes an event, and the table of
/// transition() says what follows. Samples in stamp order; step() as often as commands are sent,
/// twenty times a second or more.
class Replayer {
 public:
  /// The map is for the keep-out about tags.
  Replayer(std::unique_ptr<LocalizationMethod> method, Route route, TagMap map, RobotModel robot,
           const ReplayOptions& options);

  void add(const TagFrame& frame);
  void add(const TagPoseFrame& frame);
  void add(const Odometry& odometry);
  void add(const ImuSample& imu);
  void add(const LaserScan& scan);
  /// Where tags should be in a picture that is taken now, and which of them were not found in it, and why.
  [[nodiscard]] std::vector<ExpectedTag> expected(const MountedCamera& camera, SensorTime stamp) const {
    return expected_tags(map_, camera, method_->estimate(), stamp);
  }
  void add(std::vector<MissedTag> missed) { missed_ = std::move(missed); }
  /// The command for now. Time is an argument: the age of the newest odometry is measured against it.
  [[nodiscard]] ReplayStep step(SensorTime now);

  /// A person holds the robot: it brakes, stands and says why, until resume().
  void pause(std::string reason);
  /// A person looked: lasting alarms and pauses are forgotten. The robot goes on from the nearest point of
  /// the route that it has not passed yet, if the start gate allows it.
  void resume();

  /// A person says where the robot is. It brakes and stands, as by pause(), until resume(): from where it is
  /// then, if tags that were seen meanwhile agree.
  void restart_from(const GivenPose& given);

  [[nodiscard]] int stops() const { return stops_; }
  /// In words what is wrong about the map or what is seen: LocalizationMethod::problems().
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
  /// Arc length, going on where a closed route begins again.
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
  std::string contradiction_{};  ///< of two sources of motion, in words; lasting
  ReplayState state_ = ReplayState::Waiting;
  std::optional<RouteProgress> progress_{};
  std::optional<SensorTime> newest_odometry_{};
  std::optional<SensorTime> newest_gyro_{};
  std::optional<SensorTime> newest_picture_{};
  bool reports_accepted_ = false;                ///< the method says which observations it accepted
  std::optional<SensorTime> newest_accepted_{};  ///< observation of a tag
  std::optional<SensorTime> newest_fix_{};       ///< pose by the tags of one picture
  double accepted_path_m_ = 0;                   ///< way by the wheels up to it
  std::vector<MissedTag> missed_{};              ///< in the newest picture that should show a tag
  std::optional<LaserScan> scan_{};
  double start_way_m_ = 0;
  double driven_m_ = 0;
  double skipped_m_ = 0;   ///< of the route, when it continued farther ahead after resume()
  bool received_ = false;  ///< any sensor since the last step
  double silent_s_ = 0;    ///< since any sensor was received
  std::string silence_{};  ///< that lasted, in words; lasting
  VelocityCommand last_command_{};
  std::optional<SensorTime> last_step_{};
  std::string refusal_{};
  std::string pause_{};
  bool was_certain_ = false;     ///< a certain estimate was there once
  bool lost_certainty_ = false;  ///< and is not now
  bool given_ = false;           ///< since somebody said where it is
  bool unsure_ = false;          ///< it stands for want of a position
  bool find_ahead_ = false;      ///< after resume()
  int stops_ = 0;
};

}  // namespace waymark
