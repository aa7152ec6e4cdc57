#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/app/localize/camera_moment.hpp"
#include "waymark/app/localize/localize_fields.hpp"
#include "waymark/camera/camera_model.hpp"

namespace waymark {

class LiveFeed;

/// `waymark localize camera`: estimates the poses of a live camera without a robot, hand-held or on a tripod.
struct LocalizeCameraJob {
  std::string source{};  ///< camera address, such as v4l2:/dev/video0
  std::string map{};
  CameraDescription camera{};
  std::string output{};  ///< recording or TUM file to write; if empty, none is written
  std::optional<double> tag_size_m{};
  double duration_s = 0;  ///< 0 means until cancelled
  std::string images{};   ///< "raw" or "jpeg"; if empty, images are not recorded
  LiveFeed* feed = nullptr;
  /// Called for every image.
  std::function<void(const CameraMoment&)> on_moment = [](const CameraMoment&) {};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.source, JobField("source CAMERA", "Live camera: v4l2:/dev/video0, gstreamer:libcamerasrc")
                           .input()
                           .required());
    visit(self.map, localize_fields::map());
    visit(self.camera.file, localize_fields::camera());
    CameraDescription::fields(self.camera, visit);
    visit(self.output, JobField("output FILE",
                                "Recording of tags and poses to write (.mcap), or text file with one pose "
                                "per line (.txt, .tum: TUM)"));
    visit(self.tag_size_m, localize_fields::tag_size_m());
    visit(self.duration_s, localize_fields::duration_s());
    visit(self.images, localize_fields::record_images());
  }
};

struct LocalizeCameraReport {
  CameraWatchEnd end{};
  std::size_t known = 0;  ///< number of images with a pose
};

/// Reads the calibration of the job's camera. Fails if none is set, or if the job is invalid.
[[nodiscard]] Result<CameraModel> read_camera(const LocalizeCameraJob& job);

/// Localises the images from an open camera until it ends, `duration_s` has elapsed, or the job is cancelled.
/// A recording contains tags and poses (/waymark/pose), with timestamps since 1970.
[[nodiscard]] Result<LocalizeCameraReport> localize_camera(LiveCamera& camera, const CameraModel& model,
                                                           const LocalizeCameraJob& job,
                                                           const JobControl& control);

/// A summary such as "812 images in 27.0 s, 640 with a pose".
[[nodiscard]] std::string to_text(const LocalizeCameraReport& report);

}  // namespace waymark
