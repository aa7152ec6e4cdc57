#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/runtime/localize_session.hpp"

/// `waymark localize` of a robot that somebody else drives.
namespace waymark {

class LiveFeed;

struct LocalizeRobotJob {
  LocalizeJob localize{};  ///< of its output a recording holds every sample; `logs` and `adapt` mean nothing
  std::string images{};    ///< how pictures are recorded: raw, jpeg; empty: not at all
  LocalizeSessionOptions session{};
  LiveFeed* feed = nullptr;  ///< of viewers, if there are any
  /// LocalizeListener::on_report.
  std::function<void(SensorTime, const std::optional<LocalizationEstimate>&)> on_report =
      [](SensorTime, const std::optional<LocalizationEstimate>&) {};
};

struct LocalizeRobotReport {
  LocalizeReport localized{};
  LocalizeEnd end{};
};

/// Makes the robot of load_kind() one that is heard and never commanded.
void only_listen(RobotSetup& setup);

/// A robot KIND:ADDRESS that is only heard, with cameras of this computer (add_live_cameras()). Described by
/// `robot_file`; empty: robot.yaml beside the map, else as the kind says.
[[nodiscard]] Result<RobotSetup> load_listening_robot(const std::string& robot, const std::string& robot_file,
                                                      const std::filesystem::path& map,
                                                      const std::vector<std::string>& camera_sources);

/// Localises the robot of the setup until somebody ends it, or the control cancels it. Nothing is sent to the
/// robot. Fails where the robot waits for its commands (lockstep), as localize() does, and when the robot's
/// process ends; what was recorded by then is kept.
[[nodiscard]] Result<LocalizeRobotReport> localize_robot(const RobotSetup& setup, const LocalizeRobotJob& job,
                                                         const JobControl& control);

}  // namespace waymark
