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
  std::string map{};  ///< map.yaml or its folder; if empty, the tags of the world are used
  double minutes = 3;
  std::string output{};  ///< path of the recording to write; none is written if empty
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
  std::string halt_reason{};  ///< why the robot was stationary at the end; empty if it was driving
  double seconds = 0;
  double distance_m = 0;
  int turns = 0;
  std::vector<std::string> seen{};  ///< map tags that were observed
  std::size_t tags = 0;             ///< number of map tags
  int collisions = 0;               ///< collisions of the hull, according to ground truth
  double nearest_m = 0;             ///< smallest distance between the hull and an obstacle, according to
                                    ///< ground truth
  std::size_t estimates = 0;        ///< number of poses, at twenty per second from the first one on
  double certain_fraction = 0;      ///< fraction of the time in which the pose was certain
  /// Errors of certain poses relative to ground truth; `nullopt` if there were none.
  std::optional<double> position_rmse_m{};
  std::optional<double> position_p95_m{};
  std::optional<double> position_max_m{};
  std::optional<double> heading_rmse_deg{};
  double wall_s = 0;
};

/// Drives the robot through the world at random while localising it. Cancelling stops the robot and closes
/// the file.
[[nodiscard]] Result<ExploreReport> explore_world(RobotSetup setup, const ExploreJob& job,
                                                  const JobControl& control);
[[nodiscard]] std::string to_text(const ExploreReport& report);
[[nodiscard]] ReportFields fields(const ExploreReport& report);

}  // namespace waymark
