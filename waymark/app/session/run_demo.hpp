#pragma once

#include <string>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/app/replay/replay_route.hpp"
#include "waymark/app/teach/teach_lap.hpp"
#include "waymark/base/fields.hpp"

namespace waymark {

struct DemoJob {
  std::string folder = "demo";
  bool images = false;
  ReplayJob replay{};  ///< laps, options; files and noise are the demo's

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.folder, JobField("output FOLDER", "Folder for recordings, map and figures"));
    visit(self.replay.replay.laps, JobField("laps NUMBER", "Number of laps of the replay", 0.01, 1000.0));
    visit(self.images,
          JobField("images", "Render camera pictures, detect tags in them, and record them as JPEG"));
    visit(self.replay.durable, JobField("durable", kDurableHelp).less());
  }
};

struct DemoReport {
  TeachReport teach{};
  MapReport map{};
  ReplayReport replay{};
  std::vector<std::string> figures{};
  double wall_s = 0;
};

/// Makes the folder ready: a demo may be run again, and its own recordings of last time go. A lap or a map of
/// somebody else stays, and fails.
[[nodiscard]] Status clear_demo_folder(const std::string& folder);
/// Teach, map and replay in a row, figures and the report. What fails is said with the step it failed in.
[[nodiscard]] Result<DemoReport> run_demo(const RobotSetup& setup, const DemoJob& job,
                                          const JobControl& control);
/// A line a figure: what, and how good.
[[nodiscard]] std::string to_text(const DemoReport& report);
/// The same with the world and the robot before it, the time and the folder behind it.
[[nodiscard]] std::string to_text(const DemoReport& report, const RobotSetup& setup, const DemoJob& job);
[[nodiscard]] ReportFields fields(const DemoReport& report);

}  // namespace waymark
