#pragma once

// A simulated replay without images, compared with the ground truth, for tests of replay.
#include <algorithm>
#include <string>
#include <vector>

#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/evaluation/replay_judgement.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/pipeline/localizer.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/replay/route_progress.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark::replay_course {

/// circuit24 with its true map; the taught trajectory follows its path.
struct Course {
  World world{};
  RobotDescription robot;
  Trajectory taught{};
  Route route{};
};

inline Course circuit24(const std::string& robot_name = "limo") {
  Course course{.world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml").value(),
                .robot = read_robot(WAYMARK_SHARE "/robots/" + robot_name + ".yaml").value()};
  const auto path = sample_path(course.world.path_m, true, 0.02);
  for (std::size_t i = 0; i < path.size() + 30; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(50 * i));
    course.taught.push_back({stamp, lift(path[i % path.size()].map_T_path)});
  }
  course.route = build_route(course.taught).value();
  return course;
}

/// The outcome of a replay.
struct Outcome {
  ReplayEnd end{};
  ReplayJudgement judged{};
  double turn_gain = 1;
  std::vector<std::string> reasons{};  ///< of all stops, each once
  double moved_after_stop_m = 0;       ///< true distance, later than 1 s after a lasting stop or the goal
  double fastest_m_s = 0;              ///< command
  double keep_out_breach_m = 0;        ///< largest distance driven into the keep-out around the true tags
  double after_carry_m = 0;            ///< distance driven since the robot was last moved by hand
  std::vector<StampedCommand> commands{};
  std::vector<std::string> problems{};  ///< messages at the end
  double reaction_m = 0;                ///< shortest stopping distance at the speed of the replay
};

struct Trial {
  std::uint64_t seed = 1;
  double turn_gain = 0.85;
  std::vector<Fault> faults{};
  ReplayOptions replay{};
  double timeout_s = 900;
  std::string odometry{};       ///< kind of the driver's odometry; empty: that of the robot file
  double camera_latency_s = 0;  ///< additional delay of images and of their stamps
};

/// Shortest time and distance from a motion by hand to standstill: the next image, its latency in the camera
/// and to the motors, and braking.
struct Reaction {
  double time_s = 0;
  double way_m = 0;
};

inline Reaction reaction(const SimulatedRobotOptions& robot, const SafetyOptions& safety, double speed_m_s) {
  constexpr double kControlPeriod_s = 0.05;
  const double blind_s =
      robot.camera_latency_s + 1 / robot.camera_rate_hz + kControlPeriod_s + robot.dynamics.command_delay_s;
  const double brakes_s = speed_m_s / safety.max_deceleration_m_s2;
  const double lag_s = robot.dynamics.speed_lag_s;
  return {.time_s = blind_s + brakes_s + 3 * lag_s, .way_m = speed_m_s * (blind_s + brakes_s / 2 + lag_s)};
}

/// How far a robot drives into the keep-out. A person may place it inside, or in front of a tag while it
/// drives: then its reaction distance is allowed, and after that it must not come closer.
class KeepOut {
 public:
  KeepOut(const TagMap& tags, const Hull& hull, double min_clearance_m, const Reaction& reaction)
      : tags_(tags), hull_(hull), reaction_(reaction), min_clearance_m_(min_clearance_m) {}

  /// Adds a true pose, `dt_s` after the previous one.
  void add(const SE3& map_T_base, double dt_s) {
    constexpr double kCarried_m = 0.1;
    constexpr double kStationary_m = 0.005;
    const double clearance = clearance_m(hull_, map_T_base, tags_);
    const double moved = last_ ? (map_T_base.translation() - *last_).norm() : 0;
    after_carry_m_ = moved > kCarried_m ? 0 : after_carry_m_ + moved;
    if (moved > kCarried_m) {
      allowed_m_ = std::min(min_clearance_m_, clearance - reaction_.way_m);
      reacts_s_ = reaction_.time_s;
    } else if (reacts_s_ > 0) {
      reacts_s_ -= dt_s;
      if (reacts_s_ <= 0) allowed_m_ = std::min(min_clearance_m_, clearance - kStationary_m);
    }
    last_ = map_T_base.translation();
    breach_m_ = std::max(breach_m_, allowed_m_ - clearance);
  }
  [[nodiscard]] double breach_m() const { return breach_m_; }
  [[nodiscard]] double after_carry_m() const { return after_carry_m_; }
  [[nodiscard]] const Reaction& needs() const { return reaction_; }

 private:
  const TagMap& tags_;
  Hull hull_;
  Reaction reaction_;
  double min_clearance_m_;
  double allowed_m_ = min_clearance_m_;
  double reacts_s_ = 0;
  double after_carry_m_ = 0;
  std::optional<Eigen::Vector3d> last_{};
  double breach_m_ = 0;
};

inline Outcome drive(const Course& course, const Trial& trial) {
  SimulatedSetup setup{.world = course.world,
                       .model = course.robot.model,
                       .camera = course.robot.camera,
                       .robot = course.robot.simulation};
  setup.robot.seed = trial.seed;
  setup.robot.camera_latency_s = 0.08 + trial.camera_latency_s;
  setup.robot.dynamics.turn_gain = trial.turn_gain;
  setup.robot.faults = trial.faults;
  if (!trial.odometry.empty()) setup.robot.sensors.odometry = trial.odometry;
  LocalizerSetup localizer{.landmarks = Landmarks(course.world.tags),
                           .tags = course.world.tags,
                           .sensor = {setup.camera, setup.model.base_T_cam},
                           .live = true};
  localizer.filter.camera_latency_s = -trial.camera_latency_s;
  Replayer replayer(make_localization_method(localizer).value(), course.route, course.world.tags, setup.model,
                    trial.replay);
  Outcome outcome;
  KeepOut keep_out(course.world.tags, course.robot.model.hull, trial.replay.safety.min_clearance_m,
                   reaction(setup.robot, trial.replay.safety, trial.replay.profile.speed_m_s));
  Trajectory driven;
  std::optional<SE2> stopped_at;
  std::optional<SE2> was_at;
  double lasting_s = 0;
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) {
    const auto* truth = std::get_if<TruthPose>(&sample);
    if (truth == nullptr) return Status();
    driven.push_back({truth->stamp, truth->map_T_base});
    keep_out.add(truth->map_T_base, 1 / setup.robot.truth_rate_hz);
    const SE2 here = project_to_plane(truth->map_T_base);
    constexpr double kByHand_m = 0.1;  // between two true poses: moved by hand, not driven
    if (stopped_at && was_at && (here.translation() - was_at->translation()).norm() > kByHand_m)
      stopped_at = here;
    was_at = here;
    if (lasting_s > 1 && !stopped_at) stopped_at = here;
    if (stopped_at)
      outcome.moved_after_stop_m =
          std::max(outcome.moved_after_stop_m, (here.translation() - stopped_at->translation()).norm());
    return Status();
  };
  listener.on_step = [&](SensorTime now, const ReplayStep& step) {
    lasting_s = step.lasting ? lasting_s + 0.05 : 0;
    outcome.turn_gain = step.turn_gain;
    outcome.commands.push_back({now, step.command});
    outcome.fastest_m_s = std::max(outcome.fastest_m_s, std::abs(step.command.speed_m_s));
    if (step.reason && std::ranges::find(outcome.reasons, *step.reason) == outcome.reasons.end() &&
        outcome.reasons.size() < 50 && step.state == ReplayState::Stopped)
      outcome.reasons.push_back(*step.reason);
    return Status();
  };
  outcome.end = drive_replay(setup, replayer, listener, {.timeout_s = trial.timeout_s}).value();
  // After a clock jump the stamps of the ground truth go back; judge_replay() uses only positions.
  const auto judged = judge_replay(driven, course.taught, course.world.tags, course.robot.model.hull);
  if (judged) outcome.judged = *judged;
  outcome.problems = replayer.problems();
  outcome.keep_out_breach_m = keep_out.breach_m();
  outcome.after_carry_m = keep_out.after_carry_m();
  outcome.reaction_m = keep_out.needs().way_m;
  return outcome;
}

}  // namespace waymark::replay_course
