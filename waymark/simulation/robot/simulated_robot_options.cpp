#include "waymark/simulation/robot/simulated_robot_options.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

Status one_of(const std::string& word, const char* key, const std::vector<std::string>& allowed) {
  if (std::ranges::find(allowed, word) != allowed.end()) return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("invalid value '{}'", word), {.key = key},
              suggestion(word, allowed));
}

}  // namespace

Status check(const SimulatedRobotOptions& options) {
  Status status = check_ranges(options);
  if (status) status = check_ranges(options.dynamics);
  if (status) status = check_ranges(options.sensors);
  if (status) status = check_ranges(options.tag_camera);
  if (status) status = check_ranges(options.lidar);
  if (status) status = one_of(options.dynamics.drive, "dynamics.drive", {"differential", "ackermann"});
  if (status)
    status = one_of(options.sensors.odometry, "sensors.odometry", {"gyro", "wheels", "imu_yaw", "truth"});
  return status;
}

}  // namespace waymark
