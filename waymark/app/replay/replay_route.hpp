#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/replay_setup.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/replay/replay_notes.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/evaluation/replay_judgement.hpp"

namespace waymark {

class LiveFeed;

struct ReplayJob {
  std::filesystem::path folder;  ///< with map.yaml and route.yaml
  std::string route{};           ///< name of another route of the folder (route-NAME.yaml)
  LocalizationKind method = LocalizationKind::Riekf;
  std::string output{};  ///< recording to write; empty: none
  bool durable = false;  ///< of the recording: also a power cut loses at most a second
  std::string images{};  ///< how pictures are recorded: raw, jpeg; empty: not at all
  std::string taught{};  ///< recording of the lap to judge against; empty: the truth of the route's own lap
                         ///< in the folder; a route without one (an optimised one) is held against itself
  RiekfOptions filter{};
  AnchorOptions anchor{};
  ReplayOptions replay{};                    ///< laps, controller, limits
  std::optional<Calibration> calibration{};  ///< of the robot's camera
  LiveFeed* feed = nullptr;                  ///< of viewers, if there are any
};

/// What a user says of a replay, but options.
struct ReplayWords {
  ReplayJob job{};
  std::string method = "riekf";         ///< as choose_replay() has it ...
  std::string controller = "follower";  ///< ... both
  std::string calibration{};            ///< calibration.yaml; empty: none

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.job.folder, JobField("folder MAP", "Folder that `waymark map` wrote").input().required());
    visit(self.method, JobField("method NAME",
                                "Localisation method: riekf (right-invariant extended Kalman filter), ekf "
                                "(extended Kalman filter) or anchor (nearest tag and odometry)"));
    visit(self.controller, JobField("controller NAME",
                                    "Controller: follower (curvature feed-forward and error feedback), "
                                    "pursuit (pure pursuit) or pose (goal to goal)"));
    visit(self.job.route, JobField("route NAME",
                                   "Name of the route to drive, of another lap (`waymark map --route-name`) "
                                   "or optimised (`waymark optimize`, which is judged by itself); `waymark "
                                   "routes` lists them. Unless given: the taught route"));
    visit(self.calibration, JobField("calibration FILE",
                                     "Calibration of this robot (calibration.yaml); its yaw gain is the "
                                     "initial value that the follower learns from"));
    visit(self.job.replay.laps, JobField("laps NUMBER", "Number of laps of a closed route"));
    visit(self.job.output, JobField("output FILE", "Recording to write of the replay (.mcap)"));
    visit(self.job.images, JobField("record_images HOW",
                                    "With -o: also record the pictures (with --images, or of a robot that "
                                    "sends them): jpeg, or raw, ten times as large")
                               .one_of("jpeg,raw")
                               .less());
    visit(self.job.durable, JobField("durable", kDurableHelp).less());
    visit(self.job.taught,
          JobField("taught FILE",
                   "Recording of the lap to judge by. Unless given: truth_trajectory.txt of the folder")
              .less());
  }
};

/// What calibration.yaml knows better than the robot's file: camera and mounting, the filter's scales, and
/// where the follower begins to learn the turn gain. An empty name changes nothing.
[[nodiscard]] Status take_calibration(const std::string& path, ReplayJob& job);

/// A method that a replay can use, by name. Fails on a name that is none, and on the smoother, which speaks
/// of the past.
[[nodiscard]] Result<LocalizationKind> parse_replay_method(const std::string& name);

/// Gives the job the method and the controller of these names. Fails also on a number of laps that cannot be.
[[nodiscard]] Status choose_replay(const std::string& method, const std::string& controller, ReplayJob& job);
/// Fails on what a recording is asked to hold, where none is written or there are no pictures.
[[nodiscard]] Status check_recording(const ReplayJob& job, const RobotSetup& setup);

/// What a replay needs from its files.
struct ReplayFiles : MapFolder {
  Trajectory taught{};  ///< the true way of the teach lap; empty when not known
};

/// Reads the folder of the job; fails in words.
[[nodiscard]] Result<ReplayFiles> load_replay(const ReplayJob& job, const JobControl& control);
/// Fails when several laps, or a part of one, are asked for on an open route, and on a speed that is too slow
/// to be told from standing.
[[nodiscard]] Status check_drive(const ReplayJob& job, const Route& route);
/// How the job drives a robot.
[[nodiscard]] ReplayerSetup replayer_setup(const ReplayJob& job);

struct ReplayReport {
  ReplayEnd end{};
  double route_length_m = 0;
  Trajectory true_path{};
  Trajectory taught_path{};                    ///< empty when not known
  std::optional<ReplayJudgement> judgement{};  ///< nothing when there is nothing to judge, or against
  std::vector<StationVisit> visits{};
  std::vector<std::string> warnings{};
  double allowed_s = 0;  ///< simulated time after which it would have been given up
  double wall_s = 0;
};

/// How far a replay of the job goes along its route.
[[nodiscard]] double goal_m(const Route& route, const ReplayJob& job);

/// Simulated time after which a replay of the job is given up: three times what the asked speed and the
/// stations take, or what 0.05 m/s takes where that is longer, and a minute.
[[nodiscard]] double time_allowed_s(const Route& route, const ReplayJob& job, const RobotModel& robot);

/// The job with a limiter that lets no more than this speed pass.
[[nodiscard]] ReplayJob slowed(ReplayJob job, double most_m_s);
/// What is asked for and will not be driven: faster than the limiter lets pass, or than the robot is.
[[nodiscard]] std::vector<std::string> speed_warnings(const ReplayJob& job, const Route& route,
                                                      const RobotModel& robot);

/// The recording that the job asks for, with the map and the route it is driven by; nothing when it asks for
/// none.
[[nodiscard]] Result<std::optional<SampleRecorder>> record_replay(const RobotSetup& setup,
                                                                  const ReplayJob& job);
/// Compares the true path with the taught one, or warns why that cannot be.
void judge(const RobotSetup& setup, ReplayReport& report);

/// Lets the robot of the setup, simulated or a process, drive the route of the folder.
[[nodiscard]] Result<ReplayReport> replay_route(const RobotSetup& setup, const ReplayJob& job,
                                                const JobControl& control);

/// A state and why: "stopped: a tag is near". A reason that begins with the state stands alone.
[[nodiscard]] std::string with_reason(std::string_view state, std::string_view reason);

/// How it ended, in words: "stopped after 3.10 m of a route of 17.40 m: …". `stopped_by`: who cancels.
[[nodiscard]] std::string ending(const ReplayReport& report, std::string_view stopped_by = "its caller");
/// The same with stops, stations and the judgement, a line each.
[[nodiscard]] std::string to_text(const ReplayReport& report, std::string_view stopped_by = "its caller");
/// Whether the robot drove the laps it was asked to.
[[nodiscard]] bool succeeded(const ReplayReport& report);
[[nodiscard]] nlohmann::ordered_json to_json(const ReplayReport& report);

}  // namespace waymark
