#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/samples/live_camera.hpp"

namespace waymark {

/// Address scheme of these cameras: "gstreamer:libcamerasrc", "gstreamer:rtspsrc location=… ! decodebin".
inline constexpr std::string_view kGstreamerScheme = "gstreamer:";

/// Provides the images from a GStreamer pipeline, such as those of ribbon-cable cameras (libcamerasrc),
/// network cameras (rtspsrc), files or test images. The pipeline is written in gst-launch-1.0 syntax, without
/// a sink; conversion to grey and an appsink that keeps the newest image are appended. The timestamps of the
/// pipeline's buffers are converted to this computer's steady clock.
class GstreamerCamera final : public LiveCamera {
 public:
  /// Errors: InvalidArgument (invalid pipeline), Unsupported (no GStreamer), Unreadable (the pipeline does
  /// not start, with GStreamer's message).
  [[nodiscard]] static Result<std::unique_ptr<GstreamerCamera>> open(const std::string& pipeline,
                                                                     const std::string& name = "cam");
  ~GstreamerCamera() override;

  /// Fails if the pipeline fails. Reports the end of the pipeline once, as text.
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
