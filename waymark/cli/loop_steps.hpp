#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/cli/console.hpp"
#include "waymark/cli/lap_file.hpp"
#include "waymark/cli/replay_notes.hpp"
#include "waymark/evaluation/replay_judgement.hpp"
#include "waymark/jobs/map_lap.hpp"
#include "waymark/jobs/replay_setup.hpp"
#include "waymark/jobs/stopwatch.hpp"

namespace waymark {
class LiveFeed;
}

/// The steps of the loop with their files: what `waymark teach`, `map` and `replay` do, and `demo` in a row.
/// Each takes options and gives a report; the words and the exit code are the verb's.
namespace waymark::cli {

/// How fast people teach; a robot that cannot is driven as fast as it goes.
inline constexpr double kUsualSpeed_m_s = 0.3;

struct TeachJob {
  std::string output;  ///< recording to write
  std::string driver = "scripted";
  double speed_m_s = kUsualSpeed_m_s;  ///< that the driver means to drive
  double second_speed_m_s = 0;         ///< another in turn with it (scripted); 0: none
  double wander_m = 0.02;              ///< how far off the line (scripted), standard deviation
  double wander_time_s = 3;            ///< and how long that lasts
  double overlap_m = 1;                ///< how far past the start a closed lap is driven (scripted)
  bool durable = false;                ///< also a power cut loses at most a second
  std::string images{};                ///< how pictures are recorded: raw, jpeg; empty: not at all
  LiveFeed* feed = nullptr;            ///< of viewers, if there are any
};

/// The names that --driver takes.
[[nodiscard]] std::vector<std::string> teach_drivers();

struct TeachReport {
  TeachSummary summary{};
  LapEnd end{};
  double worst_blur_px = 0;  ///< by yaw rate, exposure and focal length
  int blurred_frames = 0;
  int abrupt_moments = 0;
  double wall_s = 0;
};

/// Records a lap that somebody drives. Ctrl-C stops the robot and closes the file.
[[nodiscard]] Result<TeachReport> teach_lap(const RobotSetup& setup, const TeachJob& job, Console& console);
[[nodiscard]] nlohmann::ordered_json to_json(const TeachReport& report, const std::string& file);

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

/// What calibration.yaml knows better than the robot's file: camera and mounting, the filter's scales, and
/// where the follower begins to learn the turn gain. An empty name changes nothing.
[[nodiscard]] Status take_calibration(const std::string& path, ReplayJob& job);

/// A method that a replay can use, by name. Fails on a name that is none, and on the smoother, which speaks
/// of the past.
[[nodiscard]] Result<LocalizationKind> parse_replay_method(const std::string& name);

/// What a replay needs from its files.
struct ReplayFiles : MapFolder {
  Trajectory taught{};  ///< the true way of the teach lap; empty when not known
};

/// Reads the folder of the job; fails in words.
[[nodiscard]] Result<ReplayFiles> load_replay(const ReplayJob& job);
/// Fails when several laps, or a part of one, are asked for on an open route.
[[nodiscard]] Status check_laps(const ReplayJob& job, const Route& route);
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
  double wall_s = 0;
};

/// How far a replay of the job goes along its route.
[[nodiscard]] double goal_m(const Route& route, const ReplayJob& job);

/// What is asked for and will not be driven: faster than the limiter lets pass.
[[nodiscard]] std::vector<std::string> speed_warnings(const ReplayJob& job, const Route& route);

/// The recording that the job asks for, with the map and the route it is driven by; nothing when it asks for
/// none.
[[nodiscard]] Result<std::optional<SampleRecorder>> record_replay(const RobotSetup& setup,
                                                                  const ReplayJob& job);
/// Holds the true path against the taught one, or says why that cannot be.
void judge(const RobotSetup& setup, ReplayReport& report);

/// Lets the robot of the setup drive the route of the folder.
[[nodiscard]] Result<ReplayReport> replay_route(const RobotSetup& setup, const ReplayJob& job,
                                                Console& console);
/// How it ended, in words: "stopped after 3.10 m of a route of 17.40 m: …".
[[nodiscard]] std::string ending(const ReplayReport& report);
/// The same with stops, stations and the judgement, a line each.
[[nodiscard]] std::string table(const ReplayReport& report);
/// Whether the robot drove the laps it was asked to.
[[nodiscard]] bool succeeded(const ReplayReport& report);
[[nodiscard]] nlohmann::ordered_json to_json(const ReplayReport& report);

}  // namespace waymark::cli
