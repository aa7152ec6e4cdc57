#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/cameras/v4l2/address.hpp"
#include "waymark/samples/live_camera.hpp"

namespace waymark {

/// A camera of Video4Linux. A thread of its own empties the driver's buffers and keeps the newest picture,
/// which next() converts to grey in the caller's thread, straight from the driver's memory. Where the camera
/// is unplugged it waits until it is there again, also under another number if it has a by-id link.
class V4l2Camera final : public LiveCamera {
 public:
  /// Errors: NotFound, Unreadable (no permission, with the group; busy, with the program), Unsupported (no
  /// camera, no format that is read, another size), InvalidArgument (controls).
  [[nodiscard]] static Result<std::unique_ptr<V4l2Camera>> open(const V4l2Options& options);
  ~V4l2Camera() override;

  /// Words come before pictures: automatic controls, damaged, black or frozen pictures, unplugged, found
  /// again. Fails once it has been unplugged for too long.
  Result<std::optional<RobotEvent>> next(Duration most) override;
  [[nodiscard]] bool more() const override;
  /// The steady clock, once there was a picture.
  [[nodiscard]] std::optional<SensorTime> now() const override;
  [[nodiscard]] CameraCounts counts() const override;
  [[nodiscard]] std::string description() const override;
  [[nodiscard]] std::vector<CameraControl> controls() override;
  Status set_control(const std::string& name, double value) override;

 private:
  struct Impl;
  explicit V4l2Camera(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark
