#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "waymark/samples/live_camera.hpp"

namespace waymark {

/// A robot whose pictures come from cameras of this computer: its samples and theirs as one source. Stamps of
/// pictures are moved to the robot's clock, by what that shows when the picture arrives; pictures that come
/// before the robot's first sample are left out.
class RobotWithCameras final : public Source {
 public:
  /// The robot outlives this.
  RobotWithCameras(Source& robot, std::vector<std::unique_ptr<LiveCamera>> cameras)
      : robot_(robot), cameras_(std::move(cameras)) {}

  /// Fails when the robot or a camera does.
  Result<std::optional<RobotEvent>> next(Duration most) override;
  [[nodiscard]] bool more() const override;
  [[nodiscard]] std::optional<SensorTime> now() const override { return robot_.now(); }

 private:
  [[nodiscard]] Result<std::optional<RobotEvent>> of_cameras();
  [[nodiscard]] bool move_to_robots_clock(CameraFrame& frame);

  Source& robot_;
  std::vector<std::unique_ptr<LiveCamera>> cameras_;
  std::size_t turn_ = 0;                      ///< of the camera that is asked first
  std::map<std::string, SensorTime> newest_;  ///< by camera
};

}  // namespace waymark
