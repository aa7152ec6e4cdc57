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

/// The files of an operator's session: nothing that was there is written over.
namespace waymark {

/// "lap.mcap", or "lap.2.mcap" where that is taken.
[[nodiscard]] std::string free_name(const std::filesystem::path& folder, const std::string& stem);

/// Makes a map of a recorded lap in a folder; without a word, on whatever thread it is called.
using MapMaker = std::function<Status(const std::string& lap, const std::filesystem::path& folder)>;

/// A map that is made on a thread of its own beside its folder: NAME.new. What a session that was cut off
/// left there is removed.
class MapInTheMaking {
 public:
  void begin(const MapMaker& make, const std::string& lap, const std::filesystem::path& folder);
  /// Begun and not taken.
  [[nodiscard]] bool under_way() const { return made_.valid(); }
  [[nodiscard]] bool ready() const;
  /// Waits for the map and puts it in its place. What was there becomes NAME.1, or the next number that is
  /// free; where that is, or empty when nothing was there.
  [[nodiscard]] Result<std::string> take();
  /// Since it was begun.
  [[nodiscard]] double seconds() const;

 private:
  std::filesystem::path folder_{};
  std::future<Status> made_{};
  std::chrono::steady_clock::time_point began_{};
};

// The operator's session with its files: teach, map, replay, with one button.

class LiveFeed;

struct SessionJob {
  std::filesystem::path folder;  ///< of what is written: lap.mcap, map/, replay.mcap
  std::string map{};             ///< folder of a map that is there already: the session begins with ready
  std::string driver = "gamepad";
  double speed_m_s = kUsualSpeed_m_s;
  std::string images{};      ///< how pictures are recorded: raw, jpeg; empty: not at all
  ReplayJob replay{};        ///< method, options; folder and output are the session's
  MapMaker make_map{};       ///< empty: map_recording()
  LiveFeed* feed = nullptr;  ///< of viewers, if there are any
};

/// What a user says of a session, but options.
struct SessionWords {
  SessionJob job{};
  std::string calibration{};  ///< calibration.yaml; empty: none
  bool images = false;        ///< the simulated robot sends pictures
  double pace = 1;            ///< of a simulated robot that is watched; 0: as fast as possible
  LoneAnchor anchor{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.job.folder,
          JobField("output FOLDER", "Folder for what is written: lap.mcap, map/, replay.mcap").required());
    visit(
        self.job.driver,
        JobField(
            "driver NAME",
            "Source of the operator's commands: gamepad, keyboard, lines (go, stop, quit and drive 0.3 -0.1 "
            "on standard input), scripted (with --world) or page (with --view, and then the default)"));
    visit(self.job.map,
          JobField("map FOLDER", "Folder of an existing map, which makes teaching unnecessary"));
    visit(self.job.replay.route,
          JobField("route NAME", "With `map`: a route of that name (`waymark routes`)").less());
    visit(self.job.images,
          JobField("record_images HOW",
                   "Also record the pictures, of laps and replays: jpeg, or raw, ten times as large")
              .one_of("jpeg,raw")
              .less());
    visit(self.calibration,
          JobField(
              "calibration FILE",
              "Calibration of this robot (calibration.yaml), also the initial values of what replays learn")
              .less());
    visit(self.job.speed_m_s,
          JobField("speed_m_s FLOAT", "Speed at full forward deflection of the stick", 0.01, 5.0));
    visit(self.job.replay.replay.laps,
          JobField("laps NUMBER", "Number of laps of a closed route", 0.01, 1000.0));
    visit(self.images, JobField("images", "Let the simulated robot send pictures"));
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
  std::vector<double> mapping_s{};  ///< from the end of each lap to its map
  bool map_failed = false;          ///< the last lap could not be mapped
  std::vector<ReplayReport> replays{};
  bool interrupted = false;
  std::string state{};   ///< the last one
  std::string reason{};  ///< of the last stop or failure
  double wall_s = 0;
};

/// Fails on a route of a map that is not there.
[[nodiscard]] Status check_session(const SessionJob& job);

/// Runs the session until the operator ends it, or the control cancels it. The setup must have a process.
[[nodiscard]] Result<SessionReport> run_session(const RobotSetup& setup, const SessionJob& job,
                                                const JobControl& control);
/// The same with an input that is there already; `driver` is then a name for the recordings.
[[nodiscard]] Result<SessionReport> run_session(const RobotSetup& setup, const SessionJob& job,
                                                std::unique_ptr<OperatorInput> input,
                                                const JobControl& control);
/// Whether every replay came to its end, and the last lap could be mapped.
[[nodiscard]] bool succeeded(const SessionReport& report);
/// Laps, and how each replay ended.
[[nodiscard]] std::string to_text(const SessionReport& report, std::string_view stopped_by = "its caller");
[[nodiscard]] ReportFields fields(const SessionReport& report);

/// Fails on flags that have no effect with this robot and this driver; `view`: it is watched.
[[nodiscard]] Status check_effects(const SessionWords& words, const RobotSetup& setup, bool view,
                                   const GivenFields& given);

}  // namespace waymark
