#include "waymark/live/robot_ways.hpp"

#include <fmt/format.h>

#include "waymark/config/robot_list.hpp"
#include "waymark/drivers/ros2/profile.hpp"
#include "waymark/live/robot_kinds.hpp"

namespace waymark {
namespace {

std::string topics_of(const Ros2Profile& profile) {
  std::string words = fmt::format("commands {}, odometry {}", profile.command_topic, profile.odometry_topic);
  const auto add = [&](const char* what, const std::string& topic) {
    if (!topic.empty()) words += fmt::format(", {} {}", what, topic);
  };
  add("IMU", profile.imu_topic);
  add("pictures", profile.image_topic);
  add("pictures", profile.compressed_image_topic);
  add("tags", profile.detections_topic);
  add("scans", profile.scan_topic);
  return words;
}

}  // namespace

std::vector<std::string> ways_to_reach(const std::string& robot) {
  std::vector<std::string> ways;
  for (const RobotKind& kind : robot_kinds())
    if (kind.name == robot)
      ways.push_back(fmt::format("--robot {}:{} ({})", kind.name, kind.address, kind.help));
  const auto profiles = list_shared("ros2");
  if (profiles)
    for (const ListedFile& listed : *profiles) {
      const auto profile = find_ros2_profile(listed.path.string());
      if (profile && profile->robot == robot)
        ways.push_back(fmt::format("--robot ros2:{} ({})", listed.name, topics_of(*profile)));
    }
  ways.push_back(fmt::format("--robot process:CMD --robot-file {} (docs/formats/robot-process.md)", robot));
  return ways;
}

}  // namespace waymark
