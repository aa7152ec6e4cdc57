#include "waymark/app/replay/robot_difference.hpp"

#include <cmath>
#include <system_error>
#include <variant>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/share.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr double kSame_m = 1e-3;
constexpr double kSame_deg = 0.1;
constexpr double kSameShare = 0.01;  // relative to the focal length

bool differ(double a, double b) { return std::abs(a - b) > kSame_m; }

bool differ(const Hull& a, const Hull& b) {
  return differ(a.front_m, b.front_m) || differ(a.rear_m, b.rear_m) || differ(a.width_m, b.width_m) ||
         differ(a.height_m, b.height_m);
}

/// Focal lengths and principal point [px].
Eigen::Vector4d focus(const CameraModel& camera) {
  return std::visit([](const auto& m) { return Eigen::Vector4d(m.fx, m.fy, m.cx, m.cy); },
                    camera.projection());
}

bool differ(const CameraModel& a, const CameraModel& b) {
  if (a.width_px() != b.width_px() || a.height_px() != b.height_px()) return true;
  if (a.projection().index() != b.projection().index()) return true;
  return (focus(a) - focus(b)).cwiseAbs().maxCoeff() > kSameShare * focus(a)[0];
}

}  // namespace

std::vector<std::string> robot_differences(const RobotDescription& taught, const RobotDescription& now) {
  std::vector<std::string> found;
  if (differ(taught.model.hull, now.model.hull)) found.emplace_back("hull");
  if (differ(taught.model.wheel_radius_m, now.model.wheel_radius_m) ||
      differ(taught.model.track_m, now.model.track_m))
    found.emplace_back("wheels");
  if (differ(taught.camera, now.camera)) found.emplace_back("camera");
  const SE3 between = taught.model.base_T_cam.inverse() * now.model.base_T_cam;
  const double apart_m = between.translation().norm();
  const double apart_deg = to_degrees(between.rotation().log().norm());
  if (apart_m > kSame_m || apart_deg > kSame_deg)
    found.push_back(fmt::format("camera mounting by {:.3f} m and {:.1f} deg", apart_m, apart_deg));
  return found;
}

std::vector<std::string> robot_difference_warnings(const RobotSetup& setup, const fs::path& map_folder) {
  const fs::path taught = map_folder / "robot.yaml";
  std::error_code ignored;
  if (!fs::exists(taught, ignored)) return {};
  const std::string name = printable(setup.simulated.model.name);
  if (!fs::equivalent(taught, setup.robot_path, ignored)) {
    const auto other = read_robot(taught);
    if (!other) return {};  // code that needs the file will report the error
    const auto found = robot_differences(*other, setup.robot());
    if (found.empty()) return {};
    return {
        fmt::format("the lap of this map was driven by another robot: {} differs from {} in {}. The map "
                    "is valid; body and camera are those of {}",
                    setup.robot_path, taught.string(), fmt::join(found, ", "), name)};
  }
  const auto usual = find_shared("robots", setup.usual_robot_file);
  if (setup.usual_robot_file.empty() || !usual) return {};
  const auto other = read_robot(*usual);
  if (!other || other->model.name == setup.simulated.model.name) return {};
  const auto found = robot_differences(*other, setup.robot());
  if (found.empty()) return {};
  return {
      fmt::format("body and camera are those of the taught robot ({}: {}), which differs from "
                  "'{}' in {}. If this robot is a {}, give `robot_file={}`",
                  taught.string(), name, setup.usual_robot_file, fmt::join(found, ", "),
                  setup.usual_robot_file, setup.usual_robot_file)};
}

}  // namespace waymark
