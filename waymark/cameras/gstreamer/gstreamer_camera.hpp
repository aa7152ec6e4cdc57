#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/samples/live_camera.hpp"

namespace waymark {

/// The scheme of these cameras' addresses: "gstreamer:libcamerasrc", "gstreamer:rtspsrc location=… !
/// decodebin".
inline constexpr std::string_view kGstreamerScheme = "gstreamer:";

/// Provides the images of a GStreamer pipeline: ribbon-cable cameras (libcamerasrc), network cameras
/// (rtspsrc), files, test images. The pipeline has the syntax of gst-launch-1.0, without a sink; conversion
/// to grey and an appsink that keeps the newest image are appended. Stamps are those of the pipeline's
/// buffers, converted to this computer's steady clock.
class GstreamerCamera final : public LiveCamera {
 public:
  /// Errors: InvalidArgument (invalid pipeline), Unsupported (no GStreamer), Unreadable (the pipeline does
  /// not start, with GStreamer's message).
  [[nodiscard]] static Result<std::unique_ptr<GstreamerCamera>> open(const std::string& pipeline,
                                                                     const std::string& name = "cam");
  ~GstreamerCamera() override;

  /// Fails if the pipeline fails. The end of the pipeline is reported once as text.
  Result<std::optional<RobotEvent>> next(Duration timeout) override;
  [[nodiscard]] bool more() const override;
  [[nodiscard]] std::optional<SensorTime> now() const override;
  [[nodiscard]] CameraCounts counts() const override;
  [[nodiscard]] bool ended() const override;
  [[nodiscard]] std::string description() const override;

 private:
  struct Impl;
  explicit GstreamerCamera(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace waymark
