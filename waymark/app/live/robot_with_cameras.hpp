#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "waymark/samples/live_camera.hpp"

namespace waymark {

/// A robot whose pictures come from cameras of this computer: its samples and theirs as one source. Stamps of
/// pictures are moved to the robot's clock, by what that shows when the picture arrives; pictures that come
/// before the robot's first sample are left out, and those that waited for more than a second while this
/// computer was busy: what the robot did since then was already heard. What the robot's own detector saw with
/// a camera that gives pictures here (tags with their corners or as poses) is left out, too: the pictures say
/// more.
class RobotWithCameras final : public Source {
 public:
  /// The robot outlives this; `names` of the cameras.
  RobotWithCameras(Source& robot, std::vector<std::unique_ptr<LiveCamera>> cameras,
                   std::set<std::string> names)
      : robot_(robot), cameras_(std::move(cameras)), names_(std::move(names)) {}

  /// Fails when the robot or a camera does.
  Result<std::optional<RobotEvent>> next(Duration most) override;
  [[nodiscard]] bool more() const override;
  [[nodiscard]] std::optional<SensorTime> now() const override { return robot_.now(); }

 private:
  [[nodiscard]] Result<std::optional<RobotEvent>> of_cameras();
  [[nodiscard]] Result<std::optional<RobotEvent>> hear_robot(Duration most);
  [[nodiscard]] bool move_to_robots_clock(CameraFrame& frame);
  [[nodiscard]] bool replaced(const RobotEvent& event) const;

  Source& robot_;
  std::vector<std::unique_ptr<LiveCamera>> cameras_;
  std::set<std::string> names_;
  std::size_t turn_ = 0;                      ///< of the camera that is asked first
  std::map<std::string, SensorTime> newest_;  ///< by camera
};

}  // namespace waymark
