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

/// A stop of a replay at a station.
struct StationVisit {
  std::string name{};
  double arc_length_m = 0;
  SensorTime arrived{};
  double dwell_s = 0;
};

/// Reports the state of a replay: stops at stations as notes, each change of state as a /diagnostics message
/// in the recording.
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

/// Outputs of a running replay: the recording, the true path, the stations, a progress line.
class ReplayLog {
 public:
  /// `images`: format of recorded images (raw, jpeg; empty: not recorded).
  ReplayLog(std::optional<SampleRecorder> recorder, std::string images, double goal_m,
            const JobControl& control)
      : recorder_(std::move(recorder)),
        images_(std::move(images)),
        goal_m_(goal_m),
        control_(control),
        notes_(control) {}

  Status on_sample(const Sample& sample);
  Status on_step(SensorTime now, const ReplayStep& step);
  /// The listener of a session for this log, which must outlive it.
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
  std::filesystem::path folder;  ///< contains map.yaml and route.yaml
  std::string route{};           ///< name of another route in the folder (route-NAME.yaml)
  LocalizationKind method = LocalizationKind::Riekf;
  std::string output{};  ///< recording to write; empty: none
  bool durable = false;  ///< recording: a power cut loses at most one second
  std::string images{};  ///< format of recorded images: raw, jpeg; empty: not recorded
  /// Recording of the lap for the evaluation. If empty, the ground truth of the route's lap in the folder is
  /// used. A route without it (an optimised one) is its own reference.
  std::string taught{};
  RiekfOptions filter{};
  AnchorOptions anchor{};
  ReplayOptions replay{};                    ///< laps, controller, limits
  std::optional<Calibration> calibration{};  ///< of the robot's camera
  LiveFeed* feed = nullptr;                  ///< for viewers; may be nullptr
};

/// A replay as requested by the user, without option structs.
struct ReplayRequest {
  ReplayJob job{};
  std::string method = "riekf";         ///< parsed by choose_replay()
  std::string controller = "follower";  ///< parsed by choose_replay()
  std::string calibration{};            ///< calibration.yaml; empty: none

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.job.folder, JobField("folder MAP", "Folder written by `waymark map`").input().required());
    visit(self.method, JobField("method NAME",
                                "Localisation method: riekf (right-invariant extended Kalman filter), ekf "
                                "(extended Kalman filter) or anchor (nearest tag and odometry)"));
    visit(self.controller, JobField("controller NAME",
                                    "Controller: follower (curvature feed-forward and error feedback), "
                                    "pursuit (pure pursuit) or pose (goal to goal)"));
    visit(self.job.route,
          JobField("route NAME",
                   "Name of the route to drive: of another lap (`route_name` of `waymark map`) or of "
                   "`waymark optimize` (its own reference in the evaluation); `waymark routes` lists "
                   "them. Default: the taught route"));
    visit(self.calibration, JobField("calibration FILE",
                                     "Calibration of this robot (calibration.yaml); its turn gain is the "
                                     "initial value of the follower's estimate"));
    visit(self.job.replay.laps, JobField("laps NUMBER", "Number of laps of a closed route"));
    visit(self.job.output, JobField("output FILE", "Recording to write of the replay (.mcap)"));
    visit(self.job.images,
          JobField("record_images HOW",
                   "With `output`: also record the images (with `images`, or of a robot that "
                   "sends them): jpeg, or raw, ten times as large")
              .one_of("jpeg,raw")
              .less());
    visit(self.job.durable, JobField("durable", kDurableHelp).less());
    visit(
        self.job.taught,
        JobField("taught FILE", "Recording of the reference lap. Default: truth_trajectory.txt in the folder")
            .less());
  }
};

/// Applies calibration.yaml over the robot's file: camera and mounting, the odometry scales of the filter,
/// and the initial turn gain of the follower. An empty path changes nothing.
[[nodiscard]] Status take_calibration(const std::string& path, ReplayJob& job);

/// A localisation method for replays, by name. Fails on an unknown name, and on the smoother, because its
/// estimates are delayed.
[[nodiscard]] Result<LocalizationKind> parse_replay_method(const std::string& name);

/// Sets method and controller of the job by name. Fails also on an invalid number of laps.
[[nodiscard]] Status choose_replay(const std::string& method, const std::string& controller, ReplayJob& job);
/// Fails if images are to be recorded without a recording or without images.
[[nodiscard]] Status check_recording(const ReplayJob& job, const RobotSetup& setup);

/// The files of a replay.
struct ReplayFiles : MapFolder {
  Trajectory taught{};  ///< true path of the teach lap; empty: unknown
};

/// Reads the folder of the job.
[[nodiscard]] Result<ReplayFiles> load_replay(const ReplayJob& job, const JobControl& control);
/// Fails on more or less than one lap of an open route, and on a speed that cannot be distinguished from
/// zero.
[[nodiscard]] Status check_drive(const ReplayJob& job, const Route& route);
/// The setup of the Replayer for this job.
[[nodiscard]] ReplayerSetup replayer_setup(const ReplayJob& job);

struct ReplayReport {
  ReplayEnd end{};
  double route_length_m = 0;
  Trajectory true_path{};
  Trajectory taught_path{};                    ///< empty: unknown
  std::optional<ReplayJudgement> judgement{};  ///< nothing without ground truth of replay and teach lap
  std::vector<StationVisit> visits{};
  std::vector<std::string> warnings{};
  double allowed_s = 0;  ///< limit of simulated time, after which the replay is aborted
  double wall_s = 0;
};

/// Distance along the route that a replay of the job drives [m].
[[nodiscard]] double goal_m(const Route& route, const ReplayJob& job);

/// Simulated time after which a replay is aborted. It is one minute plus three times the time for the
/// requested speed and the stations, or plus the time at 0.05 m/s if that is longer.
[[nodiscard]] double time_allowed_s(const Route& route, const ReplayJob& job, const RobotModel& robot);

/// The job with the limiter's maximum speed reduced to this speed.
[[nodiscard]] ReplayJob slowed(ReplayJob job, double max_speed_m_s);
/// Warnings about requested speeds above the limit of the limiter or of the robot.
[[nodiscard]] std::vector<std::string> speed_warnings(const ReplayJob& job, const Route& route,
                                                      const RobotModel& robot);

/// Begins the requested recording, with map and route as attachments; nothing if none is requested.
[[nodiscard]] Result<std::optional<SampleRecorder>> record_replay(const RobotSetup& setup,
                                                                  const ReplayJob& job);
/// Compares the true path with the taught path, or adds a warning that explains why that is impossible.
void judge(const RobotSetup& setup, ReplayReport& report);

/// Drives the route of the folder with the robot of the setup, simulated or a process.
[[nodiscard]] Result<ReplayReport> replay_route(const RobotSetup& setup, const ReplayJob& job,
                                                const JobControl& control);

/// State and reason: "stopped: a tag is near". If the reason begins with the state, only the reason.
[[nodiscard]] std::string with_reason(std::string_view state, std::string_view reason);

/// The end as text: "stopped 3.10 m along a route of 17.40 m: …". `stopped_by`: who cancelled.
[[nodiscard]] std::string ending(const ReplayReport& report, std::string_view stopped_by = "its caller");
/// The same with one line each for stops, stations and errors.
[[nodiscard]] std::string to_text(const ReplayReport& report, std::string_view stopped_by = "its caller");
/// Whether the robot drove all requested laps.
[[nodiscard]] bool succeeded(const ReplayReport& report);
/// The keys of `json`; errors are null without ground truth.

[[nodiscard]] ReportFields fields(const ReplayReport& report);
[[nodiscard]] ReportFields fields(const StationVisit& visit);

/// A replay with a robot process, and the objects that it needs.
class LiveReplay {
 public:
  /// `on_step`: called with each decision before it is recorded.
  static Result<std::unique_ptr<LiveReplay>> make(const RobotSetup& setup, const ReplayJob& job,
                                                  const ReplayFiles& files, const JobControl& control,
                                                  std::function<void(const ReplayStep&)> on_step,
                                                  SessionRequests requests = no_requests());

  [[nodiscard]] ReplaySession& session() { return *session_; }
  /// Closes the recording and returns the report, with errors if the ground truth is known.
  [[nodiscard]] Result<ReplayReport> finish(const ReplayEnd& end);

 private:
  LiveReplay(RobotSetup setup, const ReplayFiles& files) : setup_(std::move(setup)), files_(files) {}

  RobotSetup setup_;  ///< contains the map tags if the world is unknown
  const ReplayFiles& files_;
  std::unique_ptr<Replayer> replayer_{};
  std::unique_ptr<ReplayLog> log_{};
  std::unique_ptr<ReplaySession> session_{};
};

}  // namespace waymark
