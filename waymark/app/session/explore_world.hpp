#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/localization/riekf_localizer.hpp"
#include "waymark/replay/explore.hpp"

namespace waymark {

struct ExploreJob {
  std::string map{};  ///< map.yaml or its folder; empty: the tags of the world
  double minutes = 3;
  std::string output{};  ///< recording to write; empty: none
  ExploreOptions explore{};
  RiekfOptions filter{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.map, JobField("map PATH",
                             "Map of the tags: map.yaml or its folder. Default: the tags of the world with "
                             "the errors of a manual survey"));
    visit(self.minutes, JobField("minutes NUMBER", "Duration of the drive", 0.01, 10000.0));
    visit(self.output, JobField("output FILE", "Recording to write of the drive (.mcap)"));
  }
};

struct ExploreReport {
  bool interrupted = false;
  std::string halt_reason{};  ///< why the robot was stopped at the end; empty: it was driving
  double seconds = 0;
  double distance_m = 0;
  int turns = 0;
  std::vector<std::string> seen{};  ///< observed map tags
  std::size_t tags = 0;             ///< number of map tags
  int collisions = 0;               ///< of the hull, by ground truth
  double nearest_m = 0;             ///< smallest distance from the hull to an obstacle, by ground truth
  std::size_t estimates = 0;        ///< number of poses, twenty per second from the first one on
  double certain_fraction = 0;      ///< share of the time with a certain pose
  /// Errors of certain poses against ground truth; nothing if there was none.
  std::optional<double> position_rmse_m{};
  std::optional<double> position_p95_m{};
  std::optional<double> position_max_m{};
  std::optional<double> heading_rmse_deg{};
  double wall_s = 0;
};

/// Drives the robot at random through the world while it is localised. Cancelling stops the robot and closes
/// the file.
[[nodiscard]] Result<ExploreReport> explore_world(RobotSetup setup, const ExploreJob& job,
                                                  const JobControl& control);
[[nodiscard]] std::string to_text(const ExploreReport& report);
[[nodiscard]] ReportFields fields(const ExploreReport& report);

}  // namespace waymark
