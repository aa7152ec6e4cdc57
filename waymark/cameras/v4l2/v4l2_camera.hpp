#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/cameras/v4l2/address.hpp"
#include "waymark/samples/live_camera.hpp"

namespace waymark {

/// A Video4Linux camera. A separate thread drains the driver's buffers and keeps the newest image, which
/// next() converts to grey on the caller's thread, directly from the driver's memory. If the camera is
/// unplugged, the thread waits for reconnection; with a by-id link, the device number may change in the
/// meantime.
class V4l2Camera final : public LiveCamera {
 public:
  /// Errors: NotFound, Unreadable (no permission, naming the group; busy, naming the program), Unsupported
  /// (not a camera, no supported format, a different size), InvalidArgument (controls).
  [[nodiscard]] static Result<std::unique_ptr<V4l2Camera>> open(const V4l2Options& options);
  ~V4l2Camera() override;

  /// Messages are returned before images. They report automatic controls, damaged, black or frozen images,
  /// and disconnection and reconnection. Fails once the camera has been unplugged for too long.
  Result<std::optional<RobotEvent>> next(Duration timeout) override;
  [[nodiscard]] bool more() const override;
  /// The time on the steady clock; empty before the first image.
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
