#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/base/error.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/simulation/world.hpp"

/// `waymark world export`: a simulated place and robot for Gazebo Fortress.
namespace waymark {

struct ExportWorldJob {
  World world{};
  RobotDescription robot;
  std::string robot_yaml{};        ///< text of the robot's file
  std::filesystem::path folder{};  ///< to write; not there yet, or empty
};

struct ExportWorldReport {
  std::vector<std::string> files{};
  std::vector<std::string> notes{};  ///< what Gazebo shows otherwise
  std::size_t tags = 0;
  std::string anchor{};   ///< what teaching in it has to be told; empty: the world has no tag
  double tag_size_m = 0;  ///< of the anchor
};

/// Writes world.sdf with the bitmaps of its tags (write_sdf_world()), robot.yaml, and gazebo.yaml, the
/// profile by which Waymark drives the robot in it.
[[nodiscard]] Result<ExportWorldReport> export_world(const ExportWorldJob& job);
[[nodiscard]] std::string to_text(const ExportWorldReport& report, const std::filesystem::path& folder);
[[nodiscard]] nlohmann::ordered_json to_json(const ExportWorldReport& report);

}  // namespace waymark
