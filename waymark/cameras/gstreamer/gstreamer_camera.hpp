#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/samples/live_camera.hpp"

namespace waymark {

/// The scheme of addresses of these cameras: "gstreamer:libcamerasrc", "gstreamer:rtspsrc location=… !
/// decodebin".
inline constexpr std::string_view kGstreamerScheme = "gstreamer:";

/// The pictures of a GStreamer pipeline: cameras on a ribbon cable (libcamerasrc), on a network (rtspsrc),
/// files, test pictures. The pipeline is what gst-launch-1.0 understands, without a sink: conversion to grey
/// and an appsink that keeps the newest picture are put behind it. Stamps are those of the pipeline's
/// buffers, by its clock, which is the steady one of this computer.
class GstreamerCamera final : public LiveCamera {
 public:
  /// Errors: InvalidArgument (a pipeline that does not parse), Unsupported (no GStreamer), Unreadable (the
  /// pipeline does not start: in its words).
  [[nodiscard]] static Result<std::unique_ptr<GstreamerCamera>> open(const std::string& pipeline,
                                                                     const std::string& name = "cam");
  ~GstreamerCamera() override;

  /// Fails when the pipeline does. Its end is said once, as text.
  Result<std::optional<RobotEvent>> next(Duration most) override;
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
