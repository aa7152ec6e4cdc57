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

/// A stop at a station during a replay.
struct StationVisit {
  std::string name{};
  double arc_length_m = 0;
  SensorTime arrived{};
  double dwell_s = 0;
};

/// Reports the state of a replay: stops at stations as notes, and each change of state as a /diagnostics
/// message in the recording.
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

/// Outputs of a running replay: the recording, the true path, the stations, and a progress line.
class ReplayLog {
 public:
  /// `images` is the format of recorded images (raw, jpeg; not recorded if empty).
  ReplayLog(std::optional<SampleRecorder> recorder, std::string images, double goal_m,
            const JobControl& control)
      : recorder_(std::move(recorder)),
        images_(std::move(images)),
        goal_m_(goal_m),
        control_(control),
        notes_(control) {}

  Status on_sample(const Sample& sample);
  Status on_step(SensorTime now, const ReplayStep& step);
  /// A session listener that writes to this log, which must outlive it.
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
  std::filesystem::path folder;  ///< folder that contains map.yaml and route.yaml
  std::string route{};           ///< name of another route in the folder (route-NAME.yaml)
  LocalizationKind method = LocalizationKind::Riekf;
  std::string output{};  ///< path of the recording to write; none is written if empty
  bool durable = false;  ///< whether to sync the recording every second, so that a power cut loses at most
                         ///< one second
  std::string images{};  ///< format of recorded images (raw, jpeg); they are not recorded if empty
  /// Recording of the lap, used for evaluation. If empty, the ground truth for the route's lap in the folder
  /// is used. A route without ground truth (an optimised one) is its own reference.
  std::string taught{};
  RiekfOptions filter{};
  AnchorOptions anchor{};
  ReplayOptions replay{};                    ///< laps, controller, limits
  std::optional<Calibration> calibration{};  ///< calibration of the robot's camera
  LiveFeed* feed = nullptr;                  ///< feed for viewers; may be nullptr
};

/// A replay as requested by the user, without option structs.
struct ReplayRequest {
  ReplayJob job{};
  std::string method = "riekf";         ///< parsed by choose_replay()
  std::string controller = "follower";  ///< parsed by choose_replay()
  std::string calibration{};            ///< path of calibration.yaml; empty if there is none

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

/// Applies calibration.yaml in place of the values in the robot file: camera and mounting, the odometry
/// scales in the filter, and the initial turn gain in the follower. Does nothing if the path is empty.
[[nodiscard]] Status take_calibration(const std::string& path, ReplayJob& job);

/// Returns a localisation method for replays by name. Fails on an unknown name and on the smoother, because
/// its estimates are delayed.
[[nodiscard]] Result<LocalizationKind> parse_replay_method(const std::string& name);

/// Sets the method and the controller of the job by name. Fails also if the number of laps is invalid.
[[nodiscard]] Status choose_replay(const std::string& method, const std::string& controller, ReplayJob& job);
/// Fails if images should be recorded but there is no recording or there are no images.
[[nodiscard]] Status check_recording(const ReplayJob& job, const RobotSetup& setup);

/// The files that a replay reads.
struct ReplayFiles : MapFolder {
  Trajectory taught{};  ///< true path of the teach lap; empty if unknown
};

/// Reads the files from the folder of the job.
[[nodiscard]] Result<ReplayFiles> load_replay(const ReplayJob& job, const JobControl& control);
/// Fails if an open route should be driven for more or less than one lap, or if the speed cannot be
/// distinguished from zero.
[[nodiscard]] Status check_drive(const ReplayJob& job, const Route& route);
/// The Replayer setup for this job.
[[nodiscard]] ReplayerSetup replayer_setup(const ReplayJob& job);

struct ReplayReport {
  ReplayEnd end{};
  double route_length_m = 0;
  Trajectory true_path{};
  Trajectory taught_path{};                    ///< true path of the teach lap; empty if unknown
  std::optional<ReplayJudgement> judgement{};  ///< set only if the ground truth of both the replay and the
                                               ///< teach lap is known
  std::vector<StationVisit> visits{};
  std::vector<std::string> warnings{};
  double allowed_s = 0;  ///< maximum simulated time, after which the replay is aborted
  double wall_s = 0;
};

/// Passes a warning to the control, before the drive, if the limiter will stop at a tag beside the route.
void note_near_tags(const MapFolder& folder, const RobotModel& robot, const ReplayJob& job,
                    const JobControl& control);

/// Distance along the route that a replay will drive for this job [m].
[[nodiscard]] double goal_m(const Route& route, const ReplayJob& job);

/// Simulated time after which a replay is aborted. It is one minute plus three times the time needed for
/// driving at the requested speed and for the stops at stations. If three times the driving time is less than
/// that at 0.05 m/s, the latter is used instead.
[[nodiscard]] double time_allowed_s(const Route& route, const ReplayJob& job, const RobotModel& robot);

/// The job with the maximum speed of the limiter reduced to this speed.
[[nodiscard]] ReplayJob slowed(ReplayJob job, double max_speed_m_s);
/// Warnings about requested speeds that exceed the maximum of the limiter or of the robot.
[[nodiscard]] std::vector<std::string> speed_warnings(const ReplayJob& job, const Route& route,
                                                      const RobotModel& robot);

/// Starts the requested recording, with the map and the route as attachments; `nullopt` if no recording is
/// requested.
[[nodiscard]] Result<std::optional<SampleRecorder>> record_replay(const RobotSetup& setup,
                                                                  const ReplayJob& job);
/// Compares the true path with the taught one, or adds a warning that explains why this is impossible.
void judge(const RobotSetup& setup, ReplayReport& report);

/// Drives the route in the folder with the robot of the setup, which is either simulated or a process.
[[nodiscard]] Result<ReplayReport> replay_route(const RobotSetup& setup, const ReplayJob& job,
                                                const JobControl& control);

/// The state and its reason: "stopped: a tag is near". If the reason starts with the state, returns only the
/// reason.
[[nodiscard]] std::string with_reason(std::string_view state, std::string_view reason);

/// Describes how the replay ended: "stopped 3.10 m along a route of 17.40 m: …". `stopped_by` describes who
/// cancelled it.
[[nodiscard]] std::string ending(const ReplayReport& report, std::string_view stopped_by = "its caller");
/// The same, followed by one line each for stops, stations and errors.
[[nodiscard]] std::string to_text(const ReplayReport& report, std::string_view stopped_by = "its caller");
/// Whether the robot drove all requested laps.
[[nodiscard]] bool succeeded(const ReplayReport& report);
/// The keys of `json`; errors are null without ground truth.

[[nodiscard]] ReportFields fields(const ReplayReport& report);
[[nodiscard]] ReportFields fields(const StationVisit& visit);

/// A replay with a robot process, and the objects it needs.
class LiveReplay {
 public:
  /// `on_step` is called with each decision before it is recorded.
  static Result<std::unique_ptr<LiveReplay>> make(const RobotSetup& setup, const ReplayJob& job,
                                                  const ReplayFiles& files, const JobControl& control,
                                                  std::function<void(const ReplayStep&)> on_step,
                                                  SessionRequests requests = no_requests());

  [[nodiscard]] ReplaySession& session() { return *session_; }
  /// Closes the recording and returns the report. It includes errors if the ground truth is known.
  [[nodiscard]] Result<ReplayReport> finish(const ReplayEnd& end);

 private:
  LiveReplay(RobotSetup setup, const ReplayFiles& files) : setup_(std::move(setup)), files_(files) {}

  RobotSetup setup_;  ///< contains the tags of the map if the world is unknown
  const ReplayFiles& files_;
  std::unique_ptr<Replayer> replayer_{};
  std::unique_ptr<ReplayLog> log_{};
  std::unique_ptr<ReplaySession> session_{};
};

}  // namespace waymark
