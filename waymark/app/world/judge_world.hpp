#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/share.hpp"
#include "waymark/simulation/world/world_check.hpp"

/// `waymark world check` checks whether a robot can drive a good lap in a world, and `waymark world orbit`
/// whether its frames are consistent.
namespace waymark {

/// User options for a world check.
struct CheckWorldRequest {
  std::string world{};
  std::string robot_file{};  ///< if empty, the robot named in the world file

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.world, JobField("world WORLD", kWorldNames).input().required());
    visit(self.robot_file,
          JobField("robot_file NAME",
                   "Body and camera of the robot: a name that `waymark robots` lists, or the path of a .yaml "
                   "file. Default: the robot named in the world file, or limo"));
  }
};

/// Minimum requirements for a good lap.
inline constexpr double kGoodLapClearance_m = 0.35;
inline constexpr double kGoodLapTwoTags = 0.98;

struct WorldVerdict {
  std::string world{};   ///< name of the world
  std::string robot{};   ///< name of the robot
  std::size_t tags = 0;  ///< number of tags
  WorldCheck check{};
  std::vector<std::string> warnings{};  ///< warnings about probable mistakes
  bool good = false;                    ///< whether there are no warnings and the line allows a good lap
};

/// Checks a drive that follows the line in the world exactly and without noise.
[[nodiscard]] Result<WorldVerdict> judge_world(const World& world, const RobotModel& robot,
                                               const CameraModel& camera, const TagCameraOptions& tag_camera);
/// Name of the tag nearest to the hull, or "no tag" if the world has none.
[[nodiscard]] std::string nearest_tag(const WorldCheck& check);
[[nodiscard]] std::string to_text(const WorldVerdict& verdict, const World& world, const RobotModel& robot);
[[nodiscard]] ReportFields fields(const WorldVerdict& verdict);

/// Plots the nominal and the composed camera poses on an orbit (.svg, .png or .pdf).
[[nodiscard]] Status write_orbit(const std::string& path, const World& world, const OrbitReport& report);
[[nodiscard]] std::string to_text(const OrbitReport& report, const World& world);

/// Report for `waymark world orbit`.
struct WorldOrbit {
  std::string world{};  ///< name of the world
  OrbitReport orbit{};
};
[[nodiscard]] ReportFields fields(const WorldOrbit& report);

}  // namespace waymark
