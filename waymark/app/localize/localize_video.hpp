#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/localize/camera_moment.hpp"
#include "waymark/app/localize/localize_fields.hpp"

namespace waymark {

/// `waymark localize video`: estimates the camera poses in a video from a tag map.
struct LocalizeVideoJob {
  std::string video{};  ///< a video, or a recording from a camera without a robot
  std::string map{};
  CameraDescription camera{};
  std::string output{};  ///< recording or TUM file to write; if empty, none is written
  std::optional<double> tag_size_m{};
  /// Called for every image.
  std::function<void(const CameraMoment&)> on_moment = [](const CameraMoment&) {};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.video,
          JobField("video VIDEO", "Video, or the recording of a camera without a robot").input().required());
    visit(self.map, localize_fields::map());
    visit(self.camera.file, localize_fields::camera());
    CameraDescription::fields(self.camera, visit);
    visit(self.camera.readout_ms,
          JobField("readout_ms NUMBER",
                   "Readout time of the rolling shutter from the first row to the last, in milliseconds; "
                   "negative if rows are read from the bottom. Default: from calibration.yaml, else 0",
                   -200.0, 200.0)
              .less());
    visit(self.output, JobField("output FILE",
                                "Recording of tags and poses to write (.mcap), or text file with one pose "
                                "per line (.txt, .tum: TUM)"));
    visit(self.tag_size_m, localize_fields::tag_size_m());
  }
};

struct LocalizeVideoReport {
  VideoTags video{};
  std::size_t known = 0;       ///< number of images with a pose
  double corner_error_px = 0;  ///< see CameraMoments::corner_error_px
};

/// Detects the tags in all images, then computes the poses. The output is written completely or not at all. A
/// recording contains the tags, the poses (/waymark/pose) and the camera, with timestamps since the first
/// image.
[[nodiscard]] Result<LocalizeVideoReport> localize_video(const LocalizeVideoJob& job,
                                                         const JobControl& control);

/// A summary such as "812 images, 640 with a pose".
[[nodiscard]] std::string to_text(const LocalizeVideoReport& report);

}  // namespace waymark
