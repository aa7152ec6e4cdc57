#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/share.hpp"
#include "waymark/simulation/world/world_check.hpp"

/// `waymark world check` and `waymark world orbit`: whether a robot can drive in a world.
namespace waymark {

/// User options of a world check.
struct CheckWorldRequest {
  std::string world{};
  std::string robot_file{};  ///< empty: that of the world

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.world, JobField("world WORLD", kWorldNames).input().required());
    visit(self.robot_file,
          JobField("robot_file NAME",
                   "Body and camera of the robot: a name that `waymark robots` lists, or the path of a .yaml "
                   "file. Unless given: the robot that the world names, or limo"));
  }
};

/// Limits of a good lap.
inline constexpr double kGoodLapClearance_m = 0.35;
inline constexpr double kGoodLapTwoTags = 0.98;

struct WorldVerdict {
  std::string world{};   ///< name
  std::string robot{};   ///< name
  std::size_t tags = 0;  ///< of the world
  WorldCheck check{};
  std::vector<std::string> doubts{};  ///< warnings about probable mistakes
  bool good = false;                  ///< no warnings, and the line allows a good lap
};

/// Drives the world's line exactly, without noise.
[[nodiscard]] Result<WorldVerdict> judge_world(const World& world, const RobotModel& robot,
                                               const CameraModel& camera, const TagCameraOptions& tag_camera);
/// The tag nearest to the hull, by name.
[[nodiscard]] std::string nearest_tag(const WorldCheck& check);
[[nodiscard]] std::string to_text(const WorldVerdict& verdict, const World& world, const RobotModel& robot);
[[nodiscard]] ReportFields fields(const WorldVerdict& verdict);

/// Draws the circle of an orbit (.svg, .png or .pdf).
[[nodiscard]] Status write_orbit(const std::string& path, const World& world, const OrbitReport& report);
[[nodiscard]] std::string to_text(const OrbitReport& report, const World& world);

/// Report of `waymark world orbit`.
struct WorldOrbit {
  std::string world{};  ///< name
  OrbitReport orbit{};
};
[[nodiscard]] ReportFields fields(const WorldOrbit& report);

}  // namespace waymark
