#include "waymark/app/robot/robot_ways.hpp"

#include <fmt/format.h>

#include "waymark/app/common/robot_text.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/config/robot_list.hpp"
#include "waymark/config/share.hpp"
#include "waymark/robots/gazebo/profile.hpp"
#include "waymark/robots/ros2/profile.hpp"

namespace waymark {
namespace {

std::string topics_of(const GazeboProfile& profile) {
  std::string words = fmt::format("commands {}, odometry {}", profile.command_topic, profile.odometry_topic);
  if (!profile.image_topic.empty()) words += ", pictures " + profile.image_topic;
  return words;
}

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

/// The profiles of this kind that are of the robot.
template <class Find>
void add_profiles(const std::string& kind, const Find& find, const std::string& robot,
                  std::vector<std::string>& ways) {
  const auto profiles = list_shared(kind);
  if (!profiles) return;
  for (const ListedFile& listed : *profiles) {
    const auto profile = find(listed.path.string());
    if (profile && profile->robot == robot)
      ways.push_back(fmt::format("--robot {}:{} ({})", kind, listed.name, topics_of(*profile)));
  }
}

}  // namespace

std::vector<std::string> ways_to_reach(const std::string& robot) {
  std::vector<std::string> ways;
  for (const RobotKind& kind : robot_kinds())
    if (kind.name == robot)
      ways.push_back(fmt::format("--robot {}:{} ({})", kind.name, kind.address, kind.help));
  add_profiles("ros2", find_ros2_profile, robot, ways);
  add_profiles("gazebo", find_gazebo_profile, robot, ways);
  ways.push_back(fmt::format("--robot process:CMD --robot-file {} (docs/formats/robot-process.md)", robot));
  return ways;
}

Result<RobotTable> robot_table() {
  const auto robots = list_shared("robots");
  if (!robots) return tl::unexpected(robots.error());
  RobotTable table;
  for (const ListedFile& listed : *robots) {
    const auto shown = read_commented_robot(listed.path);
    if (shown)
      table.text += fmt::format("{:<20} {}\n", listed.name, first_sentence(shown->comment));
    else
      table.errors.push_back(shown.error());
  }
  return table;
}

Result<std::string> explained_robot(const std::string& name) {
  const auto path = find_shared("robots", name);
  const auto shown = path ? read_commented_robot(*path) : tl::unexpected(path.error());
  if (!shown) return tl::unexpected(shown.error());
  std::string text = robot_text(shown->robot, shown->comment);
  text += fmt::format("file: {}\n", path->string());
  for (const std::string& way : ways_to_reach(shown->robot.model.name)) text += way + "\n";
  return text;
}

}  // namespace waymark
