#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/simulation/world/world.hpp"

/// `waymark world export`: writes a world and a robot for Gazebo Fortress.
namespace waymark {

/// User options for an export.
struct ExportWorldRequest {
  std::string world{};
  std::string folder{};  ///< see ExportWorldJob::folder
  std::string robot_file = "limo-gazebo";

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.world, JobField("world WORLD", kWorldNames).input().required());
    visit(self.folder, JobField("sdf FOLDER", "New or empty folder for world.sdf").required());
    visit(
        self.robot_file,
        JobField(
            "robot_file NAME",
            "Body and camera of the robot: a name that `waymark robots` lists, or the path of a .yaml file"));
  }
};

struct ExportWorldJob {
  World world{};
  RobotDescription robot;
  std::string robot_yaml{};        ///< content of the robot file
  std::filesystem::path folder{};  ///< output folder, new or empty
};

struct ExportWorldReport {
  std::vector<std::string> files{};
  std::vector<std::string> notes{};  ///< differences between the world and the exported SDF
  std::size_t tags = 0;
  std::string anchor{};   ///< anchor for teaching; empty if the world has no tags
  double tag_size_m = 0;  ///< size of the anchor tag
};

/// Writes world.sdf with the tag bitmaps (write_sdf_world()), robot.yaml, and gazebo.yaml, the profile used
/// by Waymark to drive the robot in Gazebo. Fails if the folder is not empty.
[[nodiscard]] Result<ExportWorldReport> export_world(const ExportWorldJob& job);
[[nodiscard]] std::string to_text(const ExportWorldReport& report, const std::filesystem::path& folder);
[[nodiscard]] ReportFields fields(const ExportWorldReport& report);

}  // namespace waymark
