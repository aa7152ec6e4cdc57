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
                             "Map of the tags: map.yaml or its folder. Unless given: the tags of the world, "
                             "as a person measured them"));
    visit(self.minutes, JobField("minutes NUMBER", "Duration of the drive", 0.01, 10000.0));
    visit(self.output, JobField("output FILE", "Recording to write of the drive (.mcap)"));
  }
};

struct ExploreReport {
  bool interrupted = false;
  std::string stands{};  ///< why the robot stood at the end; empty when it drove
  double seconds = 0;
  double distance_m = 0;
  int turns = 0;
  std::vector<std::string> seen{};  ///< tags of the map
  std::size_t tags = 0;             ///< of the map
  int collisions = 0;               ///< by the truth: times the hull met something
  double nearest_m = 0;             ///< by the truth: hull to the nearest thing, at the least
  std::size_t estimates = 0;        ///< twenty a second, once there is one
  double certain_fraction = 0;      ///< of the time the place was known
  /// By the truth, while the place was known; nothing when it never was.
  std::optional<double> position_rmse_m{};
  std::optional<double> position_p95_m{};
  std::optional<double> position_max_m{};
  std::optional<double> heading_rmse_deg{};
  double wall_s = 0;
};

/// Lets the robot wander through the world while it localises itself. Cancelling stops the robot and closes
/// the file.
[[nodiscard]] Result<ExploreReport> explore_world(RobotSetup setup, const ExploreJob& job,
                                                  const JobControl& control);
[[nodiscard]] std::string to_text(const ExploreReport& report);
[[nodiscard]] ReportFields fields(const ExploreReport& report);

}  // namespace waymark
