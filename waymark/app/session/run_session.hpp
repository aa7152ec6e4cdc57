#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <string>
#include <vector>

#include "waymark/app/common/field_refusals.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/replay/replay_route.hpp"
#include "waymark/app/teach/teach_lap.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/runtime/operator_session.hpp"

/// Manages the files of an operator's session. Existing files are not overwritten.
namespace waymark {

/// Returns "lap.mcap", or "lap.2.mcap" if that file exists.
[[nodiscard]] std::string free_name(const std::filesystem::path& folder, const std::string& stem);

/// Maps a recorded lap into a folder. May be called on any thread; prints nothing.
using MapMaker = std::function<Status(const std::string& lap, const std::filesystem::path& folder)>;

/// Creates a map on its own thread, in the folder NAME.new next to the target folder. Removes any files left
/// there by an interrupted session.
class MapInTheMaking {
 public:
  void begin(const MapMaker& make, const std::string& lap, const std::filesystem::path& folder);
  /// Whether mapping has been started and the map has not yet been moved to the target folder.
  [[nodiscard]] bool under_way() const { return made_.valid(); }
  [[nodiscard]] bool ready() const;
  /// Waits for the map and moves it to the target folder. An existing folder is renamed to NAME.1, or the
  /// next free number. Returns its new name; empty if there was none.
  [[nodiscard]] Result<std::string> take();
  /// Time since mapping was started.
  [[nodiscard]] double seconds() const;

 private:
  std::filesystem::path folder_{};
  std::future<Status> made_{};
  std::chrono::steady_clock::time_point began_{};
};

// An operator's session with its files: teach, map and replay with one button.

class LiveFeed;

struct SessionJob {
  std::filesystem::path folder;  ///< folder for lap.mcap, map/ and replay.mcap
  std::string map{};             ///< folder of an existing map; if set, the session starts in the state ready
  std::string driver = "gamepad";
  double speed_m_s = kUsualSpeed_m_s;
  std::string images{};      ///< format of recorded images (raw, jpeg); they are not recorded if empty
  ReplayJob replay{};        ///< method and options; the session sets the folder and the output
  MapMaker make_map{};       ///< creates the map; map_recording() if empty
  LiveFeed* feed = nullptr;  ///< feed for viewers; may be nullptr
};

/// A session as requested by the user, without option structs.
struct RunRequest {
  SessionJob job{};
  std::string calibration{};  ///< path of calibration.yaml; empty if there is none
  bool images = false;        ///< whether the simulated robot sends images
  double pace = 1;            ///< real-time factor of a simulated robot with a page; as fast as possible if 0
  LoneAnchor anchor{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.job.folder, JobField("output FOLDER", "Folder for lap.mcap, map/ and replay.mcap").required());
    visit(
        self.job.driver,
        JobField(
            "driver NAME",
            "Source of the operator's commands: gamepad, keyboard, lines (go, stop, quit and drive 0.3 -0.1 "
            "on standard input), scripted (with `world`) or page (with `view`, where it is the default)"));
    visit(self.job.map,
          JobField("map FOLDER", "Folder of an existing map, which makes teaching unnecessary"));
    visit(self.job.replay.route,
          JobField("route NAME", "With `map`: a route of that name (`waymark routes`)").less());
    visit(self.job.images,
          JobField("record_images HOW",
                   "Also record the images of laps and replays: jpeg, or raw, ten times as large")
              .one_of("jpeg,raw")
              .less());
    visit(self.calibration,
          JobField("calibration FILE",
                   "Calibration of this robot (calibration.yaml), also with initial values for replays")
              .less());
    visit(self.job.speed_m_s,
          JobField("speed_m_s FLOAT", "Speed at full forward deflection of the stick", 0.01, 5.0));
    visit(self.job.replay.replay.laps,
          JobField("laps NUMBER", "Number of laps of a closed route", 0.01, 1000.0));
    visit(self.images, JobField("images", "Render images of the simulated robot"));
    visit(self.pace, JobField("pace FLOAT",
                              "Real-time factor with `view` and a simulated robot: simulated seconds per "
                              "second; 0: as fast as possible",
                              0.0, 100.0)
                         .less());
    LoneAnchor::fields(self.anchor, visit);
  }
};

struct SessionReport {
  int laps_taught = 0;
  std::vector<double> mapping_s{};  ///< time from the end of each lap until its map is complete
  bool map_failed = false;          ///< whether the last lap could not be mapped
  std::vector<ReplayReport> replays{};
  bool interrupted = false;
  std::string state{};   ///< the final state
  std::string reason{};  ///< reason for the last stop or failure
  double wall_s = 0;
};

/// Fails if a route is specified without a map, or does not exist.
[[nodiscard]] Status check_session(const SessionJob& job);

/// Runs the session until the operator ends it, or the control cancels it. The setup must have a process.
[[nodiscard]] Result<SessionReport> run_session(const RobotSetup& setup, const SessionJob& job,
                                                const JobControl& control);
/// The same with an existing input; `driver` is then only the name stored in the recordings.
[[nodiscard]] Result<SessionReport> run_session(const RobotSetup& setup, const SessionJob& job,
                                                std::unique_ptr<OperatorInput> input,
                                                const JobControl& control);
/// Whether every replay was completed and the last lap was mapped.
[[nodiscard]] bool succeeded(const SessionReport& report);
/// The number of laps, and how each replay ended.
[[nodiscard]] std::string to_text(const SessionReport& report, std::string_view stopped_by = "its caller");
[[nodiscard]] ReportFields fields(const SessionReport& report);

/// Fails if fields are set that have no effect for this robot and driver. `view` is true if there is a page.
[[nodiscard]] Status check_effects(const RunRequest& request, const RobotSetup& setup, bool view,
                                   const GivenFields& given);

}  // namespace waymark
