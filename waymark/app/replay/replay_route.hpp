#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/replay_setup.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/evaluation/replay_judgement.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/runtime/replay_session.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// A pause at a station that a replay made.
struct StationVisit {
  std::string name{};
  double arc_length_m = 0;
  SensorTime arrived{};
  double stood_s = 0;
};

/// What a replay says and writes down while it goes on: where it stands and why, and that it goes on. In
/// words on the terminal for stations; in the recording as /diagnostics, one message each time the state
/// changes.
class ReplayNotes {
 public:
  explicit ReplayNotes(const JobControl& control) : control_(control) {}

  Status add(SensorTime now, const ReplayStep& step, SampleRecorder* recorder);
  [[nodiscard]] const std::vector<StationVisit>& visits() const { return visits_; }

 private:
  void note_station(SensorTime now, const ReplayStep& step);

  const JobControl& control_;
  std::optional<ReplayState> last_{};
  std::string last_station_{};
  std::vector<StationVisit> visits_;
};

/// What is kept and shown of a replay as it is driven: the recording, the true path, the stations, a live
/// line.
class ReplayLog {
 public:
  /// `images`: how pictures are recorded (raw, jpeg; empty: not at all).
  ReplayLog(std::optional<SampleRecorder> recorder, std::string images, double goal_m,
            const JobControl& control)
      : recorder_(std::move(recorder)),
        images_(std::move(images)),
        goal_m_(goal_m),
        control_(control),
        notes_(control) {}

  Status on_sample(const Sample& sample);
  Status on_step(SensorTime now, const ReplayStep& step);
  /// This log as the listener of a session.
  [[nodiscard]] ReplayListener listener();
  /// Closes the recording.
  Status close();

  [[nodiscard]] Trajectory& true_path() { return true_path_; }
  [[nodiscard]] const std::vector<StationVisit>& visits() const { return notes_.visits(); }

 private:
  std::optional<SampleRecorder> recorder_;
  std::string images_;
  double goal_m_;
  const JobControl& control_;
  ReplayNotes notes_;
  Trajectory true_path_{};
};

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
    visit(self.job.route,
          JobField("route NAME",
                   "Name of the route to drive, of another lap (`route_name` of `waymark map`) "
                   "or optimised (`waymark optimize`, which is judged by itself); `waymark "
                   "routes` lists them. Unless given: the taught route"));
    visit(self.calibration, JobField("calibration FILE",
                                     "Calibration of this robot (calibration.yaml); its yaw gain is the "
                                     "initial value that the follower learns from"));
    visit(self.job.replay.laps, JobField("laps NUMBER", "Number of laps of a closed route"));
    visit(self.job.output, JobField("output FILE", "Recording to write of the replay (.mcap)"));
    visit(self.job.images,
          JobField("record_images HOW",
                   "With `output`: also record the pictures (with `images`, or of a robot that "
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
/// What `--json` prints; the judgement is null where the ground truth is unknown.
[[nodiscard]] ReportFields fields(const ReplayReport& report);
[[nodiscard]] ReportFields fields(const StationVisit& visit);

/// A replay on a robot that is a process, with everything it stands on.
class LiveReplay {
 public:
  /// `on_step`: called with each decision before it is recorded.
  static Result<std::unique_ptr<LiveReplay>> make(const RobotSetup& setup, const ReplayJob& job,
                                                  const ReplayFiles& files, const JobControl& control,
                                                  std::function<void(const ReplayStep&)> on_step,
                                                  SessionRequests requests = no_requests());

  [[nodiscard]] ReplaySession& session() { return *session_; }
  /// Closes the recording, and says what came of it, judged where the truth is known.
  [[nodiscard]] Result<ReplayReport> finish(const ReplayEnd& end);

 private:
  LiveReplay(RobotSetup known, const ReplayFiles& files) : known_(std::move(known)), files_(files) {}

  RobotSetup known_;  ///< with the tags of the map, where its world is not known
  const ReplayFiles& files_;
  std::unique_ptr<Replayer> replayer_{};
  std::unique_ptr<ReplayLog> log_{};
  std::unique_ptr<ReplaySession> session_{};
};

}  // namespace waymark
