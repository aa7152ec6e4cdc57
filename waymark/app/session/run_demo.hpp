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
  ReplayJob replay{};  ///< laps and options; the files and the noise are set by the demo

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.folder, JobField("output FOLDER", "Folder for recordings, map and figures"));
    visit(self.replay.replay.laps, JobField("laps NUMBER", "Number of laps of the replay", 0.01, 1000.0));
    visit(self.images,
          JobField("images", "Render camera images, detect tags in them, and record them as JPEG"));
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

/// Prepares the folder and removes recordings from an earlier demo. Fails without changing anything if the
/// folder contains a lap or a map that was not written by a demo.
[[nodiscard]] Status clear_demo_folder(const std::string& folder);
/// Teaches a lap, maps it and replays it, and writes figures and the report. An error names the step that
/// failed.
[[nodiscard]] Result<DemoReport> run_demo(const RobotSetup& setup, const DemoJob& job,
                                          const JobControl& control);
/// One line per value: step, name, value.
[[nodiscard]] std::string to_text(const DemoReport& report);
/// The same, preceded by a line with the world and the robot, and followed by a line with the time and the
/// folder.
[[nodiscard]] std::string to_text(const DemoReport& report, const RobotSetup& setup, const DemoJob& job);
[[nodiscard]] ReportFields fields(const DemoReport& report);

}  // namespace waymark
