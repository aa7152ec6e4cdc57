#include "waymark/app/common/robot_setup.hpp"

#include <cmath>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/config/share.hpp"

namespace waymark {
namespace {

struct Focal {
  double fx = 0, cx = 0, cy = 0;
};

Focal focal_of(const CameraModel& camera) {
  return std::visit([](const auto& c) { return Focal{c.fx, c.cx, c.cy}; }, camera.projection());
}

}  // namespace

std::vector<std::string> disagreements(const RobotDescription& robot, const RecordingSetup& setup) {
  constexpr double kFar_m = 0.005;
  constexpr double kFar_rad = 0.5 * M_PI / 180;
  constexpr double kFarScale = 0.005;
  constexpr double kFar_px = 3;
  std::vector<std::string> words;
  if (setup.base_T_cam) {
    const SE3 apart = setup.base_T_cam->inverse() * robot.model.base_T_cam;
    const double far_m = apart.translation().norm();
    const double far_rad = apart.rotation().log().norm();
    if (far_m > kFar_m || far_rad > kFar_rad)
      words.push_back(
          fmt::format("the robot's file has the camera {:.1f} cm and {:.1f} deg from where the transforms of "
                      "the recording have "
                      "it ({} to {}): the file is taken",
                      100 * far_m, to_degrees(far_rad), setup.chosen.base_frame, setup.chosen.camera_frame));
  }
  if (!setup.camera) return words;
  const CameraModel& theirs = *setup.camera;
  const CameraModel& ours = robot.camera;
  if (theirs.width_px() != ours.width_px() || theirs.height_px() != ours.height_px()) {
    words.push_back(
        fmt::format("the camera of the robot's file has pictures of {} x {}, that of the recording of {} x "
                    "{}: the file is taken",
                    ours.width_px(), ours.height_px(), theirs.width_px(), theirs.height_px()));
    return words;
  }
  const Focal a = focal_of(theirs);
  const Focal b = focal_of(ours);
  if (std::abs(b.fx / a.fx - 1) > kFarScale || std::hypot(a.cx - b.cx, a.cy - b.cy) > kFar_px)
    words.push_back(fmt::format(
        "the camera of the robot's file has a focal length of {:.1f} px and its centre at ({:.1f}, {:.1f}), "
        "that of the recording {:.1f} px and ({:.1f}, {:.1f}): the file is taken",
        b.fx, b.cx, b.cy, a.fx, a.cx, a.cy));
  return words;
}

Status take_robot(const std::string& robot, RecordingSetup& setup, std::vector<std::string>& warnings) {
  if (robot.empty()) return {};
  const auto path = find_shared("robots", robot);
  if (!path) return tl::unexpected(path.error());
  const Result<RobotDescription> description = read_robot(*path);
  if (!description) return tl::unexpected(description.error());
  for (std::string& words : disagreements(*description, setup)) warnings.push_back(std::move(words));
  setup.camera = description->camera;
  setup.base_T_cam = description->model.base_T_cam;
  setup.more_cameras = description->more_cameras;
  return {};
}

}  // namespace waymark
