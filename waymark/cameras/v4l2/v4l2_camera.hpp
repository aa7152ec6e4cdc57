#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/cameras/v4l2/address.hpp"
#include "waymark/samples/live_camera.hpp"

namespace waymark {

/// A Video4Linux camera. Its own thread empties the driver's buffers and keeps the newest image, which next()
/// converts to grey on the caller's thread, directly from the driver's memory. If the camera is unplugged, it
/// waits for reconnection; with a by-id link the device number may change.
class V4l2Camera final : public LiveCamera {
 public:
  /// Errors: NotFound, Unreadable (no permission, with the group; busy, with the program), Unsupported (not a
  /// camera, no supported format, another size), InvalidArgument (controls).
  [[nodiscard]] static Result<std::unique_ptr<V4l2Camera>> open(const V4l2Options& options);
  ~V4l2Camera() override;

  /// Messages come before images: automatic controls; damaged, black or frozen images; disconnection and
  /// reconnection. Fails once the camera has been unplugged for too long.
  Result<std::optional<RobotEvent>> next(Duration timeout) override;
  [[nodiscard]] bool more() const override;
  /// The steady clock; empty before the first image.
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
